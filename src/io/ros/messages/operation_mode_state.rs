//! `autoware_adapi_v1_msgs/msg/OperationModeState`.

use serde::{Deserialize, Serialize};

use super::stamp::Time;
use crate::core::turn_signal::planner_input::{OperationMode, PlannerInput};

/// `autoware_adapi_v1_msgs/msg/OperationModeState`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[allow(clippy::struct_excessive_bools)] // the message has them
pub struct OperationModeState {
    /// Time of the last change.
    pub stamp: Time,
    /// `UNKNOWN` 0, `STOP` 1, `AUTONOMOUS` 2, `LOCAL` 3, `REMOTE` 4.
    pub mode: u8,
    /// Autoware controls the vehicle.
    pub is_autoware_control_enabled: bool,
    /// The mode is changing.
    pub is_in_transition: bool,
    /// The mode can be changed to `STOP`.
    pub is_stop_mode_available: bool,
    /// The mode can be changed to `AUTONOMOUS`.
    pub is_autonomous_mode_available: bool,
    /// The mode can be changed to `LOCAL`.
    pub is_local_mode_available: bool,
    /// The mode can be changed to `REMOTE`.
    pub is_remote_mode_available: bool,
}

impl From<OperationModeState> for PlannerInput {
    fn from(message: OperationModeState) -> Self {
        Self::OperationMode(OperationMode {
            mode: message.mode,
            is_autoware_control_enabled: message.is_autoware_control_enabled,
            is_in_transition: message.is_in_transition,
        })
    }
}
