//! The two stretches of time that the judge follows: the requested side, and the side shown.

use std::time::Duration;

use super::counts::SignalVerdict;
use super::judged::{AskedSignal, DeciderReason, JudgeSettings, JudgedManoeuvre};
use crate::light_command::TurnCommand;
use crate::planner_input::Odometry;
use crate::side::Side;
use crate::subject::SignalSubject;
use gateway_base::time::{MonoTime, millis};

/// A side that is shown without a break.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReceivedSignal {
    pub(super) side: Side,
    /// The time since which its side is not requested; `None` while it is requested.
    pub(super) unasked: Option<Unasked>,
    /// The beginning of the time in which no side is requested.
    dark: Option<SignalStart>,
    was_asked: bool,
}

/// The beginning of the time in which a signal is shown without a request for its side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Unasked {
    since: MonoTime,
    /// The request for its side ended just before.
    follows: bool,
}

/// The beginning of a manoeuvre, or of the time in which no side is requested.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SignalStart {
    pub(super) at: MonoTime,
    pub(super) odometry: Odometry,
    pub(super) reason: DeciderReason,
}

/// A manoeuvre while it is requested.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stretch {
    side: Side,
    subject: SignalSubject,
    start: SignalStart,
    /// The signal was on before the side was requested.
    unasked: Option<Unasked>,
    required_since: Option<MonoTime>,
    /// The first cycle in which the side was received.
    on_at: Option<MonoTime>,
    /// The received signal was known in a cycle.
    is_heard: bool,
    /// In a cycle the opposite side was not received.
    is_mixed: bool,
    /// The last cycle, with the category of the time since then.
    counting: Option<(MonoTime, Counted)>,
    times: Times,
}

/// Category of the time between two cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Counted {
    received: Received,
    is_required: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Received {
    Unknown,
    Asked,
    Opposite,
    /// The opposite side is on where it does no harm.
    Tolerated,
    Dark,
}

/// Accumulated times within a manoeuvre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Times {
    required: Duration,
    unknown: Duration,
    opposite: Duration,
    /// Time without the side while it was required, after it was on.
    gap: Duration,
}

impl ReceivedSignal {
    pub(super) const fn new(side: Side) -> Self {
        Self { side, unasked: None, dark: None, was_asked: false }
    }

    /// Records that no side is requested.
    pub(super) fn note_dark(&mut self, start: SignalStart) {
        self.note_unasked(start.at);
        self.dark.get_or_insert(start);
    }

    /// Records that the other side is requested.
    pub(super) fn note_other_side(&mut self, now: MonoTime) {
        self.note_unasked(now);
        self.dark = None;
    }

    /// Records that its side is requested.
    pub(super) fn note_asked(&mut self) {
        (self.unasked, self.dark, self.was_asked) = (None, None, true);
    }

    /// Records that it was used to judge a manoeuvre: from now on it lingers.
    pub(super) fn note_judged(&mut self) {
        (self.unasked, self.was_asked) = (None, true);
    }

    /// Returns whether it is still on after its manoeuvre, within the tolerated time.
    pub(super) fn lingers(&self, settings: &JudgeSettings, now: MonoTime) -> bool {
        self.unasked.is_some_and(|unasked| unasked.follows && now.since(unasked.since) <= settings.linger)
    }

    /// Returns the verdict on the time without a request, which ends now; `None` if it is short enough.
    pub(super) fn needless(&self, settings: &JudgeSettings, now: MonoTime) -> Option<JudgedManoeuvre> {
        let SignalStart { at, odometry, reason } = self.dark.as_ref()?;
        let follows = self.unasked.is_some_and(|unasked| unasked.follows);
        let limit = if follows { settings.linger } else { settings.needless };
        (now.since(*at) > limit).then(|| JudgedManoeuvre {
            side: self.side,
            subject: None,
            reason: reason.clone(),
            start: *at,
            required_since: None,
            end: now,
            odometry: *odometry,
            received: Some(self.side),
            verdict: SignalVerdict::Needless,
        })
    }

    fn note_unasked(&mut self, now: MonoTime) {
        self.unasked.get_or_insert(Unasked { since: now, follows: self.was_asked });
    }
}

impl Stretch {
    /// Creates a manoeuvre that is requested from now on.
    pub(super) fn new(
        side: Side,
        subject: SignalSubject,
        start: SignalStart,
        unasked: Option<Unasked>,
    ) -> Self {
        Self {
            side,
            subject,
            start,
            unasked,
            required_since: None,
            on_at: None,
            is_heard: false,
            is_mixed: false,
            counting: None,
            times: Times::default(),
        }
    }

    /// Returns whether the decider's request is unchanged.
    pub(super) fn continues(&self, asked: &AskedSignal) -> bool {
        match asked {
            AskedSignal::Side { side, subject, .. } => {
                *side == self.side && subject.is_none_or(|subject| subject == self.subject)
            }
            AskedSignal::Unknown | AskedSignal::Dark(_) => false,
        }
    }

    /// Records a cycle. The opposite side is tolerated after the required section; before it only with
    /// `tolerates_opposite`, while the signal lingers or is held.
    pub(super) fn note(
        &mut self,
        now: MonoTime,
        received: Option<TurnCommand>,
        is_required: bool,
        tolerates_opposite: bool,
    ) {
        self.count_until(now);
        if is_required {
            self.required_since.get_or_insert(now);
        }
        let is_over = self.required_since.is_some();
        let received = match received.map(TurnCommand::side) {
            None => Received::Unknown,
            Some(None) => Received::Dark,
            Some(Some(side)) if side == self.side => Received::Asked,
            Some(Some(_)) if !is_required && (is_over || tolerates_opposite) => Received::Tolerated,
            Some(Some(_)) => Received::Opposite,
        };
        if received == Received::Asked {
            self.on_at.get_or_insert(now);
        }
        self.is_heard |= received != Received::Unknown;
        self.is_mixed |= !matches!(received, Received::Opposite | Received::Tolerated);
        self.counting = Some((now, Counted { received, is_required }));
    }

    /// Judges the manoeuvre, which ends now; `None` if the received signal was unknown for too long.
    pub(super) fn judged(mut self, settings: &JudgeSettings, now: MonoTime) -> Option<JudgedManoeuvre> {
        self.count_until(now);
        let is_known = self.is_heard && self.times.unknown <= settings.gap;
        is_known.then(|| {
            let verdict = self.verdict(settings);
            let shown = self.on_at.map(|_| self.side);
            JudgedManoeuvre {
                side: self.side,
                subject: Some(self.subject),
                start: self.start.at,
                required_since: self.required_since,
                end: now,
                odometry: self.start.odometry,
                received: if verdict == SignalVerdict::WrongSide {
                    Some(self.side.opposite())
                } else {
                    shown
                },
                verdict,
                reason: self.start.reason,
            }
        })
    }

    fn verdict(&self, settings: &JudgeSettings) -> SignalVerdict {
        let Times { required, opposite, gap, .. } = self.times;
        if !self.is_mixed || opposite > settings.wrong_side {
            return SignalVerdict::WrongSide;
        }
        let Some(on_at) = self.on_at else {
            // A signal that was required only for a moment could not be followed.
            return if required > settings.late { SignalVerdict::Missing } else { SignalVerdict::Agree };
        };
        let late_by = self.required_since.map_or(Duration::ZERO, |since| on_at.since(since));
        if late_by > settings.late {
            return SignalVerdict::Late { by_ms: millis(late_by) };
        }
        if let Some(unasked) = self.unasked {
            let limit = if unasked.follows { settings.linger } else { settings.early };
            let early_by = self.start.at.since(unasked.since);
            let is_planned = matches!(self.subject, SignalSubject::Manoeuvre(_)) && !unasked.follows;
            let ahead = self.required_since.map(|required| required.since(unasked.since));
            let is_usual = is_planned && ahead.is_some_and(|ahead| ahead <= settings.ahead);
            if early_by > limit && !is_usual {
                return SignalVerdict::Early { by_ms: millis(early_by) };
            }
        }
        if gap > settings.gap { SignalVerdict::Missing } else { SignalVerdict::Agree }
    }

    /// Counts the time since the last cycle.
    fn count_until(&mut self, now: MonoTime) {
        let Some((since, Counted { received, is_required })) = self.counting else { return };
        let time = now.since(since);
        if is_required {
            self.times.required += time;
        }
        match received {
            Received::Unknown => self.times.unknown += time,
            Received::Opposite => self.times.opposite += time,
            Received::Dark if is_required && self.on_at.is_some() => self.times.gap += time,
            Received::Asked | Received::Tolerated | Received::Dark => {}
        }
    }
}
