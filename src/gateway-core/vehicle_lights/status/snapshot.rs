//! Current state of the lights reports, for people and programs that monitor the gateway.

use super::{LightsFinding, LightsTask, reason_text, source_name};
use crate::vehicle_lights::VehicleLights;
use crate::vehicle_lights::role_texts::texts;
use crate::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use crate::vehicle_report::{ReportFlow, ReportSnapshot};
use can_signal::can::Bus;
use can_signal::validation::snapshot::{Received, ReceivedSnapshot, UsedBy};
use gateway_base::time::MonoTime;

impl VehicleLights {
    /// Returns the report on turn indicators; `None` if the profile does not mention them.
    pub fn turn_snapshot(&self, buses: &[Bus], now: MonoTime) -> Option<ReportSnapshot<TurnIndicators>> {
        self.report_snapshot(&self.turn_task, &self.turn, buses, now)
    }

    /// Returns the report on hazard lights; `None` if the profile does not mention them.
    pub fn hazard_snapshot(&self, buses: &[Bus], now: MonoTime) -> Option<ReportSnapshot<HazardLights>> {
        self.report_snapshot(&self.hazard_task, &self.hazard, buses, now)
    }

    /// Returns the signals and messages of the lights.
    pub fn received_snapshot(&self, buses: &[Bus], now: MonoTime) -> ReceivedSnapshot {
        let (table, observations) = (&self.binding.table, &self.observations);
        let received = Received { used_by: UsedBy::VehicleLights, table, observations, buses };
        received.snapshot(now, |signal, raw| texts(&self.binding, signal, raw))
    }

    fn report_snapshot<T: Copy + PartialEq>(
        &self,
        task: &LightsTask,
        flow: &ReportFlow<T>,
        buses: &[Bus],
        now: MonoTime,
    ) -> Option<ReportSnapshot<T>> {
        let which = self.tasks().find(|which| *which == task.task)?;
        let status = self.status(which, buses, now);
        let current = flow.current();
        let source = source_name(&self.binding, which, task.source);
        Some(ReportSnapshot {
            published: current.map(|(value, _)| value),
            withheld: current.is_none().then(|| status.message.clone()),
            failure: task.finding.as_ref().and_then(LightsFinding::kind),
            level: status.level,
            message: status.message,
            source: (!source.is_empty()).then(|| source.to_owned()),
            reason: task.reason.map(|reason| reason_text(&self.binding, reason).to_owned()),
            stamp_ns: current.map(|(_, stamp)| stamp.as_nanos()),
            signals: status.signals,
            failures: task.failures.counts(),
            last_failure: task.failures.last(now),
        })
    }
}
