//! The turn signal decider on ROS: an independent Autoware drives the shipped scenarios in real time, and
//! the daemon's commands come at the positions where the scenarios expect them.

mod deviations;
mod verdict;

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use serde_json::Value;
use signal_gateway::config::drive::{DriveFile, read};
use signal_gateway::config::files::Disk;
use signal_gateway::desk::drive::simulation::DriveSimulation;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::parameters::DeciderParameters;
use turn_signal::parameters::table::PARAMETERS;

use crate::dds::daemon_on_ros::peer::{DIAGNOSTICS, ENDPOINTS, FACTORS, Reader, SECTIONS};
use crate::support::drive_script::{COMPATS, Script};
use crate::support::json_process::Mark;
use crate::support::mcap::only_entry;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::{Missing, require};
use crate::support::process::{Folder, Process, ros_in};
use crate::support::processor::waited;
use crate::support::program::run;
use crate::support::waiting::Bystander;
use deviations::{DEVIATIONS, Deviation};
use verdict::{Driven, Figures, Kind, summary};

/// Driven each time: one of each kind. Others are driven in the slow part.
const REPRESENTATIVE: &[&str] =
    &["crossing_left.toml", "lane_change_left.toml", "pull_out_left.toml", "roundabout_first_exit.toml"];

const TURN: Kind<TurnCommand> = Kind {
    name: "turn",
    decided: |step, mode| step.decided[mode].0,
    expected: |expected| expected.command,
    number: |command| command as u8,
};
const HAZARD: Kind<HazardCommand> = Kind {
    name: "hazard",
    decided: |step, mode| step.decided[mode].1,
    expected: |expected| expected.hazard,
    number: |command| command as u8,
};

/// Longer than the peer waits for a gateway: however long the machine keeps one of them, no input is too old.
const LONG_AGE_LIMITS: &str = "[turn_signal.age_limits]\nodometry_ms = 60000\nplanned_path_ms = 60000\n\
    manoeuvre_ms = 60000\nscenario_ms = 60000\n\
    hazard_request_ms = 60000\n";

/// A machine that leaves both sides waiting for longer, or as long in all within some seconds, spoils a
/// drive, seconds.
const STALL_S: f64 = 0.15;
/// A spoilt drive is driven so often, and is not judged when all of them were spoilt.
const ATTEMPTS: u32 = 3;

fn drives() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("config/drives")
}

fn file(name: &str) -> DriveFile {
    read(&Disk, &drives().join(name)).unwrap_or_else(|refused| panic!("{name}: {refused}"))
}

fn simulation(file: DriveFile) -> DriveSimulation {
    DriveSimulation::new(file).unwrap_or_else(|refused| panic!("{refused}"))
}

/// A drive up to a position.
fn first_part(name: &str, until_m: f64) -> DriveSimulation {
    simulation(DriveFile { until_m: Some(until_m), ..file(name) })
}

/// A gateway that decides as a scenario has it, with these keys of `[turn_signal]`.
fn gateway(bench: &Bench, file: &DriveFile, keys: &str, sections: &str) -> (Folder, Process) {
    let mut text = format!(
        "{}[turn_signal]\n{keys}map = \"{}\"\nplanning_hz = {:.1}\n",
        ros_in(bench.domain),
        file.map.display(),
        file.planning_hz
    );
    text.push_str("[turn_signal.parameters]\n");
    for parameter in PARAMETERS {
        let value = parameter.value(&file.decider.parameters);
        if value != parameter.value(&DeciderParameters::DEPLOYED) {
            writeln!(text, "{} = {value:?}", parameter.name).unwrap();
        }
    }
    let vehicle = file.decider.vehicle;
    for (key, size_m) in [
        ("[vehicle_geometry]\nwheel_base_m", vehicle.wheel_base_m),
        ("front_overhang_m", vehicle.front_overhang_m),
        ("rear_overhang_m", vehicle.rear_overhang_m),
        ("left_m", vehicle.left_m),
        ("right_m", vehicle.right_m),
    ] {
        writeln!(text, "{key} = {size_m:?}").unwrap();
    }
    text.push_str(sections);
    let folder = Folder::with_configuration(&text);
    let process = Process::run(&folder);
    (folder, process)
}

/// The pace of cycles: by time, or waiting for the gateway's commands; see `tests/peer/autoware_drive.py`.
#[derive(Debug, Clone, Copy)]
enum Pace {
    Timed,
    Paced,
}

/// A peer, and the domain it drives in.
struct Bench {
    cyclone: Cyclone,
    domain: u16,
}

impl Bench {
    fn new() -> Result<Self, Missing> {
        Ok(Self { cyclone: Cyclone::on_loopback()?, domain: domain() })
    }

    /// Lets the peer drive; returns its output at the end.
    fn drive(&self, script: &Script, gateways: u32, pace: Pace, topics: &[String]) -> Value {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.jsonl");
        std::fs::write(&path, script.text()).unwrap();
        let pace = match pace {
            Pace::Timed => "timed",
            Pace::Paced => "paced",
        };
        let gateways = gateways.to_string();
        let mut args = vec![path.to_str().unwrap(), &gateways, pace];
        args.extend(topics.iter().map(String::as_str));
        self.cyclone.run("autoware_drive.py", self.domain, &args)
    }
}

/// The result of driving a scenario.
#[derive(Default)]
struct Report {
    figures: Figures,
    objections: Vec<String>,
    stall_s: f64,
    stretch_s: f64,
}

impl Report {
    /// Nothing to object yet.
    fn new(driven: &Driven<'_>) -> Self {
        Self { stall_s: driven.stall_s(), stretch_s: driven.stretch_s(), ..Self::default() }
    }

    /// True if the machine kept the scenario from being driven as planned.
    fn is_spoilt(&self) -> bool {
        self.stall_s.max(self.stretch_s) >= STALL_S
    }
}

/// A scenario in both modes at once, each with a gateway of its own.
fn scenario(bench: &Bench, name: &str) -> Report {
    let simulation = simulation(file(name));
    let mut gateways = Vec::new();
    let mut topics = Vec::new();
    // Inputs that a busy machine delays are not too old, unless the drive is about age.
    let (ages, pace) = if simulation.file().disturbances.is_empty() {
        (LONG_AGE_LIMITS, Pace::Paced)
    } else {
        ("", Pace::Timed)
    };
    for (mode, compat) in ["improved", "upstream"].into_iter().enumerate() {
        let keys = format!("enabled = true\ncompat = {compat:?}\n");
        let outputs = format!(
            "{ages}[turn_signal.outputs]\nturn_command = \"/{compat}/turn\"\nhazard_command = \"/{compat}/hazard\"\n"
        );
        gateways.push(gateway(bench, simulation.file(), &keys, &outputs));
        topics.extend(["turn", "hazard"].map(|kind| format!("{kind}{mode}=/{compat}/{kind}")));
    }
    let script = Script::new(&simulation);
    let line = bench.drive(&script, 2, pace, &topics);
    let driven = Driven::new(&script.steps, &line, 1.0 / simulation.file().planning_hz);
    let mut report = Report::new(&driven);
    for (index, mode) in COMPATS.into_iter().enumerate() {
        let deviation =
            DEVIATIONS.iter().find(|deviation| deviation.name == name && deviation.modes.contains(&mode));
        let more_m = deviation.and_then(|deviation| deviation.within_m).unwrap_or_default();
        let mut own = Figures::default();
        let mut wrong = driven.judge(index, &TURN, &format!("turn{index}"), more_m, &mut own);
        wrong.extend(driven.judge(index, &HAZARD, &format!("hazard{index}"), more_m, &mut own));
        match deviation.filter(|deviation| deviation.within_m.is_none()) {
            Some(Deviation { why, .. }) if wrong.is_empty() => {
                println!("{name}, {mode:?}: this time as expected, though {why}");
            }
            Some(Deviation { why, .. }) => {
                println!("{name}, {mode:?}: not as expected, {why}: {}", wrong.join("; "));
            }
            None => {
                let (off_m, latency_ms) = (summary(&own.off_m), summary(&own.latency_ms));
                let why = deviation.map_or("", |deviation| deviation.why);
                println!("{name}, {mode:?}: changes off by m {off_m}; latency ms {latency_ms} {why}");
                report.objections.extend(wrong.iter().map(|wrong| format!("{name}, {mode:?}: {wrong}")));
                report.figures.append(own);
            }
        }
    }
    if !report.objections.is_empty() {
        for (_, process) in &gateways {
            println!("{name}: log of a gateway:\n{}", process.log().join("\n"));
        }
    }
    report
}

/// Drives, again if the machine kept it from being driven as planned.
fn undisturbed(name: &str, drive: impl Fn() -> Report) -> Report {
    let mut report = drive();
    for attempt in 1.. {
        if report.objections.is_empty() || !report.is_spoilt() {
            break;
        }
        let Report { objections, stall_s, stretch_s, .. } = &report;
        let objections = objections.join("\n");
        println!(
            "{name}: the machine stalled for {stall_s:.2} s, and {stretch_s:.2} s in all:\n{objections}"
        );
        if attempt == ATTEMPTS {
            println!("{name}: not judged, since the machine is too busy");
            report.objections.clear();
            break;
        }
        report = drive();
    }
    report
}

#[test]
fn representative_scenarios_drive_through_as_they_expect() {
    require!(Cyclone::on_loopback());
    drive_through(REPRESENTATIVE.iter().map(|name| (*name).to_owned()).collect(), REPRESENTATIVE.len());
}

/// The names of all shipped scenarios, the longest last.
pub(crate) fn shipped() -> Vec<String> {
    let entries = std::fs::read_dir(drives()).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.retain(|name| name != "README.md");
    names.sort_by_cached_key(|name| simulation(file(name)).cycles().count());
    for Deviation { name, .. } in DEVIATIONS {
        assert!(names.iter().any(|shipped| shipped == name), "{name} is not shipped");
    }
    names
}

/// True for a scenario whose inputs fail for a while.
pub(crate) fn is_disturbed(name: &str) -> bool {
    !file(name).disturbances.is_empty()
}

/// Drives scenarios, so many at a time; each is a peer and two gateways.
///
/// # Panics
/// If one is not driven as it expects.
pub(crate) fn drive_through(names: Vec<String>, abreast: usize) {
    let left = Mutex::new(VecDeque::from(names));
    let results = Mutex::new((Figures::default(), Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..abreast {
            scope.spawn(|| {
                let bench = Bench::new().unwrap();
                // From the back, where the longest are.
                let next = || left.lock().unwrap().pop_back();
                while let Some(name) = next() {
                    let report = undisturbed(&name, || scenario(&bench, &name));
                    let mut results = results.lock().unwrap();
                    results.0.append(report.figures);
                    results.1.extend(report.objections);
                }
            });
        }
    });
    let (figures, objections) = results.into_inner().unwrap();
    println!("changes off by m {}; latency ms {}", summary(&figures.off_m), summary(&figures.latency_ms));
    assert!(objections.is_empty(), "{}", objections.join("\n"));
}

/// The system requests them for a while, the planner does not.
#[test]
fn the_systems_hazard_request_is_joined_with_the_planners() {
    let bench = require!(Bench::new());
    let simulation = first_part("crossing_left.toml", 45.0);
    let mut script = Script::new(&simulation);
    let is_requested = |index: usize| (10..25).contains(&index);
    script.add("hazard_request", |index, _| Some(if is_requested(index) { 2 } else { 1 }));
    let mut steps = script.steps.clone();
    for (index, step) in steps.iter_mut().enumerate() {
        step.decided[0].1 = if is_requested(index) { HazardCommand::Enable } else { HazardCommand::Disable };
    }
    let topics = ["turn=/planning/turn_indicators_cmd", "hazard=/planning/hazard_lights_cmd"];
    let report = undisturbed("the system's request", || {
        let _gateway = gateway(&bench, simulation.file(), "enabled = true\n", LONG_AGE_LIMITS);
        let line = bench.drive(&script, 1, Pace::Paced, &topics.map(str::to_owned));
        let driven = Driven::new(&steps, &line, 0.1);
        let mut report = Report::new(&driven);
        report.objections = driven.judge(0, &TURN, "turn", 0.0, &mut report.figures);
        report.objections.extend(driven.judge(0, &HAZARD, "hazard", 0.0, &mut report.figures));
        report
    });
    assert!(report.objections.is_empty(), "{}", report.objections.join("\n"));
    // Left from 37 m on; on and off again.
    assert!(report.figures.off_m.len() == 3 || report.is_spoilt(), "{:?}", report.figures);
}

#[test]
fn a_shadow_publishes_nothing_and_reports_its_agreement() {
    let bench = require!(Bench::new());
    if !(0..ATTEMPTS).any(|_| shadow(&bench)) {
        println!("not judged, since the machine is too busy");
    }
}

/// Autoware's own decider commands what ours would, but for some seconds of the wrong side. False if the
/// machine kept the gateway from seeing any of them.
fn shadow(bench: &Bench) -> bool {
    /// Cycles with the wrong side, longer than a busy machine keeps the gateway from seeing them.
    const WRONG: std::ops::Range<usize> = 42..108;
    /// What a disagreement may last until it counts, and what may be off at its ends.
    const TOLERANCE_S: f64 = 0.5;
    const SLACK: Duration = Duration::from_millis(600);
    let simulation = first_part("crossing_left.toml", 114.0);
    let sections = format!("{LONG_AGE_LIMITS}[mcap]\nfolder = \"bags\"\n");
    let (folder, mut process) = gateway(bench, simulation.file(), "shadow = true\n", &sections);
    let reader = Reader::start(&bench.cyclone, bench.domain, &[ENDPOINTS, DIAGNOSTICS]);
    let mut script = Script::new(&simulation);
    script.add("own_turn", |index, step| {
        Some(if WRONG.contains(&index) { TurnCommand::Right as u8 } else { step.decided[0].0 as u8 })
    });
    script.add("own_hazard", |_, step| Some(step.decided[0].1 as u8));
    let beside = Bystander::start();
    let line = bench.drive(&script, 1, Pace::Paced, &[]);
    let (lateness, waited) = (beside.finish(), waited(process.id()));
    let status = |key: &str, mark| {
        reader.status(mark, "turn_signal_decider", key, |value, _| value != "nothing compared")
    };
    let value = |status: &Value, key: &str| {
        let values = status["values"].as_array().unwrap();
        let value = values.iter().find(|value| value["key"] == key).unwrap_or_else(|| panic!("no {key}"));
        value["value"].as_str().unwrap().to_owned()
    };
    let last = status("turn_agreement_percent", reader.mark());
    assert_eq!(value(&last, "role"), "shadow");
    let [percent, compared] = ["turn_agreement_percent", "turn_compared"].map(|key| value(&last, key));
    println!("{percent} %, {compared}");
    let counts: Vec<f64> = compared.split(' ').filter_map(|word| word.parse().ok()).collect();
    let [alike, tolerated, different, _] = counts[..] else { panic!("{compared}") };
    let share = 100.0 * (alike + tolerated) / (alike + tolerated + different);
    assert_eq!(percent, format!("{share:.2}"));
    // Ten cycles a second.
    let at_s = |index: usize| Duration::from_nanos(line["cycles"][index].as_u64().unwrap()).as_secs_f64();
    let expected_s = at_s(WRONG.end) - at_s(WRONG.start) - TOLERANCE_S;
    let off = Duration::from_secs_f64((different / 10.0 - expected_s).abs());
    lateness.assert_gap(
        format!("a difference of {expected_s:.1} s, {different} cycles"),
        off,
        SLACK + waited,
    );
    assert_eq!(value(&last, "hazard_agreement_percent"), "100.00");
    if different == 0.0 {
        return false;
    }
    let warned = reader.status(Mark::START, "turn_signal_decider", "turn_disagreement", |value, level| {
        level == 1 && value.starts_with("LEFT here, RIGHT of Autoware")
    });
    println!("{}", warned["message"]);
    let commanding = reader.samples(Mark::START, "endpoints");
    let commanding: Vec<_> = commanding
        .iter()
        .map(|line| line["data"]["topic"].as_str().unwrap().to_owned())
        .filter(|topic| topic.ends_with("_cmd"))
        .collect();
    // Autoware's own, and no other.
    assert_eq!(commanding.len(), 2, "{commanding:?}");
    process.stop("TERM");
    recorded_drive_is_judged(folder.path());
    true
}

/// The gateway's own recording has what the report on the drive needs.
fn recorded_drive_is_judged(folder: &Path) {
    let bag = only_entry(&folder.join("bags"));
    // A busy machine leaves gaps between the commands that are recorded.
    let text = std::fs::read_to_string(folder.join("gateway.toml")).unwrap();
    let patient = text.replace("odometry_ms = 60000", "odometry_ms = 60000\nown_command_ms = 60000");
    std::fs::write(folder.join("patient.toml"), patient).unwrap();
    let report = run(folder, &["decide", bag.to_str().unwrap(), "--config", "patient.toml", "--json"]);
    let lines = report.json();
    println!("{}", report.out);
    let [turn, summary] = lines.as_slice() else { panic!("{}{}", report.out, report.error) };
    let turn = &turn["manoeuvre"];
    assert_eq!(
        (turn["what"].as_str(), turn["verdict"].as_str()),
        (Some("left turn on 111"), Some("wrong_side"))
    );
    // A busy machine passes over commands that a newer one replaces.
    assert!(summary["summary"]["samples"].as_u64().unwrap() > 0, "{summary}");
    assert_eq!(report.code, 5);
}

/// In shadow mode as well: nothing is commanded, but what would be is seen.
#[test]
fn sections_are_published_as_markers_and_as_a_planning_factor() {
    let bench = require!(Bench::new());
    let simulation = first_part("crossing_left.toml", 60.0);
    let outputs = format!(
        "{LONG_AGE_LIMITS}[turn_signal.outputs]\nmarkers = \"/debug/sections\"\nplanning_factors = \"/debug/factors\"\n"
    );
    let (_folder, mut process) = gateway(&bench, simulation.file(), "shadow = true\n", &outputs);
    let reader = Reader::start(&bench.cyclone, bench.domain, &[SECTIONS, FACTORS]);
    let beside = Bystander::start();
    bench.drive(&Script::new(&simulation), 1, Pace::Paced, &[]);
    let (lateness, waited) = (beside.finish(), waited(process.id()));
    let x_of = |marker: &Value| marker["pose"]["position"]["x"].as_f64().unwrap();
    let arrows = reader.wait(Mark::START, "sections", "the turn that is signalled", |data| {
        let [deleted, markers @ ..] = &data["markers"].as_array().unwrap()[..] else { return None };
        assert_eq!(deleted["action"], 3, "those before are deleted");
        let label = markers.last()?;
        assert_eq!((markers.len(), &label["text"]), (5, &"left turn on 111: won".into()), "{data}");
        Some(markers.iter().map(x_of).collect::<Vec<_>>())
    });
    // The turn begins at 100 m, which is x = -12 here.
    assert!((arrows[1] - -12.0).abs() < 0.1 && arrows[0] < arrows[1], "{arrows:?}");
    let distance_m = reader.wait(Mark::START, "factors", "the turn", |data| {
        let factor = data["factors"].as_array().unwrap().first()?;
        assert_eq!((&factor["module"], &factor["behavior"]), (&"signal_gateway".into(), &6.into()), "{data}");
        factor["control_points"][0]["distance"].as_f64()
    });
    // Signalled from 37 m on, the front 3.79 m ahead, at 10 m/s.
    assert!(distance_m < 60.0, "{distance_m}");
    let late = Duration::from_secs_f64((60.0 - distance_m) / 10.0);
    let limit = Duration::from_secs(1) + waited;
    lateness.assert_gap(format!("the first section, {distance_m} m ahead"), late, limit);
    process.stop("TERM");
}
