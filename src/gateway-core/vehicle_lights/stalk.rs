//! Stalks and buttons: derives the requested state from the positions of a control.
//!
//! A latched stalk stays in its position and needs no memory, unless its taps are held. A momentary stalk
//! returns to its middle position: the effect of a press depends on the previous request and on the deepest
//! detent reached. (On its way to the full detent a stalk passes the half detent, in frames or between them.)
//! The effect is therefore determined again with each frame of the press, from the previous request.
//!
//! At start, and after a gap that could hide a press, nothing is assumed to be requested and the state
//! is unknown for a while.

pub mod button;
pub mod tap;
mod visibility;

#[cfg(test)]
mod cases;
#[cfg(test)]
mod properties;

use std::time::Duration;

use serde::Serialize;

use super::state::{StateMachine, TurnCode};
use gateway_base::time::{MonoTime, deadline_after};
use visibility::Visibility;

/// Position of a stalk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StalkPosition {
    /// The lever is in its middle position.
    Idle,
    /// First detent to the left.
    LeftHalf,
    /// Second detent to the left.
    LeftFull,
    /// First detent to the right.
    RightHalf,
    /// Second detent to the right.
    RightFull,
}

impl StalkPosition {
    /// Returns the side to which the stalk is pressed.
    pub fn side(self) -> TurnCode {
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

/// Duration of comfort flashing after a tap to the half detent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comfort {
    /// A number of flashes at a rate.
    Flashes {
        /// Number of flashes; 0 if the vehicle has no comfort flashing.
        count: u8,
        /// Flashes per minute; 0 counts as 1.
        per_minute: u8,
    },
    /// A fixed duration.
    For(Duration),
}

impl Comfort {
    /// Returns the time between the tap and the end of the last flash cycle.
    pub fn duration(self) -> Duration {
        match self {
            Self::Flashes { count, per_minute } => {
                Duration::from_secs(60) * u32::from(count) / u32::from(per_minute.max(1))
            }
            Self::For(duration) => duration,
        }
    }
}

/// Effect of a press to the side opposite to the requested one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OppositePress {
    /// The press ends the request.
    Cancels,
    /// The press requests the other side.
    Switches,
}

/// Effect of a press to the side that is already latched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RepeatedPress {
    /// The press ends the request.
    Cancels,
    /// The request continues.
    Keeps,
}

/// Rules and times of a momentary stalk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StalkSettings {
    /// Flashing after a tap to the half detent; lasts longer while the stalk is held.
    pub comfort: Comfort,
    /// Effect of a tap to the opposite half detent.
    pub opposite_half: OppositePress,
    /// Effect of a press to the opposite full detent.
    pub opposite_full: OppositePress,
    /// Effect of a press to the latched side.
    pub repeat: RepeatedPress,
    /// Longest time for which the request of a full press lasts after its release; `None` = unlimited. The
    /// return by the steering wheel is mechanical and does not appear in the positions.
    pub max_on: Option<Duration>,
    /// Longest gap in the positions that cannot hide a press.
    pub max_gap: Duration,
    /// Time for which the stalk must be observed, at start and after a longer gap, before an earlier request
    /// is assumed to have ended and the state is known.
    pub startup_delay: Duration,
}

impl Default for StalkSettings {
    /// Returns three flashes at 90 a minute (2 s); an opposite tap cancels, an opposite full press switches,
    /// a repeated press cancels; no limit; a gap of 100 ms, shorter than a movement of the hand; a startup
    /// delay of 4 s, the longest comfort flashing.
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

/// State machine of a momentary stalk. Its state is the latest request that is still in effect.
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

/// Request of a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct RequestedSide {
    side: Side,
    detent: Detent,
    /// Last instant of the request, which the release of the stalk may postpone; `None` = unlimited.
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
    /// Creates the machine before any frame.
    pub fn new(settings: StalkSettings) -> Self {
        Self {
            settings,
            visibility: Visibility::new(settings.max_gap, settings.startup_delay),
            press: None,
            requested: None,
        }
    }

    fn pressed(&mut self, side: Side, detent: Detent) {
        let now = self.visibility.now();
        let press = match self.press.filter(|press| press.side == side) {
            Some(press) => Press { deepest: press.deepest.max(detent), ..press },
            None => Press { side, deepest: detent, since: now, before: self.requested },
        };
        self.press = Some(press);
        self.requested = self.effect(press);
    }

    fn released(&mut self) {
        if self.press.take().is_some() {
            // The limit of a full press starts at its release.
            let now = self.visibility.now();
            if let Some(RequestedSide { detent: Detent::Full, until, .. }) = &mut self.requested {
                *until = self.settings.max_on.map(|limit| now.after(limit));
            }
            self.advance(now);
        }
    }

    fn effect(&self, press: Press) -> Option<RequestedSide> {
        let settings = &self.settings;
        let (until, opposite) = match press.deepest {
            Detent::Half => (Some(press.since.after(settings.comfort.duration())), settings.opposite_half),
            Detent::Full => (None, settings.opposite_full),
        };
        let fresh = Some(RequestedSide { side: press.side, detent: press.deepest, until });
        match press.before {
            None => fresh,
            Some(before) if before.side == press.side => match (before.detent, settings.repeat) {
                (Detent::Half, _) => fresh,
                (Detent::Full, RepeatedPress::Cancels) => None,
                (Detent::Full, RepeatedPress::Keeps) => Some(before),
            },
            Some(_) => fresh.filter(|_| opposite == OppositePress::Switches),
        }
    }

    /// Returns the instant at which the request ends; `None` without a limit, or while the stalk is held.
    fn request_end(&self) -> Option<MonoTime> {
        let until = self.requested.filter(|_| self.press.is_none())?.until?;
        Some(deadline_after(until, Duration::ZERO))
    }
}

impl StateMachine for MomentaryStalk {
    type Input = StalkPosition;
    type State = TurnCode;

    fn observe(&mut self, position: Option<StalkPosition>, now: MonoTime) {
        self.advance(now);
        let Some(position) = position else {
            self.visibility.unknown_frame();
            return;
        };
        if self.visibility.known_frame() {
            self.press = None;
            self.requested = None;
        }
        match position.detent() {
            Some((side, detent)) => self.pressed(side, detent),
            None => self.released(),
        }
    }

    fn advance(&mut self, now: MonoTime) {
        self.visibility.advance(now);
        if self.request_end().is_some_and(|end| end <= self.visibility.now()) {
            self.requested = None;
        }
    }

    fn state(&self) -> Option<TurnCode> {
        self.visibility
            .is_known()
            .then(|| self.requested.map_or(TurnCode::Off, |requested| requested.side.code()))
    }

    fn next_deadline(&self) -> Option<MonoTime> {
        [self.request_end(), self.visibility.next_deadline()].into_iter().flatten().min()
    }
}
