//! `autoware_vehicle_msgs`: the reports and commands of lights, and the control mode.

use serde::{Deserialize, Serialize};

use super::stamp::Time;
use crate::core::light_command::{HazardCommand, TurnCommand};
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

/// `autoware_vehicle_msgs/msg/TurnIndicatorsCommand`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TurnIndicatorsCommand {
    /// Time at which the command was given.
    pub stamp: Time,
    /// `NO_COMMAND` 0, `DISABLE` 1, `ENABLE_LEFT` 2, `ENABLE_RIGHT` 3.
    pub command: u8,
}

impl TurnIndicatorsCommand {
    /// The message that gives `command`.
    pub fn new(command: TurnCommand, stamp: WallStamp) -> Self {
        Self { stamp: stamp.into(), command: command as u8 }
    }
}

/// `autoware_vehicle_msgs/msg/HazardLightsCommand`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct HazardLightsCommand {
    /// Time at which the command was given.
    pub stamp: Time,
    /// `NO_COMMAND` 0, `DISABLE` 1, `ENABLE` 2.
    pub command: u8,
}

impl HazardLightsCommand {
    /// The message that gives `command`.
    pub fn new(command: HazardCommand, stamp: WallStamp) -> Self {
        Self { stamp: stamp.into(), command: command as u8 }
    }
}

/// `autoware_vehicle_msgs/msg/ControlModeReport`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ControlModeReport {
    /// Time of the vehicle's report.
    pub stamp: Time,
    /// `NO_COMMAND` 0, `AUTONOMOUS` 1, `AUTONOMOUS_STEER_ONLY` 2, `AUTONOMOUS_VELOCITY_ONLY` 3,
    /// `MANUAL` 4, `DISENGAGED` 5, `NOT_READY` 6.
    pub mode: u8,
}
