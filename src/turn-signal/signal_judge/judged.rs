//! What the judge compares: its tolerances, the requests of the decider, and judged signals.

use std::time::Duration;

use serde::Serialize;

use super::counts::SignalVerdict;
use crate::decision::{Basis, BasisKind, Decision};
use crate::manoeuvre::ManoeuvreOutcome;
use crate::min_duration::Held;
use crate::planner_input::Odometry;
use crate::resolve::{CandidateOutcome, CandidateSource, Case};
use crate::side::Side;
use crate::subject::SignalSubject;
use gateway_base::time::MonoTime;

/// Tolerances of the judge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JudgeSettings {
    /// A signal may begin this long before the decider requests it.
    pub early: Duration,
    /// A signal of a planner's manoeuvre may begin this long before it is required, even if the decider
    /// requests it later: the planner knows its manoeuvre before its trajectory shows it.
    pub ahead: Duration,
    /// A signal may begin this long after the vehicle has reached the required section.
    pub late: Duration,
    /// The signal may be missing for this long while it is required, once it was on.
    pub gap: Duration,
    /// The other side may be on for this long while a side is requested.
    pub wrong_side: Duration,
    /// A signal may stay on for this long after its manoeuvre.
    pub linger: Duration,
    /// A signal without a manoeuvre counts if it lasts longer than this.
    pub needless: Duration,
}

/// The signal that the decider requests in a cycle.
#[derive(Debug, Clone, PartialEq)]
pub enum AskedSignal {
    /// The decider lacks inputs, or requests hazard lights instead: nothing is judged.
    Unknown,
    /// No side is requested.
    Dark(DeciderReason),
    /// A side is requested.
    Side {
        /// The requested side.
        side: Side,
        /// The subject of the request; `None` while a minimum duration keeps it on beyond its subject.
        subject: Option<SignalSubject>,
        /// The vehicle is in the required section; otherwise the signal is optional.
        is_required: bool,
        /// Reason for the request.
        reason: DeciderReason,
    },
}

/// The reason of the decider.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs)] // their names say it
pub struct DeciderReason {
    pub basis: BasisKind,
    /// Source of the candidate that won; `None` without one.
    pub winner: Option<CandidateSource>,
    /// Rule by which it won; `None` when nothing was compared.
    pub rule: Option<Case>,
    /// The minimum duration that holds the command; `None` if none does.
    pub held: Option<Held>,
    pub candidates: Vec<(CandidateSource, CandidateOutcome)>,
    pub manoeuvres: Vec<ManoeuvreOutcome>,
}

/// A manoeuvre, or a needless signal, with the verdict on the received signal.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedManoeuvre {
    /// The requested side; for a needless signal, the side shown.
    pub side: Side,
    /// The subject of the request; `None` for a needless signal.
    pub subject: Option<SignalSubject>,
    /// Reason of the decider at the start.
    pub reason: DeciderReason,
    /// Time at which the decider began the request, or the needless signal began.
    pub start: MonoTime,
    /// Time at which the signal became required; `None` if it never did.
    pub required_since: Option<MonoTime>,
    /// Time at which the decider ended the request, or the needless signal ended.
    pub end: MonoTime,
    /// Pose and speed at the start.
    pub odometry: Odometry,
    /// The received side that determines the verdict; `None` without a signal.
    pub received: Option<Side>,
    /// The verdict on the received signal.
    pub verdict: SignalVerdict,
}

impl JudgeSettings {
    /// Tolerates a signal that is early within a driver's habit; strict once the vehicle steers.
    pub const DEFAULT: Self = Self {
        early: Duration::from_secs(2),
        ahead: Duration::from_secs(5),
        late: Duration::from_millis(700),
        gap: Duration::from_secs(1),
        wrong_side: Duration::from_millis(700),
        linger: Duration::from_secs(3),
        needless: Duration::from_secs(1),
    };

    /// Returns the settings for a signal that may belong to the manoeuvre requested next.
    pub(super) fn before_manoeuvre(self) -> Self {
        Self { needless: self.needless.max(self.early), ..self }
    }
}

impl DeciderReason {
    /// Returns the reason of a decision.
    pub fn of(decision: &Decision) -> Self {
        let evaluated = decision.evaluated().iter();
        Self {
            basis: decision.basis.kind(),
            winner: decision.winner(),
            rule: decision.case(),
            held: decision.held,
            candidates: evaluated.map(|candidate| (candidate.source, candidate.outcome)).collect(),
            manoeuvres: decision.remarks.clone(),
        }
    }
}

impl AskedSignal {
    /// Returns the request of a decision. Without a required section to measure, a side is required as soon
    /// as it is requested.
    pub fn of(decision: &Decision) -> Self {
        if matches!(decision.basis, Basis::NoInputs | Basis::Hazard) {
            return Self::Unknown;
        }
        let reason = DeciderReason::of(decision);
        let Some(side) = decision.turn.side() else { return Self::Dark(reason) };
        let (subject, is_required) = match (decision.resolution(), decision.won()) {
            (None, _) => (Some(SignalSubject::Unnamed), true),
            (Some(_), Some(won)) if won.turn.side() == Some(side) => {
                let is_required = won.distances.is_none_or(|distances| distances.are_required());
                (Some(won.subject), is_required)
            }
            (Some(_), _) => (None, false),
        };
        Self::Side { side, subject, is_required, reason }
    }
}
