//! How a snapshot is shown: the level, the words and the sentences of each thing, which the page's feed
//! carries, and of which terminal and status text are made.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Serialize;

use super::counts::{self, Count};
use crate::process_status::snapshot::Snapshot;
use can_signal::can::{BusReception, BusSnapshot, LinkState};
use can_signal::validation::snapshot::{IntegritySnapshot, MessageSnapshot, SignalSnapshot, UsedBy};
use gateway_base::diagnostics::Level;
use gateway_base::names::words;
use gateway_core::command::snapshot::FunctionSnapshot;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_report::ReportSnapshot;
use turn_signal::flow::snapshot::{CandidateSnapshot, DeciderSnapshot, DecisionSnapshot};
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::resolve::CandidateOutcome;

/// An event of the live page: the snapshot, and how it is shown.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Feed<'a> {
    #[serde(flatten)]
    snapshot: &'a Snapshot,
    view: LiveView,
}

impl<'a> Feed<'a> {
    /// Creates the event of a snapshot.
    pub fn new(snapshot: &'a Snapshot) -> Self {
        Self { snapshot, view: LiveView::of(snapshot) }
    }
}

/// How a snapshot is shown.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LiveView {
    /// Turn indicators and hazard lights, as far as the profile has them.
    pub reports: Vec<ReportView>,
    /// Velocity, steering, gear, control mode and doors, as far as the profile has them.
    pub vehicle_status: Vec<ReportView>,
    /// The buses, in the order of the vehicle profile.
    pub buses: Vec<BusView>,
    /// The decider's decision; `None` before the first.
    pub decision: Option<DecisionView>,
}

/// A value with a heading, and the lines below it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Tile {
    /// How bad it is; `None` where there is nothing to judge.
    pub level: Option<Level>,
    /// The value in a word.
    pub value: String,
    /// The lines below it.
    pub lines: Vec<String>,
}

/// A step on the way from the wire to a report, or another word, with its level.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Badge {
    /// How bad it is; `None` where there is nothing to judge.
    pub level: Option<Level>,
    /// The word that is shown.
    pub name: String,
    /// What explains it; empty where the word is enough.
    pub text: String,
}

/// A report, with the way to it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ReportView {
    /// Its key in the snapshot, there in `vehicle_status` if it is no report on lights.
    pub key: &'static str,
    /// Its heading.
    pub title: &'static str,
    /// What is requested of the vehicle; `None` for what cannot be.
    pub commanded: Option<Tile>,
    /// The value that is published, if any.
    pub reported: Tile,
    /// The signals on which it depends.
    pub raw: Vec<RawView>,
    /// The steps from the wire to the report; the first that fails is the reason.
    pub steps: Vec<Badge>,
    /// Its failures since start, as a sentence.
    pub failures: String,
}

/// The raw value of a signal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct RawView {
    /// Name of the signal.
    pub name: String,
    /// The raw value in decimal.
    pub value: String,
    /// Its meaning; empty while there is no value.
    pub meaning: String,
    /// Its age; empty while there is no value.
    pub age: String,
    /// Why it is not valid; `None` while it is.
    pub missing: Option<String>,
}

/// A bus, in the words of the page.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct BusView {
    /// Name in the vehicle profile.
    pub name: String,
    /// The worst level of link, controller and reception.
    pub level: Level,
    /// Its state in a few words: the first of link, controller and reception that is not good.
    pub state: String,
    /// Link, controller and reception.
    pub badges: Vec<Badge>,
    /// How long nothing has been received; `None` while something is.
    pub silence: Option<String>,
    /// What is counted of it since start.
    pub counts: Vec<CountView>,
}

/// A count since start.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct CountView {
    /// The name of what is counted.
    pub label: &'static str,
    /// The number of times it happened.
    pub count: u64,
}

/// A decision of the decider.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DecisionView {
    /// The turn command in words.
    pub turn: String,
    /// Basis, winner, rule, minimum duration and hazard lights.
    pub reason: String,
    /// The candidates, each with its outcome.
    pub candidates: Vec<CandidateView>,
    /// Manoeuvres and findings, a sentence each.
    pub remarks: Vec<String>,
}

/// A candidate of a decision.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CandidateView {
    /// What it is about.
    pub subject: String,
    /// Command that it requests, in words.
    pub turn: String,
    /// What became of it.
    pub outcome: String,
    /// True for the one that is signalled.
    pub has_won: bool,
    /// Distances to its desired start, desired end, required start and required end, m; `None` without a
    /// record.
    pub distances_m: Option<[f64; 4]>,
}

impl LiveView {
    /// Returns how a snapshot is shown.
    pub fn of(snapshot: &Snapshot) -> Self {
        let commands = snapshot.commands.as_ref();
        let decision = snapshot.decider.as_ref().and_then(|decider| decider.decision.as_ref());
        let turn = snapshot.turn_indicators.as_ref().map(|report| {
            let function = commands.map(|commands| &commands.turn_indicators);
            let decided = decision.map(|decision| turn_words(decision.turn));
            let commanded = commanded(snapshot, function, decided);
            let named = ("turn_indicators", "Turn indicators", UsedBy::VehicleLights);
            report_view(named, snapshot, report, report.published.map(reported_turn), Some(commanded))
        });
        let hazard = snapshot.hazard_lights.as_ref().map(|report| {
            let function = commands.map(|commands| &commands.hazard_lights);
            let decided = decision.map(|decision| hazard_words(decision.hazard));
            let commanded = commanded(snapshot, function, decided);
            let named = ("hazard_lights", "Hazard lights", UsedBy::VehicleLights);
            report_view(named, snapshot, report, report.published.map(reported_hazard), Some(commanded))
        });
        let status = snapshot.vehicle_status.reports().into_iter().map(|(of, report)| {
            let named = (of.name(), of.title(), UsedBy::VehicleStatus);
            report_view(named, snapshot, &report, report.published.as_deref(), None)
        });
        Self {
            reports: turn.into_iter().chain(hazard).collect(),
            vehicle_status: status.collect(),
            buses: snapshot.buses.iter().map(bus_view).collect(),
            decision: decision.map(decision_view),
        }
    }
}

fn reported_turn(value: TurnIndicators) -> &'static str {
    match value {
        TurnIndicators::Disable => "off",
        TurnIndicators::EnableLeft => "left",
        TurnIndicators::EnableRight => "right",
    }
}

fn reported_hazard(value: HazardLights) -> &'static str {
    match value {
        HazardLights::Disable => "off",
        HazardLights::Enable => "on",
    }
}

fn turn_words(command: TurnCommand) -> &'static str {
    match command {
        TurnCommand::NoCommand => "no command",
        TurnCommand::Disable => "off",
        TurnCommand::Left => "left",
        TurnCommand::Right => "right",
    }
}

fn hazard_words(command: HazardCommand) -> &'static str {
    match command {
        HazardCommand::NoCommand => "no command",
        HazardCommand::Disable => "off",
        HazardCommand::Enable => "on",
    }
}

/// Time in its largest unit, or its two largest from a minute on.
#[allow(clippy::cast_precision_loss)] // far from the limits
pub fn age_text(ms: u64) -> String {
    let seconds = ms / 1000;
    match (seconds / 3600, seconds / 60 % 60) {
        _ if ms < 1000 => format!("{ms} ms"),
        (0, 0) => format!("{:.1} s", ms as f64 / 1000.0),
        (0, minutes) => format!("{minutes} min {} s", seconds % 60),
        (hours, minutes) => format!("{hours} h {minutes} min"),
    }
}

fn commanded(snapshot: &Snapshot, function: Option<&FunctionSnapshot>, decided: Option<&str>) -> Tile {
    let Some(function) = function else {
        let role = snapshot.decider.as_ref().map(|decider| format!("decider, {}", decider.role));
        let (value, line) = match (decided, role) {
            (Some(decided), Some(role)) => (decided, role),
            _ => ("–", "no commands are configured".to_owned()),
        };
        return Tile { level: None, value: value.to_owned(), lines: vec![line] };
    };
    let requested = function
        .requested
        .map_or_else(|| "vehicle left alone".to_owned(), |requested| format!("requested: {requested}"));
    let reason = format!("{}: {}", words(&function.compliance), function.reason.text());
    let age = function.command_age_ms.map(|age| format!("received {} ago", age_text(age)));
    Tile {
        level: Some(function.level),
        value: words(&function.command),
        lines: [requested, reason].into_iter().chain(age).collect(),
    }
}

/// Signals of a report.
pub fn signals_of<'a, T>(
    snapshot: &'a Snapshot,
    report: &'a ReportSnapshot<T>,
    used_by: UsedBy,
) -> impl Iterator<Item = &'a SignalSnapshot> {
    let of_flow = move |signal: &&SignalSnapshot| signal.used_by == used_by;
    snapshot.signals.iter().filter(of_flow).filter(|signal| report.signals.contains(&signal.name))
}

/// The message that carries a signal.
pub fn message_of<'a>(snapshot: &'a Snapshot, signal: &SignalSnapshot) -> Option<&'a MessageSnapshot> {
    snapshot.messages.iter().find(|message| {
        (&message.name, &message.bus, message.used_by) == (&signal.message, &signal.bus, signal.used_by)
    })
}

/// What the integrity check says of the last frame.
pub fn integrity_text(integrity: &IntegritySnapshot) -> String {
    match (integrity.is_trusted, integrity.last_reject) {
        (None, _) => "not checked yet".to_owned(),
        (Some(true), _) => "trusted".to_owned(),
        (Some(false), reject) => reject.map_or_else(|| "rejected".to_owned(), |reject| reject.to_string()),
    }
}

fn report_view<T>(
    (key, title, used_by): (&'static str, &'static str, UsedBy),
    snapshot: &Snapshot,
    report: &ReportSnapshot<T>,
    published: Option<&str>,
    commanded: Option<Tile>,
) -> ReportView {
    let source = report.source.as_ref().map(|source| format!("by {source}"));
    let lines = [Some(report.message.clone()), report.reason.clone(), source].into_iter().flatten().collect();
    let reported = Tile {
        level: Some(if published.is_none() { Level::Error } else { report.level }),
        value: published.unwrap_or("withheld").to_owned(),
        lines,
    };
    let failures = report.failures;
    let last = report
        .last_failure
        .as_ref()
        .map(|last| format!("; the last {} ago: {}", age_text(last.age_ms / 1000 * 1000), last.text));
    let signals: Vec<_> = signals_of(snapshot, report, used_by).collect();
    ReportView {
        key,
        title,
        commanded,
        reported,
        raw: signals.iter().map(|signal| raw_view(signal)).collect(),
        steps: steps(
            snapshot,
            &signals,
            published.map(|value| format!("published: {value}")),
            &report.message,
        ),
        failures: format!(
            "Failures since start: {} unknown, {} invalid, {} hardware fault{}",
            failures.unknown,
            failures.invalid,
            failures.hardware_fault,
            last.unwrap_or_default()
        ),
    }
}

fn raw_view(signal: &SignalSnapshot) -> RawView {
    let meaning = signal.raw.map_or_else(String::new, |_| signal.meanings.join(", "));
    RawView {
        name: signal.name.clone(),
        value: signal.raw.map_or_else(|| "no value".to_owned(), |raw| raw.to_string()),
        meaning,
        age: signal.age_ms.map_or_else(String::new, |age| format!("{} old", age_text(age))),
        missing: signal.missing.as_ref().map(|missing| missing.text.clone()),
    }
}

/// An error if one of them is bad; `None` without any.
fn all<T>(items: impl IntoIterator<Item = T>, is_good: impl Fn(T) -> bool) -> Option<Level> {
    items.into_iter().map(|item| if is_good(item) { Level::Ok } else { Level::Error }).max()
}

fn steps(
    snapshot: &Snapshot,
    signals: &[&SignalSnapshot],
    published: Option<String>,
    message: &str,
) -> Vec<Badge> {
    let buses: Vec<_> =
        snapshot.buses.iter().filter(|bus| signals.iter().any(|signal| signal.bus == bus.name)).collect();
    let mut messages: Vec<_> = signals.iter().filter_map(|signal| message_of(snapshot, signal)).collect();
    let mut seen = BTreeSet::new();
    messages.retain(|message| seen.insert((&message.name, &message.bus)));
    let checks: Vec<_> = messages.iter().filter_map(|message| message.integrity.as_ref()).collect();
    let with_age: Vec<_> =
        signals.iter().filter_map(|signal| Some((signal.age_ms?, signal.timeout_ms))).collect();
    let values: Vec<_> = signals.iter().filter(|signal| signal.raw.is_some()).collect();
    let or = |texts: Vec<String>, other: &str| if texts.is_empty() { vec![other.to_owned()] } else { texts };
    let required = |level: Option<Level>| level.or(Some(Level::Error));
    let controllers = buses.iter().filter_map(|bus| bus.controller.as_ref());
    let age = |(age, limit): &(u64, Option<u64>)| {
        age_text(*age) + &limit.map_or_else(String::new, |limit| format!(" of {}", age_text(limit)))
    };
    let meaning = |signal: &&&SignalSnapshot| {
        let raw =
            signal.raw.filter(|_| !signal.is_defined).map_or_else(String::new, |raw| format!("{raw}: "));
        raw + &signal.meanings.join(", ")
    };
    let mut steps = vec![
        (
            all(&buses, |bus| bus.link == LinkState::Up),
            "Link",
            buses.iter().map(|bus| format!("{} {}", bus.interface, words(&bus.link))).collect(),
        ),
        (
            all(controllers.clone(), |controller| controller.state.level() < Level::Error),
            "Controller",
            or(controllers.map(|controller| controller.report().to_string()).collect(), "not reported"),
        ),
        (
            all(&buses, |bus| bus.is_receiving()),
            "Frames",
            buses.iter().map(|bus| reception_text(bus.reception)).collect(),
        ),
        (
            all(checks.iter().filter_map(|check| check.is_trusted), |is_trusted| is_trusted),
            "Integrity",
            or(checks.iter().map(|check| integrity_text(check)).collect(), "no checksum or counter"),
        ),
        (
            required(all(&with_age, |(age, limit)| limit.is_none_or(|limit| *age <= limit))),
            "Age",
            or(with_age.iter().map(age).collect(), "no value"),
        ),
        (
            required(all(&values, |signal| signal.is_defined)),
            "Meaning",
            or(values.iter().map(meaning).collect(), "no value"),
        ),
    ];
    // A value can be defined and say that there is none.
    if published.is_none() && steps.iter().all(|(level, ..)| *level != Some(Level::Error)) {
        steps[5].0 = Some(Level::Warn);
    }
    let level = Some(if published.is_some() { Level::Ok } else { Level::Error });
    steps.push((level, "Report", vec![published.unwrap_or_else(|| format!("withheld: {message}"))]));
    let badge = |(level, name, texts): (Option<Level>, &str, Vec<String>)| Badge {
        level,
        name: name.to_owned(),
        text: texts.join("; "),
    };
    steps.into_iter().map(badge).collect()
}

fn reception_text(reception: Option<BusReception>) -> String {
    reception.map_or_else(|| "no link".to_owned(), |reception| words(&reception))
}

fn bus_view(bus: &BusSnapshot) -> BusView {
    let states: Vec<_> = bus.states().collect();
    let state = states.iter().find(|(level, _)| *level > Level::Ok).or(states.last());
    let is_silent = bus.reception != Some(BusReception::Receiving);
    BusView {
        name: bus.name.clone(),
        level: bus.worst(),
        state: state.map_or_else(String::new, |(_, text)| text.clone()),
        badges: bus
            .details()
            .map(|(level, name)| Badge { level: Some(level), name, text: String::new() })
            .collect(),
        silence: bus.silence_ms.filter(|_| is_silent).map(age_text),
        counts: counts::BUS.iter().filter_map(|count| count_view(count, bus)).collect(),
    }
}

fn count_view<T>(row: &Count<T>, counted: &T) -> Option<CountView> {
    let count = (row.value)(counted);
    Some(CountView { label: row.label?, count }).filter(|_| count > 0 || !row.only_if_any)
}

fn decision_view(decision: &DecisionSnapshot) -> DecisionView {
    let reason = [
        Some(format!("basis: {}", words(&decision.basis))),
        decision.winner.map(|winner| format!("winner: {winner}")),
        decision.rule.map(|rule| format!("rule {rule}")),
        decision.held.map(|held| format!("held: {held}")),
        Some(format!("hazard lights: {}", hazard_words(decision.hazard))),
    ];
    let manoeuvres = decision.manoeuvres.iter().map(ToString::to_string);
    DecisionView {
        turn: turn_words(decision.turn).to_owned(),
        reason: reason.into_iter().flatten().collect::<Vec<_>>().join(" · "),
        candidates: decision.candidates.iter().map(candidate_view).collect(),
        remarks: manoeuvres.chain(decision.findings.iter().cloned()).collect(),
    }
}

fn candidate_view(candidate: &CandidateSnapshot) -> CandidateView {
    CandidateView {
        subject: candidate.subject.clone().unwrap_or_else(|| candidate.source.to_string()),
        turn: turn_words(candidate.turn).to_owned(),
        outcome: candidate.outcome.to_string(),
        has_won: candidate.outcome == CandidateOutcome::Won,
        distances_m: candidate.distances_m,
    }
}

/// The decision in a line, or why there is none.
pub fn decider_text(decider: &DeciderSnapshot) -> String {
    let Some(decision) = &decider.decision else { return decider.message.clone() };
    let won = decision.candidates.iter().find(|candidate| candidate.outcome == CandidateOutcome::Won);
    let subject =
        won.and_then(|won| won.subject.clone()).or(decision.winner.map(|winner| winner.to_string()));
    let subject = subject.map_or_else(String::new, |subject| format!(": {subject}"));
    let rule = decision.rule.map_or_else(String::new, |rule| format!(", rule {rule}"));
    let held = decision.held.map_or_else(String::new, |held| format!(", held: {held}"));
    format!("turn {}, hazard {}{subject}{rule}{held}", decision.turn, decision.hazard)
}
