//! Diagnostic tasks of the lights reports: their findings, and the messages about them.

use serde::Serialize;

use super::binding::{FaultBinding, HazardSource, LightsBinding};
use super::catalogue;
use super::sources::LightsContext;
use super::state::UnavailableReason;
use super::verdict::{ActiveFault, Reason, Verdict};
use super::warning::Warnings;
use crate::vehicle_report::{ReportFinding, ReportState, ReportTask, catalogue as report};
use can_signal::can::Bus;
use can_signal::validation::display::raw_text;
use can_signal::validation::table::SignalIndex;
use can_signal::validation::unusable::FaultKind;
use gateway_base::diagnostics::{MessagePart, texts};
use gateway_base::names::named_by_variant;

/// Diagnostic task of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // their names say it
pub enum Task {
    TurnIndicators,
    HazardLights,
}

named_by_variant!(Task);

/// Condition of a report for diagnostics: unavailable, faulty or both, with irregularities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct LightsFinding {
    pub(super) reason: Option<UnavailableReason>,
    fault: Option<ActiveFault>,
    withheld: bool,
    warnings: Warnings,
    /// Why the reason is not a failure.
    pub(super) excuse: Option<Excuse>,
}

/// Why the reason for an unavailable state is not a failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Excuse {
    /// The first values since the start are awaited, or lamps or a stalk observed for the first time.
    Starting,
    /// The bus sleeps as permitted.
    Asleep,
    /// Lamps or a stalk are observed again after a permitted sleep of the bus.
    WakingUp,
    /// The vehicle never shows the state.
    NotVisible,
}

impl LightsFinding {
    /// Returns the finding of a verdict, as the successor of `before`. `is_starting` is true while a first
    /// frame since the start is not overdue.
    fn new<T>(verdict: &Verdict<T>, before: Option<&Self>, is_starting: bool) -> Self {
        let reason = verdict.state.as_ref().err().copied();
        Self {
            reason,
            fault: verdict.fault,
            withheld: verdict.publish.is_none(),
            warnings: verdict.warnings,
            excuse: reason.and_then(|reason| Self::excuse(reason, before, is_starting)),
        }
    }

    fn excuse(reason: UnavailableReason, before: Option<&Self>, is_starting: bool) -> Option<Excuse> {
        if reason == UnavailableReason::NotVisible {
            return Some(Excuse::NotVisible);
        }
        if reason.is_sleep() {
            return Some(Excuse::Asleep);
        }
        if reason.is_awaited(is_starting) {
            return Some(Excuse::Starting);
        }
        let before = before.map_or(Some(Excuse::Starting), |before| before.excuse);
        match before.filter(|_| reason.is_observing())? {
            Excuse::Starting => Some(Excuse::Starting),
            Excuse::Asleep | Excuse::WakingUp => Some(Excuse::WakingUp),
            Excuse::NotVisible => None,
        }
    }
}

impl ReportFinding for LightsFinding {
    fn failure(&self) -> Option<FaultKind> {
        let reason = self.reason.filter(|_| self.excuse.is_none());
        let reason = reason.map(UnavailableReason::kind);
        if self.fault.is_some() { Some(FaultKind::HardwareFault) } else { reason }
    }

    fn state(&self) -> ReportState {
        match (self.failure(), self.excuse) {
            (Some(kind), _) => kind.into(),
            (None, Some(Excuse::NotVisible)) => ReportState::NotVisible,
            (None, Some(Excuse::Asleep)) => ReportState::Asleep,
            (None, Some(Excuse::WakingUp)) => ReportState::WakingUp,
            (None, Some(Excuse::Starting)) => ReportState::Starting,
            (None, None) => ReportState::Published,
        }
    }
}

/// A task with the finding of its last verdict, and what only its status shows.
#[derive(Debug, Clone)]
pub(super) struct LightsTask {
    pub(super) task: Task,
    pub(super) report: ReportTask<LightsFinding>,
    pub(super) reason: Option<Reason>,
    pub(super) source: usize,
}

impl LightsTask {
    pub(super) fn new(task: Task, signals: Vec<SignalIndex>) -> Self {
        Self { task, report: ReportTask::new(signals), reason: None, source: 0 }
    }

    /// Updates the finding from the current verdict and returns whether it has changed.
    pub(super) fn update<T>(&mut self, verdict: &Verdict<T>, context: LightsContext<'_>) -> bool {
        (self.reason, self.source) = (verdict.reason, verdict.source);
        let is_starting = context.buses.iter().any(|bus| bus.is_starting(context.now.mono));
        let finding = LightsFinding::new(verdict, self.report.finding.as_ref(), is_starting);
        let text = || texts(&message(context.binding, context.buses, self.task, &finding));
        self.report.update(finding, text, context.now.mono)
    }
}

/// Returns the message of a task's status: faults, the reason why the state is unavailable, and warnings.
pub(super) fn message(
    binding: &LightsBinding,
    buses: &[Bus],
    task: Task,
    finding: &LightsFinding,
) -> Vec<MessagePart> {
    let faults = match task {
        Task::TurnIndicators => &binding.turn_faults,
        Task::HazardLights => &binding.hazard_faults,
    };
    let reason = finding.reason.map(|reason| unavailable_message(binding, buses, reason, finding.excuse));
    let unavailable = |reason| {
        let excuse = LightsFinding::excuse(reason, Some(finding), true);
        unavailable_message(binding, buses, reason, excuse)
    };
    let fault = finding.fault.map(|fault| fault_message(binding, faults, fault, finding));
    let source = |position| source_name(binding, task, position);
    let warnings = finding.warnings.messages(binding, source, unavailable);
    let parts: Vec<_> = fault.into_iter().chain(reason).chain(warnings).collect();
    if parts.is_empty() { vec![report::publishing()] } else { parts }
}

pub(super) fn source_name(binding: &LightsBinding, task: Task, position: usize) -> &str {
    let name = match task {
        Task::TurnIndicators => binding.turn.sources().get(position).map(|named| &named.name),
        Task::HazardLights => binding.hazard.sources().get(position).map(|named| &named.name),
    };
    name.map_or("", String::as_str)
}

pub(super) fn reason_text(binding: &LightsBinding, reason: Reason) -> &str {
    match binding.hazard.sources().get(reason.source).map(|named| &named.source) {
        Some(HazardSource::Signal { reasons, .. }) => {
            reasons.get(usize::from(reason.index)).map_or("", String::as_str)
        }
        Some(HazardSource::BothSides | HazardSource::Button { .. }) | None => "",
    }
}

fn fault_message(
    binding: &LightsBinding,
    faults: &FaultBinding,
    fault: ActiveFault,
    finding: &LightsFinding,
) -> MessagePart {
    let device = faults.signals.get(fault.index).map_or("", |signal| signal.text.as_str());
    let (signal, raw) = (&binding.table.signals[fault.signal.0].name, raw_text(fault.raw));
    if finding.withheld {
        catalogue::fault_not_published(device, signal, raw)
    } else {
        catalogue::fault_published(device, signal, raw)
    }
}

/// Returns the message for an unavailable state: the excuse or the kind of failure, and the cause.
fn unavailable_message(
    binding: &LightsBinding,
    buses: &[Bus],
    reason: UnavailableReason,
    excuse: Option<Excuse>,
) -> MessagePart {
    let cause = cause(binding, buses, reason);
    match (excuse, reason.kind()) {
        (Some(Excuse::NotVisible), _) if binding.is_acknowledged() => catalogue::acknowledged(),
        (Some(Excuse::NotVisible), _) => cause.within(catalogue::not_visible),
        (Some(Excuse::Asleep), _) => cause.within(report::asleep),
        (Some(Excuse::WakingUp), _) => cause.within(catalogue::waking_up),
        (Some(Excuse::Starting), _) => cause.within(report::starting),
        (None, FaultKind::Unknown) => cause.within(report::unknown),
        (None, FaultKind::Invalid) => cause.within(report::invalid),
        (None, FaultKind::HardwareFault) => cause.within(report::hardware_fault),
    }
}

fn cause(binding: &LightsBinding, buses: &[Bus], reason: UnavailableReason) -> MessagePart {
    let name = |signal: SignalIndex| binding.table.signals[signal.0].name.as_str();
    match reason {
        UnavailableReason::NotVisible => catalogue::hazard_not_visible(),
        UnavailableReason::OtherVehicle(unmet) => binding.requirements[unmet.index].message(unmet),
        UnavailableReason::NotSelected(signal, raw) => {
            catalogue::no_source_applies(name(signal), raw_text(raw))
        }
        UnavailableReason::Signal(reason) => reason.message(&binding.table, buses),
        UnavailableReason::BothOn([(left, left_raw), (right, right_raw)]) => {
            catalogue::both_on(name(left), raw_text(left_raw), name(right), raw_text(right_raw))
        }
        UnavailableReason::WatchingLamps([left, right]) => {
            catalogue::observing_lamps(name(left), name(right))
        }
        UnavailableReason::Settling(signal) => catalogue::observing_stalk(name(signal)),
    }
}
