//! Findings on a profile: contradictions, and evidence that is missing.

use std::time::Duration;

use serde::Serialize;

use super::evidence::ProfileEvidence;
use super::fingerprint::PlatformMatch;
use super::message::{MIN_FRAMES, MessageEvidence, Proof, Rhythm};
use super::states::{Implausible, StateHistory};
use super::unused::{UnusedChecksum, UnusedCounter};
use can_signal::validation::integrity::search::FoundChecksum;
use can_signal::validation::requirement::Unmet;
use gateway_core::vehicle_lights::binding::{HazardSource, StateBinding, TurnSource};
use gateway_core::vehicle_lights::state::TurnCode;

/// Weight of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// A hint only; nothing is wrong.
    Note,
    /// To be examined before the drive.
    Warning,
    /// The profile does not match these frames, or cannot work.
    Error,
}

/// A finding on a profile.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub struct ProfileFinding {
    pub severity: Severity,
    pub kind: FindingKind,
}

/// A state that a recording should show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub enum Coverage {
    Left,
    Right,
    Hazard,
}

/// The content of a finding. A message or source is given by its position.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub enum FindingKind {
    /// Not one message of the profile was received.
    NoMessage,
    /// The identifiers on a bus are not those of the profile's platform.
    OtherPlatform {
        /// Title of the list that explains most of them.
        title: String,
        /// Number of identifiers that are in the list.
        explained: u32,
        /// Number of all identifiers on the bus.
        identifiers: u32,
        /// Minimum number for a bus of the platform.
        expected: u32,
    },
    /// A requirement of the profile is contradicted, or the recording does not meet it.
    Unmet(Unmet),
    /// Frames have a length other than in the DBC.
    WrongLength {
        message: usize,
        /// Number of these frames.
        frames: u64,
        /// Length of the first of them, bytes.
        length: usize,
    },
    /// Frames are less frequent than the profile states.
    TooSlow {
        message: usize,
        /// Usual gap between frames.
        median: Duration,
    },
    /// Frames are more than twice as frequent as the DBC states.
    Faster {
        message: usize,
        /// Usual gap between frames.
        median: Duration,
    },
    /// Counter or checksum of the profile fail for most frames.
    IntegrityFails {
        message: usize,
        /// Number of frames for which they do not hold.
        frames: u64,
    },
    /// The DBC names a counter that holds, and the profile does not use it.
    UnusedCounter {
        message: usize,
        signal: String,
        /// Number of frames that follow it.
        frames: u64,
        /// Maximum step that a profile should tolerate.
        max_step: u32,
    },
    /// The DBC names a checksum that holds, and the profile does not use it.
    UnusedChecksum {
        message: usize,
        signal: String,
        /// Number of frames for which it holds.
        frames: u64,
        found: FoundChecksum,
    },
    /// Values that the profile does not name.
    Undefined {
        source: SourceIndex,
        /// Number of frames with such a value.
        frames: u64,
    },
    /// Behaviour that no driver causes.
    Implausible {
        source: SourceIndex,
        /// Behaviour that was observed.
        behaviour: Implausible,
        changes: u64,
    },
    /// No state ever changed, so that the recording confirms nothing.
    NothingChanged {
        /// Each source with its constant state; empty if no source showed a defined state.
        states: Vec<(SourceIndex, TurnCode)>,
    },
    /// A state was never shown.
    NeverOn(Coverage),
}

/// A source of the profile, by its position in the binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceIndex {
    /// A source of the turn state.
    Turn(usize),
    /// A source of the hazard state.
    Hazard(usize),
}

/// Returns all findings, the most severe first.
pub fn findings(evidence: &ProfileEvidence) -> Vec<ProfileFinding> {
    let mut findings = Vec::new();
    if !evidence.messages.is_empty() && evidence.messages.iter().all(|message| message.frames == 0) {
        findings.push(ProfileFinding { severity: Severity::Error, kind: FindingKind::NoMessage });
    }
    if let Some(unmet) = evidence.unmet() {
        let severity = if unmet.is_contradicted { Severity::Error } else { Severity::Warning };
        findings.push(ProfileFinding { severity, kind: FindingKind::Unmet(unmet) });
    }
    for (position, message) in evidence.messages.iter().enumerate() {
        of_message(position, message, &mut findings);
    }
    for (position, (source, states)) in
        evidence.lights().turn.sources().iter().zip(&evidence.turn).enumerate()
    {
        let is_lamp = matches!(source.source, TurnSource::Lamps { .. });
        of_states(SourceIndex::Turn(position), states, is_lamp, &mut findings);
    }
    for (position, states) in evidence.hazard.iter().enumerate() {
        of_states(SourceIndex::Hazard(position), states, false, &mut findings);
    }
    coverage(evidence, &mut findings);
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    findings
}

/// Returns a finding if a bus does not belong to the compared platform.
pub fn other_platform(platform: PlatformMatch<'_>) -> Option<ProfileFinding> {
    let PlatformMatch { list, explained, identifiers } = platform;
    platform.is_of_other_platform().then(|| ProfileFinding {
        severity: Severity::Warning,
        kind: FindingKind::OtherPlatform {
            title: list.title.clone(),
            explained,
            identifiers,
            expected: platform.min_explained(),
        },
    })
}

fn of_message(message: usize, evidence: &MessageEvidence, findings: &mut Vec<ProfileFinding>) {
    let mut push = |severity, kind| findings.push(ProfileFinding { severity, kind });
    let (frames, length) = evidence.wrong_length;
    if frames > 0 {
        let severity = if frames * 2 > evidence.frames { Severity::Error } else { Severity::Warning };
        push(severity, FindingKind::WrongLength { message, frames, length });
    }
    if let Some(median) = evidence.gaps.median() {
        match evidence.rhythm() {
            Rhythm::TooSlow if evidence.frames >= 3 => {
                push(Severity::Warning, FindingKind::TooSlow { message, median });
            }
            Rhythm::Slower => push(Severity::Warning, FindingKind::TooSlow { message, median }),
            Rhythm::Faster => push(Severity::Note, FindingKind::Faster { message, median }),
            Rhythm::TooSlow | Rhythm::AsDescribed | Rhythm::Open => {}
        }
    }
    if let Proof::Fails { frames } = evidence.proof() {
        push(Severity::Error, FindingKind::IntegrityFails { message, frames });
    }
    if let Some((signal, frames, max_step)) = evidence.unused_counter.as_ref().and_then(UnusedCounter::holds)
    {
        let signal = signal.to_owned();
        push(Severity::Warning, FindingKind::UnusedCounter { message, signal, frames, max_step });
    }
    if let Some((signal, frames, found)) = evidence.unused_checksum.as_ref().and_then(UnusedChecksum::holds) {
        push(Severity::Warning, FindingKind::UnusedChecksum { message, signal, frames, found });
    }
}

fn of_states(source: SourceIndex, states: &StateHistory, is_lamp: bool, findings: &mut Vec<ProfileFinding>) {
    let frames = states.undefined;
    if frames > 0 {
        let severity = match frames {
            1 => Severity::Note,
            _ if frames >= MIN_FRAMES && frames * 2 > states.frames => Severity::Error,
            _ => Severity::Warning,
        };
        findings.push(ProfileFinding { severity, kind: FindingKind::Undefined { source, frames } });
    }
    if let Some(behaviour) = states.implausible(is_lamp) {
        let changes = states.changes;
        let severity = match behaviour {
            Implausible::Flickers => Severity::Error,
            Implausible::Flashes | Implausible::Crosses => Severity::Warning,
        };
        findings
            .push(ProfileFinding { severity, kind: FindingKind::Implausible { source, behaviour, changes } });
    }
}

/// Adds findings for states that were never shown. Without any change of state, only a checksum confirms a
/// profile.
fn coverage(evidence: &ProfileEvidence, findings: &mut Vec<ProfileFinding>) {
    let lights = evidence.lights();
    let mut push = |severity, kind| findings.push(ProfileFinding { severity, kind });
    let is_proven =
        |message: &MessageEvidence| matches!(message.proof(), Proof::Holds { checksum: true, .. });
    let has_turn = matches!(lights.turn, StateBinding::From(_));
    let hazard_sources = lights.hazard.sources();
    let can_show_hazard = hazard_sources.iter().any(|source| match source.source {
        HazardSource::BothSides => lights.turn.sources().iter().any(|turn| turn.source.shows_both()),
        HazardSource::Signal { .. } | HazardSource::Button { .. } => true,
    });
    if evidence.messages.iter().all(|message| message.frames == 0) {
        return;
    }
    if (has_turn || can_show_hazard) && !evidence.has_changed() && !evidence.messages.iter().any(is_proven) {
        let states = shown_states(evidence);
        // A short drive needs no indicators.
        let severity = if is_off(&states) { Severity::Note } else { Severity::Warning };
        return push(severity, FindingKind::NothingChanged { states });
    }
    for (is_missing, state) in [
        (has_turn && !evidence.has_seen_turn(TurnCode::Left), Coverage::Left),
        (has_turn && !evidence.has_seen_turn(TurnCode::Right), Coverage::Right),
        (can_show_hazard && !evidence.has_seen_hazard(), Coverage::Hazard),
    ] {
        if is_missing {
            push(Severity::Note, FindingKind::NeverOn(state));
        }
    }
}

/// Returns true if every source that has shown a state was off.
pub fn is_off(states: &[(SourceIndex, TurnCode)]) -> bool {
    !states.is_empty() && states.iter().all(|(_, state)| *state == TurnCode::Off)
}

/// Returns the state of each source, without sources that have shown none.
fn shown_states(evidence: &ProfileEvidence) -> Vec<(SourceIndex, TurnCode)> {
    let turn = evidence.turn.iter().enumerate().map(|(index, states)| (SourceIndex::Turn(index), states));
    let hazard =
        evidence.hazard.iter().enumerate().map(|(index, states)| (SourceIndex::Hazard(index), states));
    turn.chain(hazard).filter_map(|(source, states)| Some((source, states.current_state()?))).collect()
}
