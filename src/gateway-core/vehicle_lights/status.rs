//! Diagnostic statuses and snapshots of the lights reports, for people and programs that monitor the gateway.

#[cfg(test)]
mod tests;

use super::VehicleLights;
use super::binding::LightsBinding;
use super::catalogue::SECTION;
use super::role_texts;
use super::state::UnavailableReason;
use super::task::{LightsTask, Task, message, reason_text, source_name};
use super::verdict::{HazardLights, TurnIndicators};
use crate::vehicle_report::{ReportFinding, ReportSnapshot, ReportState};
use can_signal::can::Bus;
use can_signal::validation::observation::Observations;
use can_signal::validation::snapshot::{Received, ReceivedSnapshot, UsedBy};
use can_signal::validation::unusable::FaultKind;
use gateway_base::diagnostics::Status;
use gateway_base::time::{MonoTime, WallStamp};

impl VehicleLights {
    /// Returns the diagnostic status of a task.
    pub fn status(&self, which: Task, buses: &[Bus], now: MonoTime) -> Status {
        let (task, report) = match which {
            Task::TurnIndicators => (&self.turn_task, self.turn.value().map(TurnIndicators::name)),
            Task::HazardLights => (&self.hazard_task, self.hazard.value().map(HazardLights::name)),
        };
        let finding = task.report.finding.unwrap_or_default();
        let mut values = vec![("report", report.unwrap_or("not published").to_owned())];
        if finding.reason == Some(UnavailableReason::NotVisible) {
            let is_accepted = self.binding.is_acknowledged();
            let text = if is_accepted { "not visible, acknowledged" } else { "not visible" };
            values.push(("hazard", text.to_owned()));
        }
        let source = source_name(&self.binding, which, task.source);
        if !source.is_empty() {
            values.push(("source", source.to_owned()));
        }
        if let Some(reason) = task.reason {
            values.push(("reason", reason_text(&self.binding, reason).to_owned()));
        }
        let message = message(&self.binding, buses, which, &finding);
        let mut status = Status::new(&SECTION, which.name(), &message, values);
        task.report.add_to(&mut status, received(&self.binding, &self.observations, buses), now);
        status
    }

    /// Returns the kind of failure of a report (`None` = no failure), and whether the report is still
    /// published.
    pub fn failure(&self, which: Task) -> (Option<FaultKind>, bool) {
        let (task, published) = match which {
            Task::TurnIndicators => (&self.turn_task, self.turn.value().is_some()),
            Task::HazardLights => (&self.hazard_task, self.hazard.value().is_some()),
        };
        (task.report.finding.and_then(|finding| finding.failure()), published)
    }

    /// Returns the state of a report; `None` before its first verdict.
    pub fn state(&self, which: Task) -> Option<ReportState> {
        let task = match which {
            Task::TurnIndicators => &self.turn_task,
            Task::HazardLights => &self.hazard_task,
        };
        task.report.finding.map(|finding| finding.state())
    }

    /// Samples the frame counts from which rates are computed; call it at every refresh.
    pub fn sample_rates(&mut self, buses: &[Bus], now: MonoTime) {
        let received = received(&self.binding, &self.observations, buses);
        for task in [&mut self.turn_task, &mut self.hazard_task] {
            task.report.sample_rate(received, now);
        }
    }

    /// Returns the report on turn indicators; `None` if the profile does not mention them.
    pub fn turn_snapshot(&self, buses: &[Bus], now: MonoTime) -> Option<ReportSnapshot<TurnIndicators>> {
        self.report_snapshot(&self.turn_task, self.turn.current(), buses, now)
    }

    /// Returns the report on hazard lights; `None` if the profile does not mention them.
    pub fn hazard_snapshot(&self, buses: &[Bus], now: MonoTime) -> Option<ReportSnapshot<HazardLights>> {
        self.report_snapshot(&self.hazard_task, self.hazard.current(), buses, now)
    }

    /// Returns the raw value of each signal of the lights; `None` while it is not valid.
    pub fn raw_values(&self, buses: &[Bus], now: MonoTime) -> Vec<Option<i128>> {
        received(&self.binding, &self.observations, buses).raw_values(now)
    }

    /// Returns the signals and messages of the lights.
    pub fn received_snapshot(&self, buses: &[Bus], now: MonoTime) -> ReceivedSnapshot {
        received(&self.binding, &self.observations, buses)
            .snapshot(now, |signal, raw| role_texts::texts(&self.binding, signal, raw))
    }

    fn report_snapshot<T>(
        &self,
        task: &LightsTask,
        current: Option<(T, WallStamp)>,
        buses: &[Bus],
        now: MonoTime,
    ) -> Option<ReportSnapshot<T>> {
        let which = self.tasks().find(|which| *which == task.task)?;
        let source = source_name(&self.binding, which, task.source);
        let reason = task.reason.map(|reason| reason_text(&self.binding, reason).to_owned());
        let status = self.status(which, buses, now);
        Some(ReportSnapshot { reason, ..task.report.snapshot(current, status, source, now) })
    }
}

fn received<'a>(
    binding: &'a LightsBinding,
    observations: &'a Observations,
    buses: &'a [Bus],
) -> Received<'a> {
    Received { used_by: UsedBy::VehicleLights, table: &binding.table, observations, buses }
}
