//! What others command, and what decides whether they may.

use crate::core::time::WallStamp;

/// One message for the command flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CommandInput {
    /// `TurnIndicatorsCommand` for the vehicle.
    Turn {
        /// As sent, defined or not.
        raw: u8,
        /// The sender's.
        stamp: WallStamp,
    },
    /// `HazardLightsCommand` for the vehicle.
    Hazard {
        /// As sent, defined or not.
        raw: u8,
        /// The sender's.
        stamp: WallStamp,
    },
    /// `ControlModeReport` of the vehicle: who drives it.
    ControlMode {
        /// As sent, defined or not.
        raw: u8,
        /// The sender's.
        stamp: WallStamp,
    },
}
