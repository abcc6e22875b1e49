//! The present state of the reports, for people and programs that watch the gateway.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{LightsFinding, LightsTask, reason_text, source_name};
use crate::core::can::Bus;
use crate::core::diagnostics::Level;
use crate::core::time::{MonoTime, millis};
use crate::core::validation::snapshot::{MessageSnapshot, Received, SignalSnapshot, UsedBy};
use crate::core::vehicle_lights::report::ReportFlow;
use crate::core::vehicle_lights::role_texts::texts;
use crate::core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use crate::core::vehicle_lights::{FaultKind, VehicleLights};

/// The present state of a report with values of `T`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ReportSnapshot<T> {
    /// Value that is published; `None` while the report is withheld.
    pub published: Option<T>,
    /// Why it is withheld; `None` while it is published.
    pub withheld: Option<String>,
    /// Kind of failure; `None` without one. A report can be published in spite of a hardware fault.
    pub failure: Option<FaultKind>,
    /// Level of its diagnostic status.
    pub level: Level,
    /// Message of its diagnostic status.
    pub message: String,
    /// Name of the source that decides; `None` where there is only one.
    pub source: Option<String>,
    /// Why the hazard lights are on, as the vehicle gives it; `None` where it does not.
    pub reason: Option<String>,
    /// Stamp of the published message, nanoseconds since 1970; `None` while the report is withheld.
    pub stamp_ns: Option<i64>,
    /// Signals on which it depends, by name.
    pub signals: Vec<String>,
    /// Number of failures since start.
    pub failures: FailureCounts,
    /// The last failure; `None` before the first.
    pub last_failure: Option<LastFailure>,
}

/// Number of failures of a report since start, by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct FailureCounts {
    /// There was no valid value.
    pub unknown: u64,
    /// The value had no meaning in the profile.
    pub invalid: u64,
    /// The vehicle reported a fault.
    pub hardware_fault: u64,
}

/// The last failure of a report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LastFailure {
    /// The kind of failure.
    pub kind: FaultKind,
    /// The reason in words.
    pub text: String,
    /// Time since it began, ms.
    pub age_ms: u64,
}

impl VehicleLights {
    /// The report on turn indicators; `None` when the profile leaves it out.
    pub fn turn_snapshot(&self, buses: &[Bus], now: MonoTime) -> Option<ReportSnapshot<TurnIndicators>> {
        self.report_snapshot(&self.turn_task, &self.turn, buses, now)
    }

    /// The report on hazard lights; `None` when the profile leaves it out.
    pub fn hazard_snapshot(&self, buses: &[Bus], now: MonoTime) -> Option<ReportSnapshot<HazardLights>> {
        self.report_snapshot(&self.hazard_task, &self.hazard, buses, now)
    }

    /// The signals and messages of the lights.
    pub(in crate::core) fn received_snapshot(
        &self,
        buses: &[Bus],
        now: MonoTime,
    ) -> (Vec<SignalSnapshot>, Vec<MessageSnapshot>) {
        let (table, observations) = (&self.binding.table, &self.observations);
        let received = Received { used_by: UsedBy::VehicleLights, table, observations, buses };
        let signals = received.signals(now, |signal, raw| texts(&self.binding, signal, raw));
        (signals.collect(), received.messages().collect())
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
        let count = |kind: FaultKind| task.failures[kind as usize];
        let source = source_name(&self.binding, which, task.source);
        Some(ReportSnapshot {
            published: current.map(|(value, _)| value),
            withheld: current.is_none().then(|| status.message.clone()),
            failure: task.finding.and_then(LightsFinding::kind),
            level: status.level,
            message: status.message,
            source: (!source.is_empty()).then(|| source.to_owned()),
            reason: task.reason.map(|reason| reason_text(&self.binding, reason).to_owned()),
            stamp_ns: current.map(|(_, stamp)| stamp.as_nanos()),
            signals: status.signals,
            failures: FailureCounts {
                unknown: count(FaultKind::Unknown),
                invalid: count(FaultKind::Invalid),
                hardware_fault: count(FaultKind::HardwareFault),
            },
            last_failure: task.last_failure.as_ref().map(|failure| LastFailure {
                kind: failure.kind,
                text: failure.text.clone(),
                age_ms: millis(now.since(failure.at)),
            }),
        })
    }
}
