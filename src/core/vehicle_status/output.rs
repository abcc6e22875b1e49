//! Outputs of the vehicle's status.

use super::doors::DoorStates;
use super::gear::Gear;
use super::steering::TireAngle;
use super::velocity::Velocity;
use crate::core::control_mode::ControlMode;
use crate::core::vehicle_report::Step;

/// A report to publish or to withdraw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VehicleStatusOutput {
    /// For the topic of `VelocityReport`.
    Velocity(Step<Velocity>),
    /// For the topic of `SteeringReport`.
    Steering(Step<TireAngle>),
    /// For the topic of `GearReport`.
    Gear(Step<Gear>),
    /// For the topic of `ControlModeReport`.
    ControlMode(Step<ControlMode>),
    /// For the topic of `DoorStatusArray`.
    Doors(Step<DoorStates>),
}

impl VehicleStatusOutput {
    /// Returns the name of the report and its value in words; `None` when it is withdrawn. The value of a report that is published
    /// with each frame is just that it is published.
    pub fn named(self) -> (&'static str, Option<String>) {
        let streamed = "published".to_owned();
        match self {
            Self::Velocity(step) => ("velocity", step.value().map(|_| streamed)),
            Self::Steering(step) => ("steering", step.value().map(|_| streamed)),
            Self::Gear(step) => ("gear", step.value().map(|gear| gear.name().to_owned())),
            Self::ControlMode(step) => ("control_mode", step.value().map(|mode| mode.name().to_owned())),
            Self::Doors(step) => {
                let texts =
                    |doors: DoorStates| doors.as_slice().iter().map(|door| door.name()).collect::<Vec<_>>();
                ("doors", step.value().map(|doors| texts(doors).join(", ")))
            }
        }
    }
}
