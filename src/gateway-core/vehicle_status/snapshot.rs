//! Current state of the reports, for people and programs that monitor the gateway.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::doors::{DoorState, doors_text};
use super::gear::Gear;
use super::measure::{Measure, StatusReport};
use super::velocity::Velocity;
use crate::control_mode::ControlMode;
use crate::vehicle_report::ReportSnapshot;

/// A door and its state.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct DoorSnapshot {
    /// Name in the vehicle profile.
    pub name: String,
    /// Its state.
    pub state: DoorState,
}

/// The reports on the vehicle's status.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VehicleStatusSnapshot {
    /// Speed and heading rate at the middle of the rear axle; `None` when the profile leaves them out.
    pub velocity: Option<ReportSnapshot<Velocity>>,
    /// Angle of the front wheels, rad, left positive; `None` when the profile leaves it out.
    pub steering: Option<ReportSnapshot<f64>>,
    /// Engaged gear; `None` when the profile leaves it out.
    pub gear: Option<ReportSnapshot<Gear>>,
    /// Who is in control; `None` when the profile leaves it out.
    pub control_mode: Option<ReportSnapshot<ControlMode>>,
    /// Doors in the order of the profile; `None` when the profile leaves them out.
    pub doors: Option<ReportSnapshot<Vec<DoorSnapshot>>>,
}

impl VehicleStatusSnapshot {
    /// Returns the reports that the profile describes, each with its value as text.
    pub fn reports(&self) -> Vec<(StatusReport, ReportSnapshot<String>)> {
        let velocity =
            self.velocity.as_ref().map(|report| report.map(|value| Measure::texts(&value.measures())));
        let steering =
            self.steering.as_ref().map(|report| report.map(|angle| Measure::TireAngle.text(*angle)));
        let gear = self.gear.as_ref().map(|report| report.map(|gear| gear.name().to_owned()));
        let mode = self.control_mode.as_ref().map(|report| report.map(|mode| mode.name().to_owned()));
        let doors = self.doors.as_ref().map(|report| {
            report.map(|doors| doors_text(doors.iter().map(|door| (door.name.as_str(), door.state))))
        });
        let reports = [
            (StatusReport::Velocity, velocity),
            (StatusReport::Steering, steering),
            (StatusReport::Gear, gear),
            (StatusReport::ControlMode, mode),
            (StatusReport::Doors, doors),
        ];
        reports.into_iter().filter_map(|(name, report)| Some((name, report?))).collect()
    }

    /// Returns the published measured values, in SI units.
    pub fn measures(&self) -> Vec<(Measure, f64)> {
        let velocity = self.velocity.as_ref().and_then(|report| report.published);
        let steering = self.steering.as_ref().and_then(|report| report.published);
        let velocity = velocity.iter().flat_map(|velocity| velocity.measures());
        velocity.chain(steering.map(|angle| (Measure::TireAngle, angle))).collect()
    }
}
