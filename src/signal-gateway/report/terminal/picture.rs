//! The present state as the view shows it: of a gateway, or of a simulated vehicle.

use crate::process_status::snapshot::{ProcessSnapshot, Snapshot};
use crate::report::live_view::{age_text, decider_text, message_of, signals_of};
use can_signal::can::{BusSnapshot, LinkState};
use can_signal::validation::snapshot::{SignalSnapshot, UsedBy};
use gateway_base::diagnostics::Level;
use gateway_core::command::snapshot::LightsValue;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_report::ReportSnapshot;
use gateway_core::vehicle_status::StatusReport;
use traffic_lights::bulb::Bulb;
use traffic_lights::snapshot::TrafficLightsSnapshot;

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
    /// Velocity, steering, gear, control mode and doors, as far as the profile has them.
    pub status: Vec<StatusLine>,
    /// The buses, a line each.
    pub buses: Vec<BusLine>,
    /// Further parts, by name: decider, traffic lights, ROS 2.
    pub more: Vec<(String, More)>,
}

/// The state of a further part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum More {
    /// A text in words.
    Text(String),
    /// The bulbs of a traffic light; none when it is dark.
    Bulbs(Vec<Bulb>),
}

/// A turn indicator of the car.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lamp {
    /// It is not known whether it flashes.
    #[default]
    Unknown,
    /// It does not flash.
    Off,
    /// Flashes; the view lets it blink.
    Flashing,
    /// Lit at this moment.
    Lit,
}

/// A function of the lights.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Function {
    /// Its name, `turn` or `hazard`.
    pub name: &'static str,
    /// What stands under the titles; `None` where there is nothing.
    pub values: [Option<String>; 3],
    /// What the strip shows of it.
    pub mark: Mark,
    /// The outcome of each of [`STAGES`]; empty where nothing is received.
    pub stages: Vec<Stage>,
    /// Level and message, where it is not simply published.
    pub reason: Option<(Level, String)>,
    /// What to do; empty if nothing is to be done.
    pub remedy: String,
}

/// A report of the vehicle's status.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatusLine {
    /// Its name.
    pub name: &'static str,
    /// The published value; `withheld` while there is none.
    pub value: String,
    /// How bad it is.
    pub level: Level,
    /// What is wrong; empty while nothing is.
    pub reason: String,
    /// What to do; empty if nothing is to be done.
    pub remedy: String,
}

/// One moment of a function in the strip. A column of several moments shows the greatest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Mark {
    /// There is no such report.
    #[default]
    Nothing,
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

/// The outcome of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// The stage is passed.
    Passed,
    /// There is nothing to pass, as without a checksum.
    Absent,
    /// The way ends at this stage.
    Failed,
    /// The way ended before this stage.
    NotReached,
}

/// A bus in one line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BusLine {
    /// Name of the bus and its interface.
    pub name: String,
    /// Link, controller and reception, as far as they are known.
    pub state: String,
    /// How bad its state is.
    pub level: Level,
    /// Number of frames a second.
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
                function("turn", "turn_indicators", snapshot, report, published)
                    .commanded(commands.and_then(|commands| commands.turn_indicators.requested))
            }),
            hazard.map(|report| {
                let published = report.published.map(|value| (value.name(), hazard_mark(value)));
                function("hazard", "hazard_lights", snapshot, report, published)
                    .commanded(commands.and_then(|commands| commands.hazard_lights.requested))
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
            status: snapshot
                .vehicle_status
                .reports()
                .into_iter()
                .map(|of| status_line(snapshot, of))
                .collect(),
            buses: snapshot.buses.iter().map(bus).collect(),
            more: more(snapshot),
        }
    }
}

impl Function {
    fn commanded(mut self, value: Option<LightsValue>) -> Self {
        self.values[0] = value.map(|value| value.to_string());
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
    task: &str,
    snapshot: &Snapshot,
    report: &ReportSnapshot<T>,
    published: Option<(&'static str, Mark)>,
) -> Function {
    let signals: Vec<_> = signals_of(snapshot, report, UsedBy::VehicleLights).collect();
    let raw: Vec<_> = signals.iter().map(|signal| raw_text(signal)).collect();
    let value = published.map_or("withheld", |(value, _)| value);
    Function {
        name,
        values: [None, Some(value.to_owned()), (!raw.is_empty()).then(|| raw.join("  "))],
        mark: published.map_or(Mark::Withheld, |(_, mark)| mark),
        stages: stages(snapshot, &signals, published.is_some()),
        reason: (report.level != Level::Ok).then(|| (report.level, report.message.clone())),
        remedy: snapshot.remedy(task).unwrap_or_default().to_owned(),
    }
}

fn status_line(snapshot: &Snapshot, (of, report): (StatusReport, ReportSnapshot<String>)) -> StatusLine {
    let is_withheld = report.published.is_none();
    StatusLine {
        name: of.title(),
        value: report.published.unwrap_or_else(|| "withheld".to_owned()),
        level: if is_withheld { report.level.max(Level::Warn) } else { report.level },
        reason: if report.level == Level::Ok { String::new() } else { report.message },
        remedy: snapshot.remedy(of.name()).unwrap_or_default().to_owned(),
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
    let checks: Vec<_> =
        signals.iter().filter_map(|signal| message_of(snapshot, signal)?.integrity.as_ref()).collect();
    let is_rejected = checks.iter().any(|check| check.is_trusted == Some(false));
    let is_linked = buses.iter().all(|bus| is_linked(bus));
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

/// True if frames can be received.
fn is_linked(bus: &BusSnapshot) -> bool {
    bus.link == LinkState::Up
        && bus.controller.as_ref().is_none_or(|found| found.state.level() < Level::Error)
}

fn bus(bus: &BusSnapshot) -> BusLine {
    BusLine {
        name: format!("{} ({})", bus.name, bus.interface),
        state: bus.details().map(|(_, text)| text).collect::<Vec<_>>().join(", "),
        level: bus.worst(),
        rate_hz: bus.traffic.map_or(bus.rate_hz, |traffic| traffic.rate_hz.max(bus.rate_hz)),
        load_percent: bus.traffic.and_then(|traffic| traffic.load_percent),
        drops: bus.drops,
    }
}

fn more(snapshot: &Snapshot) -> Vec<(String, More)> {
    let mut more = Vec::new();
    let decider = snapshot.decider.as_ref();
    more.extend(decider.map(|decider| ("decider".to_owned(), More::Text(decider_text(decider)))));
    more.extend(snapshot.traffic_lights.iter().flat_map(lights_lines));
    more.extend(snapshot.process.as_ref().map(|process| ("ROS 2".to_owned(), More::Text(ros_text(process)))));
    more
}

fn lights_lines(lights: &TrafficLightsSnapshot) -> impl Iterator<Item = (String, More)> {
    let states = lights.named_lights().map(|(name, light)| (name, More::Bulbs(light.bulbs.clone())));
    let phases = lights.controllers.iter().map(|controller| {
        let phase = controller.phase.clone().unwrap_or_else(|| "no phase yet".to_owned());
        (controller.name.clone(), More::Text(phase))
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
