//! Describes a change in a drive in one sentence: the command, the position and the reason.

use std::mem::{Discriminant, discriminant};

use super::snapshot::Snapshot;
use turn_signal::decision::{Basis, Decision};
use turn_signal::inputs::InputFinding;
use turn_signal::junction::JunctionRemark;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::manoeuvre::{ManoeuvreOutcome, SignalReason};
use turn_signal::min_duration::Held;
use turn_signal::resolve::{CandidateOutcome, CandidateSource, EvaluatedCandidate};
use turn_signal::section::Distances;
use turn_signal::shift::ShiftVerdict;

/// Speed below which the time is also stated, since the position does not change, m/s.
const STANDING_MPS: f64 = 0.1;
/// A signal that ends this close to its section's end was not dropped, metres; longer than a cycle.
const END_TOLERANCE_M: f64 = 3.0;

#[derive(Debug, Clone, Default)]
pub(super) struct Narrator {
    last: Option<Essence>,
    signalled: Option<Signalled>,
}

/// The essential part of a decision, whose change makes a sentence new.
#[derive(Debug, Clone, PartialEq)]
struct Essence {
    turn: TurnCommand,
    hazard: HazardCommand,
    basis: Discriminant<Basis>,
    held: Option<Held>,
    subject: Option<String>,
    junction: Option<&'static str>,
    findings: Vec<Discriminant<InputFinding>>,
}

#[derive(Debug, Clone)]
struct Signalled {
    name: String,
    /// Distances from the rear axle to the ends of its sections, metres.
    desired_end_m: f64,
    required_end_m: f64,
}

impl Narrator {
    /// Returns the sentence of a cycle, and whether command, candidate, hold or a problem in it is new.
    pub(super) fn next(&mut self, snapshot: &Snapshot<'_>) -> (String, bool) {
        let decision = snapshot.decision;
        let sentence = self.sentence(snapshot);
        let won = decision.won();
        let essence = Essence {
            turn: decision.turn,
            hazard: decision.hazard,
            basis: discriminant(&decision.basis),
            held: decision.held,
            subject: won.map(name),
            junction: decision.junction.as_ref().map(JunctionRemark::key),
            findings: decision.findings.iter().map(discriminant).collect(),
        };
        let is_new = self.last.as_ref().is_none_or(|last| {
            let is_known = |finding: &Discriminant<InputFinding>| last.findings.contains(finding);
            // The disappearance of a finding is not news.
            *last != Essence { findings: last.findings.clone(), ..essence.clone() }
                || !essence.findings.iter().all(is_known)
        });
        self.last = Some(essence);
        self.signalled = won.and_then(|won| {
            let Distances { desired_end_m, required_end_m, .. } = won.distances?;
            Some(Signalled { name: name(won), desired_end_m, required_end_m })
        });
        (sentence, is_new)
    }

    fn sentence(&self, snapshot: &Snapshot<'_>) -> String {
        let decision = snapshot.decision;
        let command = match decision.hazard {
            HazardCommand::Enable => format!("{} + hazard", decision.turn),
            HazardCommand::Disable | HazardCommand::NoCommand => decision.turn.to_string(),
        };
        let stands = snapshot.speed_mps.abs() < STANDING_MPS;
        let time = if stands { format!(", {} s", short(snapshot.at_s)) } else { String::new() };
        let reasons = self.reasons(decision).join("; ");
        format!("{command} at {} m{time}: {reasons}", short(snapshot.at_m))
    }

    fn reasons(&self, decision: &Decision) -> Vec<String> {
        let mut reasons = match &decision.basis {
            Basis::NoInputs => Vec::new(),
            Basis::Hazard => decision.remarks.iter().copied().map(remark).collect(),
            Basis::ManoeuvreAlone(_) => vec!["by the manoeuvres alone".to_owned()],
            Basis::PathGenerator(tagged) => vec![tagged.to_string()],
            Basis::Candidates(_) => self.of_candidates(decision),
        };
        reasons.extend(decision.findings.iter().map(|finding| finding.message().text));
        reasons
    }

    fn of_candidates(&self, decision: &Decision) -> Vec<String> {
        let won = decision.won();
        let next = won.map(|won| format!("{} for the {}", won.turn, name(won)));
        match (decision.held, won) {
            (Some(held), _) => {
                let what = match held {
                    Held::On(_) => "kept on for its minimum time",
                    Held::Off => "off for the minimum time between two signals",
                };
                let held = next.map_or(what.to_owned(), |next| format!("{what}, then {next}"));
                self.ended(decision, won).into_iter().chain([held]).collect()
            }
            (None, Some(won)) => {
                let mut reasons = vec![stretch(won)];
                if won.source == CandidateSource::Intersection {
                    reasons.extend(decision.junction.as_ref().map(ToString::to_string));
                }
                reasons.extend(decision.evaluated().iter().filter_map(|other| rival(other, won)));
                reasons.extend(self.ended(decision, Some(won)));
                reasons
            }
            (None, None) => {
                let mut reasons: Vec<String> = self.ended(decision, None).into_iter().collect();
                let was_held = self.last.as_ref().is_some_and(|last| last.held.is_some());
                if reasons.is_empty() && was_held {
                    reasons.push("the minimum time is over".to_owned());
                } else if reasons.is_empty() {
                    match &decision.junction {
                        Some(junction) => reasons.push(junction.to_string()),
                        None => reasons.push("nothing to signal".to_owned()),
                    }
                    reasons.extend(decision.evaluated().iter().filter_map(waiting));
                    reasons.extend(silent(decision).copied().map(remark));
                    reasons.dedup();
                }
                reasons
            }
        }
    }

    /// Describes the end of the previous signal, and why it was dropped; `None` if it is still a candidate.
    fn ended(&self, decision: &Decision, now: Option<&EvaluatedCandidate>) -> Option<String> {
        let Signalled { name: before, desired_end_m, required_end_m } = self.signalled.as_ref()?;
        let rivals = decision.evaluated().iter().filter(|other| lost(other));
        if rivals.chain(now).any(|candidate| name(candidate) == *before) {
            return None;
        }
        Some(if *desired_end_m <= END_TOLERANCE_M {
            format!("the {before} is over")
        } else if *required_end_m <= END_TOLERANCE_M {
            format!("the required section of the {before} is over")
        } else {
            let why: Vec<_> = silent(decision).map(|outcome| outcome.why.to_string()).collect();
            let why = if why.is_empty() { String::new() } else { format!(" ({})", why.join(", ")) };
            format!("the {before} is no longer signalled {} before its end{why}", metres(*desired_end_m))
        })
    }
}

fn name(candidate: &EvaluatedCandidate) -> String {
    candidate.subject.name(candidate.turn).unwrap_or_else(|| candidate.source.to_string())
}

const fn lost(candidate: &EvaluatedCandidate) -> bool {
    matches!(candidate.outcome, CandidateOutcome::LostTo { .. })
}

/// Describes the vehicle's position in the sections of the winner.
fn stretch(won: &EvaluatedCandidate) -> String {
    let name = name(won);
    let Some(Distances { desired_end_m, required_start_m, required_end_m, .. }) = won.distances else {
        return format!("for the {name}");
    };
    if required_start_m > 0.0 {
        format!("{} before the required section of the {name}", metres(required_start_m))
    } else if required_end_m >= 0.0 {
        format!("in the required section of the {name}")
    } else {
        format!("past the required section of the {name}, {} before its end", metres(desired_end_m))
    }
}

/// Describes a losing candidate by the position of its sections relative to the winner's.
fn rival(other: &EvaluatedCandidate, won: &EvaluatedCandidate) -> Option<String> {
    let (ours, theirs) = (won.distances?, other.distances.filter(|_| lost(other))?);
    let relation = if theirs.required_end_m < 0.0 {
        "is past its required section"
    } else if theirs.required_start_m > ours.required_start_m {
        "begins later"
    } else {
        "gives way"
    };
    Some(format!("the {} {relation}", name(other)))
}

/// Describes a candidate that is not signalled, with the reason.
fn waiting(candidate: &EvaluatedCandidate) -> Option<String> {
    let name = name(candidate);
    match candidate.outcome {
        CandidateOutcome::NotReached => {
            Some(format!("the {name} begins in {}", metres(candidate.distances?.desired_start_m)))
        }
        CandidateOutcome::Passed => Some(format!("the {name} is over")),
        CandidateOutcome::NotFinite => Some(format!("a point of the {name} is not a number")),
        CandidateOutcome::Finished => Some(format!("the {name} was over before another signal ended")),
        // The junction has a sentence of its own.
        CandidateOutcome::WaitsForJunction
        | CandidateOutcome::Absent
        | CandidateOutcome::NoSide
        | CandidateOutcome::LostTo { .. }
        | CandidateOutcome::Won => None,
    }
}

/// Returns the manoeuvres that are not signalled although there is something to signal.
fn silent(decision: &Decision) -> impl Iterator<Item = &ManoeuvreOutcome> {
    decision.remarks.iter().filter(|outcome| {
        !matches!(
            outcome.why,
            SignalReason::Idle | SignalReason::OwnRule | SignalReason::Shift(ShiftVerdict::Signalled)
        )
    })
}

fn remark(outcome: ManoeuvreOutcome) -> String {
    match outcome.why {
        SignalReason::TooEarly | SignalReason::Shift(ShiftVerdict::TooEarly) => {
            format!("the {} is too far ahead", outcome.kind)
        }
        SignalReason::Shift(_) | SignalReason::Ignored | SignalReason::Idle | SignalReason::OwnRule => {
            format!("{}, {}", outcome.kind, outcome.why)
        }
    }
}

/// Formats a distance in whole metres, below 10 m with one decimal.
fn metres(distance_m: f64) -> String {
    if distance_m.abs() < 9.95 { format!("{distance_m:.1} m") } else { format!("{distance_m:.0} m") }
}

/// Formats a number with one decimal, unless that is zero.
fn short(number: f64) -> String {
    let text = format!("{:.1}", (number * 10.0).round() / 10.0 + 0.0);
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}
