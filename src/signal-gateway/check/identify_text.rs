//! Formats the result of `identify` as text and JSON.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use super::finding_text::{finding_text, millis, of_identifiers};
use super::identify::{Identifier, ProfileCandidate};
use super::report::{RESET, color};
use crate::report::text::{Layout, counted, escaped, wrapped};
use vehicle_bringup::plausibility::finding::Severity;
use vehicle_bringup::plausibility::fingerprint::PlatformMatch;
use vehicle_bringup::plausibility::fit::{FitVerdict, Support};

const LISTED: usize = 3;

/// Returns the best candidates with the evidence for and against them, or all candidates with `all`. `log` is
/// `None` for a bus.
pub fn text(identifier: &Identifier, log: Option<&Path>, all: bool, layout: Layout) -> String {
    let candidates = identifier.candidates();
    let mut text = String::new();
    let interfaces: Vec<_> = identifier.interfaces().map(escaped).collect();
    let _ = writeln!(
        text,
        "{} in {:.3} s on {}; {} profiles tried",
        counted(identifier.frames(), "frame"),
        identifier.length().as_secs_f64(),
        interfaces.join(", "),
        identifier.profiles()
    );
    for line in identifier.platforms().filter_map(|(name, found)| platform_text(identifier, name, &found)) {
        let _ = writeln!(text, "{}", wrapped(&line, layout.width, 0).join("\n"));
    }
    let fitting = candidates.iter().filter(|candidate| candidate.fits()).count();
    let listed = if all { candidates.len() } else { LISTED.max(fitting.min(2 * LISTED)) };
    let is_listed = |candidate: &&ProfileCandidate<'_>| all || candidate.fit.verdict > FitVerdict::No;
    for candidate in candidates.iter().filter(is_listed).take(listed) {
        add(&mut text, candidate, layout);
    }
    let refuted = candidates.iter().filter(|candidate| candidate.fit.verdict == FitVerdict::No).count();
    let hidden = candidates.len() - listed.min(candidates.len() - refuted);
    let mut end = vec![conclusion(&candidates, log, interfaces.len() > 1)];
    if hidden > 0 && !all {
        let (hidden, pronoun) = if hidden == 1 {
            ("1 weaker match".to_owned(), "it")
        } else {
            (format!("{hidden} weaker matches"), "them")
        };
        end.push(format!("{hidden} hidden; --all lists {pronoun}"));
    }
    for line in end.iter().flat_map(|line| wrapped(line, layout.width, 0)) {
        let _ = write!(text, "\n{line}");
    }
    text.push('\n');
    text
}

/// Names the platform of a bus, with the profiles for it; `None` if its identifiers indicate none.
fn platform_text(identifier: &Identifier, interface: &str, found: &[PlatformMatch<'_>]) -> Option<String> {
    let [best, ..] = found else { return None };
    let titles: Vec<_> = found.iter().map(|found| found.list.title.as_str()).collect();
    let of = of_identifiers(best.explained, best.identifiers);
    let profiles = profiles_of(identifier, found);
    let profiles = match profiles.len() {
        0 => "no profile is for it".to_owned(),
        count => format!("profile{} {}", if count == 1 { "" } else { "s" }, profiles.join(", ")),
    };
    let interface = escaped(interface);
    Some(format!(
        "{interface}: {of} those of {} ({:.0} expected by chance); {profiles}",
        titles.join(" or "),
        best.expected_by_chance()
    ))
}

fn profiles_of(identifier: &Identifier, found: &[PlatformMatch<'_>]) -> Vec<&'static str> {
    let profiles: BTreeSet<_> = found.iter().flat_map(|found| identifier.profiles_of(found.list)).collect();
    profiles.into_iter().collect()
}

/// Returns the conclusion, with a command if there is one; `with_map` is for a recording of several buses.
fn conclusion(candidates: &[ProfileCandidate<'_>], log: Option<&Path>, with_map: bool) -> String {
    match candidates {
        [first, rest @ ..] if first.fits() => {
            let rivals = rest.iter().filter(|other| other.fits() && other.fit.score == first.fit.score);
            let names: Vec<_> = rivals.map(|rival| rival.profile).collect();
            let also =
                if names.is_empty() { String::new() } else { format!(" (as well as {})", names.join(", ")) };
            let log = log.map_or_else(|| "LOG".to_owned(), |log| argument(&log.to_string_lossy()));
            let map = if with_map { format!(" --map {}={}", argument(first.interface), first.bus) } else { String::new() };
            format!("{} fits{also}: signal-gateway check {log} --profile {}{map}", first.profile, first.profile)
        }
        [first, ..] if first.fit.verdict == FitVerdict::Possible => {
            "none: no profile is more than possible. Record left, right and hazard, and try again.".to_owned()
        }
        _ => "none: no profile fits. Was it recorded on the bus with the lights? `signal-gateway discover` makes a profile for a car \
              that has none."
            .to_owned(),
    }
}

/// Quotes an argument for a shell if necessary.
fn argument(text: &str) -> String {
    let is_plain = |char: char| char.is_alphanumeric() || "-_./+=:,@%".contains(char);
    if text.chars().all(is_plain) {
        text.to_owned()
    } else {
        format!("'{}'", escaped(text).replace('\'', r"'\''"))
    }
}

const COLUMN: usize = 10;

fn add(text: &mut String, candidate: &ProfileCandidate<'_>, layout: Layout) {
    let (verdict, weight) = weighed(candidate.fit.verdict);
    let (start, end) = if layout.has_color { (color(weight), RESET) } else { ("", "") };
    let lines = |body: &str, column: usize| {
        let width = layout.width.map(|width| width.saturating_sub(column));
        wrapped(body, width, 0).join(&format!("\n{:column$}", ""))
    };
    let (received, all) = candidate.fit.received;
    let title = format!(
        "{} ({}) on {}: {received} of {}",
        candidate.profile,
        escaped(candidate.vehicle),
        escaped(candidate.interface),
        counted(all as u64, "message")
    );
    let _ = writeln!(text, "\n{start}{verdict:<COLUMN$}{end}{}", lines(&title, COLUMN));
    if candidate.fit.verdict > FitVerdict::No && !candidate.reports.is_empty() {
        let reports = format!("reports {}", candidate.reports.join(", "));
        let _ = writeln!(text, "{:COLUMN$}{}", "", lines(&reports, COLUMN));
    }
    let signed = candidate.fit.support.iter().map(|support| ("+", support_text(candidate, support)));
    let against = candidate.fit.against.iter();
    let against = against.map(|finding| ("-", finding_text(candidate.evidence, &finding.kind)));
    for (sign, body) in signed.chain(against) {
        let _ = writeln!(text, "{:COLUMN$}{sign} {}", "", lines(&body, COLUMN + 2));
    }
}

fn weighed(verdict: FitVerdict) -> (&'static str, Severity) {
    match verdict {
        FitVerdict::Fits => ("fits", Severity::Note),
        FitVerdict::Possible => ("possible", Severity::Warning),
        FitVerdict::No => ("no", Severity::Error),
    }
}

fn support_text(candidate: &ProfileCandidate<'_>, support: &Support) -> String {
    let name = |message: usize| {
        let bound = &candidate.evidence.messages[message].bound;
        format!("{} ({})", bound.name, bound.ids)
    };
    match support {
        Support::Integrity { message, frames, checksum } => {
            let what = if *checksum { "checksum" } else { "counter" };
            let all = counted(candidate.evidence.messages[*message].frames, "frame");
            format!(
                "{}: {frames} of {all} pass all checks of the profile, a {what} among them",
                name(*message)
            )
        }
        Support::Period { message, median } => {
            format!("{}: every {}, as described", name(*message), millis(*median))
        }
        Support::ExtendedIdentifier { message } => {
            format!("{}: an identifier of 29 bits", name(*message))
        }
        Support::Sides { left, right } => {
            let sides = match (left, right) {
                (true, true) => "left and right were",
                (true, false) => "left was",
                (false, true) => "right was",
                (false, false) => " was",
            };
            format!("{sides} on and off again, as by a driver")
        }
        Support::NamedValues => "the state changed, and the profile names every value".to_owned(),
        Support::Platform { title, explained, identifiers } => {
            format!("{} in the list of {title}", of_identifiers(*explained, *identifiers))
        }
        Support::Heartbeat { ids } => format!("{ids}, which proves the bus alive, came as well"),
    }
}

/// Returns all candidates as one JSON object.
pub fn json(identifier: &Identifier) -> String {
    let candidates: Vec<Value> = identifier
        .candidates()
        .iter()
        .map(|candidate| {
            let (received, messages) = candidate.fit.received;
            json!({
                "profile": candidate.profile,
                "vehicle": candidate.vehicle,
                "reports": candidate.reports,
                "interface": candidate.interface,
                "verdict": weighed(candidate.fit.verdict).0,
                "score": candidate.fit.score,
                "messages_received": received,
                "messages": messages,
                "for": candidate.fit.support.iter().map(|support| support_text(candidate, support)).collect::<Vec<_>>(),
                "against": candidate.fit.against.iter().map(|finding| finding_text(candidate.evidence, &finding.kind)).collect::<Vec<_>>(),
            })
        })
        .collect();
    let seconds = identifier.length().as_secs_f64();
    let platforms: Vec<Value> = identifier
        .platforms()
        .filter_map(|(interface, found)| {
            let best = found.first()?;
            Some(json!({
                "interface": interface,
                "make": best.list.make,
                "titles": found.iter().map(|found| &found.list.title).collect::<Vec<_>>(),
                "identifier_lists": found.iter().map(|found| &found.list.name).collect::<Vec<_>>(),
                "profiles": profiles_of(identifier, &found),
                "identifiers": best.identifiers,
                "explained": best.explained,
                "expected_by_chance": best.expected_by_chance(),
            }))
        })
        .collect();
    let whole = json!({
        "frames": identifier.frames(),
        "seconds": seconds,
        "profiles": identifier.profiles(),
        "platforms": platforms,
        "candidates": candidates,
    });
    format!("{whole}\n")
}
