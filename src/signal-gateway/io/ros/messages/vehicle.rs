//! `autoware_vehicle_msgs`, and the doors: reports on the vehicle, and commands for its lights.

use serde::Serialize;

use gateway_base::time::WallStamp;
use gateway_core::control_mode::ControlMode;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_status::doors::DoorStates;
use gateway_core::vehicle_status::gear::Gear;
use gateway_core::vehicle_status::steering::TireAngle;
use gateway_core::vehicle_status::velocity::Velocity;
use ros_messages::autoware_adapi_v1_msgs::{DoorStatus, DoorStatusArray};
use ros_messages::autoware_vehicle_msgs::{
    ControlModeReport, GearReport, HazardLightsCommand, HazardLightsReport, SteeringReport,
    TurnIndicatorsCommand, TurnIndicatorsReport, VelocityReport,
};
use ros_messages::std_msgs::Header;
use turn_signal::light_command::{HazardCommand, TurnCommand};

/// Frame of the velocity: the middle of the rear axle, on the ground.
const BASE_LINK: &str = "base_link";

/// Conversion of an output to its message.
pub trait ToRos {
    /// The message.
    type Message: Serialize + Send + 'static;

    /// Creates the message; `stamp` is the receive time of the newest frame it is based on, or the time of
    /// the decision.
    fn to_ros(self, stamp: WallStamp) -> Self::Message;
}

impl ToRos for TurnIndicators {
    type Message = TurnIndicatorsReport;

    fn to_ros(self, stamp: WallStamp) -> TurnIndicatorsReport {
        let report = match self {
            Self::Disable => TurnIndicatorsReport::DISABLE,
            Self::EnableLeft => TurnIndicatorsReport::ENABLE_LEFT,
            Self::EnableRight => TurnIndicatorsReport::ENABLE_RIGHT,
        };
        TurnIndicatorsReport { stamp: stamp.into(), report }
    }
}

impl ToRos for HazardLights {
    type Message = HazardLightsReport;

    fn to_ros(self, stamp: WallStamp) -> HazardLightsReport {
        let report = match self {
            Self::Disable => HazardLightsReport::DISABLE,
            Self::Enable => HazardLightsReport::ENABLE,
        };
        HazardLightsReport { stamp: stamp.into(), report }
    }
}

/// The discriminants equal the constants of the message.
impl ToRos for TurnCommand {
    type Message = TurnIndicatorsCommand;

    fn to_ros(self, stamp: WallStamp) -> TurnIndicatorsCommand {
        TurnIndicatorsCommand { stamp: stamp.into(), command: self as u8 }
    }
}

/// The discriminants equal the constants of the message.
impl ToRos for HazardCommand {
    type Message = HazardLightsCommand;

    fn to_ros(self, stamp: WallStamp) -> HazardLightsCommand {
        HazardLightsCommand { stamp: stamp.into(), command: self as u8 }
    }
}

/// The lateral component is 0 in the model.
impl ToRos for Velocity {
    type Message = VelocityReport;

    fn to_ros(self, stamp: WallStamp) -> VelocityReport {
        VelocityReport {
            header: Header::new(stamp, BASE_LINK),
            longitudinal_velocity: single(self.longitudinal_mps),
            lateral_velocity: 0.0,
            heading_rate: single(self.heading_rate_radps),
        }
    }
}

impl ToRos for TireAngle {
    type Message = SteeringReport;

    fn to_ros(self, stamp: WallStamp) -> SteeringReport {
        SteeringReport { stamp: stamp.into(), steering_tire_angle: single(self.0) }
    }
}

/// The discriminants equal the constants of the message.
impl ToRos for Gear {
    type Message = GearReport;

    fn to_ros(self, stamp: WallStamp) -> GearReport {
        GearReport { stamp: stamp.into(), report: self as u8 }
    }
}

/// The discriminants equal the constants of the message.
impl ToRos for ControlMode {
    type Message = ControlModeReport;

    fn to_ros(self, stamp: WallStamp) -> ControlModeReport {
        ControlModeReport { stamp: stamp.into(), mode: self as u8 }
    }
}

/// The discriminants equal the constants of the message.
impl ToRos for DoorStates {
    type Message = DoorStatusArray;

    fn to_ros(self, stamp: WallStamp) -> DoorStatusArray {
        let doors = self.as_slice().iter().map(|state| DoorStatus { status: *state as u8 });
        DoorStatusArray { stamp: stamp.into(), doors: doors.collect() }
    }
}

/// Rounds to single precision.
#[allow(clippy::cast_possible_truncation)] // the messages have no more digits
const fn single(value: f64) -> f32 {
    value as f32
}
