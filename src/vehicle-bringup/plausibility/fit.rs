//! Measures how well a profile fits frames of an unknown vehicle.

use std::time::Duration;

use super::evidence::ProfileEvidence;
use super::finding::{FindingKind, ProfileFinding, Severity, findings, other_platform};
use super::fingerprint::PlatformMatch;
use super::message::{MIN_FRAMES, MessageEvidence, Proof, Rhythm};
use can_signal::can::{CanId, IdMatch};
use gateway_core::vehicle_lights::state::TurnCode;

/// Certainty that a profile fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FitVerdict {
    /// Something contradicts the profile.
    No,
    /// Nothing contradicts the profile, but only identifiers that other vehicles also use support it.
    Possible,
    /// Rules, behaviour, rhythm or platform of the profile hold, to a greater extent than chance explains.
    Fits,
}

/// Evidence that supports a profile.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub enum Support {
    /// Counter or checksum hold.
    Integrity {
        /// Position of the message.
        message: usize,
        /// Number of frames for which they hold.
        frames: u64,
        /// True with a checksum.
        checksum: bool,
    },
    /// A message has the period of the DBC.
    Period {
        /// Position of the message.
        message: usize,
        /// Usual gap between frames.
        median: Duration,
    },
    /// A message has an identifier of 29 bits, which is rarely shared by chance.
    ExtendedIdentifier { message: usize },
    /// A side was on and off as when operated by a driver.
    Sides { left: bool, right: bool },
    /// The state changed, and the profile names every value.
    NamedValues,
    /// The bus belongs to the profile's platform.
    Platform {
        /// Title of the list.
        title: String,
        /// Number of identifiers that are in the list.
        explained: u32,
        /// Number of all identifiers on the bus.
        identifiers: u32,
    },
    /// A heartbeat message of the bus was received.
    Heartbeat { ids: IdMatch },
}

/// Result of comparing a profile with frames.
#[derive(Debug, Clone, PartialEq, Eq)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct Fit {
    pub verdict: FitVerdict,
    /// Rank among profiles of the same verdict.
    pub score: u32,
    /// Evidence that supports it, the strongest first.
    pub support: Vec<Support>,
    /// Findings that contradict it.
    pub against: Vec<ProfileFinding>,
    /// Number of its received messages, and of all its messages.
    pub received: (usize, usize),
}

impl Support {
    fn points(&self) -> u32 {
        match self {
            Self::Integrity { checksum: true, .. } => 60,
            Self::Integrity { checksum: false, .. } => 30,
            Self::Sides { left, right } => 10 * (u32::from(*left) + u32::from(*right)),
            Self::Platform { .. } => 15,
            Self::Period { .. } | Self::ExtendedIdentifier { .. } => 10,
            Self::Heartbeat { .. } => 6,
            Self::NamedValues => 5,
        }
    }
}

/// Points from which a profile fits: a period alone is not enough, but with the platform it is.
const FITTING: u32 = 20;

/// Judges a profile; `None` when none of its messages was received. `heartbeats` are its received heartbeat
/// messages. `platform` is the best match of its lists, or `None` if the profile names none or the bus has
/// too few identifiers.
pub fn fit(
    evidence: &ProfileEvidence,
    heartbeats: &[IdMatch],
    platform: Option<PlatformMatch<'_>>,
) -> Option<Fit> {
    let received = evidence.messages.iter().filter(|message| message.frames > 0).count();
    if received == 0 {
        return None;
    }
    let mut support: Vec<_> = evidence.messages.iter().enumerate().flat_map(of_message).collect();
    support.extend(heartbeats.iter().map(|ids| Support::Heartbeat { ids: *ids }));
    let [left, right] = [TurnCode::Left, TurnCode::Right].map(|side| evidence.has_seen_turn(side));
    let was_off = evidence.has_seen_turn(TurnCode::Off);
    if was_off && (left || right) {
        support.push(Support::Sides { left, right });
    }
    let undefined: u64 = evidence.turn.iter().chain(&evidence.hazard).map(|states| states.undefined).sum();
    if evidence.has_changed() && undefined == 0 {
        support.push(Support::NamedValues);
    }
    if let Some(platform) = platform.filter(PlatformMatch::is_of_platform) {
        let PlatformMatch { list, explained, identifiers } = platform;
        support.push(Support::Platform { title: list.title.clone(), explained, identifiers });
    }
    support.sort_by_key(|support| std::cmp::Reverse(support.points()));
    let mut against: Vec<_> = findings(evidence).into_iter().filter(speaks_against).collect();
    let other_platform = platform.and_then(other_platform);
    let is_refuted = other_platform.is_some()
        || against.iter().any(|finding| finding.severity == Severity::Error)
        || evidence
            .messages
            .iter()
            .any(|message| matches!(message.rhythm(), Rhythm::TooSlow | Rhythm::Slower));
    against.extend(other_platform);
    let score: u32 = support.iter().map(Support::points).sum();
    let is_whole = received == evidence.messages.len();
    let verdict = if is_refuted {
        FitVerdict::No
    } else if is_whole && score >= FITTING {
        FitVerdict::Fits
    } else {
        FitVerdict::Possible
    };
    // Each fault that alone does not refute it makes it less likely.
    let faults = u32::try_from(against.len()).unwrap_or(u32::MAX);
    let score = score.saturating_sub(faults.saturating_mul(3));
    Some(Fit { verdict, score, support, against, received: (received, evidence.messages.len()) })
}

fn of_message((message, evidence): (usize, &MessageEvidence)) -> Vec<Support> {
    let mut support = Vec::new();
    if evidence.frames == 0 {
        return support;
    }
    if let Proof::Holds { frames, checksum } = evidence.proof() {
        support.push(Support::Integrity { message, frames, checksum });
    }
    if let (Rhythm::AsDescribed, Some(median)) = (evidence.rhythm(), evidence.gaps.median()) {
        support.push(Support::Period { message, median });
    }
    if matches!(evidence.bound.ids.described(), CanId::Extended(_)) && evidence.frames >= MIN_FRAMES {
        support.push(Support::ExtendedIdentifier { message });
    }
    support
}

/// Returns true for a finding on the frames themselves, rather than on missing evidence.
fn speaks_against(finding: &ProfileFinding) -> bool {
    match finding.kind {
        FindingKind::WrongLength { .. }
        | FindingKind::TooSlow { .. }
        | FindingKind::IntegrityFails { .. }
        | FindingKind::Implausible { .. }
        | FindingKind::Undefined { .. }
        | FindingKind::OtherPlatform { .. }
        | FindingKind::NoMessage => true,
        FindingKind::Unmet(unmet) => unmet.is_contradicted,
        FindingKind::Faster { .. }
        | FindingKind::UnusedCounter { .. }
        | FindingKind::UnusedChecksum { .. }
        | FindingKind::NothingChanged { .. }
        | FindingKind::NeverOn(_) => false,
    }
}
