//! Judges the turn signal of another planner by the rules of the decider (docs/turn-signal-decider.md,
//! "Learned planners").
//!
//! A manoeuvre lasts while the decider requests one side for one subject. When it is over, the signal
//! received in that time gets a verdict. So does a signal that was shown while none was requested.

use std::time::Duration;

use super::decision::Decision;
use super::decision_context::STOP_SPEED_MPS;
use super::inputs::Timed;
use super::manoeuvre::ManoeuvreKind;
use super::planner_input::Odometry;
use super::subject::SignalSubject;
use crate::light_command::{EnumOrUnknown, TurnCommand};
pub use counts::{JudgedCounts, JudgedKind, SignalVerdict, VerdictCounts, VerdictKind};
use gateway_base::time::MonoTime;
pub use judged::{AskedSignal, DeciderReason, JudgeSettings, JudgedManoeuvre};
use stretch::{ReceivedSignal, SignalStart, Stretch};

mod counts;
mod judged;
mod stretch;

#[cfg(test)]
mod tests;

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
    signal: Option<ReceivedSignal>,
    /// The manoeuvre that is being requested.
    open: Option<Stretch>,
    last: MonoTime,
    counts: JudgedCounts,
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
                    signal.note_dark(SignalStart { at: now, odometry, reason });
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
                    let start = SignalStart { at: now, odometry, reason };
                    Stretch::new(side, subject.unwrap_or_default(), start, unasked)
                });
                let lingers = signal.is_some_and(|signal| signal.lingers(&self.settings, now));
                open.note(now, received, is_required, subject.is_none() || lingers);
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
