//! The present state as the view shows it: of a gateway, or of a simulated vehicle.

use crate::core::can::snapshot::BusSnapshot;
use crate::core::diagnostics::Level;
use crate::core::gateway::snapshot::{ProcessSnapshot, Snapshot};
use crate::core::traffic_light::snapshot::TrafficLightsSnapshot;
use crate::core::turn_signal::flow::snapshot::DeciderSnapshot;
use crate::core::validation::snapshot::{MessageSnapshot, SignalSnapshot};
use crate::core::vehicle_lights::ReportSnapshot;
use crate::core::vehicle_lights::verdict::{HazardLights, TurnIndicators};

/// The stages between the bus and ROS, in the order in which trust is won.
pub const STAGES: [&str; 5] = ["link", "frame", "checks", "value", "published"];

/// One state of everything.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Picture {
    /// Time line of the strip, ms.
    pub stamp_ms: i64,
    /// The worst level; `None` where there are no levels.
    pub level: Option<Level>,
    /// The left and the right turn indicator of the car.
    pub lamps: [Lamp; 2],
    /// The lights in a word: `LEFT`, `not published`.
    pub headline: String,
    /// Titles of the three values of a function.
    pub titles: [&'static str; 3],
    /// Turn indicators, hazard lights.
    pub functions: Vec<Function>,
    /// Buses.
    pub buses: Vec<BusLine>,
    /// Further parts, by name: decider, traffic lights, ROS 2.
    pub more: Vec<(String, String)>,
}

/// A turn indicator of the car.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lamp {
    /// Nobody knows.
    #[default]
    Unknown,
    /// Not used.
    Off,
    /// Flashes; the view lets it blink.
    Flashing,
    /// Lit at this moment.
    Lit,
}

/// A function of the lights.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Function {
    /// `turn` or `hazard`.
    pub name: &'static str,
    /// What stands under the titles; `None` where there is nothing.
    pub values: [Option<String>; 3],
    /// For the strip.
    pub mark: Mark,
    /// The outcome of each of [`STAGES`]; empty where nothing is received.
    pub stages: Vec<Stage>,
    /// Level and message, where it is not simply published.
    pub reason: Option<(Level, String)>,
}

/// One moment of a function in the strip. A column of several moments shows the greatest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Mark {
    /// There is no such report.
    #[default]
    Nothing,
    /// Off.
    Off,
    /// Turn indicators on the right.
    Right,
    /// Turn indicators on the left.
    Left,
    /// Hazard lights.
    Hazard,
    /// Nothing is published.
    Withheld,
}

/// The outcome of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Passed.
    Passed,
    /// There is nothing to pass, as without a checksum.
    Absent,
    /// Failed here.
    Failed,
    /// Not reached.
    NotReached,
}

/// A bus in one line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BusLine {
    /// Name and interface.
    pub name: String,
    /// Link, reception and controller, where one of them is worth a word.
    pub state: String,
    /// True if it works.
    pub is_sound: bool,
    /// Frames a second.
    pub rate_hz: f64,
    /// Load in percent; `None` without a bit rate.
    pub load_percent: Option<f64>,
    /// Frames dropped since start.
    pub drops: u64,
}

impl Picture {
    /// The state of a gateway.
    pub fn of(snapshot: &Snapshot) -> Self {
        let (turn, hazard) = (snapshot.turn_indicators.as_ref(), snapshot.hazard_lights.as_ref());
        let commands = snapshot.commands.as_ref();
        let functions = [
            turn.map(|report| {
                let published = report.published.map(|value| (value.name(), turn_mark(value)));
                function("turn", snapshot, report, published)
                    .commanded(commands.and_then(|commands| commands.turn_indicators.requested.clone()))
            }),
            hazard.map(|report| {
                let published = report.published.map(|value| (value.name(), hazard_mark(value)));
                function("hazard", snapshot, report, published)
                    .commanded(commands.and_then(|commands| commands.hazard_lights.requested.clone()))
            }),
        ];
        let functions: Vec<_> = functions.into_iter().flatten().collect();
        let marks: Vec<_> = functions.iter().map(|function| function.mark).collect();
        Self {
            stamp_ms: snapshot.stamp_ns / 1_000_000,
            level: Some(snapshot.level),
            lamps: [Mark::Left, Mark::Right].map(|side| lamp(side, &marks)),
            headline: headline(&marks).to_owned(),
            titles: ["commanded", "reported", "raw"],
            functions,
            buses: snapshot.buses.iter().map(bus).collect(),
            more: more(snapshot),
        }
    }
}

impl Function {
    fn commanded(mut self, value: Option<String>) -> Self {
        self.values[0] = value;
        self
    }
}

fn turn_mark(value: TurnIndicators) -> Mark {
    match value {
        TurnIndicators::Disable => Mark::Off,
        TurnIndicators::EnableLeft => Mark::Left,
        TurnIndicators::EnableRight => Mark::Right,
    }
}

fn hazard_mark(value: HazardLights) -> Mark {
    match value {
        HazardLights::Disable => Mark::Off,
        HazardLights::Enable => Mark::Hazard,
    }
}

/// A lamp by what is published.
fn lamp(side: Mark, marks: &[Mark]) -> Lamp {
    if marks.contains(&Mark::Hazard) || marks.contains(&side) {
        Lamp::Flashing
    } else if marks.contains(&Mark::Withheld) || marks.is_empty() {
        Lamp::Unknown
    } else {
        Lamp::Off
    }
}

/// What is published, in a word.
fn headline(marks: &[Mark]) -> &'static str {
    let texts = [
        (Mark::Hazard, "HAZARD"),
        (Mark::Left, "LEFT"),
        (Mark::Right, "RIGHT"),
        (Mark::Withheld, "not published"),
        (Mark::Off, "off"),
    ];
    texts.iter().find(|(mark, _)| marks.contains(mark)).map_or("", |(_, text)| text)
}

fn function<T>(
    name: &'static str,
    snapshot: &Snapshot,
    report: &ReportSnapshot<T>,
    published: Option<(&'static str, Mark)>,
) -> Function {
    let is_of_report = |signal: &&SignalSnapshot| {
        signal.used_by == "vehicle_lights" && report.signals.contains(&signal.name)
    };
    let signals: Vec<_> = snapshot.signals.iter().filter(is_of_report).collect();
    let raw: Vec<_> = signals.iter().map(|signal| raw_text(signal)).collect();
    let value = published.map_or("withheld", |(value, _)| value);
    Function {
        name,
        values: [None, Some(value.to_owned()), (!raw.is_empty()).then(|| raw.join("  "))],
        mark: published.map_or(Mark::Withheld, |(_, mark)| mark),
        stages: stages(snapshot, &signals, published.is_some()),
        reason: (report.level != Level::Ok).then(|| (report.level, report.message.clone())),
    }
}

/// `12 ms`; from a second on `1.2 s`.
#[allow(clippy::cast_precision_loss)] // far from the limits
fn age_text(ms: u64) -> String {
    match ms {
        0..1_000 => format!("{ms} ms"),
        1_000..10_000 => format!("{:.1} s", ms as f64 / 1_000.0),
        _ => format!("{} s", ms / 1_000),
    }
}

/// `1 turn left, 12 ms`, with a question mark for a value that means nothing.
fn raw_text(signal: &SignalSnapshot) -> String {
    let Some(raw) = signal.raw else { return "none".to_owned() };
    let age = signal.age_ms.map_or_else(String::new, |age| format!(", {}", age_text(age)));
    match signal.meanings.as_slice() {
        [] => format!("{raw}{age}"),
        meanings => format!("{raw} {}{age}", meanings.join("/")),
    }
}

/// How far the signals of a report are trusted.
fn stages(snapshot: &Snapshot, signals: &[&SignalSnapshot], is_published: bool) -> Vec<Stage> {
    let buses: Vec<_> =
        snapshot.buses.iter().filter(|bus| signals.iter().any(|signal| signal.bus == bus.name)).collect();
    let integrity = |signal: &&SignalSnapshot| {
        let is_its = |message: &&MessageSnapshot| {
            (&message.name, &message.bus, &message.used_by) == (&signal.message, &signal.bus, &signal.used_by)
        };
        snapshot.messages.iter().find(is_its).and_then(|message| message.integrity.as_ref())
    };
    let checks: Vec<_> = signals.iter().filter_map(integrity).collect();
    let is_rejected = checks.iter().any(|check| check.is_trusted == Some(false));
    let is_linked = buses.iter().all(|bus| is_sound(bus));
    let has_frames =
        signals.iter().all(|signal| signal.raw.is_some() && (signal.missing.is_none() || is_rejected));
    let passed = [
        Some(is_linked),
        Some(has_frames || is_rejected),
        (!checks.is_empty()).then_some(!is_rejected),
        // What was published passed all of it; what was not failed at the value, when nothing before did.
        Some(is_published),
        Some(is_published),
    ];
    let mut is_broken = false;
    let stages = passed.map(|passed| match passed {
        _ if is_broken => Stage::NotReached,
        None => Stage::Absent,
        // A report may live on with one source of several.
        Some(true) => Stage::Passed,
        Some(false) if is_published => Stage::Absent,
        Some(false) => {
            is_broken = true;
            Stage::Failed
        }
    });
    if signals.is_empty() { Vec::new() } else { stages.to_vec() }
}

/// The state of a controller in which nothing is received.
const SILENT: [&str; 2] = ["bus-off", "stopped"];

fn is_sound(bus: &BusSnapshot) -> bool {
    let controller = bus.controller.as_ref().map_or("", |controller| controller.state.as_str());
    bus.link == "up" && !SILENT.contains(&controller)
}

fn bus(bus: &BusSnapshot) -> BusLine {
    let controller =
        bus.controller.as_ref().map(|controller| match controller.tx_errors.zip(controller.rx_errors) {
            Some((tx, rx)) if controller.state != "error-active" => {
                format!("{} tx {tx} rx {rx}", controller.state)
            }
            _ => controller.state.clone(),
        });
    let reception = match bus.reception.as_str() {
        "receiving" | "no_link" => None,
        other => Some(other.replace('_', " ")),
    };
    let parts = [Some(format!("link {}", bus.link)), controller, reception];
    BusLine {
        name: format!("{} ({})", bus.name, bus.interface),
        state: parts.into_iter().flatten().collect::<Vec<_>>().join(", "),
        is_sound: is_sound(bus) && ["receiving", "asleep"].contains(&bus.reception.as_str()),
        rate_hz: bus.traffic.map_or(bus.rate_hz, |traffic| traffic.rate_hz.max(bus.rate_hz)),
        load_percent: bus.traffic.and_then(|traffic| traffic.load_percent),
        drops: bus.drops,
    }
}

fn more(snapshot: &Snapshot) -> Vec<(String, String)> {
    let mut more = Vec::new();
    more.extend(snapshot.decider.as_ref().map(|decider| ("decider".to_owned(), decider_text(decider))));
    more.extend(snapshot.traffic_lights.iter().flat_map(lights_lines));
    more.extend(snapshot.process.as_ref().map(|process| ("ROS 2".to_owned(), ros_text(process))));
    more
}

fn decider_text(decider: &DeciderSnapshot) -> String {
    let Some(decision) = &decider.decision else { return decider.message.clone() };
    let won = decision.candidates.iter().find(|candidate| candidate.outcome.starts_with("won"));
    let subject = won.and_then(|won| won.subject.clone()).or_else(|| decision.winner.clone());
    let subject = subject.map_or_else(String::new, |subject| format!(": {subject}"));
    let rule = decision.rule.as_ref().map_or_else(String::new, |rule| format!(", rule {rule}"));
    let held = decision.held.as_ref().map_or_else(String::new, |held| format!(", held: {held}"));
    format!("turn {}, hazard {}{subject}{rule}{held}", decision.turn, decision.hazard)
}

fn lights_lines(lights: &TrafficLightsSnapshot) -> impl Iterator<Item = (String, String)> {
    let states = lights.channels.iter().flat_map(|channel| {
        channel.states.iter().map(|light| {
            let layer = if light.layer == "detected" { ", detected" } else { "" };
            let state = if light.state.is_empty() { "dark" } else { &light.state };
            (format!("{} {}{layer}", light.id, channel.channel), state.to_owned())
        })
    });
    let phases = lights.controllers.iter().map(|controller| {
        (controller.name.clone(), controller.phase.clone().unwrap_or_else(|| "no phase yet".to_owned()))
    });
    phases.chain(states)
}

fn ros_text(process: &ProcessSnapshot) -> String {
    let Some(ros) = &process.ros else { return "off".to_owned() };
    let peers: u64 = ros.written.iter().map(|topic| topic.peers).sum();
    match (ros.is_up, &ros.last_failure) {
        (true, _) => format!("domain {}, {peers} readers", ros.domain_id),
        (false, Some(failure)) => format!("domain {}, down: {failure}", ros.domain_id),
        (false, None) => format!("domain {}, joining", ros.domain_id),
    }
}
