//! What the vehicle's lights give out.

use super::verdict::{HazardLights, TurnIndicators};
use crate::core::time::WallStamp;

/// One report to publish, or to withdraw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VehicleLightsOutput {
    /// Publish `TurnIndicatorsReport`.
    TurnIndicators {
        /// The state.
        report: TurnIndicators,
        /// Receive time of the frame that carried the newest value.
        stamp: WallStamp,
    },
    /// Publish `HazardLightsReport`.
    HazardLights {
        /// The state.
        report: HazardLights,
        /// Receive time of the frame that carried the newest value.
        stamp: WallStamp,
    },
    /// Turn reports stop: a late joiner must not be handed an old one.
    WithdrawTurnIndicators,
    /// Hazard reports stop, likewise.
    WithdrawHazardLights,
}
