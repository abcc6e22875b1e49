//! Judges the turn signal of another planner by the rules of the decider (docs/turn-signal-decider.md,
//! "Learned planners").
//!
//! A manoeuvre lasts while the decider requests one side for one subject. When it is over, the signal
//! received in that time gets a verdict. So does a signal that was shown while none was requested.

use std::time::Duration;

use serde::Serialize;

use super::decision::{Basis, BasisKind, Decision};
use super::decision_context::STOP_SPEED_MPS;
use super::inputs::Timed;
use super::manoeuvre::{ManoeuvreKind, ManoeuvreOutcome};
use super::min_duration::Held;
use super::planner_input::Odometry;
use super::resolve::{CandidateOutcome, CandidateSource, Case};
use super::side::Side;
use super::subject::SignalSubject;
use crate::light_command::{EnumOrUnknown, TurnCommand};
pub use counts::{JudgedCounts, JudgedKind, SignalVerdict, VerdictCounts, VerdictKind};
use gateway_base::time::MonoTime;
use stretch::{ReceivedSignal, Stretch};

mod counts;
mod stretch;

#[cfg(test)]
mod tests;

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
pub struct DeciderReason {
    /// The basis of the decision.
    pub basis: BasisKind,
    /// Source of the candidate that won; `None` without one.
    pub winner: Option<CandidateSource>,
    /// Rule by which it won; `None` when nothing was compared.
    pub rule: Option<Case>,
    /// The minimum duration that holds the command; `None` if none does.
    pub held: Option<Held>,
    /// The outcome of each candidate.
    pub candidates: Vec<(CandidateSource, CandidateOutcome)>,
    /// The outcome of each manoeuvre of the planner.
    pub manoeuvres: Vec<ManoeuvreOutcome>,
}

/// One cycle of the decider with the received signal.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedCycle {
    /// Time of the cycle.
    pub now: MonoTime,
    /// Pose and speed of the vehicle.
    pub odometry: Odometry,
    /// The signal that the decider requests.
    pub asked: AskedSignal,
    /// The command in force; `None` if unknown. All commands that turn nothing on count as dark.
    pub received: Option<TurnCommand>,
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

/// Judges cycle by cycle. [`Self::on_cycle`] is called for each cycle of the decider, [`Self::finish`] at the
/// end.
///
/// ```
/// use turn_signal::light_command::TurnCommand;
/// use gateway_base::time::MonoTime;
/// use turn_signal::planner_input::Odometry;
/// use turn_signal::signal_judge::{AskedSignal, JudgeSettings, JudgedCycle, SignalJudge};
///
/// let mut judge = SignalJudge::new(JudgeSettings::DEFAULT);
/// let cycle = JudgedCycle {
///     now: MonoTime::ZERO,
///     odometry: Odometry::default(),
///     asked: AskedSignal::Unknown,
///     received: Some(TurnCommand::Left),
/// };
/// assert_eq!(judge.on_cycle(cycle), []);
/// assert_eq!(judge.finish(), []);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SignalJudge {
    settings: JudgeSettings,
    /// The signal that is being received.
    signal: Option<ReceivedSignal>,
    /// The manoeuvre that is being requested.
    open: Option<Stretch>,
    /// Time of the last cycle.
    last: MonoTime,
    counts: JudgedCounts,
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
    fn before_manoeuvre(self) -> Self {
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

impl JudgedCycle {
    /// Returns the cycle of a decision with the last received command, unless that is older than `limit`.
    pub fn of(
        decision: &Decision,
        odometry: Odometry,
        received: Option<Timed<EnumOrUnknown<TurnCommand>>>,
        limit: Duration,
        now: MonoTime,
    ) -> Self {
        let fresh = received.filter(|received| now.since(received.at) <= limit);
        let received = fresh.and_then(|received| received.value.known());
        Self { now, odometry, asked: AskedSignal::of(decision), received }
    }
}

impl SignalJudge {
    /// Creates a judge before its first cycle.
    pub fn new(settings: JudgeSettings) -> Self {
        Self { settings, signal: None, open: None, last: MonoTime::ZERO, counts: JudgedCounts::default() }
    }

    /// Processes a cycle, no earlier than the previous one. Returns the manoeuvre and the needless signal
    /// that it ends, oldest first.
    pub fn on_cycle(&mut self, cycle: JudgedCycle) -> Vec<JudgedManoeuvre> {
        let JudgedCycle { now, odometry, asked, received } = cycle;
        self.last = now;
        if asked == AskedSignal::Unknown {
            self.signal = None;
            self.counts.unjudged += u64::from(self.open.take().is_some());
            return Vec::new();
        }
        let mut over = Vec::new();
        let shown = received.and_then(TurnCommand::side);
        if let Some(ended) = self.signal.take_if(|signal| shown != Some(signal.side)) {
            over.extend(ended.needless(&self.settings, now).filter(|_| received.is_some()));
        }
        if let Some(ended) = self.open.take_if(|open| !open.continues(&asked)) {
            let judged = self.judged(ended, now);
            let wrong = judged.as_ref().filter(|judged| judged.verdict == SignalVerdict::WrongSide);
            let wrong = wrong.and_then(|judged| judged.received);
            if let Some(signal) = self.signal.as_mut().filter(|signal| Some(signal.side) == wrong) {
                signal.note_judged();
            }
            over.extend(judged);
        }
        if let Some(side) = shown {
            self.signal.get_or_insert(ReceivedSignal::new(side));
        }
        match asked {
            AskedSignal::Unknown => {}
            AskedSignal::Dark(reason) => {
                if let Some(signal) = &mut self.signal {
                    signal.note_dark((now, odometry), reason);
                }
            }
            AskedSignal::Side { side, subject, is_required, reason } => {
                if let Some(signal) = self.signal.as_mut().filter(|signal| signal.side != side) {
                    over.extend(signal.needless(&self.settings.before_manoeuvre(), now));
                    signal.note_other_side(now);
                }
                let is_required = is_required && !waits_to_pull_out(subject, odometry);
                let signal = self.signal.as_ref();
                let open = self.open.get_or_insert_with(|| {
                    let unasked =
                        signal.filter(|signal| signal.side == side).and_then(|signal| signal.unasked);
                    Stretch::new((side, subject), reason, (now, odometry), unasked)
                });
                let lingers = signal.is_some_and(|signal| signal.lingers(&self.settings, now));
                open.note(now, received, (is_required, subject.is_none(), lingers));
                if let Some(signal) = self.signal.as_mut().filter(|signal| signal.side == side) {
                    signal.note_asked();
                }
            }
        }
        self.counted(over)
    }

    /// Ends the manoeuvre or the needless signal that is not over at the last cycle, and returns it. A signal
    /// that may still have become an early signal is left out.
    pub fn finish(&mut self) -> Vec<JudgedManoeuvre> {
        let now = self.last;
        let settings = self.settings.before_manoeuvre();
        let needless = self.signal.take().and_then(|signal| signal.needless(&settings, now));
        let open = self.open.take();
        let open = open.and_then(|open| self.judged(open, now));
        self.counted(needless.into_iter().chain(open).collect())
    }

    /// Returns the verdicts so far, by the kind of what was signalled.
    pub const fn counts(&self) -> &JudgedCounts {
        &self.counts
    }

    fn judged(&mut self, ended: Stretch, now: MonoTime) -> Option<JudgedManoeuvre> {
        let judged = ended.judged(&self.settings, now);
        self.counts.unjudged += u64::from(judged.is_none());
        judged
    }

    fn counted(&mut self, mut over: Vec<JudgedManoeuvre>) -> Vec<JudgedManoeuvre> {
        over.sort_by_key(|judged| judged.start);
        for judged in &over {
            self.counts.add(JudgedKind::of(judged.subject), judged.verdict.kind());
        }
        over
    }
}

/// Returns whether the vehicle stands before it pulls out: its signal may then be on, and must be on once it
/// moves.
fn waits_to_pull_out(subject: Option<SignalSubject>, odometry: Odometry) -> bool {
    subject == Some(SignalSubject::Manoeuvre(ManoeuvreKind::PullOut))
        && odometry.speed_mps.abs() < STOP_SPEED_MPS
}
