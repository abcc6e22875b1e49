//! Whether a control was watched well enough to know what it was used for.

use std::time::Duration;

use crate::core::time::MonoTime;

#[derive(Debug, Clone)]
pub(super) struct Sight {
    blind: Duration,
    settle: Duration,
    now: MonoTime,
    seen: Seen,
    /// Since when no use can have been missed.
    since: MonoTime,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Seen {
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

impl Sight {
    pub(super) fn new(blind: Duration, settle: Duration) -> Self {
        Self { blind, settle, now: MonoTime::ZERO, seen: Seen::Never, since: MonoTime::ZERO }
    }

    /// The latest time heard of: it never runs backwards.
    pub(super) fn now(&self) -> MonoTime {
        self.now
    }

    pub(super) fn advance(&mut self, now: MonoTime) {
        self.now = self.now.max(now);
    }

    pub(super) fn lose(&mut self) {
        if self.seen == Seen::Now {
            self.seen = Seen::Lost(self.now);
        }
    }

    pub(super) fn regain(&mut self) -> Gap {
        let hidden = match std::mem::replace(&mut self.seen, Seen::Now) {
            Seen::Now => false,
            Seen::Never => true,
            Seen::Lost(at) => self.now.since(at) > self.blind,
        };
        if !hidden {
            return Gap::TooShortForAPress;
        }
        self.since = self.now;
        Gap::CouldHideAPress
    }

    pub(super) fn is_known(&self) -> bool {
        self.seen == Seen::Now && self.now.since(self.since) >= self.settle
    }

    /// When it becomes known with nothing happening.
    pub(super) fn next_deadline(&self) -> Option<MonoTime> {
        let settled = self.since.after(self.settle);
        (self.seen == Seen::Now && settled > self.now).then_some(settled)
    }
}
