//! Formats findings as text, with the profile lines that fix them.

use std::time::Duration;

use super::kind::CheckKind;
use super::patch::{Fix, timeout};
use crate::report::text::{counted, times};
use can_signal::validation::integrity::search::RuleParameter;
use can_signal::validation::table::{SignalIndex, Timing};
use gateway_core::vehicle_lights::binding::HazardSource;
use gateway_core::vehicle_lights::state::TurnCode;
use vehicle_bringup::plausibility::evidence::ProfileEvidence;
use vehicle_bringup::plausibility::finding::{Coverage, FindingKind, SourceIndex, is_off};
use vehicle_bringup::plausibility::states::Implausible;

/// Returns a finding as text, without its severity.
pub(super) fn finding_text(evidence: &ProfileEvidence, finding: &FindingKind) -> String {
    let of = |message: usize| &evidence.messages[message];
    let name = |message: usize| of(message).bound.name.as_str();
    match finding {
        FindingKind::NoMessage => {
            "none of the profile's messages was received: is it the profile of this vehicle?".to_owned()
        }
        FindingKind::OtherPlatform { title, explained, identifiers, expected } => format!(
            "the bus is that of another platform: {} in the list of {title}, at least {expected} expected",
            of_identifiers(*explained, *identifiers)
        ),
        FindingKind::Unmet(unmet) => {
            let requirement = &evidence.lights().requirements[unmet.index];
            if unmet.is_contradicted {
                requirement.message(*unmet).text
            } else {
                format!("the recording does not show what the profile requires: {requirement}")
            }
        }
        FindingKind::WrongLength { message, frames, length } => {
            let (all, expected) = (of(*message).frames, of(*message).length);
            format!(
                "{}: {frames} of {} with another length: {length} bytes, not {expected}",
                name(*message),
                counted(all, "frame")
            )
        }
        FindingKind::TooSlow { message, median } | FindingKind::Faster { message, median } => {
            let expected = expected_period(evidence, *message);
            format!("{}: usually every {}, {expected}", name(*message), millis(*median))
        }
        FindingKind::IntegrityFails { message, frames } => {
            let all = counted(of(*message).frames, "frame");
            format!("{}: its counter or checksum is wrong in {frames} of {all}", name(*message))
        }
        FindingKind::UnusedCounter { message, signal, frames, .. } => {
            let (name, frames) = (name(*message), counted(*frames, "frame"));
            format!("{name}: the DBC's {signal} is a counter in {frames}, and the profile does not check it")
        }
        FindingKind::UnusedChecksum { message, signal, frames, .. } => {
            let (name, frames) = (name(*message), counted(*frames, "frame"));
            format!("{name}: the DBC's {signal} is a checksum of {frames}, and the profile does not check it")
        }
        FindingKind::Undefined { source, frames } => {
            let (what, all) = source_text(evidence, *source);
            format!(
                "{what}: {} of {all} with a value that the profile does not name",
                counted(*frames, "frame")
            )
        }
        FindingKind::Implausible { source, behaviour, changes } => {
            let (what, _) = source_text(evidence, *source);
            let changed = format!("{what} changed {}", times(*changes));
            match behaviour {
                Implausible::Flickers => {
                    format!("{changed}, mostly within 80 ms: no driver and no lamp does that")
                }
                Implausible::Flashes => {
                    format!(
                        "{changed}, mostly within 0.7 s: it flashes; a lamp is bound with kind = \"lamp\""
                    )
                }
                Implausible::Crosses => {
                    format!("{changed}, mostly from one side to the other: no driver does that")
                }
            }
        }
        FindingKind::NothingChanged { states } => nothing_changed_text(evidence, states),
        FindingKind::NeverOn(Coverage::Left) => "left was never seen: record it".to_owned(),
        FindingKind::NeverOn(Coverage::Right) => "right was never seen: record it".to_owned(),
        FindingKind::NeverOn(Coverage::Hazard) => "hazard was never seen: record it".to_owned(),
    }
}

/// Formats the number of identifiers that a list explains, e.g. `2 of 39 identifiers (5 %) are`.
pub(super) fn of_identifiers(explained: u32, identifiers: u32) -> String {
    let verb = if explained == 1 { "is" } else { "are" };
    format!("{explained} of {identifiers} identifiers ({} %) {verb}", explained * 100 / identifiers.max(1))
}

/// Names the state of each source that was on all the time.
fn nothing_changed_text(evidence: &ProfileEvidence, states: &[(SourceIndex, TurnCode)]) -> String {
    if states.is_empty() {
        return "no value that the profile names was received: record off, left, right and hazard".to_owned();
    }
    let was_on: Vec<_> = states
        .iter()
        .filter_map(|(source, state)| {
            let on = match (source, state) {
                (_, TurnCode::Off) => return None,
                (SourceIndex::Hazard(_), _) => "hazard was",
                (_, TurnCode::Left) => "left was",
                (_, TurnCode::Right) => "right was",
                (_, TurnCode::Both) => "left and right were both",
            };
            let (signals, frames) = source_text(evidence, *source);
            Some(format!("{on} on throughout ({signals}, {})", counted(frames, "frame")))
        })
        .collect();
    if was_on.is_empty() {
        return "nothing but off was received, which many messages show by chance: record left, right and hazard"
            .to_owned();
    }
    let was_on = was_on.join(", ");
    format!("{was_on}, which other messages show by chance: record off, left, right and hazard")
}

/// Returns the kind of a finding.
pub(super) fn kind(finding: &FindingKind) -> CheckKind {
    match finding {
        FindingKind::NoMessage => CheckKind::WrongProfile,
        FindingKind::OtherPlatform { .. } => CheckKind::OtherPlatform,
        FindingKind::Unmet(_) => CheckKind::UnmetRequirement,
        FindingKind::WrongLength { .. } => CheckKind::WrongLength,
        FindingKind::TooSlow { .. } | FindingKind::Faster { .. } => CheckKind::WrongPeriod,
        FindingKind::IntegrityFails { .. } => CheckKind::IntegrityRejected,
        FindingKind::UnusedCounter { .. } | FindingKind::UnusedChecksum { .. } => CheckKind::UnusedIntegrity,
        FindingKind::Undefined { .. } => CheckKind::UndefinedValue,
        FindingKind::NothingChanged { states } if is_off(states) => CheckKind::StateNotShown,
        FindingKind::Implausible { .. } | FindingKind::NothingChanged { .. } => CheckKind::ImplausibleStates,
        FindingKind::NeverOn(_) => CheckKind::StateNotShown,
    }
}

/// Returns the profile line that fixes a finding; `None` if the recording does not show it.
pub(super) fn fix(evidence: &ProfileEvidence, finding: &FindingKind) -> Option<Fix> {
    let fix = |message: usize, line| Fix::new(&evidence.messages[message].bound.name, line);
    match finding {
        FindingKind::UnusedCounter { message, signal, max_step, .. } => {
            fix(*message, format!("counter = {{ signal = {signal:?}, max_step = {max_step} }}"))
        }
        FindingKind::TooSlow { message, median } => fix(*message, timeout(*median)?),
        FindingKind::UnusedChecksum { message, signal, found, .. } => {
            let parameter = |(key, value): &(&str, RuleParameter)| match value {
                RuleParameter::Number(number) => format!(", {key} = 0x{number:X}"),
                RuleParameter::Flag(flag) => format!(", {key} = {flag}"),
                RuleParameter::Text(text) => format!(", {key} = {text:?}"),
                RuleParameter::Bytes(bytes) => format!(", {key} = {bytes:?}"),
            };
            let parameters: String = found.parameters.iter().map(parameter).collect();
            fix(
                *message,
                format!("checksum = {{ kind = {:?}, signal = {signal:?}{parameters} }}", found.kind),
            )
        }
        FindingKind::NoMessage
        | FindingKind::OtherPlatform { .. }
        | FindingKind::Unmet(_)
        | FindingKind::WrongLength { .. }
        | FindingKind::Faster { .. }
        | FindingKind::IntegrityFails { .. }
        | FindingKind::Undefined { .. }
        | FindingKind::Implausible { .. }
        | FindingKind::NothingChanged { .. }
        | FindingKind::NeverOn(_) => None,
    }
}

fn expected_period(evidence: &ProfileEvidence, message: usize) -> String {
    let message = &evidence.messages[message];
    match (message.cycle, message.bound.timing) {
        (Some(cycle), _) => format!("by the DBC every {}", millis(cycle)),
        (None, Timing::Cyclic { timeout } | Timing::EventCyclic { timeout }) => {
            format!("unknown after {}", millis(timeout))
        }
        (None, Timing::Event) => "on change".to_owned(),
    }
}

pub(super) fn millis(duration: Duration) -> String {
    format!("{:.0} ms", duration.as_secs_f64() * 1e3)
}

/// Returns the signals of a source, and its number of frames.
fn source_text(evidence: &ProfileEvidence, source: SourceIndex) -> (String, u64) {
    let lights = evidence.lights();
    let name = |signal: SignalIndex| lights.table.signals[signal.0].name.as_str();
    match source {
        SourceIndex::Turn(position) => {
            let signals: Vec<_> = lights.turn.sources()[position].source.signals().map(name).collect();
            (signals.join(" and "), evidence.turn[position].frames)
        }
        SourceIndex::Hazard(position) => {
            let signal = match &lights.hazard.sources()[position].source {
                HazardSource::BothSides => "hazard",
                HazardSource::Signal { role, .. } => name(role.signal),
                HazardSource::Button { role, .. } => name(role.signal),
            };
            (signal.to_owned(), evidence.hazard[position].frames)
        }
    }
}
