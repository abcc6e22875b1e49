//! The reports: the published value of each with its state, and the steps of its validation.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Serialize;

use super::flows;
use super::signals::{integrity_text, message_of};
use super::value::{Value, age_text};
use crate::process_status::snapshot::Snapshot;
use can_signal::can::{BusSnapshot, LinkState};
use can_signal::validation::snapshot::{MessageSnapshot, SignalSnapshot, UsedBy};
use gateway_base::diagnostics::Level;
use gateway_base::names::{state_word, words};
use gateway_core::command::snapshot::{CommandSnapshot, FunctionSnapshot};
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_report::{LastFailure, ReportSnapshot};
use gateway_core::vehicle_status::doors::DoorState;
use gateway_core::vehicle_status::{DoorSnapshot, StatusReport};
use turn_signal::flow::snapshot::DecisionSnapshot;

/// A report, with the way to it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ReportView {
    /// Its key in the snapshot, there in `vehicle_status` if it is not a report on lights.
    pub key: &'static str,
    /// Its name for a narrow column.
    pub name: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// The kind of value that is published.
    pub mark: Mark,
    /// Whether it is published, or why not, in words.
    pub state: String,
    /// What is requested of the vehicle; `None` where nothing can request it.
    pub commanded: Option<Value>,
    /// The value that is published, in words, or `withheld`; its source below it. It has the level of its
    /// diagnostic status.
    pub reported: Value,
    /// The measured values that are published.
    pub measures: Vec<MeasureView>,
    /// Age of the published value, or for how long the report has failed; empty where neither is known.
    pub age: String,
    /// Message of its diagnostic status, which begins with the words of `state`; empty if nothing is wrong.
    pub message: String,
    /// What to do; empty if nothing is to be done.
    pub remedy: String,
    /// The steps from the wire to the report; the one that failed is the reason.
    pub steps: Vec<Step>,
    /// Its failures since start, as a sentence.
    pub failures: String,
    /// Number of its failures since start.
    pub failure_count: u64,
    /// The last failure; `None` before the first.
    pub last_failure: Option<LastFailure>,
}

/// A measured value.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MeasureView {
    /// Its name.
    pub name: &'static str,
    /// Its unit, with the space before it, if any.
    pub unit: &'static str,
    /// The value in this unit.
    pub value: f64,
}

/// A door of the vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct DoorView {
    /// Its name in the profile.
    pub name: String,
    /// Its state, in words.
    pub state: String,
    /// True unless it is closed; `None` while that is not known.
    pub is_open: Option<bool>,
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

/// The statuses that Autoware needs of a vehicle, and the doors: key, name and title.
const REPORTS: [(&str, &str, &str); 7] = [
    ("velocity", "velocity", "Velocity"),
    ("steering", "steering", "Steering"),
    ("gear", "gear", "Gear"),
    ("control_mode", "mode", "Control mode"),
    (TURN, "turn", "Turn indicators"),
    (HAZARD, "hazard", "Hazard lights"),
    (DOORS, "doors", "Doors"),
];
/// Key of the report on turn indicators.
pub const TURN: &str = "turn_indicators";
/// Key of the report on hazard lights.
pub const HAZARD: &str = "hazard_lights";
/// Key of the report on doors, which Autoware does not need.
pub const DOORS: &str = "doors";

impl ReportView {
    /// Returns true for turn indicators and hazard lights.
    pub fn is_of_lights(&self) -> bool {
        [TURN, HAZARD].contains(&self.key)
    }
}

/// Returns the place and the title of a report by the key of its status; `None` for other statuses.
pub fn report_place(key: &str) -> Option<(usize, &'static str)> {
    let mut reports = REPORTS.iter().enumerate();
    reports.find(|(_, (known, ..))| *known == key).map(|(place, (.., title))| (place, *title))
}

/// Returns the reports that the profile describes.
pub(super) fn reports(snapshot: &Snapshot) -> Vec<ReportView> {
    let mut reports: Vec<_> = status_reports(snapshot).chain(light_reports(snapshot)).collect();
    reports.sort_by_key(|report| REPORTS.iter().position(|(key, ..)| *key == report.key));
    reports
}

/// Returns the titles of the statuses that Autoware needs and that are not among these reports.
pub(super) fn absent(reports: &[ReportView]) -> Vec<&'static str> {
    let is_absent = |key: &str| key != DOORS && reports.iter().all(|report| report.key != key);
    REPORTS.iter().filter(|(key, ..)| is_absent(key)).map(|(.., title)| *title).collect()
}

/// Returns the doors; none while their report is not published.
pub(super) fn doors(snapshot: &Snapshot) -> Vec<DoorView> {
    let doors = snapshot.vehicle_status.doors.as_ref().and_then(|report| report.published.as_ref());
    let door = |DoorSnapshot { name, state }: &DoorSnapshot| DoorView {
        name: name.clone(),
        state: state_word(state),
        is_open: match state {
            DoorState::Unknown | DoorState::NotAvailable => None,
            DoorState::Opened | DoorState::Opening | DoorState::Closing => Some(true),
            DoorState::Closed => Some(false),
        },
    };
    doors.into_iter().flatten().map(door).collect()
}

fn light_reports(snapshot: &Snapshot) -> impl Iterator<Item = ReportView> {
    let turn = snapshot.turn_indicators.as_ref().map(|report| {
        let report = report.map(|value| {
            let mark = match value {
                TurnIndicators::Disable => Mark::Off,
                TurnIndicators::EnableLeft => Mark::Left,
                TurnIndicators::EnableRight => Mark::Right,
            };
            (state_word(value), mark)
        });
        let view = report_view(TURN, UsedBy::VehicleLights, snapshot, &report);
        let commanded = commanded(snapshot, |of| &of.turn_indicators, |decision| state_word(&decision.turn));
        ReportView { commanded, ..view }
    });
    let hazard = snapshot.hazard_lights.as_ref().map(|report| {
        let report = report.map(|value| {
            let mark = if *value == HazardLights::Enable { Mark::Hazard } else { Mark::Off };
            (state_word(value), mark)
        });
        let view = report_view(HAZARD, UsedBy::VehicleLights, snapshot, &report);
        let commanded = commanded(snapshot, |of| &of.hazard_lights, |decision| state_word(&decision.hazard));
        ReportView { commanded, ..view }
    });
    turn.into_iter().chain(hazard)
}

fn status_reports(snapshot: &Snapshot) -> impl Iterator<Item = ReportView> {
    let measures = snapshot.vehicle_status.measures();
    snapshot.vehicle_status.reports().into_iter().map(move |(of, report)| {
        let mark = match of {
            StatusReport::Velocity | StatusReport::Steering => Mark::Measured,
            StatusReport::Gear | StatusReport::ControlMode | StatusReport::Doors => Mark::Named,
        };
        let report = report.map(|text| (text.clone(), mark));
        let measures = measures.iter().filter(|(measure, _)| measure.report() == of);
        let measures = measures.map(|(measure, value)| {
            let row = measure.row();
            MeasureView { name: row.name, unit: row.unit, value: measure.shown(*value) }
        });
        let view = report_view(of.name(), UsedBy::VehicleStatus, snapshot, &report);
        ReportView { measures: measures.collect(), ..view }
    })
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
pub fn caption(marks: &[Mark]) -> &'static str {
    let texts = [
        (Mark::Hazard, "hazard lights on"),
        (Mark::Left, "turning left"),
        (Mark::Right, "turning right"),
        (Mark::Withheld, "not published"),
        (Mark::Off, "lights off"),
    ];
    texts.iter().find(|(mark, _)| marks.contains(mark)).map_or("", |(_, text)| text)
}

/// Returns the request to the vehicle, or the decision if nothing is requested. `None` without either.
fn commanded(
    snapshot: &Snapshot,
    function: impl Fn(&CommandSnapshot) -> &FunctionSnapshot,
    decided: impl Fn(&DecisionSnapshot) -> String,
) -> Option<Value> {
    if let Some(commands) = &snapshot.commands {
        return Some(flows::commanded(function(commands)));
    }
    let decider = snapshot.decider.as_ref()?;
    let decided = decided(decider.decision.as_ref()?);
    Some(Value { lines: vec![format!("decider, {}", decider.role)], ..Value::new(None, decided) })
}

/// Returns a report without measured values and command.
fn report_view(
    key: &'static str,
    used_by: UsedBy,
    snapshot: &Snapshot,
    report: &ReportSnapshot<(String, Mark)>,
) -> ReportView {
    let (_, name, title) = REPORTS.into_iter().find(|(known, ..)| *known == key).unwrap_or_default();
    let source = report.source.as_ref().map(|source| format!("from {source}"));
    let failures = report.failures;
    let last = report.last_failure.as_ref();
    let last_text = last.map_or_else(String::new, |last| {
        format!("; the last {} ago: {}", age_text(last.age_ms / 1000 * 1000), last.text)
    });
    let is_own =
        |signal: &&SignalSnapshot| signal.used_by == used_by && report.signals.contains(&signal.name);
    let signals: Vec<_> = snapshot.signals.iter().filter(is_own).collect();
    let (text, mark) = report.published.clone().unwrap_or(("withheld".to_owned(), Mark::Withheld));
    let is_good = report.level == Level::Ok && report.published.is_some();
    let age = match report.stamp_ns {
        Some(stamp_ns) => {
            let age_ms = snapshot.stamp_ns.saturating_sub(stamp_ns) / 1_000_000;
            Some(format!("{} old", age_text(u64::try_from(age_ms).unwrap_or_default())))
        }
        None => report.failure.and(last).map(|last| format!("for {}", age_text(last.age_ms))),
    };
    ReportView {
        key,
        name,
        title,
        mark,
        state: words(&report.state),
        reported: Value {
            level: Some(report.level),
            text,
            lines: source.into_iter().chain(report.reason.clone()).collect(),
        },
        age: age.unwrap_or_default(),
        message: if is_good { String::new() } else { report.message.clone() },
        remedy: snapshot.remedy(key).unwrap_or_default().to_owned(),
        steps: steps(snapshot, &signals, report),
        failures: format!(
            "Failures since start: {} unknown, {} invalid, {} hardware fault{last_text}",
            failures.unknown, failures.invalid, failures.hardware_fault,
        ),
        failure_count: failures.unknown + failures.invalid + failures.hardware_fault,
        last_failure: report.last_failure.clone(),
        ..ReportView::default()
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
    let of = |name: &str, text: String| format!("{name}: {text}");
    let check = |message: &MessageSnapshot| {
        let integrity = message.integrity.as_ref();
        let is_trusted = integrity.and_then(|integrity| integrity.is_trusted);
        (is_trusted, of(&message.name, or(integrity.map(integrity_text), "no checksum or counter")))
    };
    let age = |signal: &&SignalSnapshot| {
        let (age, limit) = (signal.age_ms, signal.timeout_ms);
        let is_recent = age.is_some_and(|age| limit.is_none_or(|limit| age <= limit));
        let limit = limit.map_or_else(String::new, |limit| format!(" of {}", age_text(limit)));
        (Some(is_recent), of(&signal.name, or(age.map(|age| age_text(age) + &limit), "no value")))
    };
    let value = |signal: &&SignalSnapshot| {
        let raw =
            signal.raw.filter(|_| !signal.is_defined).map_or_else(String::new, |raw| format!("{raw}: "));
        let meanings = signal.raw.map(|_| raw + &signal.meanings.join(", "));
        (Some(signal.is_defined), of(&signal.name, or(meanings, "no value")))
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
