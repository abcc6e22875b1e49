//! Outputs of the vehicle lights.

use super::verdict::{HazardLights, TurnIndicators};
use crate::core::time::WallStamp;

/// A report to publish or to withdraw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VehicleLightsOutput {
    /// Publish `TurnIndicatorsReport`.
    TurnIndicators {
        /// State of the lights.
        report: TurnIndicators,
        /// Receive time of the frame that carried the newest value.
        stamp: WallStamp,
    },
    /// Publish `HazardLightsReport`.
    HazardLights {
        /// State of the lights.
        report: HazardLights,
        /// Receive time of the frame that carried the newest value.
        stamp: WallStamp,
    },
    /// Withdraw turn reports, so that no late joiner receives an old one.
    WithdrawTurnIndicators,
    /// Withdraw hazard reports, so that no late joiner receives an old one.
    WithdrawHazardLights,
}
