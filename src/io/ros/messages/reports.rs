//! The two reports of `autoware_vehicle_msgs`.

use serde::{Deserialize, Serialize};

use super::stamp::Time;
use crate::core::time::WallStamp;
use crate::core::vehicle_lights::verdict::{HazardLights, TurnIndicators};

/// `autoware_vehicle_msgs/msg/TurnIndicatorsReport`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TurnIndicatorsReport {
    /// Receive time of the frame that carried the state.
    pub stamp: Time,
    /// `DISABLE` 1, `ENABLE_LEFT` 2, `ENABLE_RIGHT` 3; 0 and "unknown" do not exist.
    pub report: u8,
}

impl TurnIndicatorsReport {
    /// The message that reports `state`.
    pub fn new(state: TurnIndicators, stamp: WallStamp) -> Self {
        let report = match state {
            TurnIndicators::Disable => 1,
            TurnIndicators::EnableLeft => 2,
            TurnIndicators::EnableRight => 3,
        };
        Self { stamp: stamp.into(), report }
    }
}

/// `autoware_vehicle_msgs/msg/HazardLightsReport`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HazardLightsReport {
    /// Receive time of the frame that carried the state.
    pub stamp: Time,
    /// `DISABLE` 1, `ENABLE` 2; 0 and "unknown" do not exist.
    pub report: u8,
}

impl HazardLightsReport {
    /// The message that reports `state`.
    pub fn new(state: HazardLights, stamp: WallStamp) -> Self {
        let report = match state {
            HazardLights::Disable => 1,
            HazardLights::Enable => 2,
        };
        Self { stamp: stamp.into(), report }
    }
}
