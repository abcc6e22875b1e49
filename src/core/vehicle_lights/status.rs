//! Diagnostic status of the two reports.

pub(super) mod snapshot;
#[cfg(test)]
mod tests;

use serde::Serialize;

use super::VehicleLights;
use super::binding::{FaultBinding, HAZARD_NOT_VISIBLE, HazardSource, LightsBinding};
use super::sources::LightsContext;
use super::state::UnavailableReason;
use super::verdict::{ActiveFault, Reason, Verdict};
use super::warning::Warnings;
use crate::core::can::Bus;
use crate::core::diagnostics::{Level, Status};
use crate::core::names::{variant_name, words};
use crate::core::time::MonoTime;
use crate::core::validation::display::raw_text;
use crate::core::validation::table::SignalIndex;
use crate::core::validation::unusable::FaultKind;
use crate::core::vehicle_report::{FailureHistory, ReceivedSignals, ReportSignals};

/// Diagnostic task of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// The report on turn indicators.
    TurnIndicators,
    /// The report on hazard lights.
    HazardLights,
}

impl Task {
    /// Name of the task.
    pub fn name(self) -> &'static str {
        variant_name(&self)
    }
}

/// Condition of a report for diagnostics: unavailable, faulty or both, with irregularities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LightsFinding {
    reason: Option<UnavailableReason>,
    fault: Option<ActiveFault>,
    withheld: bool,
    warnings: Warnings,
    /// True if lamps or a stalk are observed again after a permitted sleep of the bus, which is no failure.
    waking_up: bool,
}

impl LightsFinding {
    /// The finding of a verdict.
    pub fn of<T>(verdict: &Verdict<T>) -> Self {
        Self {
            reason: verdict.state.as_ref().err().copied(),
            fault: verdict.fault,
            withheld: verdict.publish.is_none(),
            warnings: verdict.warnings,
            waking_up: false,
        }
    }

    /// The finding after an earlier one.
    fn after(self, before: Self) -> Self {
        let observes = |reason: UnavailableReason| {
            matches!(reason, UnavailableReason::WatchingLamps(_) | UnavailableReason::Settling(_))
        };
        let slept = before.waking_up || before.reason.is_some_and(UnavailableReason::is_sleep);
        Self { waking_up: slept && self.reason.is_some_and(observes), ..self }
    }

    /// `None` without a failure, see [`UnavailableReason::is_failure`].
    fn kind(self) -> Option<FaultKind> {
        let reason = self.reason.filter(|reason| reason.is_failure() && !self.waking_up);
        let reason = reason.map(UnavailableReason::kind);
        if self.fault.is_some() { Some(FaultKind::HardwareFault) } else { reason }
    }
}

/// The finding of a task with its history.
#[derive(Debug, Clone)]
pub(super) struct LightsTask {
    task: Task,
    signals: ReportSignals,
    finding: Option<LightsFinding>,
    reason: Option<Reason>,
    source: usize,
    failures: FailureHistory,
}

impl LightsTask {
    pub(super) fn new(task: Task, signals: Vec<SignalIndex>) -> Self {
        let signals = ReportSignals::new(signals);
        Self { task, signals, finding: None, reason: None, source: 0, failures: FailureHistory::default() }
    }

    pub(super) fn task(&self) -> Task {
        self.task
    }

    /// Replaces the signals on which the state depends; the history stays.
    pub(super) fn reconfigure(&mut self, signals: Vec<SignalIndex>) {
        self.signals.reconfigure(signals);
    }

    /// Takes the current verdict and returns whether its finding has changed.
    pub(super) fn update<T>(&mut self, verdict: &Verdict<T>, context: LightsContext<'_>) -> bool {
        let finding = LightsFinding::of(verdict).after(self.finding.unwrap_or_default());
        self.reason = verdict.reason;
        self.source = verdict.source;
        if self.finding == Some(finding) {
            return false;
        }
        let before = self.finding.replace(finding).and_then(LightsFinding::kind);
        let text = || message(context.binding, context.buses, self.task, &finding);
        self.failures.changed(before, finding.kind(), text, context.now.mono);
        true
    }
}

impl VehicleLights {
    /// Diagnostic status of a task.
    pub fn status(&self, which: Task, buses: &[Bus], now: MonoTime) -> Status {
        let (task, report) = match which {
            Task::TurnIndicators => (&self.turn_task, self.turn.current().map(|(value, _)| value.name())),
            Task::HazardLights => (&self.hazard_task, self.hazard.current().map(|(value, _)| value.name())),
        };
        let finding = task.finding.unwrap_or_default();
        let bad = finding.kind().is_some();
        let is_accepted =
            finding.reason == Some(UnavailableReason::NotVisible) && self.binding.is_acknowledged();
        let warns = finding.warnings.any() || finding.reason.is_some() && !is_accepted;
        let level = if warns { Level::Warn } else { Level::Ok };
        let mut values = vec![("report", report.unwrap_or("not published").to_owned())];
        if finding.reason == Some(UnavailableReason::NotVisible) {
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
        values.extend(task.signals.status_values(self.received(), now));
        values.extend(task.failures.status_values(bad, now));
        let level = if bad { Level::Error } else { level };
        let message = message(&self.binding, buses, which, &finding);
        let signals = task.signals.names(&self.binding.table);
        Status { signals, ..Status::new(which.name(), level, message, values) }
    }

    /// Kind of failure of a report (`None` = none), and whether it is still published.
    pub fn failure(&self, which: Task) -> (Option<FaultKind>, bool) {
        let (task, published) = match which {
            Task::TurnIndicators => (&self.turn_task, self.turn.current().is_some()),
            Task::HazardLights => (&self.hazard_task, self.hazard.current().is_some()),
        };
        (task.finding.and_then(LightsFinding::kind), published)
    }

    /// Samples the frame counts from which rates are computed; call it at every refresh.
    pub fn sample_rates(&mut self, now: MonoTime) {
        let received = ReceivedSignals { table: &self.binding.table, observations: &self.observations };
        for task in [&mut self.turn_task, &mut self.hazard_task] {
            task.signals.sample_rate(received, now);
        }
    }

    fn received(&self) -> ReceivedSignals<'_> {
        ReceivedSignals { table: &self.binding.table, observations: &self.observations }
    }
}

fn message(binding: &LightsBinding, buses: &[Bus], task: Task, finding: &LightsFinding) -> String {
    let faults = match task {
        Task::TurnIndicators => &binding.turn_faults,
        Task::HazardLights => &binding.hazard_faults,
    };
    let text = |reason| unavailable_text(binding, buses, reason);
    let waking_up = |reason| format!("waking up: {}", cause_text(binding, buses, reason));
    let reason =
        finding.reason.map(|reason| if finding.waking_up { waking_up(reason) } else { text(reason) });
    let fault = finding.fault.map(|fault| fault_text(binding, faults, fault, finding));
    let source = |position| source_name(binding, task, position);
    let warnings = finding.warnings.texts(binding, source, text);
    match fault.into_iter().chain(reason).chain(warnings).collect::<Vec<_>>() {
        texts if texts.is_empty() => "publishing".to_owned(),
        texts => texts.join("; "),
    }
}

fn source_name(binding: &LightsBinding, task: Task, position: usize) -> &str {
    let name = match task {
        Task::TurnIndicators => binding.turn.sources().get(position).map(|named| &named.name),
        Task::HazardLights => binding.hazard.sources().get(position).map(|named| &named.name),
    };
    name.map_or("", String::as_str)
}

fn reason_text(binding: &LightsBinding, reason: Reason) -> &str {
    match binding.hazard.sources().get(reason.source).map(|named| &named.source) {
        Some(HazardSource::Signal { reasons, .. }) => {
            reasons.get(usize::from(reason.index)).map_or("", String::as_str)
        }
        Some(HazardSource::BothSides | HazardSource::Button { .. }) | None => "",
    }
}

fn fault_text(
    binding: &LightsBinding,
    faults: &FaultBinding,
    fault: ActiveFault,
    finding: &LightsFinding,
) -> String {
    let text = faults.signals.get(fault.index).map_or("", |signal| signal.text.as_str());
    let signal = &binding.table.signals[fault.signal.0].name;
    let effect = if finding.withheld { "not published" } else { "still published" };
    format!("hardware fault: {text} ({signal} = {}), {effect}", raw_text(fault.raw))
}

/// Why a state is unavailable: the kind and the cause.
fn unavailable_text(binding: &LightsBinding, buses: &[Bus], reason: UnavailableReason) -> String {
    let kind = if reason.is_sleep() {
        "asleep".to_owned()
    } else if reason == UnavailableReason::NotVisible {
        "not visible".to_owned()
    } else {
        words(&reason.kind())
    };
    format!("{kind}: {}", cause_text(binding, buses, reason))
}

fn cause_text(binding: &LightsBinding, buses: &[Bus], reason: UnavailableReason) -> String {
    let name = |signal: SignalIndex| binding.table.signals[signal.0].name.as_str();
    match reason {
        UnavailableReason::NotVisible if binding.is_acknowledged() => {
            "never published, as acknowledged in the configuration".to_owned()
        }
        UnavailableReason::NotVisible => HAZARD_NOT_VISIBLE.to_owned(),
        UnavailableReason::OtherVehicle(unmet) => binding.requirements[unmet.index].text(unmet),
        UnavailableReason::NotSelected(signal, raw) => {
            format!("no source applies while {} = {}", name(signal), raw_text(raw))
        }
        UnavailableReason::Signal(reason) => reason.text(&binding.table, buses),
        UnavailableReason::BothOn(sides) => {
            let [left, right] = sides.map(|(signal, raw)| format!("{} = {}", name(signal), raw_text(raw)));
            format!("{left} and {right} at once is not defined")
        }
        UnavailableReason::WatchingLamps([left, right]) => {
            format!("observing the lamps {} and {}", name(left), name(right))
        }
        UnavailableReason::Settling(signal) => {
            format!("observing {}, which may have been pressed before", name(signal))
        }
    }
}
