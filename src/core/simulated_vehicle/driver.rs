//! The driver's controls, and the lights that follow from them and from the commands.

use std::time::Duration;

use super::plan::Ending;
use super::receiver::LightsRequest;
use super::{SimulationSettings, Who};
use crate::core::command::Turn;
use crate::core::command::control_mode::{ControlMode, Grants};
use crate::core::time::MonoTime;
use crate::core::vehicle_lights::stalk::StalkPosition;
use crate::core::vehicle_lights::state::TurnCode;

/// Time for which a momentary stalk or button is pressed.
const PRESS: Duration = Duration::from_millis(300);
/// Number of flashes after a tap.
const COMFORT_FLASHES: u32 = 3;

/// The stalk, the hazard button and the control mode.
#[derive(Debug, Clone)]
pub(super) struct Driver {
    ending: Option<Ending>,
    comfort: Duration,
    /// State requested by the stalk.
    turn: Turn,
    tapped: Option<(Turn, MonoTime)>,
    hazard: Option<Who>,
    stalk: Option<(StalkPosition, MonoTime)>,
    button_until: Option<MonoTime>,
    pub(super) mode: ControlMode,
}

impl Driver {
    pub(super) fn new(ending: Option<Ending>, simulation: &SimulationSettings) -> Self {
        Self {
            ending,
            comfort: simulation.flash_period * COMFORT_FLASHES,
            turn: Turn::Off,
            tapped: None,
            hazard: None,
            stalk: None,
            button_until: None,
            mode: ControlMode::Autonomous,
        }
    }

    /// Presses the stalk to the full detent of a side or, for [`Turn::Off`], ends the request.
    pub(super) fn stalk(&mut self, turn: Turn, now: MonoTime) {
        let on = self.tapped.take().map_or(self.turn, |(turn, _)| turn);
        let position = match (turn, on, self.ending) {
            (Turn::Left | Turn::Right, ..) => full(turn),
            (Turn::Off, Turn::Off, _) | (Turn::Off, _, None) => StalkPosition::Idle,
            (Turn::Off, on, Some(Ending::OppositeHalf)) => half(opposite(on)),
            (Turn::Off, on, Some(Ending::OppositeFull)) => full(opposite(on)),
            (Turn::Off, on, Some(Ending::SameAgain)) => full(on),
        };
        // A repeated press to the same side would end the request.
        if turn != self.turn {
            self.stalk = Some((position, now.after(PRESS)));
        }
        self.turn = turn;
    }

    /// Taps the stalk to the half detent of a side.
    pub(super) fn tap(&mut self, turn: Turn, now: MonoTime) {
        self.stalk = Some((half(turn), now.after(PRESS)));
        self.tapped = Some((turn, now.after(self.comfort)));
    }

    /// Switches the hazard lights on or off, or toggles them for `None`.
    pub(super) fn press_hazard(&mut self, wanted: Option<bool>, who: Who, now: MonoTime) {
        if wanted == Some(self.hazard.is_some()) {
            return;
        }
        self.hazard = if self.hazard.is_some() { None } else { Some(who) };
        self.button_until = Some(now.after(PRESS));
    }

    /// Releases controls that are no longer held.
    pub(super) fn settle(&mut self, now: MonoTime) {
        self.stalk = self.stalk.filter(|(_, until)| now < *until);
        self.tapped = self.tapped.filter(|(_, until)| now < *until);
        self.button_until = self.button_until.filter(|until| now < *until);
    }

    pub(super) fn next_deadline(&self) -> Option<MonoTime> {
        let stalk = self.stalk.map(|(_, until)| until);
        let tapped = self.tapped.map(|(_, until)| until);
        [stalk, tapped, self.button_until].into_iter().flatten().min()
    }

    /// Requested lights and their origin. Hazard lights override turn indicators, the driver overrides the
    /// commands.
    pub(super) fn requested_lights(&self, request: LightsRequest) -> (TurnCode, Who) {
        if let Some(who) = self.hazard {
            return (TurnCode::Both, who);
        }
        if request.hazard == Some(true) {
            return (TurnCode::Both, Who::Command);
        }
        let driver = self.driver_turn();
        let (turn, who) = match (driver, request.turn) {
            (Turn::Left | Turn::Right, _) => (driver, Who::Driver),
            (Turn::Off, Some(turn)) => (turn, Who::Command),
            (Turn::Off, None) => (Turn::Off, Who::Nobody),
        };
        match turn {
            Turn::Off => (TurnCode::Off, Who::Nobody),
            Turn::Left => (TurnCode::Left, who),
            Turn::Right => (TurnCode::Right, who),
        }
    }

    /// Functions that the driver uses in place of the commands.
    pub(super) fn driver(&self) -> Grants {
        Grants { turn: self.driver_turn() != Turn::Off, hazard: self.hazard == Some(Who::Driver) }
    }

    pub(super) fn stalk_position(&self) -> StalkPosition {
        self.stalk.map_or(StalkPosition::Idle, |(position, _)| position)
    }

    pub(super) fn is_button_pressed(&self) -> bool {
        self.button_until.is_some()
    }

    fn driver_turn(&self) -> Turn {
        self.tapped.map_or(self.turn, |(turn, _)| turn)
    }
}

fn opposite(turn: Turn) -> Turn {
    match turn {
        Turn::Off => Turn::Off,
        Turn::Left => Turn::Right,
        Turn::Right => Turn::Left,
    }
}

/// Position of the full detent of a side.
fn full(turn: Turn) -> StalkPosition {
    match turn {
        Turn::Off => StalkPosition::Idle,
        Turn::Left => StalkPosition::LeftFull,
        Turn::Right => StalkPosition::RightFull,
    }
}

/// Position of the half detent of a side.
fn half(turn: Turn) -> StalkPosition {
    match turn {
        Turn::Off => StalkPosition::Idle,
        Turn::Left => StalkPosition::LeftHalf,
        Turn::Right => StalkPosition::RightHalf,
    }
}
