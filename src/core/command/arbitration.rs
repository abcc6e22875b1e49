//! What is requested of the vehicle now: hazard before turn, within what the control mode grants, without
//! fighting the driver, and with a defined state when a sender falls silent.

use super::Turn;
use super::control_mode::{Grants, Mode};
use super::intake::CommandState;

/// What is requested of the vehicle with authority; `None` = this function is left to the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct VehicleRequest {
    /// Turn indicators.
    pub turn: Option<Turn>,
    /// Hazard lights, `true` = on.
    pub hazard: Option<bool>,
}

/// What is wanted instead, when a sender that wanted something has fallen silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TimeoutAction {
    /// Its lights off.
    #[default]
    Off,
    /// What it wanted last.
    Hold,
    /// Hazard lights on.
    Hazard,
}

/// What the vehicle is asked for in the last frames before the gateway ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ShutdownAction {
    /// Nothing: authority is given back.
    #[default]
    Release,
    /// Lights off.
    Off,
    /// Hazard lights on.
    Hazard,
}

/// What does not change while the gateway runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Rules {
    /// When the turn command falls silent.
    pub on_turn_timeout: TimeoutAction,
    /// When the hazard command falls silent.
    pub on_hazard_timeout: TimeoutAction,
    /// At the end.
    pub on_shutdown: ShutdownAction,
}

/// Everything that decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Situation {
    /// Of the turn command.
    pub turn: CommandState<Turn>,
    /// Of the hazard command.
    pub hazard: CommandState<bool>,
    /// The control mode.
    pub mode: Mode,
    /// Functions the driver has taken.
    pub driver: Grants,
    /// Whether the hazard lights may be the driver's for all that is known.
    pub hazard_without_feedback: bool,
    /// Whether the gateway is about to end.
    pub stopping: bool,
}

/// Why a function is asked for what it is, or for nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DecisionReason {
    /// The command says so.
    Commanded,
    /// The hazard lights are on, which come before turn indicators.
    HazardFirst,
    /// The command has fallen silent, and this is the state for that.
    TimedOut,
    /// Nothing is wanted.
    NoCommand,
    /// No command has come since start.
    NeverCommanded,
    /// The control mode does not allow it.
    NotGranted,
    /// The driver does something else.
    Driver,
    /// No report says whether the hazard lights are on, and so perhaps the driver's.
    NoFeedback,
    /// The gateway is about to end.
    Stopping,
}

/// What is asked for, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Decision {
    /// What goes into the frames.
    pub request: VehicleRequest,
    /// The same before the driver had a say: what the report is held against.
    pub wanted: VehicleRequest,
    /// About the turn indicators.
    pub turn: DecisionReason,
    /// About the hazard lights.
    pub hazard: DecisionReason,
}

impl DecisionReason {
    /// For people.
    pub fn text(self) -> &'static str {
        match self {
            Self::Commanded => "as commanded",
            Self::HazardFirst => "hazard lights come first",
            Self::TimedOut => "the command has timed out",
            Self::NoCommand => "nothing requested",
            Self::NeverCommanded => "no command yet",
            Self::NotGranted => "not allowed in this control mode",
            Self::Driver => "left to the driver",
            Self::NoFeedback => "no report says whether they are on",
            Self::Stopping => "the gateway ends",
        }
    }
}

/// Decides.
pub fn arbitrate(rules: Rules, situation: &Situation) -> Decision {
    let (mut turn, mut turn_why) = requested(situation.turn, |last| match rules.on_turn_timeout {
        TimeoutAction::Hold => last,
        TimeoutAction::Off | TimeoutAction::Hazard => Turn::Off,
    });
    let (mut hazard, mut hazard_why) = requested(situation.hazard, |last| match rules.on_hazard_timeout {
        TimeoutAction::Hold => last,
        TimeoutAction::Off => false,
        TimeoutAction::Hazard => true,
    });
    if rules.on_turn_timeout == TimeoutAction::Hazard && turn_why == DecisionReason::TimedOut {
        (hazard, hazard_why) = (Some(true), DecisionReason::TimedOut);
    }
    if situation.stopping {
        (turn, hazard) = match rules.on_shutdown {
            ShutdownAction::Release => (None, None),
            ShutdownAction::Off => (Some(Turn::Off), Some(false)),
            ShutdownAction::Hazard => (Some(Turn::Off), Some(true)),
        };
        (turn_why, hazard_why) = (DecisionReason::Stopping, DecisionReason::Stopping);
    }
    let grants = situation.mode.grants();
    if !grants.turn {
        (turn, turn_why) = (None, DecisionReason::NotGranted);
    }
    if !grants.hazard {
        (hazard, hazard_why) = (None, DecisionReason::NotGranted);
    }
    if hazard == Some(true) && turn.is_some() {
        (turn, turn_why) = (Some(Turn::Off), DecisionReason::HazardFirst);
    }
    let wanted = VehicleRequest { turn, hazard };
    let mut request = wanted;
    if situation.driver.turn && request.turn.is_some() {
        (request.turn, turn_why) = (None, DecisionReason::Driver);
    }
    // On is safe whoever wants it: only an off gives way.
    if request.hazard == Some(false) {
        if situation.driver.hazard {
            (request.hazard, hazard_why) = (None, DecisionReason::Driver);
        } else if situation.hazard_without_feedback {
            (request.hazard, hazard_why) = (None, DecisionReason::NoFeedback);
        }
    }
    Decision { request, wanted, turn: turn_why, hazard: hazard_why }
}

/// What a command state comes to; `silent` = what to make of the last request of a sender that fell silent.
fn requested<T>(command_state: CommandState<T>, silent: impl FnOnce(T) -> T) -> (Option<T>, DecisionReason) {
    match command_state {
        CommandState::NeverReceived => (None, DecisionReason::NeverCommanded),
        CommandState::NoCommand | CommandState::TimedOut(None) => (None, DecisionReason::NoCommand),
        CommandState::Requested(requested) => (Some(requested), DecisionReason::Commanded),
        CommandState::TimedOut(Some(last)) => (Some(silent(last)), DecisionReason::TimedOut),
    }
}
