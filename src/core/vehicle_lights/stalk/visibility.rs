//! Whether a control was watched well enough to know what it was used for.

use std::time::Duration;

use crate::core::time::MonoTime;

#[derive(Debug, Clone)]
pub(super) struct Visibility {
    max_gap: Duration,
    startup_delay: Duration,
    now: MonoTime,
    state: ControlState,
    /// Since when no use can have been missed.
    since: MonoTime,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ControlState {
    Never,
    Now,
    Lost(MonoTime),
}

/// What happened before the control came into sight again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Gap {
    TooShortForAPress,
    CouldHideAPress,
}

impl Visibility {
    pub(super) fn new(max_gap: Duration, startup_delay: Duration) -> Self {
        Self {
            max_gap,
            startup_delay,
            now: MonoTime::ZERO,
            state: ControlState::Never,
            since: MonoTime::ZERO,
        }
    }

    /// The latest time heard of: it never runs backwards.
    pub(super) fn now(&self) -> MonoTime {
        self.now
    }

    pub(super) fn advance(&mut self, now: MonoTime) {
        self.now = self.now.max(now);
    }

    pub(super) fn mark_unseen(&mut self) {
        if self.state == ControlState::Now {
            self.state = ControlState::Lost(self.now);
        }
    }

    pub(super) fn mark_seen(&mut self) -> Gap {
        let hidden = match std::mem::replace(&mut self.state, ControlState::Now) {
            ControlState::Now => false,
            ControlState::Never => true,
            ControlState::Lost(at) => self.now.since(at) > self.max_gap,
        };
        if !hidden {
            return Gap::TooShortForAPress;
        }
        self.since = self.now;
        Gap::CouldHideAPress
    }

    pub(super) fn is_known(&self) -> bool {
        self.state == ControlState::Now && self.now.since(self.since) >= self.startup_delay
    }

    /// When it becomes known with nothing happening.
    pub(super) fn next_deadline(&self) -> Option<MonoTime> {
        let settled = self.since.after(self.startup_delay);
        (self.state == ControlState::Now && settled > self.now).then_some(settled)
    }
}
