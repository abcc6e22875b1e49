//! The reports: commanded, published and received values of each, and the steps of their validation.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Serialize;

use super::flows;
use super::value::{Value, age_text};
use crate::process_status::snapshot::Snapshot;
use can_signal::can::{BusSnapshot, LinkState};
use can_signal::validation::snapshot::{IntegritySnapshot, MessageSnapshot, SignalSnapshot, UsedBy};
use gateway_base::diagnostics::Level;
use gateway_base::names::words;
use gateway_core::command::snapshot::{CommandSnapshot, FunctionSnapshot};
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_report::{LastFailure, ReportSnapshot};
use gateway_core::vehicle_status::StatusReport;
use turn_signal::flow::snapshot::DecisionSnapshot;

/// A report, with the way to it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct ReportView {
    /// Its key in the snapshot, there in `vehicle_status` if it is not a report on lights.
    pub key: &'static str,
    /// Its name for a narrow column.
    pub name: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// The kind of value that is published.
    pub mark: Mark,
    /// What is requested of the vehicle; `None` for what cannot be.
    pub commanded: Option<Value>,
    /// The value that is published, in the words of its message, or `withheld`.
    pub reported: Value,
    /// Message of its diagnostic status.
    pub message: String,
    /// What to do; empty if nothing is to be done.
    pub remedy: String,
    /// The signals on which it depends.
    pub raw: Vec<RawView>,
    /// The steps from the wire to the report; the one that failed is the reason.
    pub steps: Vec<Step>,
    /// Its failures since start, as a sentence.
    pub failures: String,
    /// Number of its failures since start.
    pub failure_count: u64,
    /// The last failure; `None` before the first.
    pub last_failure: Option<LastFailure>,
}

/// The kind of value that is published at one moment. Of several moments the greatest is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mark {
    /// There is no such report.
    #[default]
    Nothing,
    /// A number, which changes all the time.
    Measured,
    /// A name, such as a gear.
    Named,
    /// The lights are off.
    Off,
    /// Turn indicators on the right.
    Right,
    /// Turn indicators on the left.
    Left,
    /// The hazard lights are on.
    Hazard,
    /// The report is not published.
    Withheld,
}

/// A turn indicator of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Lamp {
    /// It is not known whether it flashes.
    #[default]
    Unknown,
    /// It does not flash.
    Off,
    /// Flashes; the view lets it blink.
    Flashing,
    /// Lit at this moment, which only a simulated vehicle knows.
    Lit,
}

/// A signal with its raw value.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct RawView {
    /// Name of the signal.
    pub name: String,
    /// The raw value in decimal, or `no value`.
    pub value: String,
    /// Its meaning; empty where there is none.
    pub meaning: String,
    /// Its age; empty while there is no value.
    pub age: String,
    /// Why it is not valid; `None` while it is.
    pub missing: Option<String>,
    /// The result of the integrity check of its message; `None` for a message without one.
    pub integrity: Option<String>,
}

/// A step on the way from the wire to a report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Step {
    /// Its name: `Link`, `Controller`, `Frames`, `Checks` of the message, `Age` and `Value` of the signals,
    /// `Report`.
    pub name: &'static str,
    /// Whether it is passed.
    pub outcome: Outcome,
    /// The state behind the outcome, in words.
    pub text: String,
}

/// The outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The step is passed.
    Passed,
    /// There is nothing to pass, as without a checksum.
    Absent,
    /// It fails for some of the signals, and the report is published without them.
    Partial,
    /// The way ends at this step.
    Failed,
    /// The way ended before this step.
    NotReached,
}

pub(super) fn light_reports(snapshot: &Snapshot) -> Vec<ReportView> {
    let turn = snapshot.turn_indicators.as_ref().map(|report| {
        let commanded = commanded(snapshot, |of| &of.turn_indicators, |decision| decision.turn.to_string());
        let report = report.map(|value| {
            let mark = match value {
                TurnIndicators::Disable => Mark::Off,
                TurnIndicators::EnableLeft => Mark::Left,
                TurnIndicators::EnableRight => Mark::Right,
            };
            (value.name().to_owned(), mark)
        });
        let view = report_view("turn_indicators", UsedBy::VehicleLights, snapshot, &report);
        ReportView { name: "turn", title: "Turn indicators", commanded: Some(commanded), ..view }
    });
    let hazard = snapshot.hazard_lights.as_ref().map(|report| {
        let commanded = commanded(snapshot, |of| &of.hazard_lights, |decision| decision.hazard.to_string());
        let report = report.map(|value| {
            let mark = if *value == HazardLights::Enable { Mark::Hazard } else { Mark::Off };
            (value.name().to_owned(), mark)
        });
        let view = report_view("hazard_lights", UsedBy::VehicleLights, snapshot, &report);
        ReportView { name: "hazard", title: "Hazard lights", commanded: Some(commanded), ..view }
    });
    turn.into_iter().chain(hazard).collect()
}

pub(super) fn status_reports(snapshot: &Snapshot) -> Vec<ReportView> {
    let reports = snapshot.vehicle_status.reports();
    let views = reports.iter().map(|(of, report)| {
        let mark = match of {
            StatusReport::Velocity | StatusReport::Steering => Mark::Measured,
            StatusReport::Gear | StatusReport::ControlMode | StatusReport::Doors => Mark::Named,
        };
        let report = report.map(|text| (text.clone(), mark));
        let view = report_view(of.name(), UsedBy::VehicleStatus, snapshot, &report);
        ReportView { name: of.title(), title: of.title(), ..view }
    });
    views.collect()
}

pub(super) fn lamp(side: Mark, marks: &[Mark]) -> Lamp {
    if marks.contains(&Mark::Hazard) || marks.contains(&side) {
        Lamp::Flashing
    } else if marks.contains(&Mark::Withheld) || marks.is_empty() {
        Lamp::Unknown
    } else {
        Lamp::Off
    }
}

/// Describes the published state of the lights; empty without a report on them.
pub(super) fn caption(marks: &[Mark]) -> &'static str {
    let texts = [
        (Mark::Hazard, "hazard lights on"),
        (Mark::Left, "turning left"),
        (Mark::Right, "turning right"),
        (Mark::Withheld, "not published"),
        (Mark::Off, "lights off"),
    ];
    texts.iter().find(|(mark, _)| marks.contains(mark)).map_or("", |(_, text)| text)
}

/// Returns the request to the vehicle. Without commands there is none, regardless of the decider's decision.
fn commanded(
    snapshot: &Snapshot,
    function: impl Fn(&CommandSnapshot) -> &FunctionSnapshot,
    decided: impl Fn(&DecisionSnapshot) -> String,
) -> Value {
    if let Some(commands) = &snapshot.commands {
        return flows::commanded(function(commands));
    }
    let decider = snapshot.decider.as_ref();
    let line = decider.and_then(|decider| {
        Some(format!("decider, {}: {}", decider.role, decided(decider.decision.as_ref()?)))
    });
    let line = line.unwrap_or_else(|| "no commands are configured".to_owned());
    Value { lines: vec![line], ..Value::new(None, "–") }
}

/// Returns a report without its headings and without the command.
fn report_view(
    key: &'static str,
    used_by: UsedBy,
    snapshot: &Snapshot,
    report: &ReportSnapshot<(String, Mark)>,
) -> ReportView {
    let source = report.source.as_ref().map(|source| format!("from {source}"));
    let failures = report.failures;
    let last = report.last_failure.as_ref().map_or_else(String::new, |last| {
        format!("; the last {} ago: {}", age_text(last.age_ms / 1000 * 1000), last.text)
    });
    let is_own =
        |signal: &&SignalSnapshot| signal.used_by == used_by && report.signals.contains(&signal.name);
    let signals: Vec<_> = snapshot.signals.iter().filter(is_own).collect();
    let (level, text, mark) = match &report.published {
        Some((text, mark)) => (report.level, text.as_str(), *mark),
        None => (report.level, "withheld", Mark::Withheld),
    };
    ReportView {
        key,
        mark,
        reported: Value {
            level: Some(level),
            text: text.to_owned(),
            lines: source.into_iter().chain(report.reason.clone()).collect(),
        },
        message: report.message.clone(),
        remedy: snapshot.remedy(key).unwrap_or_default().to_owned(),
        raw: signals.iter().map(|signal| RawView::of(snapshot, signal)).collect(),
        steps: steps(snapshot, &signals, report),
        failures: format!(
            "Failures since start: {} unknown, {} invalid, {} hardware fault{last}",
            failures.unknown, failures.invalid, failures.hardware_fault,
        ),
        failure_count: failures.unknown + failures.invalid + failures.hardware_fault,
        last_failure: report.last_failure.clone(),
        ..ReportView::default()
    }
}

fn message_of<'a>(snapshot: &'a Snapshot, signal: &SignalSnapshot) -> Option<&'a MessageSnapshot> {
    snapshot.messages.iter().find(|message| {
        (&message.name, &message.bus, message.used_by) == (&signal.message, &signal.bus, signal.used_by)
    })
}

fn integrity_text(integrity: &IntegritySnapshot) -> String {
    match (integrity.is_trusted, integrity.last_reject) {
        (None, _) => "not checked yet".to_owned(),
        (Some(true), _) => "trusted".to_owned(),
        (Some(false), reject) => reject.map_or_else(|| "rejected".to_owned(), |reject| reject.to_string()),
    }
}

impl RawView {
    pub(super) fn of(snapshot: &Snapshot, signal: &SignalSnapshot) -> Self {
        let integrity = message_of(snapshot, signal).and_then(|message| message.integrity.as_ref());
        Self {
            name: signal.name.clone(),
            value: signal.raw.map_or_else(|| "no value".to_owned(), |raw| raw.to_string()),
            meaning: signal.raw.map_or_else(String::new, |_| signal.meanings.join(", ")),
            age: signal.age_ms.map_or_else(String::new, age_text),
            missing: signal.missing.as_ref().map(|missing| missing.text.clone()),
            integrity: integrity.map(|integrity| match integrity.rejected {
                0 => integrity_text(integrity),
                rejected => format!("{} ({rejected} rejected)", integrity_text(integrity)),
            }),
        }
    }

    /// Returns the value, its meaning and its age in a line: `1 turn left, 12 ms`.
    pub fn text(&self) -> String {
        let value = [self.value.as_str(), &self.meaning].join(" ");
        let age = if self.age.is_empty() { String::new() } else { format!(", {}", self.age) };
        format!("{}{age}", value.trim_end())
    }
}

/// Returns the steps to a report; none without signals.
fn steps(
    snapshot: &Snapshot,
    signals: &[&SignalSnapshot],
    report: &ReportSnapshot<(String, Mark)>,
) -> Vec<Step> {
    if signals.is_empty() {
        return Vec::new();
    }
    let is_published = report.published.is_some();
    let mut answers = answers(snapshot, signals);
    // A defined value can mean that there is no value.
    let is_explained =
        answers.iter().any(|(_, answers)| answers.iter().any(|(passed, _)| *passed == Some(false)));
    if let Some((_, values)) = answers.last_mut().filter(|_| !is_published && !is_explained) {
        values.push((Some(false), "nothing to report".to_owned()));
    }
    let text = match &report.published {
        Some((value, _)) => format!("published: {value}"),
        None => format!("withheld: {}", report.message),
    };
    let mut is_broken = false;
    let step = |(name, answers): (&'static str, Vec<Answer>)| {
        let passed = answers.iter().filter_map(|(passed, _)| *passed).reduce(|one, other| one && other);
        let outcome = match passed {
            _ if is_broken => Outcome::NotReached,
            None => Outcome::Absent,
            Some(true) => Outcome::Passed,
            Some(false) if is_published => Outcome::Partial,
            Some(false) => Outcome::Failed,
        };
        is_broken |= outcome == Outcome::Failed;
        let mut texts: Vec<_> = answers.into_iter().map(|(_, text)| text).collect();
        texts.dedup();
        Step { name, outcome, text: texts.join("; ") }
    };
    answers.into_iter().chain([("Report", vec![(Some(is_published), text)])]).map(step).collect()
}

/// Whether a step is passed (`None` if it does not apply), and the underlying state in words.
type Answer = (Option<bool>, String);

/// Returns the answers of the buses, messages and signals for each step except the last.
fn answers(snapshot: &Snapshot, signals: &[&SignalSnapshot]) -> Vec<(&'static str, Vec<Answer>)> {
    let carries = |bus: &str| signals.iter().any(|signal| signal.bus == bus);
    let buses = || snapshot.buses.iter().filter(|bus| carries(&bus.name));
    let or = |text: Option<String>, other: &str| text.unwrap_or_else(|| other.to_owned());
    let link = |bus: &BusSnapshot| {
        (Some(bus.link == LinkState::Up), format!("{} {}", bus.interface, words(&bus.link)))
    };
    let controller = |bus: &BusSnapshot| {
        let controller = bus.controller.as_ref();
        let is_working = controller.map(|controller| controller.state.level() < Level::Error);
        (is_working, or(controller.map(|controller| controller.report().to_string()), "not reported"))
    };
    let frames = |bus: &BusSnapshot| {
        (Some(bus.is_receiving()), or(bus.reception.map(|reception| words(&reception)), "no link"))
    };
    let mut names = BTreeSet::new();
    let messages = signals.iter().filter_map(|signal| message_of(snapshot, signal));
    let messages = messages.filter(|message| names.insert((&message.name, &message.bus)));
    let check = |message: &MessageSnapshot| {
        let integrity = message.integrity.as_ref();
        let is_trusted = integrity.and_then(|integrity| integrity.is_trusted);
        (is_trusted, or(integrity.map(integrity_text), "no checksum or counter"))
    };
    let age = |signal: &&SignalSnapshot| {
        let (age, limit) = (signal.age_ms, signal.timeout_ms);
        let is_recent = age.is_some_and(|age| limit.is_none_or(|limit| age <= limit));
        let limit = limit.map_or_else(String::new, |limit| format!(" of {}", age_text(limit)));
        (Some(is_recent), or(age.map(|age| age_text(age) + &limit), "no value"))
    };
    let value = |signal: &&SignalSnapshot| {
        let raw =
            signal.raw.filter(|_| !signal.is_defined).map_or_else(String::new, |raw| format!("{raw}: "));
        let meanings = signal.raw.map(|_| raw + &signal.meanings.join(", "));
        (Some(signal.is_defined), or(meanings, "no value"))
    };
    vec![
        ("Link", buses().map(link).collect()),
        ("Controller", buses().map(controller).collect()),
        ("Frames", buses().map(frames).collect()),
        ("Checks", messages.map(check).collect()),
        ("Age", signals.iter().map(age).collect()),
        ("Value", signals.iter().map(value).collect()),
    ]
}
