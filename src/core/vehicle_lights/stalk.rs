//! Stalks and buttons: from where the driver's hand is to what was asked for.
//!
//! A latched stalk stays where it was put and needs no memory. A momentary one springs back: what a
//! press does depends on what was on when it began and on the deepest detent it reached. (On its way
//! to the full detent a stalk passes the half one, in frames or between them.) So the outcome of a
//! press is worked out anew, with each of its frames, from what was on before it.
//!
//! Such memory is only as good as the sight of the stalk: at start, and after a gap in which a press
//! could have hidden, nothing is taken to be on, and the state is unknown for a while.

pub mod button;
mod visibility;

#[cfg(test)]
mod cases;
#[cfg(test)]
mod properties;

use std::time::Duration;

use super::state::TurnCode;
use crate::core::time::{MonoTime, deadline_after};
use visibility::{Gap, Visibility};

/// Where the stalk is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StalkPosition {
    /// In the middle.
    Idle,
    /// Left, first detent.
    LeftHalf,
    /// Left, second detent.
    LeftFull,
    /// Right, first detent.
    RightHalf,
    /// Right, second detent.
    RightFull,
}

impl StalkPosition {
    /// What a latched stalk in this position asks for.
    pub fn latched(self) -> TurnCode {
        self.detent().map_or(TurnCode::Off, |(side, _)| side.code())
    }

    fn detent(self) -> Option<(Side, Detent)> {
        match self {
            Self::Idle => None,
            Self::LeftHalf => Some((Side::Left, Detent::Half)),
            Self::LeftFull => Some((Side::Left, Detent::Full)),
            Self::RightHalf => Some((Side::Right, Detent::Half)),
            Self::RightFull => Some((Side::Right, Detent::Full)),
        }
    }
}

/// How long a tap on the half detent blinks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comfort {
    /// So many flashes at this rate; no flashes when the vehicle has no comfort blinking.
    Flashes {
        /// Flashes.
        count: u8,
        /// Rate; at least 1 is assumed.
        per_minute: u8,
    },
    /// So long.
    For(Duration),
}

impl Comfort {
    /// Time from the tap to the end of the last flash cycle.
    pub fn duration(self) -> Duration {
        match self {
            Self::Flashes { count, per_minute } => {
                Duration::from_secs(60) * u32::from(count) / u32::from(per_minute.max(1))
            }
            Self::For(duration) => duration,
        }
    }
}

/// What a press against the side that is on does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OppositePress {
    /// Ends it and asks for nothing else.
    Cancels,
    /// Ends it and asks for the other side.
    Switches,
}

/// What pressing again to the latched side does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RepeatedPress {
    /// Ends it.
    Cancels,
    /// Nothing.
    Keeps,
}

/// Rules and times of a momentary stalk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StalkSettings {
    /// Blinking after a tap on the half detent; longer while it is held.
    pub comfort: Comfort,
    /// A tap on the half detent against the side that is on.
    pub opposite_half: OppositePress,
    /// A full press against the side that is on.
    pub opposite_full: OppositePress,
    /// A press to the side that is latched already.
    pub repeat: RepeatedPress,
    /// Longest time a full press is believed to last after the stalk was let go. The return by the
    /// steering wheel is mechanical and shows in no position.
    pub max_on: Option<Duration>,
    /// Longest time of unknown positions that cannot hide a press.
    pub max_gap: Duration,
    /// How long the stalk must be watched, at start and after longer blindness, before what was on
    /// unseen is taken to be over and the state to be known.
    pub startup_delay: Duration,
}

impl Default for StalkSettings {
    /// Three flashes at 90 a minute (2 s); opposite tap cancels, opposite full press switches, repeat
    /// cancels; no limit; 100 ms blind, shorter than a hand moves; settled after 4 s, the longest
    /// comfort blinking.
    fn default() -> Self {
        Self {
            comfort: Comfort::Flashes { count: 3, per_minute: 90 },
            opposite_half: OppositePress::Cancels,
            opposite_full: OppositePress::Switches,
            repeat: RepeatedPress::Cancels,
            max_on: None,
            max_gap: Duration::from_millis(100),
            startup_delay: Duration::from_secs(4),
        }
    }
}

/// A momentary stalk and what it has asked for.
#[derive(Debug, Clone)]
pub struct MomentaryStalk {
    settings: StalkSettings,
    visibility: Visibility,
    press: Option<Press>,
    requested: Option<RequestedSide>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Left,
    Right,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Detent {
    Half,
    Full,
}

/// What is on. `until` is `None` while it lasts for ever.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct RequestedSide {
    side: Side,
    detent: Detent,
    /// Comfort: last instant, or the release if later. Latched: last instant once let go.
    until: Option<MonoTime>,
}

#[derive(Debug, Clone, Copy)]
struct Press {
    side: Side,
    deepest: Detent,
    since: MonoTime,
    before: Option<RequestedSide>,
}

impl Side {
    fn code(self) -> TurnCode {
        match self {
            Self::Left => TurnCode::Left,
            Self::Right => TurnCode::Right,
        }
    }
}

impl MomentaryStalk {
    /// Nothing seen yet.
    pub fn new(settings: StalkSettings) -> Self {
        Self {
            settings,
            visibility: Visibility::new(settings.max_gap, settings.startup_delay),
            press: None,
            requested: None,
        }
    }

    /// Takes a frame; `None` = unknown, also when the last frame is no longer believed. A `now` before
    /// the last one counts as the last one.
    pub fn observe(&mut self, position: Option<StalkPosition>, now: MonoTime) {
        self.advance(now);
        let Some(position) = position else {
            self.visibility.mark_unseen();
            return;
        };
        if self.visibility.mark_seen() == Gap::CouldHideAPress {
            self.press = None;
            self.requested = None;
        }
        match position.detent() {
            Some((side, detent)) => self.pressed(side, detent),
            None => self.released(),
        }
    }

    /// Lets time pass without a frame.
    pub fn advance(&mut self, now: MonoTime) {
        self.visibility.advance(now);
        if self.deadline_of_asked().is_some_and(|end| end <= self.visibility.now()) {
            self.requested = None;
        }
    }

    /// What was asked for last and still stands; `None` while that cannot be known.
    pub fn state(&self) -> Option<TurnCode> {
        self.visibility
            .is_known()
            .then(|| self.requested.map_or(TurnCode::Off, |requested| requested.side.code()))
    }

    /// When to call [`Self::advance`] with no frame coming.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        [self.deadline_of_asked(), self.visibility.next_deadline()].into_iter().flatten().min()
    }

    fn pressed(&mut self, side: Side, detent: Detent) {
        let now = self.visibility.now();
        let press = match self.press.filter(|press| press.side == side) {
            Some(press) => Press { deepest: press.deepest.max(detent), ..press },
            None => Press { side, deepest: detent, since: now, before: self.requested },
        };
        self.press = Some(press);
        self.requested = self.outcome(press);
    }

    fn released(&mut self) {
        if self.press.take().is_some() {
            // The longest stay of a full press runs from here.
            let now = self.visibility.now();
            let max_on = self.settings.max_on;
            if let Some(requested) =
                self.requested.as_mut().filter(|requested| requested.detent == Detent::Full)
            {
                requested.until = max_on.map(|limit| now.after(limit));
            }
            self.advance(now);
        }
    }

    fn outcome(&self, press: Press) -> Option<RequestedSide> {
        let settings = &self.settings;
        let fresh = Some(match press.deepest {
            Detent::Half => RequestedSide {
                side: press.side,
                detent: Detent::Half,
                until: Some(press.since.after(settings.comfort.duration())),
            },
            Detent::Full => RequestedSide { side: press.side, detent: Detent::Full, until: None },
        });
        match press.before {
            None => fresh,
            Some(before) if before.side == press.side => match (before.detent, settings.repeat) {
                (Detent::Half, _) => fresh,
                (Detent::Full, RepeatedPress::Cancels) => None,
                (Detent::Full, RepeatedPress::Keeps) => Some(before),
            },
            Some(_) => {
                let rule = match press.deepest {
                    Detent::Half => settings.opposite_half,
                    Detent::Full => settings.opposite_full,
                };
                fresh.filter(|_| rule == OppositePress::Switches)
            }
        }
    }

    /// The first instant at which nothing is asked any more; `None` while the stalk is held.
    fn deadline_of_asked(&self) -> Option<MonoTime> {
        let until = self.requested.filter(|_| self.press.is_none())?.until?;
        Some(deadline_after(until, Duration::ZERO))
    }
}
