//! Outputs of the vehicle's status.

use derive_more::Display;

use super::doors::DoorStates;
use super::gear::Gear;
use super::measure::{Measure, StatusReport};
use super::steering::TireAngle;
use super::velocity::Velocity;
use super::velocity::binding::Motion;
use crate::control_mode::ControlMode;
use crate::vehicle_report::Step;
use gateway_base::names::state_word;

/// A report to publish or to withdraw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VehicleStatusOutput {
    /// On the topic of `VelocityReport`.
    Velocity(Step<Velocity>),
    /// On the topic of `SteeringReport`.
    Steering(Step<TireAngle>),
    /// On the topic of `GearReport`.
    Gear(Step<Gear>),
    /// On the topic of `ControlModeReport`.
    ControlMode(Step<ControlMode>),
    /// On the topic of `DoorStatusArray`.
    Doors(Step<DoorStates>),
}

/// A published value as text.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
#[display("{state}{}{measured}", if measured.is_empty() { "" } else { ", " })]
pub struct NamedValue {
    /// Part that rarely changes: the gear, or the direction of a velocity.
    pub state: String,
    /// Measured values with their units; empty if there are none.
    pub measured: String,
}

impl VehicleStatusOutput {
    /// Returns the report of this output.
    pub fn report(self) -> StatusReport {
        match self {
            Self::Velocity(_) => StatusReport::Velocity,
            Self::Steering(_) => StatusReport::Steering,
            Self::Gear(_) => StatusReport::Gear,
            Self::ControlMode(_) => StatusReport::ControlMode,
            Self::Doors(_) => StatusReport::Doors,
        }
    }

    /// Returns the measured values; empty for a report that has none or is withdrawn.
    pub fn measures(self) -> Vec<(Measure, f64)> {
        match self {
            Self::Velocity(step) => step.value().map(|value| value.measures().to_vec()).unwrap_or_default(),
            Self::Steering(step) => step.value().map(|value| value.measures().to_vec()).unwrap_or_default(),
            Self::Gear(_) | Self::ControlMode(_) | Self::Doors(_) => Vec::new(),
        }
    }

    /// Returns the value in words; `None` if the report is withdrawn.
    pub fn named(self) -> Option<NamedValue> {
        let state = match self {
            Self::Velocity(step) => Motion::of(step.value()?.longitudinal_mps).name().to_owned(),
            Self::Steering(step) => step.value().map(|_| "published".to_owned())?,
            Self::Gear(step) => state_word(&step.value()?),
            Self::ControlMode(step) => state_word(&step.value()?),
            Self::Doors(step) => {
                let doors = step.value()?;
                doors.as_slice().iter().map(state_word).collect::<Vec<_>>().join(", ")
            }
        };
        Some(NamedValue { state, measured: Measure::texts(&self.measures()) })
    }
}
