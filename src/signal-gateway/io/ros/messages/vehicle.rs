//! `autoware_vehicle_msgs`, and the doors: reports on the vehicle, and commands for its lights.

use super::autoware_adapi_v1_msgs::{DoorStatus, DoorStatusArray};
use super::autoware_vehicle_msgs::{
    ControlModeReport, GearReport, HazardLightsCommand, HazardLightsReport, SteeringReport,
    TurnIndicatorsCommand, TurnIndicatorsReport, VelocityReport,
};
use super::std_msgs::Header;
use gateway_base::time::WallStamp;
use gateway_core::control_mode::ControlMode;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_status::doors::DoorStates;
use gateway_core::vehicle_status::gear::Gear;
use gateway_core::vehicle_status::steering::TireAngle;
use gateway_core::vehicle_status::velocity::Velocity;
use turn_signal::light_command::{HazardCommand, TurnCommand};

/// Frame of the velocity: the middle of the rear axle, on the ground.
const BASE_LINK: &str = "base_link";

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

impl VelocityReport {
    /// Creates the report of `velocity`, whose lateral part is 0 by the model; `stamp` is the receive time of the leading frame.
    pub fn new(velocity: Velocity, stamp: WallStamp) -> Self {
        Self {
            header: Header::new(stamp, BASE_LINK),
            longitudinal_velocity: single(velocity.longitudinal_mps),
            lateral_velocity: 0.0,
            heading_rate: single(velocity.heading_rate_radps),
        }
    }
}

impl SteeringReport {
    /// Creates the report of `angle`; `stamp` is the receive time of the frame that carried it.
    pub fn new(angle: TireAngle, stamp: WallStamp) -> Self {
        Self { stamp: stamp.into(), steering_tire_angle: single(angle.0) }
    }
}

impl GearReport {
    /// Creates the report of `gear`, which has the constants of the message as numbers; `stamp` is the receive time of the
    /// frame that carried it.
    pub fn new(gear: Gear, stamp: WallStamp) -> Self {
        Self { stamp: stamp.into(), report: gear as u8 }
    }
}

impl ControlModeReport {
    /// Creates the report of `mode`, which has the constants of the message as numbers; `stamp` is the receive time of the
    /// newest frame that carried it.
    pub fn new(mode: ControlMode, stamp: WallStamp) -> Self {
        Self { stamp: stamp.into(), mode: mode as u8 }
    }
}

impl DoorStatusArray {
    /// Creates the report of all doors, whose states have the constants of the message as numbers; `stamp` is the receive time
    /// of the newest frame that carried one.
    pub fn new(doors: DoorStates, stamp: WallStamp) -> Self {
        let doors = doors.as_slice().iter().map(|state| DoorStatus { status: *state as u8 });
        Self { stamp: stamp.into(), doors: doors.collect() }
    }
}

/// The nearest number of single precision.
#[allow(clippy::cast_possible_truncation)] // the messages have no more digits
const fn single(value: f64) -> f32 {
    value as f32
}
