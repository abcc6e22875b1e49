//! Current state of the reports, for people and programs that monitor the gateway.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::control_mode::ControlMode;
use crate::vehicle_report::ReportSnapshot;
use crate::vehicle_status::doors::{DoorState, doors_text};
use crate::vehicle_status::gear::Gear;
use crate::vehicle_status::measure::Measure;
use crate::vehicle_status::role_texts::StatusTexts;
use crate::vehicle_status::velocity::Velocity;
use crate::vehicle_status::{StatusReport, VehicleStatus};
use can_signal::can::Bus;
use can_signal::validation::snapshot::{Received, ReceivedSnapshot, UsedBy};
use gateway_base::time::{MonoTime, WallStamp};

/// A door and its state.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct DoorSnapshot {
    /// Name in the vehicle profile.
    pub name: String,
    /// Its state.
    pub state: DoorState,
}

/// Motion of the middle of the rear axle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VelocitySnapshot {
    /// Speed, m/s, forward positive.
    pub longitudinal_mps: f64,
    /// Heading rate, rad/s, counter-clockwise positive.
    pub heading_rate_radps: f64,
}

/// The reports on the vehicle's status.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VehicleStatusSnapshot {
    /// Speed and heading rate at the middle of the rear axle; `None` when the profile leaves them out.
    pub velocity: Option<ReportSnapshot<VelocitySnapshot>>,
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

impl VelocitySnapshot {
    fn measures(self) -> [(Measure, f64); 2] {
        let Self { longitudinal_mps, heading_rate_radps } = self;
        Velocity { longitudinal_mps, heading_rate_radps }.measures()
    }
}

impl VehicleStatus {
    /// Returns the current state of the reports.
    pub fn snapshot(&self, buses: &[Bus], now: MonoTime) -> VehicleStatusSnapshot {
        let doors = self.doors.current().map(|(states, stamp)| {
            let named = self.binding.doors.iter().zip(states.as_slice());
            let doors = named.map(|(door, state)| DoorSnapshot { name: door.name.clone(), state: *state });
            (doors.collect(), stamp)
        });
        let steering = self.steering.current().map(|(angle, received)| (angle.0, received.stamp));
        let velocity = self.velocity.current().map(|(velocity, received)| {
            let Velocity { longitudinal_mps, heading_rate_radps } = velocity;
            (VelocitySnapshot { longitudinal_mps, heading_rate_radps }, received.stamp)
        });
        VehicleStatusSnapshot {
            velocity: self.report_snapshot(StatusReport::Velocity, velocity, buses, now),
            steering: self.report_snapshot(StatusReport::Steering, steering, buses, now),
            gear: self.report_snapshot(StatusReport::Gear, self.gear.current(), buses, now),
            control_mode: self.report_snapshot(
                StatusReport::ControlMode,
                self.control_mode.current(),
                buses,
                now,
            ),
            doors: self.report_snapshot(StatusReport::Doors, doors, buses, now),
        }
    }

    /// Returns the signals and messages of the status.
    pub fn received_snapshot(&self, buses: &[Bus], now: MonoTime) -> ReceivedSnapshot {
        let (table, observations) = (&self.binding.table, &self.observations);
        let received = Received { used_by: UsedBy::VehicleStatus, table, observations, buses };
        let texts = StatusTexts::of(&self.binding);
        received.snapshot(now, |signal, raw| texts.texts(signal, raw))
    }

    fn report_snapshot<T>(
        &self,
        report: StatusReport,
        current: Option<(T, WallStamp)>,
        buses: &[Bus],
        now: MonoTime,
    ) -> Option<ReportSnapshot<T>> {
        let task = self.tasks.iter().find(|task| task.report == report)?;
        let status = self.status(report, buses, now)?;
        let finding = task.finding.unwrap_or_default();
        let source = report.source_name(&self.binding, finding.source);
        let (published, stamp) = current.unzip();
        Some(ReportSnapshot {
            withheld: published.is_none().then(|| status.message.clone()),
            published,
            failure: finding.failure(),
            level: status.level,
            message: status.message,
            source: (!source.is_empty()).then(|| source.to_owned()),
            reason: None,
            stamp_ns: stamp.map(WallStamp::as_nanos),
            signals: status.signals,
            failures: task.failures.counts(),
            last_failure: task.failures.last(now),
        })
    }
}
