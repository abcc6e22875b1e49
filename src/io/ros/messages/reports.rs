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
    /// One of the constants below; 0 and "unknown" do not exist.
    pub report: u8,
}

impl TurnIndicatorsReport {
    /// No side.
    pub const DISABLE: u8 = 1;
    /// Left.
    pub const ENABLE_LEFT: u8 = 2;
    /// Right.
    pub const ENABLE_RIGHT: u8 = 3;

    /// The message that reports `state`.
    pub fn new(state: TurnIndicators, stamp: WallStamp) -> Self {
        let report = match state {
            TurnIndicators::Disable => Self::DISABLE,
            TurnIndicators::EnableLeft => Self::ENABLE_LEFT,
            TurnIndicators::EnableRight => Self::ENABLE_RIGHT,
        };
        Self { stamp: stamp.into(), report }
    }
}

/// `autoware_vehicle_msgs/msg/HazardLightsReport`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HazardLightsReport {
    /// Receive time of the frame that carried the state.
    pub stamp: Time,
    /// One of the constants below; 0 and "unknown" do not exist.
    pub report: u8,
}

impl HazardLightsReport {
    /// Off.
    pub const DISABLE: u8 = 1;
    /// On.
    pub const ENABLE: u8 = 2;

    /// The message that reports `state`.
    pub fn new(state: HazardLights, stamp: WallStamp) -> Self {
        let report = match state {
            HazardLights::Disable => Self::DISABLE,
            HazardLights::Enable => Self::ENABLE,
        };
        Self { stamp: stamp.into(), report }
    }
}
