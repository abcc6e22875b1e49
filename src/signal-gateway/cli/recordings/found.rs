//! What a command has found on one recording, from its JSON.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

use crate::report::text::counted;

/// Result of a recording in a table.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(in crate::cli) struct Found {
    /// Profile of the vehicle, if the command finds it.
    pub(in crate::cli) car: Option<String>,
    pub(in crate::cli) text: String,
}

/// Reads the JSON of a command; returns `None` if it is not a result.
pub(in crate::cli) type ReadResult = fn(&Value) -> Option<Found>;

/// Result of `identify`.
#[derive(Debug, Deserialize)]
pub(in crate::cli) struct Identified {
    frames: u64,
    seconds: f64,
    /// Best first.
    candidates: Vec<Candidate>,
}

#[derive(Debug, Deserialize)]
struct Candidate {
    profile: String,
    verdict: Verdict,
    score: i64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Verdict {
    Fits,
    Possible,
    No,
}

impl Identified {
    pub(in crate::cli) fn read(result: &Value) -> Option<Found> {
        let Self { frames, seconds, candidates } = Self::deserialize(result).ok()?;
        let best = candidates.first().filter(|best| best.verdict != Verdict::No);
        let mut text = match best.map(|best| best.verdict) {
            Some(Verdict::Fits) => "fits",
            Some(Verdict::Possible) => "is possible",
            Some(Verdict::No) | None => "no profile fits",
        }
        .to_owned();
        let is_equal = |other: &&Candidate| {
            best.is_some_and(|best| (best.verdict, best.score) == (other.verdict, other.score))
        };
        let rivals: Vec<_> =
            candidates.iter().filter(is_equal).skip(1).map(|rival| rival.profile.as_str()).collect();
        if !rivals.is_empty() {
            text += &format!(" (as well as {})", rivals.join(", "));
        }
        text += &format!("; {} in {seconds:.1} s", counted(frames, "frame"));
        Some(Found { car: best.map(|best| best.profile.clone()), text })
    }
}

/// Result of `check`.
#[derive(Debug, Deserialize)]
pub(in crate::cli) struct Checked {
    errors: u64,
    warnings: u64,
    notes: u64,
    /// Most severe first.
    findings: Vec<Finding>,
}

#[derive(Debug, Deserialize)]
struct Finding {
    text: String,
}

impl Checked {
    pub(in crate::cli) fn read(result: &Value) -> Option<Found> {
        let Self { errors, warnings, notes, findings } = Self::deserialize(result).ok()?;
        let counts = [(errors, "error"), (warnings, "warning"), (notes, "note")];
        let mut text = counts.map(|(count, noun)| counted(count, noun)).join(", ");
        if let Some(first) = findings.first().filter(|_| errors + warnings > 0) {
            text += &format!("; first: {}", first.text);
        }
        Some(Found { car: None, text })
    }
}

/// Result of `replay --csv`.
#[derive(Debug, Deserialize)]
pub(in crate::cli) struct Tabulated {
    csv: String,
    rows: u64,
    seconds: f64,
    known_s: BTreeMap<String, f64>,
}

impl Tabulated {
    pub(in crate::cli) fn read(result: &Value) -> Option<Found> {
        let Self { csv, rows, seconds, known_s } = Self::deserialize(result).ok()?;
        let share = |(name, known_s): (&String, &f64)| {
            let percent = known_s / seconds * 100.0;
            percent.is_finite().then(|| format!("{name} {percent:.0} %"))
        };
        let shares: Vec<_> = known_s.iter().filter_map(share).collect();
        let shares = if shares.is_empty() { String::new() } else { format!("; {}", shares.join(", ")) };
        Some(Found { car: None, text: format!("{csv}, {} in {seconds:.1} s{shares}", counted(rows, "row")) })
    }
}

/// Last object of `decide` with a recording.
#[derive(Debug, Deserialize)]
pub(in crate::cli) struct DecideSummary {
    summary: Summary,
}

#[derive(Debug, Deserialize)]
struct Summary {
    signal: String,
    length_s: f64,
    driven_m: f64,
    agreement_percent: Option<f64>,
    counts: Counts,
}

#[derive(Debug, Deserialize)]
struct Counts {
    /// Number of manoeuvres by kind and verdict.
    by_kind: BTreeMap<String, BTreeMap<String, u64>>,
}

impl DecideSummary {
    pub(in crate::cli) fn read(result: &Value) -> Option<Found> {
        let Self { summary } = Self::deserialize(result).ok()?;
        let mut by_verdict: BTreeMap<&str, u64> = BTreeMap::new();
        for (verdict, count) in summary.counts.by_kind.values().flatten().filter(|(_, count)| **count > 0) {
            *by_verdict.entry(verdict).or_default() += count;
        }
        let counts: Vec<_> = by_verdict
            .into_iter()
            .map(|(verdict, count)| format!("{count} {}", verdict.replace('_', " ")))
            .collect();
        let judged = match summary.agreement_percent {
            Some(percent) => format!("{percent:.0} % agree ({})", counts.join(", ")),
            None => "nothing to judge".to_owned(),
        };
        let Summary { signal, length_s, driven_m, .. } = summary;
        Some(Found { car: None, text: format!("{judged}; {signal}, {length_s:.1} s, {driven_m:.0} m") })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_result_is_a_line_and_anything_else_is_none() {
        let candidate =
            |profile, verdict, score| json!({ "profile": profile, "verdict": verdict, "score": score });
        let identified =
            |candidates: &[Value]| json!({ "frames": 2, "seconds": 1.5, "candidates": candidates });
        let [one, two, no] =
            [("one", "fits", 80), ("two", "fits", 80), ("no", "no", 0)].map(|(a, b, c)| candidate(a, b, c));
        let finding = json!({ "severity": "warning", "text": "BCM is missing" });
        let cases: [(ReadResult, Value, &str); 6] = [
            (
                Identified::read,
                identified(&[one, two, no.clone()]),
                "fits (as well as two); 2 frames in 1.5 s",
            ),
            (Identified::read, identified(&[no]), "no profile fits; 2 frames in 1.5 s"),
            (
                Checked::read,
                json!({ "errors": 0, "warnings": 1, "notes": 2, "findings": [finding], "facts": [] }),
                "0 errors, 1 warning, 2 notes; first: BCM is missing",
            ),
            (
                Checked::read,
                json!({ "errors": 0, "warnings": 0, "notes": 1, "findings": [finding] }),
                "0 errors, 0 warnings, 1 note",
            ),
            (
                Tabulated::read,
                json!({ "csv": "a.csv", "rows": 3, "seconds": 2.0, "known_s": { "gear": 1.0 } }),
                "a.csv, 3 rows in 2.0 s; gear 50 %",
            ),
            (
                DecideSummary::read,
                json!({ "summary": { "signal": "planner", "length_s": 9.0, "driven_m": 80.0, "agreement_percent": 50.0,
                    "counts": { "by_kind": { "turn": { "agree": 1, "wrong_side": 1, "late": 0 } } } } }),
                "50 % agree (1 agree, 1 wrong side); planner, 9.0 s, 80 m",
            ),
        ];
        for (read, result, expected) in cases {
            assert_eq!(read(&result).unwrap().text, expected);
            assert_eq!(read(&json!({ "other": 1 })), None);
        }
    }
}
