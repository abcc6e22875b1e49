//! Makes a signal readable for people: it stays on for a minimum time, and off for a minimum time between two
//! signals (weakness W2). Upstream has neither.

use std::time::Duration;

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::side::Side;
use crate::light_command::TurnCommand;
use gateway_base::time::MonoTime;

/// Minimum durations of signals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MinDurations {
    /// Time for which a side stays on.
    pub minimum_on: Duration,
    /// Time off before the next signal to either side.
    pub minimum_gap: Duration,
}

/// The minimum duration that keeps a signal from changing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, Display)]
#[serde(rename_all = "snake_case")]
pub enum Held {
    /// This side has not been on long enough.
    #[display("{_0} is on for too short a time")]
    On(Side),
    /// It has not been off long enough.
    #[display("off for too short a time")]
    Off,
}

/// The command that is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShownCommand {
    /// The command to send.
    pub signal: TurnCommand,
    /// The minimum duration that holds the command; `None` if it is the requested command.
    pub held: Option<Held>,
    /// The next time at which it may change by itself.
    pub deadline: Option<MonoTime>,
}

/// The side that is on, or the time since which no side is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MinDurationFilter {
    on: Option<(Side, MonoTime)>,
    off_since: Option<MonoTime>,
}

impl MinDurations {
    /// Three flashes at 120 per minute, and one dark phase between two signals.
    pub const READABLE: Self =
        Self { minimum_on: Duration::from_millis(1500), minimum_gap: Duration::from_millis(500) };
    /// Every change takes effect at once.
    pub const NONE: Self = Self { minimum_on: Duration::ZERO, minimum_gap: Duration::ZERO };
}

impl MinDurationFilter {
    /// Returns the command to show for a request. `required` are the sides of the required sections that the
    /// vehicle is in: a minimum duration never delays them, and never keeps the lights dark while there is
    /// one.
    pub fn show(
        &mut self,
        requested: TurnCommand,
        required: &[Side],
        min_durations: MinDurations,
        now: MonoTime,
    ) -> ShownCommand {
        let is_urgent = requested.side().is_some_and(|side| required.contains(&side));
        if let Some((side, since)) = self.on {
            if requested.side() == Some(side) {
                return ShownCommand { signal: requested, held: None, deadline: None };
            }
            if !is_urgent && now.since(since) < min_durations.minimum_on {
                let deadline = Some(since.after(min_durations.minimum_on));
                return ShownCommand { signal: side.into(), held: Some(Held::On(side)), deadline };
            }
            self.force_off(now);
        }
        let Some(side) = requested.side() else {
            return ShownCommand { signal: requested, held: None, deadline: None };
        };
        let ended = self.off_since.filter(|since| now.since(*since) < min_durations.minimum_gap);
        if let Some(since) = ended.filter(|_| required.is_empty()) {
            let deadline = Some(since.after(min_durations.minimum_gap));
            return ShownCommand { signal: TurnCommand::Disable, held: Some(Held::Off), deadline };
        }
        self.on = Some((side, now));
        ShownCommand { signal: requested, held: None, deadline: None }
    }

    /// Switches off at once, as when the hazard lights are on.
    pub fn force_off(&mut self, now: MonoTime) {
        if self.on.take().is_some() {
            self.off_since = Some(now);
        }
    }
}
