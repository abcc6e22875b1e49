//! `autoware_vehicle_msgs`: the reports and commands of lights.

use super::autoware_vehicle_msgs::{
    HazardLightsCommand, HazardLightsReport, TurnIndicatorsCommand, TurnIndicatorsReport,
};
use crate::core::light_command::{HazardCommand, TurnCommand};
use crate::core::time::WallStamp;
use crate::core::vehicle_lights::verdict::{HazardLights, TurnIndicators};

impl TurnIndicatorsReport {
    /// Creates the report of `state`; `stamp` is the receive time of the frame that carried it.
    pub fn new(state: TurnIndicators, stamp: WallStamp) -> Self {
        let report = match state {
            TurnIndicators::Disable => Self::DISABLE,
            TurnIndicators::EnableLeft => Self::ENABLE_LEFT,
            TurnIndicators::EnableRight => Self::ENABLE_RIGHT,
        };
        Self { stamp: stamp.into(), report }
    }
}

impl HazardLightsReport {
    /// Creates the report of `state`; `stamp` is the receive time of the frame that carried it.
    pub fn new(state: HazardLights, stamp: WallStamp) -> Self {
        let report = match state {
            HazardLights::Disable => Self::DISABLE,
            HazardLights::Enable => Self::ENABLE,
        };
        Self { stamp: stamp.into(), report }
    }
}

impl TurnIndicatorsCommand {
    /// Creates the message that gives `command`, which has the constants of the message as numbers.
    pub fn new(command: TurnCommand, stamp: WallStamp) -> Self {
        Self { stamp: stamp.into(), command: command as u8 }
    }
}

impl HazardLightsCommand {
    /// Creates the message that gives `command`, which has the constants of the message as numbers.
    pub fn new(command: HazardCommand, stamp: WallStamp) -> Self {
        Self { stamp: stamp.into(), command: command as u8 }
    }
}
