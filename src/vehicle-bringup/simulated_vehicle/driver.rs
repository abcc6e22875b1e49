//! The driver's controls, and the lights that result from them and from the commands.

use std::time::Duration;

use super::output::Who;
use super::plan::CancelPress;
use gateway_base::time::MonoTime;
use gateway_core::command::Turn;
use gateway_core::command::arbitration::VehicleRequest;
use gateway_core::command::control_mode::Grants;
use gateway_core::control_mode::ControlMode;
use gateway_core::vehicle_lights::stalk::StalkPosition;
use gateway_core::vehicle_lights::state::TurnCode;

const PRESS: Duration = Duration::from_millis(300);
const COMFORT_FLASHES: u32 = 3;

#[derive(Debug, Clone)]
pub(super) struct Driver {
    ending: Option<CancelPress>,
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
    pub(super) fn new(ending: Option<CancelPress>, flash_period: Duration) -> Self {
        Self {
            ending,
            comfort: flash_period * COMFORT_FLASHES,
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
            (Turn::Left | Turn::Right, ..) => pressed(turn, true),
            (Turn::Off, Turn::Off, _) | (Turn::Off, _, None) => StalkPosition::Idle,
            (Turn::Off, on, Some(CancelPress::OppositeHalf)) => pressed(opposite(on), false),
            (Turn::Off, on, Some(CancelPress::OppositeFull)) => pressed(opposite(on), true),
            (Turn::Off, on, Some(CancelPress::SameAgain)) => pressed(on, true),
        };
        // A repeated press to the same side would end the request.
        if turn != self.turn {
            self.stalk = Some((position, now.after(PRESS)));
        }
        self.turn = turn;
    }

    /// Taps the stalk to the half detent of a side.
    pub(super) fn tap(&mut self, turn: Turn, now: MonoTime) {
        self.stalk = Some((pressed(turn, false), now.after(PRESS)));
        self.tapped = Some((turn, now.after(self.comfort)));
    }

    /// Switches the hazard lights on or off, or toggles them for `None`.
    pub(super) fn press_hazard(&mut self, on: Option<bool>, who: Who, now: MonoTime) {
        if on == Some(self.hazard.is_some()) {
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

    /// Returns the requested lights and their origin. Hazard lights override turn indicators, the driver
    /// overrides the commands.
    pub(super) fn requested_lights(&self, request: VehicleRequest) -> (TurnCode, Who) {
        if let Some(who) = self.hazard {
            return (TurnCode::Both, who);
        }
        if request.hazard == Some(true) {
            return (TurnCode::Both, Who::Command);
        }
        let driver = self.driver_turn();
        let who = if driver == Turn::Off { Who::Command } else { Who::Driver };
        match if driver == Turn::Off { request.turn.unwrap_or_default() } else { driver } {
            Turn::Off => (TurnCode::Off, Who::Nobody),
            Turn::Left => (TurnCode::Left, who),
            Turn::Right => (TurnCode::Right, who),
        }
    }

    /// Returns the functions that the driver uses in place of the commands.
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

fn pressed(turn: Turn, is_full: bool) -> StalkPosition {
    match (turn, is_full) {
        (Turn::Off, _) => StalkPosition::Idle,
        (Turn::Left, false) => StalkPosition::LeftHalf,
        (Turn::Left, true) => StalkPosition::LeftFull,
        (Turn::Right, false) => StalkPosition::RightHalf,
        (Turn::Right, true) => StalkPosition::RightFull,
    }
}
