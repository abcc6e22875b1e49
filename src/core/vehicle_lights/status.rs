//! Diagnostic status of the two reports.

pub(super) mod snapshot;
#[cfg(test)]
mod tests;

use serde::Serialize;

use super::VehicleLights;
use super::binding::{FaultBinding, HAZARD_NOT_VISIBLE, HazardSource, LightsBinding};
use super::sources::LightsContext;
use super::state::{FaultKind, UnavailableReason};
use super::verdict::{ActiveFault, Reason, Verdict};
use super::warning::Warnings;
use crate::core::can::Bus;
use crate::core::diagnostics::{Level, RateMeter, Status};
use crate::core::names::{variant_name, words};
use crate::core::time::MonoTime;
use crate::core::validation::display::{missing_reason_text, raw_text};
use crate::core::validation::integrity::IntegrityCounts;
use crate::core::validation::observation::MessageCounts;
use crate::core::validation::table::{MessageIndex, SignalIndex};

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

/// A failure of a report.
#[derive(Debug, Clone)]
struct Failure {
    kind: FaultKind,
    text: String,
    /// The instant at which it began.
    at: MonoTime,
}

/// The finding of a task with its history.
#[derive(Debug, Clone)]
pub(super) struct LightsTask {
    task: Task,
    signals: Vec<SignalIndex>,
    finding: Option<LightsFinding>,
    reason: Option<Reason>,
    source: usize,
    /// Number of failures since start, by [`FaultKind`].
    failures: [u64; 3],
    last_failure: Option<Failure>,
    rate: RateMeter,
}

impl LightsTask {
    pub(super) fn new(task: Task, signals: Vec<SignalIndex>) -> Self {
        Self {
            task,
            signals,
            finding: None,
            reason: None,
            source: 0,
            failures: [0; 3],
            last_failure: None,
            rate: RateMeter::default(),
        }
    }

    pub(super) fn task(&self) -> Task {
        self.task
    }

    /// Replaces the signals on which the state depends; the history stays.
    pub(super) fn reconfigure(&mut self, signals: Vec<SignalIndex>) {
        self.signals = signals;
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
        let kind = finding.kind();
        if let Some(kind) = kind {
            if Some(kind) != before {
                self.failures[kind as usize] += 1;
            }
            let text = message(context.binding, context.buses, self.task, &finding);
            self.last_failure = Some(Failure { kind, text, at: context.now.mono });
        }
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
        let name = |signal: &SignalIndex| self.binding.table.signals[signal.0].name.clone();
        let signals: Vec<_> = task.signals.iter().map(name).collect();
        if !signals.is_empty() {
            values.push(("signal", signals.join(", ")));
            self.signal_values(task, now, &mut values);
        }
        values.extend([
            ("unknown_count", task.failures[FaultKind::Unknown as usize].to_string()),
            ("invalid_count", task.failures[FaultKind::Invalid as usize].to_string()),
            ("hardware_fault_count", task.failures[FaultKind::HardwareFault as usize].to_string()),
        ]);
        values.push((
            "last_error",
            match &task.last_failure {
                Some(failure) if bad => failure.text.clone(),
                Some(Failure { text, at, .. }) => format!("{text} ({} s ago)", now.since(*at).as_secs()),
                None => "none".to_owned(),
            },
        ));
        let level = if bad { Level::Error } else { level };
        let message = message(&self.binding, buses, which, &finding);
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
        let (turn, hazard) = (self.frames(&self.turn_task), self.frames(&self.hazard_task));
        self.turn_task.rate.sample(turn, now);
        self.hazard_task.rate.sample(hazard, now);
    }

    fn signal_values(&self, task: &LightsTask, now: MonoTime, values: &mut Vec<(&'static str, String)>) {
        let joined = |text: &dyn Fn(SignalIndex) -> String| {
            task.signals.iter().map(|signal| text(*signal)).collect::<Vec<_>>().join(", ")
        };
        let last = |signal: SignalIndex| self.observations.last(signal);
        let age = |signal| last(signal).map(|last| now.since(last.received.at));
        let oldest = task.signals.iter().map(|signal| age(*signal)).max().flatten();
        let any_never = task.signals.iter().any(|signal| age(*signal).is_none());
        let frames = self.frames(task);
        let total = |count: fn(MessageCounts) -> u64| -> u64 {
            self.messages_of(task).iter().map(|message| count(self.observations.counts(*message))).sum()
        };
        values.extend([
            ("raw_value", joined(&|signal| last(signal).map_or("none".into(), |last| raw_text(last.raw)))),
            (
                "age_ms",
                oldest.filter(|_| !any_never).map_or("never".into(), |age| age.as_millis().to_string()),
            ),
            ("frames", frames.to_string()),
            ("rate_hz", format!("{:.1}", task.rate.rate_hz(frames, now))),
            ("too_short_frames", total(|counts| counts.too_short).to_string()),
        ]);
        let wrong_format = total(|counts| counts.wrong_format);
        values.extend((wrong_format > 0).then(|| ("wrong_format_frames", wrong_format.to_string())));
        self.integrity_values(task, values);
    }

    /// Adds the integrity counts of the messages of a task, if any has integrity rules.
    fn integrity_values(&self, task: &LightsTask, values: &mut Vec<(&'static str, String)>) {
        let messages = self.messages_of(task);
        let counts: Vec<_> =
            messages.iter().filter_map(|message| self.observations.integrity_counts(*message)).collect();
        if counts.is_empty() {
            return;
        }
        let last = messages.iter().filter_map(|message| {
            let name = &self.binding.table.messages[message.0].name;
            self.observations.last_reject(*message).map(|reject| format!("{name}: {reject}"))
        });
        let last = last.collect::<Vec<_>>().join("; ");
        values.extend([
            ("rejected_frames", counts.iter().map(IntegrityCounts::rejected).sum::<u64>().to_string()),
            ("wrong_checksums", counts.iter().map(|counts| counts.wrong_checksum).sum::<u64>().to_string()),
            ("lost_frames", counts.iter().map(|counts| counts.lost).sum::<u64>().to_string()),
            ("last_reject", if last.is_empty() { "none".to_owned() } else { last }),
        ]);
    }

    fn messages_of(&self, task: &LightsTask) -> Vec<MessageIndex> {
        let mut messages: Vec<_> =
            task.signals.iter().map(|signal| self.binding.table.signals[signal.0].message).collect();
        messages.sort_unstable();
        messages.dedup();
        messages
    }

    fn frames(&self, task: &LightsTask) -> u64 {
        self.messages_of(task).iter().map(|message| self.observations.counts(*message).frames).sum()
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
        UnavailableReason::Absent(signal, reason) => {
            missing_reason_text(&binding.table, buses, signal, reason)
        }
        UnavailableReason::NotAvailable(signal, raw) => {
            format!("{} = {} means not available", name(signal), raw_text(raw))
        }
        UnavailableReason::Undefined(signal, raw) => {
            format!("{} = {} is not a defined value", name(signal), raw_text(raw))
        }
        UnavailableReason::BothOn(sides) => {
            let [left, right] = sides.map(|(signal, raw)| format!("{} = {}", name(signal), raw_text(raw)));
            format!("{left} and {right} at once is not defined")
        }
        UnavailableReason::Fault(signal, raw) => {
            format!("{} = {} means fault", name(signal), raw_text(raw))
        }
        UnavailableReason::WatchingLamps([left, right]) => {
            format!("observing the lamps {} and {}", name(left), name(right))
        }
        UnavailableReason::Settling(signal) => {
            format!("observing {}, which may have been pressed before", name(signal))
        }
    }
}
