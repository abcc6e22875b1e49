//! Diagnostic statuses and snapshots of the vehicle status reports.

use super::VehicleStatus;
use super::binding::StatusBinding;
use super::catalogue::SECTION;
use super::doors::doors_text;
use super::finding::message;
use super::measure::{Measure, StatusReport};
use super::role_texts::StatusTexts;
use super::snapshot::{DoorSnapshot, VehicleStatusSnapshot};
use crate::vehicle_report::{ReportFinding as _, ReportSnapshot};
use can_signal::can::Bus;
use can_signal::validation::observation::Observations;
use can_signal::validation::snapshot::{Received, ReceivedSnapshot, UsedBy};
use can_signal::validation::unusable::FaultKind;
use gateway_base::diagnostics::Status;
use gateway_base::time::{MonoTime, WallStamp};

impl VehicleStatus {
    /// Returns the diagnostic status of a report; `None` if the profile does not describe it.
    pub fn status(&self, report: StatusReport, buses: &[Bus], now: MonoTime) -> Option<Status> {
        let (_, task) = self.tasks.iter().find(|(described, _)| *described == report)?;
        let finding = task.finding.unwrap_or_default();
        let value = self.published_text(report);
        let mut values = vec![("report", value.unwrap_or_else(|| "not published".to_owned()))];
        let source = self.binding.source_name(report, finding.source);
        if !source.is_empty() {
            values.push(("source", source.to_owned()));
        }
        let geometry = &self.settings.geometry;
        if report == StatusReport::Steering
            && self.binding.uses_ratio(finding.source)
            && let Some(conversion) = &geometry.wheel_to_tire
        {
            let ratio = conversion.constant_ratio();
            values.push(("ratio", ratio.map_or_else(|| "variable".to_owned(), |ratio| ratio.to_string())));
            values.push(("ratio_source", geometry.ratio_origin.name().to_owned()));
        }
        let message = message(&self.binding, geometry, buses, report, finding);
        let mut status = Status::new(&SECTION, report.name(), &message, values);
        task.add_to(&mut status, received(&self.binding, &self.observations, buses), now);
        Some(status)
    }

    /// Returns the failure of a report; `None` without a failure.
    pub fn failure(&self, report: StatusReport) -> Option<FaultKind> {
        let (_, task) = self.tasks.iter().find(|(described, _)| *described == report)?;
        task.finding?.failure()
    }

    /// Returns all diagnostic statuses.
    pub fn statuses(&self, buses: &[Bus], now: MonoTime) -> Vec<Status> {
        self.tasks.iter().filter_map(|(report, _)| self.status(*report, buses, now)).collect()
    }

    /// Samples the frame counts from which rates are computed; call it at every refresh.
    pub fn sample_rates(&mut self, buses: &[Bus], now: MonoTime) {
        let received = received(&self.binding, &self.observations, buses);
        for (_, task) in &mut self.tasks {
            task.sample_rate(received, now);
        }
    }

    /// Returns the published value for display; `None` while nothing is published.
    fn published_text(&self, report: StatusReport) -> Option<String> {
        Some(match report {
            StatusReport::Velocity => Measure::texts(&self.velocity.value()?.measures()),
            StatusReport::Steering => Measure::texts(&self.steering.value()?.measures()),
            StatusReport::Gear => self.gear.value()?.name().to_owned(),
            StatusReport::ControlMode => self.control_mode.value()?.name().to_owned(),
            StatusReport::Doors => {
                let states = self.doors.value()?;
                let named = self.binding.doors.iter().zip(states.as_slice());
                doors_text(named.map(|(door, state)| (door.name.as_str(), *state)))
            }
        })
    }

    /// Returns the current state of the reports.
    pub fn snapshot(&self, buses: &[Bus], now: MonoTime) -> VehicleStatusSnapshot {
        let doors = self.doors.current().map(|(states, stamp)| {
            let named = self.binding.doors.iter().zip(states.as_slice());
            let doors = named.map(|(door, state)| DoorSnapshot { name: door.name.clone(), state: *state });
            (doors.collect(), stamp)
        });
        let steering = self.steering.current().map(|(angle, received)| (angle.0, received.stamp));
        let velocity = self.velocity.current().map(|(velocity, received)| (velocity, received.stamp));
        let mode = self.control_mode.current();
        VehicleStatusSnapshot {
            velocity: self.report_snapshot(StatusReport::Velocity, velocity, buses, now),
            steering: self.report_snapshot(StatusReport::Steering, steering, buses, now),
            gear: self.report_snapshot(StatusReport::Gear, self.gear.current(), buses, now),
            control_mode: self.report_snapshot(StatusReport::ControlMode, mode, buses, now),
            doors: self.report_snapshot(StatusReport::Doors, doors, buses, now),
        }
    }

    /// Returns the raw value of each signal of the status; `None` while it is not valid.
    pub fn raw_values(&self, buses: &[Bus], now: MonoTime) -> Vec<Option<i128>> {
        received(&self.binding, &self.observations, buses).raw_values(now)
    }

    /// Returns the signals and messages of the status.
    pub fn received_snapshot(&self, buses: &[Bus], now: MonoTime) -> ReceivedSnapshot {
        let texts = StatusTexts::of(&self.binding);
        received(&self.binding, &self.observations, buses)
            .snapshot(now, |signal, raw| texts.texts(signal, raw))
    }

    fn report_snapshot<T>(
        &self,
        report: StatusReport,
        current: Option<(T, WallStamp)>,
        buses: &[Bus],
        now: MonoTime,
    ) -> Option<ReportSnapshot<T>> {
        let (_, task) = self.tasks.iter().find(|(described, _)| *described == report)?;
        let status = self.status(report, buses, now)?;
        let source = self.binding.source_name(report, task.finding.unwrap_or_default().source);
        Some(task.snapshot(current, status, source, now))
    }
}

fn received<'a>(
    binding: &'a StatusBinding,
    observations: &'a Observations,
    buses: &'a [Bus],
) -> Received<'a> {
    Received { used_by: UsedBy::VehicleStatus, table: &binding.table, observations, buses }
}
