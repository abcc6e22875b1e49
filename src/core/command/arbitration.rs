//! Arbitration: which request goes to the vehicle now. Hazard lights come before turn indicators, within what
//! the control mode grants, without fighting the driver, and with a defined state when a sender falls silent.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Turn;
use super::control_mode::{Grants, Mode};
use super::intake::CommandState;

/// A request to the vehicle, with authority; `None` = this function is left to the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct VehicleRequest {
    /// Turn indicators.
    pub turn: Option<Turn>,
    /// Hazard lights, `true` = on.
    pub hazard: Option<bool>,
}

/// The request instead of the last one of a sender that has fallen silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TimeoutAction {
    /// Its lights off.
    #[default]
    Off,
    /// Its last request.
    Hold,
    /// Hazard lights on.
    Hazard,
}

/// The request in the last frames before the gateway ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ShutdownAction {
    /// Nothing: authority is given back.
    #[default]
    Release,
    /// Its lights are switched off.
    Off,
    /// Hazard lights on.
    Hazard,
}

/// The rules of arbitration that the configuration sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Rules {
    /// The request after a timeout of the turn command.
    pub on_turn_timeout: TimeoutAction,
    /// The request after a timeout of the hazard command.
    pub on_hazard_timeout: TimeoutAction,
    /// The request when the gateway ends.
    pub on_shutdown: ShutdownAction,
}

/// Everything that arbitration decides on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Situation {
    /// State of the turn command.
    pub turn: CommandState<Turn>,
    /// State of the hazard command.
    pub hazard: CommandState<bool>,
    /// The control mode.
    pub mode: Mode,
    /// Functions that the driver has taken over.
    pub driver: Grants,
    /// True if no report shows the hazard lights, so that they may be on by the driver.
    pub hazard_without_feedback: bool,
    /// True if the gateway is about to end.
    pub stopping: bool,
}

/// Why this is requested of a function, or nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DecisionReason {
    /// The command requests it.
    Commanded,
    /// The hazard lights are on, which come before turn indicators.
    HazardFirst,
    /// The command has timed out, and this is the state for that.
    TimedOut,
    /// The command requests nothing.
    NoCommand,
    /// No command has been received since start.
    NeverCommanded,
    /// The control mode does not allow it.
    #[default]
    NotGranted,
    /// The driver does something else.
    Driver,
    /// No report shows the hazard lights, so that they may be on by the driver.
    NoFeedback,
    /// The gateway is about to end.
    Stopping,
}

/// The request to the vehicle and its reasons; by default nothing, since no control mode is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Decision {
    /// The request that goes into the frames.
    pub request: VehicleRequest,
    /// The request as if there were no driver, which the report is compared with.
    pub commanded: VehicleRequest,
    /// The reason for the turn indicators.
    pub turn: DecisionReason,
    /// The reason for the hazard lights.
    pub hazard: DecisionReason,
}

impl DecisionReason {
    /// Text of the reason for diagnostics.
    pub fn text(self) -> &'static str {
        match self {
            Self::Commanded => "as commanded",
            Self::HazardFirst => "hazard lights come first",
            Self::TimedOut => "the command has timed out",
            Self::NoCommand => "nothing requested",
            Self::NeverCommanded => "no command yet",
            Self::NotGranted => "not allowed in this control mode",
            Self::Driver => "left to the driver",
            Self::NoFeedback => "no report shows whether they are on",
            Self::Stopping => "the gateway ends",
        }
    }
}

/// Decides the request to the vehicle; the rules and their order are those of docs/spec/vehicle-interface.md.
pub fn arbitrate(rules: Rules, situation: &Situation) -> Decision {
    let (mut turn, mut turn_reason) = requested(situation.turn, |last| match rules.on_turn_timeout {
        TimeoutAction::Hold => last,
        TimeoutAction::Off | TimeoutAction::Hazard => Turn::Off,
    });
    let (mut hazard, mut hazard_reason) = requested(situation.hazard, |last| match rules.on_hazard_timeout {
        TimeoutAction::Hold => last,
        TimeoutAction::Off => false,
        TimeoutAction::Hazard => true,
    });
    if rules.on_turn_timeout == TimeoutAction::Hazard && turn_reason == DecisionReason::TimedOut {
        (hazard, hazard_reason) = (Some(true), DecisionReason::TimedOut);
    }
    if situation.stopping {
        (turn, hazard) = match rules.on_shutdown {
            ShutdownAction::Release => (None, None),
            ShutdownAction::Off => (Some(Turn::Off), Some(false)),
            ShutdownAction::Hazard => (Some(Turn::Off), Some(true)),
        };
        (turn_reason, hazard_reason) = (DecisionReason::Stopping, DecisionReason::Stopping);
    }
    let grants = situation.mode.grants();
    if !grants.turn {
        (turn, turn_reason) = (None, DecisionReason::NotGranted);
    }
    if !grants.hazard {
        (hazard, hazard_reason) = (None, DecisionReason::NotGranted);
    }
    if hazard == Some(true) && turn.is_some() {
        (turn, turn_reason) = (Some(Turn::Off), DecisionReason::HazardFirst);
    }
    let commanded = VehicleRequest { turn, hazard };
    let mut request = commanded;
    if situation.driver.turn && request.turn.is_some() {
        (request.turn, turn_reason) = (None, DecisionReason::Driver);
    }
    // On is safe whoever requests it: only an off gives way.
    if request.hazard == Some(false) {
        if situation.driver.hazard {
            (request.hazard, hazard_reason) = (None, DecisionReason::Driver);
        } else if situation.hazard_without_feedback {
            (request.hazard, hazard_reason) = (None, DecisionReason::NoFeedback);
        }
    }
    Decision { request, commanded, turn: turn_reason, hazard: hazard_reason }
}

/// The request of a command state; `on_timeout` makes it of the last request of a sender that fell silent.
fn requested<T>(
    command_state: CommandState<T>,
    on_timeout: impl FnOnce(T) -> T,
) -> (Option<T>, DecisionReason) {
    match command_state {
        CommandState::NeverReceived => (None, DecisionReason::NeverCommanded),
        CommandState::NoCommand | CommandState::TimedOut(None) => (None, DecisionReason::NoCommand),
        CommandState::Requested(requested) => (Some(requested), DecisionReason::Commanded),
        CommandState::TimedOut(Some(last)) => (Some(on_timeout(last)), DecisionReason::TimedOut),
    }
}
