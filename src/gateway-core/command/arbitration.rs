//! Arbitration: decides which request goes to the vehicle now. Hazard lights come before turn indicators, the
//! control mode limits what is requested, the driver has priority, and the silence of a sender has a defined
//! effect.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Turn;
use super::control_mode::{Grants, ModeState};
use super::intake::CommandState;

/// A request to the vehicle with authority; `None` leaves the function to the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct VehicleRequest {
    /// Requested state of the turn indicators.
    pub turn: Option<Turn>,
    /// Hazard lights, `true` = on.
    pub hazard: Option<bool>,
}

/// Request that replaces the commands of a sender that has fallen silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum TimeoutAction {
    /// The lights of the sender are switched off.
    #[default]
    Off,
    /// The last request of the sender is kept.
    Hold,
    /// The hazard lights are switched on.
    Hazard,
}

/// Request in the last frames before the gateway stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ShutdownAction {
    /// Nothing is requested, which returns authority to the vehicle.
    #[default]
    Release,
    /// All lights are switched off.
    Off,
    /// The hazard lights are switched on.
    Hazard,
}

/// Rules of the arbitration, as configured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[allow(missing_docs)] // their names say it
pub struct ArbitrationRules {
    pub on_turn_timeout: TimeoutAction,
    pub on_hazard_timeout: TimeoutAction,
    pub on_shutdown: ShutdownAction,
}

/// All inputs of the arbitration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct Situation {
    pub turn: CommandState<Turn>,
    pub hazard: CommandState<bool>,
    pub mode: ModeState,
    /// Functions that the driver has taken over.
    pub driver: Grants,
    /// True if no report shows the hazard lights, so the driver may have switched them on.
    pub hazard_without_feedback: bool,
    pub stopping: bool,
}

/// Reason for the request to a function, or for its absence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DecisionReason {
    /// The command requests it.
    Commanded,
    /// The hazard lights are on and come before turn indicators.
    HazardFirst,
    /// The command has timed out; the configured action applies.
    TimedOut,
    /// The command requests nothing.
    NoCommand,
    /// No command has been received since start.
    NeverCommanded,
    /// The control mode does not allow it.
    #[default]
    NotGranted,
    /// The driver has taken over the function.
    Driver,
    /// No report shows the hazard lights, so that the driver may have switched them on.
    NoFeedback,
    /// The gateway is about to stop.
    Stopping,
}

/// The request to the vehicle with its reasons; empty by default, when no control mode is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct CommandDecision {
    /// Request sent in the frames.
    pub request: VehicleRequest,
    /// Request before driver overrides are applied; the report is compared with this request.
    pub commanded: VehicleRequest,
    pub turn: DecisionReason,
    pub hazard: DecisionReason,
}

impl DecisionReason {
    /// Returns the text of the reason for diagnostics.
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

/// Decides the request to the vehicle, applying the rules of docs/spec/vehicle-interface.md in order.
pub fn arbitrate(rules: ArbitrationRules, situation: &Situation) -> CommandDecision {
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
    // On is safe regardless of who requests it; only an off request gives way.
    if request.hazard == Some(false) {
        if situation.driver.hazard {
            (request.hazard, hazard_reason) = (None, DecisionReason::Driver);
        } else if situation.hazard_without_feedback {
            (request.hazard, hazard_reason) = (None, DecisionReason::NoFeedback);
        }
    }
    CommandDecision { request, commanded, turn: turn_reason, hazard: hazard_reason }
}

/// Returns the request of a command state; `on_timeout` converts the last request of a sender that fell
/// silent.
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
