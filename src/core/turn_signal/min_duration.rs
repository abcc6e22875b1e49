//! A signal that a person can read: it stays on for a while, and off for a while between two signals
//! (weakness W2). Upstream has neither.

use std::fmt;
use std::time::Duration;

use super::signal::{Side, Signal};
use crate::core::time::MonoTime;

/// How long signals last at least.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MinDurations {
    /// On.
    pub minimum_on: Duration,
    /// Off before the next, whichever side.
    pub minimum_gap: Duration,
}

/// Why something else is shown than is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Held {
    /// This side has not been on long enough.
    On(Side),
    /// It has not been off long enough.
    Off,
}

impl fmt::Display for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::On(side) => write!(f, "{side} is on for too short a time"),
            Self::Off => f.write_str("off for too short a time"),
        }
    }
}

/// What is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shown {
    /// The command.
    pub signal: Signal,
    /// Why it is not what was wanted.
    pub held: Option<Held>,
    /// When it may change without anything else changing.
    pub deadline: Option<MonoTime>,
}

/// What was shown last, and since when.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MinDurationFilter {
    on: Option<(Side, MonoTime)>,
    off_since: Option<MonoTime>,
}

impl MinDurations {
    /// Three flashes at 120 a minute, and one dark phase between two signals.
    pub const READABLE: Self =
        Self { minimum_on: Duration::from_millis(1500), minimum_gap: Duration::from_millis(500) };
    /// Every change at once.
    pub const NONE: Self = Self { minimum_on: Duration::ZERO, minimum_gap: Duration::ZERO };
}

impl MinDurationFilter {
    /// What to show when `wanted` is wanted.
    pub fn show(&mut self, wanted: Signal, min_durations: MinDurations, now: MonoTime) -> Shown {
        if let Some((side, since)) = self.on {
            if wanted.side() == Some(side) {
                return Shown { signal: wanted, held: None, deadline: None };
            }
            if now.since(since) < min_durations.minimum_on {
                let deadline = Some(since.after(min_durations.minimum_on));
                return Shown { signal: side.into(), held: Some(Held::On(side)), deadline };
            }
            self.force_off(now);
        }
        let Some(side) = wanted.side() else {
            return Shown { signal: wanted, held: None, deadline: None };
        };
        if let Some(since) = self.off_since.filter(|since| now.since(*since) < min_durations.minimum_gap) {
            let deadline = Some(since.after(min_durations.minimum_gap));
            return Shown { signal: Signal::Disable, held: Some(Held::Off), deadline };
        }
        self.on = Some((side, now));
        Shown { signal: wanted, held: None, deadline: None }
    }

    /// Off at once: there is no inputs, or the hazard lights are on.
    pub fn force_off(&mut self, now: MonoTime) {
        if self.on.take().is_some() {
            self.off_since = Some(now);
        }
    }
}
