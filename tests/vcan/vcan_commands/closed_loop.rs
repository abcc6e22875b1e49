//! The whole loop in real time: an independent Autoware drives, the gateway decides and commands, the
//! simulated vehicle follows on a real interface, and its report comes back to Autoware.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::Value;
use signal_gateway::config::drive::{DriveFile, read};
use signal_gateway::config::files::Disk;
use signal_gateway::desk::drive::simulation::DriveSimulation;
use turn_signal::parameters::DeciderParameters;

use super::recording::{BusTime, RecordedFrame, Recording};
use super::vehicles::{Change, PACMOD};
use crate::support::drive_script::Script;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::process::{self, Folder, Process};
use crate::support::vcan::Vcan;

/// A scenario, and how far to drive it; all with the parameters that Autoware is deployed with.
type Drive = (&'static str, Option<f64>);
pub(super) const CROSSING: Drive = ("crossing_left", Some(125.0));

/// What a busy machine holds up is not too old: here, for commands and for the vehicle.
const PATIENT: &str = "[turn_signal.age_limits]\nodometry_ms = 10000\nplanned_path_ms = 10000\n\
    manoeuvre_ms = 10000\nscenario_ms = 10000\n";

/// `TurnIndicatorsCommand` and `TurnIndicatorsReport` have the same numbers; words of the command frame.
const WORDS: [(i64, &str); 3] = [(1, "off"), (2, "left"), (3, "right")];

/// What the vehicle is commanded in the order of the bits of its report: right, none, left.
fn shown(frame: &RecordedFrame) -> i64 {
    match frame.data[3] {
        0 => 3,
        1 => 1,
        2 => 2,
        other => panic!("OUTPUT_VALUE {other}"),
    }
}

#[test]
fn each_decision_is_commanded_carried_out_and_reported() {
    let cyclone = require!(Cyclone::on_loopback());
    let vcan = require!(Vcan::new("vcan-loop"));
    drive_all(&cyclone, &vcan, &[CROSSING]);
}

mod slow {
    use super::{CROSSING, Cyclone, Drive, Vcan, drive_all, require};

    /// Each state of the signal lasts longer than a busy machine stands still: a report of half a second,
    /// such as the off between two sides, is not published when it is that late.
    const DRIVES: [Drive; 6] = [
        CROSSING,
        ("pull_out_left", Some(150.0)),
        ("lane_change_right_waiting", None),
        ("lane_change_left", None),
        ("reroute_short_signal", None),
        ("roundabout_first_exit", None),
    ];

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn each_decision_of_all_drives_is_commanded_carried_out_and_reported() {
        let cyclone = require!(Cyclone::on_loopback());
        let vcan = require!(Vcan::new("vcan-loops"));
        drive_all(&cyclone, &vcan, &DRIVES);
    }
}

/// Drives them one after the other.
fn drive_all(cyclone: &Cyclone, vcan: &Vcan, drives: &[Drive]) {
    let mut spans = Spans::default();
    for drive_case in drives {
        drive(cyclone, vcan, *drive_case, &mut spans);
    }
    assert!(
        spans.0["decision to report"].len() >= 2 * drives.len(),
        "a signal is switched on and off at least"
    );
    spans.print();
}

/// One drive. Every change of the decider's command is looked for in each of the stages.
fn drive(cyclone: &Cyclone, vcan: &Vcan, (name, until_m): Drive, spans: &mut Spans) {
    let simulation = simulation((name, until_m));
    let domain = domain();
    let folder = folder(vcan, domain, &simulation);
    let mut bus = Recording::of(vcan.name);
    let mut vehicle = vehicle(&folder);
    let seen_by_vehicle = folder.path().join(SEEN_BY_VEHICLE);
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("turn_indicators: publishing");
    let line = drive_by_script(cyclone, domain, &simulation, &folder);
    gateway.stop("TERM");
    vehicle.stop("TERM");
    bus.finish();

    let decided = changes(&line["received"]["turn"]);
    let reported = changes(&line["received"]["report"]);
    let (commands, reports) =
        (bus.since(BusTime::START, PACMOD.command()), bus.since(BusTime::START, PACMOD.report()));
    assert_eq!(values(&reported), values(&decided), "{name}: what is reported is what was decided");
    let lights: Vec<_> = lights(&seen_by_vehicle);
    let expected: Vec<_> = decided.iter().map(|change| word(change.value)).collect();
    assert_eq!(lights, expected, "{name}: the vehicle follows the commands only");
    let mut before = Duration::ZERO;
    for (change, report) in decided.iter().zip(&reported) {
        // The message received first need not be the first: on a busy machine the peer loses some.
        let frame = commands
            .iter()
            .find(|frame| frame.at > before && PACMOD.request(&frame.data) == word(change.value));
        let frame = frame.unwrap_or_else(|| panic!("{name}: no command frame after {change:?}"));
        before = frame.at;
        let mut backs = reports.iter().filter(|back| back.at > frame.at && shown(back) == change.value);
        let back = backs.clone().next().unwrap_or_else(|| panic!("{name}: no report frame after {change:?}"));
        assert!(
            backs.any(|back| back.at == report.stamp),
            "{name}: {report:?} has the kernel's stamp of a frame"
        );
        spans.add("decision to command frame", frame.at.saturating_sub(change.stamp));
        spans.add("command frame to report frame", back.at.saturating_sub(frame.at));
        spans.add("report frame to report", report.arrived.saturating_sub(back.at));
        spans.add("decision to report", report.arrived.saturating_sub(change.stamp));
    }
    println!("{name}: {:?}", values(&decided).into_iter().map(word).collect::<Vec<_>>());
}

/// The file in which the simulated vehicle notes what it does.
const SEEN_BY_VEHICLE: &str = "vehicle.jsonl";

pub(super) fn simulation((name, until_m): Drive) -> DriveSimulation {
    let file = file(name);
    let simulation = DriveSimulation::new(DriveFile { until_m: until_m.or(file.until_m), ..file })
        .unwrap_or_else(|refused| panic!("{refused}"));
    assert_eq!(simulation.file().decider.parameters, DeciderParameters::DEPLOYED, "{name}");
    simulation
}

/// A gateway that decides, and commands a vehicle.
pub(super) fn folder(vcan: &Vcan, domain: u16, simulation: &DriveSimulation) -> Folder {
    let ros = process::ros_in(domain);
    let keys = format!(
        "{ros}[command]\ntx = \"on\"\nsource = \"decider\"\nturn_timeout_ms = 60000\n\
         hazard_timeout_ms = 60000\ncontrol_mode_timeout_ms = 60000\n[turn_signal]\nenabled = true\nmap = \"{}\"\n{PATIENT}",
        simulation.file().map.display()
    );
    PACMOD.folder(vcan.name, &keys, &Change::NONE)
}

/// Starts the simulated vehicle.
pub(super) fn vehicle(folder: &Folder) -> Process {
    Process::start(folder.path(), |command| {
        command.args(["vehicle", "--json", "--command-timeout-ms", "10000", "--config"]);
        command.arg(folder.path().join("gateway.toml"));
        command.stdout(std::fs::File::create(folder.path().join(SEEN_BY_VEHICLE)).unwrap());
    })
}

/// Lets Autoware drive; returns its output at the end.
pub(super) fn drive_by_script(
    cyclone: &Cyclone,
    domain: u16,
    simulation: &DriveSimulation,
    folder: &Folder,
) -> Value {
    let mut script = Script::new(simulation);
    script.add("control_mode", |_, _| Some(1));
    let path = folder.path().join("drive.jsonl");
    std::fs::write(&path, script.text()).unwrap();
    let topics = ["turn=/planning/turn_indicators_cmd", "report=/vehicle/status/turn_indicators_status"];
    let args = [path.to_str().unwrap(), "1", "paced", topics[0], topics[1]];
    cyclone.run("autoware_drive.py", domain, &args)
}

fn file(name: &str) -> DriveFile {
    let folder: PathBuf = [env!("CARGO_MANIFEST_DIR"), "config", "drives"].iter().collect();
    read(&Disk, &folder.join(name).with_extension("toml")).unwrap_or_else(|refused| panic!("{refused}"))
}

/// A message with another content than the one before; times of day.
#[derive(Debug)]
struct Received {
    stamp: Duration,
    value: i64,
    arrived: Duration,
}

/// From the first message that requests a light.
fn changes(received: &Value) -> Vec<Received> {
    let nanos = |value: &Value| Duration::from_nanos(value.as_u64().unwrap());
    let mut all: Vec<_> = received
        .as_array()
        .unwrap()
        .iter()
        .map(|message| Received {
            stamp: nanos(&message[0]),
            value: message[1].as_i64().unwrap(),
            arrived: nanos(&message[2]),
        })
        .filter(|received| received.value != 0)
        .collect();
    all.dedup_by_key(|received| received.value);
    all.drain(..all.iter().position(|received| received.value != 1).unwrap_or(all.len()));
    all
}

fn values(changes: &[Received]) -> Vec<i64> {
    changes.iter().map(|change| change.value).collect()
}

fn word(value: i64) -> &'static str {
    WORDS.iter().find(|(known, _)| *known == value).map_or("?", |(_, word)| word)
}

/// What the vehicle's lights did, one after the other, and that only the commands caused it.
fn lights(path: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let lights: Vec<_> = lines.filter(|line| line["what"] == "lights").collect();
    assert!(lights.iter().all(|line| line["who"] != "driver"));
    lights.iter().map(|line| line["lights"].as_str().unwrap().to_owned()).collect()
}

/// Times of the stages, in milliseconds.
#[derive(Default)]
struct Spans(BTreeMap<&'static str, Vec<f64>>);

impl Spans {
    fn add(&mut self, stage: &'static str, time: Duration) {
        self.0.entry(stage).or_default().push(time.as_secs_f64() * 1000.0);
    }

    fn print(&self) {
        for (stage, times) in &self.0 {
            let mut times = times.clone();
            times.sort_by(f64::total_cmp);
            let at = |percent: usize| times[(times.len() - 1) * percent / 100];
            println!(
                "measured: {stage}, {} changes: median {:.1} ms, 90 % {:.1} ms, 99 % {:.1} ms, most {:.1} ms",
                times.len(),
                at(50),
                at(90),
                at(99),
                at(100)
            );
        }
    }
}
