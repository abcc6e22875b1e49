//! Values, stamps, quality of service and diagnostics, as the reader receives them.

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use flate2::read::GzDecoder;
use serde_json::Value;

use super::reader::{nanos, stamp};
use super::{
    Bench, DISABLE, ENABLE_LEFT, ENABLE_RIGHT, HAZARD, HAZARD_ENABLE, HAZARD_OFF, HAZARD_ON, LEFT,
    NOT_AVAILABLE, OFF, RIGHT, Reader, Sender, TURN, UNDEFINED, Vcan,
};
use crate::support::prerequisite::{can_utils, require};
use crate::support::process;
use crate::support::processor::waited;
use crate::support::vcan::{Window, wall};
use crate::support::waiting::Bystander;

#[test]
fn what_cansend_sends_comes_out_with_the_time_the_kernel_received_it() {
    let bench = require!(Bench::new("vcan-send", ""));
    require!(can_utils());
    let (reader, mut gateway) = bench.start();
    let start = reader.mark();
    reader.status(start, "turn_indicators", 2, "no frame of BCM_TurnIndicators (2A5) on vcan-send yet");

    let hazard_off = cansend(&bench.vcan, HAZARD, HAZARD_OFF);
    assert!(hazard_off.contains(&reader.report(start, "hazard", DISABLE)));
    let step = |data: [u8; 8], report: u8| {
        let mark = reader.mark();
        let window = cansend(&bench.vcan, TURN, data);
        let stamp = reader.report(mark, "turn", report);
        assert!(window.contains(&stamp), "{report}: {stamp} is not in {window:?}");
        // The report goes on with the stamp of the frame, not of now.
        let later = reader.next(reader.mark(), "turn", 4);
        assert!(later.iter().all(|line| self::stamp(line) == stamp), "{stamp}: {later:?}");
    };
    step(OFF, DISABLE);
    step(LEFT, ENABLE_LEFT);
    step(RIGHT, ENABLE_RIGHT);

    let silenced_by = |data: [u8; 8], text: &str| {
        let mark = reader.mark();
        cansend(&bench.vcan, TURN, data);
        let status = reader.status(mark, "turn_indicators", 2, text);
        let mark = reader.expect_silence(&["turn"]);
        // The hazard lights go on.
        reader.next(mark, "hazard", 2);
        status
    };
    let status =
        silenced_by(UNDEFINED, "invalid: BCM_TurnIndicators.TurnIndicatorState = 3 is not a defined value");
    assert_eq!(value(&status, "raw_value"), "3");
    assert_eq!(value(&status, "report"), "not published");
    resume(&reader, || step(LEFT, ENABLE_LEFT));
    silenced_by(NOT_AVAILABLE, "unknown: BCM_TurnIndicators.TurnIndicatorState = 7 means not available");
    resume(&reader, || step(RIGHT, ENABLE_RIGHT));

    // Hazard takes the direction away, with its own time.
    let mark = reader.mark();
    let window = cansend(&bench.vcan, HAZARD, HAZARD_ON);
    assert!(window.contains(&reader.report(mark, "hazard", HAZARD_ENABLE)));
    assert!(window.contains(&reader.report(mark, "turn", DISABLE)));
    println!("SIGTERM with a reader: {:?}", gateway.stop("TERM"));
}

fn resume(reader: &Reader, step: impl FnOnce()) {
    let mark = reader.mark();
    step();
    let status = reader.status(mark, "turn_indicators", 0, "publishing");
    assert!(value(&status, "last_error").contains("TurnIndicatorState"), "{status}");
}

fn value(status: &Value, key: &str) -> String {
    let values = status["values"].as_array().unwrap();
    let found = values.iter().find(|value| value["key"] == key);
    found.unwrap_or_else(|| panic!("no {key} in {status}"))["value"].as_str().unwrap().to_owned()
}

fn cansend(vcan: &Vcan, id: u32, data: [u8; 8]) -> Window {
    let data: String = data.iter().fold(String::new(), |text, byte| text + &format!("{byte:02X}"));
    let before = wall();
    let status = Command::new("cansend").args([vcan.name, &format!("{id:03X}#{data}")]).status();
    assert!(status.unwrap().success());
    before..=wall()
}

#[test]
fn a_drive_played_by_canplayer_gives_the_same_reports() {
    let bench = require!(Bench::new("vcan-play", ""));
    require!(can_utils());
    // The vehicle as it is shipped, on a bus as busy as a real one.
    let profile = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/vehicles/demo_vehicle.toml");
    let configured = std::fs::read_to_string(bench.folder.path().join("gateway.toml")).unwrap();
    bench.folder.write("gateway.toml", &configured.replace("demo_vehicle.toml", profile.to_str().unwrap()));
    bench.folder.write("drive.log", &scenes());
    let (reader, mut gateway) = bench.start();
    let mark = reader.mark();
    gateway.wait_for_log("CAN bus opened");
    // The first report is followed by others: a reader that is found late would be handed a later one.
    for kind in ["turn", "hazard"] {
        reader.matched(kind);
    }
    reader.status(mark, "turn_indicators", 2, "unknown");
    let (beside, before) = (Bystander::start(), wall());
    let status = Command::new("canplayer")
        .arg("-I")
        .arg(bench.folder.path().join("drive.log"))
        .arg("vcan-play=can0")
        .status();
    assert!(status.unwrap().success());
    let played = before..=wall();
    reader.status(mark, "vcan-play", 1, "no frame of the vehicle profile for more than 1000 ms");
    // Topics do not wait for each other: the last reports may come behind the status.
    let lateness = beside.finish();
    for (kind, expected) in [("turn", &[1, 2, 1, 3, 1][..]), ("hazard", &[1, 2, 1])] {
        for _ in 0..40 {
            if states(&reader.samples(mark, kind), &played).len() >= expected.len() {
                break;
            }
            reader.refreshes(reader.mark(), 1);
        }
        let states = states(&reader.samples(mark, kind), &played);
        if states != expected {
            // Where it has to wait, a report is replaced by the next one.
            let what = format!("the reports of {kind} {states:?} instead of {expected:?}");
            lateness.assert_gap(&what, SCENE, SCENE / 2 + waited(gateway.id()));
            let mut rest = expected.iter();
            assert!(states.iter().all(|state| rest.any(|next| next == state)), "{what}");
        }
    }
    gateway.stop("TERM");
}

/// The shortest time of a state in [`scenes`].
const SCENE: Duration = Duration::from_millis(600);

/// The moments of the demo recording at which something is switched, one right after the other.
fn scenes() -> String {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/demo.log.gz");
    let mut recording = String::new();
    GzDecoder::new(std::fs::File::open(shipped).unwrap()).read_to_string(&mut recording).unwrap();
    let time = |line: &str| line[1..line.find(')').unwrap()].parse::<f64>().unwrap();
    let start = time(recording.lines().next().unwrap());
    let mut scenes = String::new();
    let mut passed = 0.0;
    for moment in [9.0, 15.0, 16.5, 20.5, 29.5, 32.5] {
        let (from, to) = (start + moment - 0.2, start + moment + 0.4);
        for line in recording.lines().filter(|line| (from..to).contains(&time(line))) {
            let rest = &line[line.find(')').unwrap()..];
            writeln!(scenes, "({:.6}{rest}", 1_000_000.0 + passed + time(line) - from).unwrap();
        }
        passed += to - from;
    }
    scenes
}

/// The reports without repetitions, each received while it was played.
fn states(samples: &[Value], played: &Window) -> Vec<u64> {
    assert!(samples.iter().all(|sample| played.contains(&stamp(sample))), "{played:?}: {samples:?}");
    let mut states: Vec<_> =
        samples.iter().map(|sample| sample["data"]["report"].as_u64().unwrap()).collect();
    states.dedup();
    states
}

#[test]
fn the_writers_are_reliable_and_transient_local_and_diagnostics_are_refreshed_twice_a_second() {
    let bench = require!(Bench::new("vcan-qos", ""));
    let sender = Sender::start(&bench.vcan, &[(TURN, LEFT), (HAZARD, HAZARD_OFF)]);
    let beside = Bystander::start();
    let (reader, mut gateway) = bench.start();
    let mark = reader.mark();
    let started = gateway.started();
    let first = reader.sample(mark, "turn", |_| true);
    println!("from the start to the first report at the reader: {:?}", first.0 - started);
    // The depth is not announced; test what late joiners get.
    for (kind, durability) in
        [("turn", "TransientLocal"), ("hazard", "TransientLocal"), ("diagnostics", "Volatile")]
    {
        let qos = reader.matched(kind);
        for part in ["Policy.Reliability.Reliable", &format!("Policy.Durability.{durability}")] {
            assert!(qos.contains(part), "{kind}: {part} is not in {qos}");
        }
    }
    let refreshes = reader.refreshes(reader.mark(), 13);
    let stamps: Vec<_> = refreshes.iter().map(|line| nanos(&line["data"]["header"]["stamp"])).collect();
    let mut gaps_ms: Vec<_> = stamps.windows(2).map(|pair| (pair[1] - pair[0]) / 1_000_000).collect();
    gaps_ms.sort_unstable();
    println!("measured: all diagnostics are refreshed every {gaps_ms:?} ms");
    // What holds up the machine now and then is no matter.
    let median = Duration::from_millis(gaps_ms[gaps_ms.len() / 2].unsigned_abs());
    beside.finish().assert_gap(format!("the median of {gaps_ms:?}"), median, Duration::from_millis(500));
    for sample in reader.samples(mark, "turn") {
        assert!(sender.sent_at(stamp(&sample)), "nothing was sent at {sample}");
    }
    gateway.stop("TERM");
}

#[test]
fn two_buses_may_mean_different_things_by_the_same_id() {
    let bench = require!(Bench::new("vcan-body", ""));
    let chassis = require!(Vcan::new("vcan-chassis"));
    let folder = &bench.folder;
    folder.write(
        "body.dbc",
        "VERSION \"\"\nBU_: A\nBO_ 256 Lights: 8 A\n SG_ Direction : 0|8@1+ (1,0) [0|2] \"\" A\n",
    );
    folder.write(
        "chassis.dbc",
        "VERSION \"\"\nBU_: A\nBO_ 256 Warning: 8 A\n SG_ Flasher : 0|8@1+ (1,0) [0|2] \"\" A\n",
    );
    folder.write("vehicle.toml", TWO_BUSES);
    let interfaces = "[can.body]\ninterface = \"vcan-body\"\n[can.chassis]\ninterface = \"vcan-chassis\"\n";
    let ros = process::ros_in(bench.domain);
    folder.write("gateway.toml", &format!("profile = \"vehicle.toml\"\n{interfaces}{ros}"));
    let (reader, mut gateway) = bench.start();
    let byte = |value: u8| [value, 0, 0, 0, 0, 0, 0, 0];
    let start = reader.mark();
    reader.status(start, "vcan-body", 1, "no frame");
    reader.status(start, "vcan-chassis", 1, "no frame");
    for (direction, flasher) in [(0, 0), (1, 0), (2, 1), (0, 1), (1, 0)] {
        let mark = reader.mark();
        let of_direction = bench.vcan.send(0x100, byte(direction));
        let of_flasher = chassis.send(0x100, byte(flasher));
        let stamped = |kind: &str, report: u8, window: &Window| {
            let (_, line) = reader.sample(mark, kind, |line| window.contains(&stamp(line)));
            assert_eq!(line["data"]["report"], report, "{kind}");
        };
        stamped("turn", direction + 1, &of_direction);
        stamped("hazard", flasher + 1, &of_flasher);
    }
    // What is not a value on one bus does not disturb the other.
    let mark = reader.mark();
    chassis.send(0x100, byte(2));
    reader.status(mark, "hazard_lights", 2, "invalid: Warning.Flasher = 2");
    let mark = reader.expect_silence(&["hazard"]);
    reader.next(mark, "turn", 1);
    gateway.stop("TERM");
}

const TWO_BUSES: &str = r#"name = "Two buses"
[bus.body]
dbc = "body.dbc"
[bus.chassis]
dbc = "chassis.dbc"
[message.Lights]
timeout_ms = 60000
[message.Warning]
timeout_ms = 60000
[turn]
signal = "Lights.Direction"
off = [0]
left = [1]
right = [2]
while_hazard = "keep"
[hazard]
from = "signal"
signal = "Warning.Flasher"
off = [0]
on = [1]
"#;
