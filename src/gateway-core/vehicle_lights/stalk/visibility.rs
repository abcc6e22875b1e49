//! Observation of a momentary control: whether an earlier press can have been missed.

use std::time::Duration;

use gateway_base::time::MonoTime;

/// Observation state of a control.
#[derive(Debug, Clone)]
pub(super) struct Visibility {
    max_gap: Duration,
    startup_delay: Duration,
    now: MonoTime,
    state: ControlState,
    /// Time since which no press can have been missed.
    since: MonoTime,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ControlState {
    NeverObserved,
    Observed,
    LostAt(MonoTime),
}

impl Visibility {
    pub(super) fn new(max_gap: Duration, startup_delay: Duration) -> Self {
        Self {
            max_gap,
            startup_delay,
            now: MonoTime::ZERO,
            state: ControlState::NeverObserved,
            since: MonoTime::ZERO,
        }
    }

    /// Returns the latest time of any call, which never runs backwards.
    pub(super) fn now(&self) -> MonoTime {
        self.now
    }

    /// Advances the time without a frame.
    pub(super) fn advance(&mut self, now: MonoTime) {
        self.now = self.now.max(now);
    }

    /// Processes a frame with an unknown position.
    pub(super) fn unknown_frame(&mut self) {
        if self.state == ControlState::Observed {
            self.state = ControlState::LostAt(self.now);
        }
    }

    /// Processes a frame with a known position. Returns true if the gap before it could hide a press.
    pub(super) fn known_frame(&mut self) -> bool {
        let could_hide_press = match std::mem::replace(&mut self.state, ControlState::Observed) {
            ControlState::Observed => false,
            ControlState::NeverObserved => true,
            ControlState::LostAt(at) => self.now.since(at) > self.max_gap,
        };
        if could_hide_press {
            self.since = self.now;
        }
        could_hide_press
    }

    /// Returns true if the control has been observed for the startup delay without a missed press.
    pub(super) fn is_known(&self) -> bool {
        self.state == ControlState::Observed && self.now.since(self.since) >= self.startup_delay
    }

    /// Returns the instant at which [`Self::is_known`] becomes true without an event; `None` = never.
    pub(super) fn next_deadline(&self) -> Option<MonoTime> {
        let known_at = self.since.after(self.startup_delay);
        (self.state == ControlState::Observed && known_at > self.now).then_some(known_at)
    }
}
