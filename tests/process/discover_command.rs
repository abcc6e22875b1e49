//! `discover` on recordings, and `init`: what is written is accepted, and nothing is overwritten unasked.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::prerequisite::{peer_python, require};
use crate::support::program::{Ran, run};

/// Two rounds: the time of each request, s, and the driver's action of the simulated vehicle.
const ROUNDS: [(u32, &str, &str); 12] = [
    (10, "left", "stalk left"),
    (15, "off", "stalk off"),
    (19, "right", "stalk right"),
    (24, "off", "stalk off"),
    (28, "hazard", "hazard on"),
    (33, "off", "hazard off"),
    (37, "left", "stalk left"),
    (42, "off", "stalk off"),
    (46, "right", "stalk right"),
    (51, "off", "stalk off"),
    (55, "hazard", "hazard on"),
    (60, "off", "hazard off"),
];

/// A recording of a simulated vehicle, with marks beside it.
fn recorded(profile: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let lines = |line: &dyn Fn(u32, &str, &str) -> String| -> String {
        ROUNDS.iter().map(|(at, mark, request)| line(*at, mark, request)).collect()
    };
    fs::write(folder.path().join("script"), lines(&|at, _, request| format!("{at}.6 {request}\n"))).unwrap();
    fs::write(folder.path().join("marks"), lines(&|at, mark, _| format!("{at} {mark}\n"))).unwrap();
    let args = ["vehicle", "--profile", profile, "--candump", "--until", "65", "--script", "script"];
    fs::write(folder.path().join("drive.log"), run(&folder, &args).succeeded()).unwrap();
    folder
}

const INTO_CAR: [&str; 6] = ["discover", "drive.log", "--marks", "marks", "--output", "car"];

/// Accepted, with 4 for warnings about what the simulated vehicle does not send.
fn assert_found(found: &Ran, part: &str) {
    found.assert(if found.code == 4 { 4 } else { 0 }, part);
}

#[test]
fn a_marked_recording_becomes_a_configuration_that_check_accepts() {
    let folder = recorded("mazda_2017");
    let args = ["discover", "drive.log", "--marks", "marks", "--name", "My car"];
    assert_found(&run(&folder, &args), "followed 2 of 2 requests to the left");
    for file in ["my_car.dbc", "my_car.toml", "gateway.toml"] {
        assert!(folder.path().join("my_car").join(file).exists(), "{file}");
    }
    let replayed = run(&folder, &["replay", "drive.log", "--config", "my_car/gateway.toml"]).text();
    for state in ["turn_indicators  left", "turn_indicators  right"] {
        assert_eq!(replayed.matches(state).count(), 2, "{replayed}");
    }
    run(&folder, &args).assert(1, "nothing is overwritten unasked");
}

/// Two messages, of which the one with the indicators pauses for six seconds: it is not taken for one that is
/// sent when something changes, which needs another message that proves the bus alive.
#[test]
fn a_message_that_paused_once_is_still_sent_regularly() {
    let folder = recorded("mazda_2017");
    let path = folder.path().join("drive.log");
    let log = fs::read_to_string(&path).unwrap();
    let seconds = |line: &str| line[1..].split(')').next().unwrap().parse::<f64>().unwrap();
    let begin = seconds(log.lines().next().unwrap());
    let kept = log.lines().filter(|line| !(2.0..8.0).contains(&(seconds(line) - begin)));
    let kept: Vec<_> = kept.collect();
    fs::write(&path, kept.join("\n") + "\n").unwrap();
    assert_found(&run(&folder, &INTO_CAR), "");
    let profile = fs::read_to_string(folder.path().join("car/new_car.toml")).unwrap();
    assert!(profile.contains("timeout_ms = ") && !profile.contains("timing = \"event\""), "{profile}");
}

#[test]
fn the_written_dbc_is_read_by_cantools() {
    let python = require!(peer_python());
    let folder = recorded("mazda_2017");
    assert_found(&run(&folder, &INTO_CAR), "");
    run(&folder, &["check", "--config", "car/gateway.toml"]).succeeded();
    fs::write(folder.path().join("requests"), "file car/new_car.dbc\n").unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/cantools_decode.py");
    let mut decode = Command::new(python);
    let read = decode.current_dir(folder.path()).arg(script).arg("requests").output().unwrap();
    assert_eq!(Ran::from(read).text(), "file whole\n");
}

#[test]
fn what_is_not_sure_is_not_written() {
    let folder = recorded("mazda_2017");
    let marks: String = (1..7).map(|at| format!("{} left\n{} off\n", at * 9, at * 9 + 5)).collect();
    fs::write(folder.path().join("marks"), marks).unwrap();
    run(&folder, &INTO_CAR).assert(4, "Nothing is written");
    assert_eq!(fs::read_dir(folder.path().join("car")).unwrap().count(), 0);
    let unmarked = run(&folder, &["discover", "drive.log", "--output", "other"]);
    unmarked.assert(2, "no mark says what the driver did");
}

#[test]
fn init_writes_a_configuration_that_check_accepts_and_overwrites_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["init", "--interface", "can3", "--profile", "hyundai_kia", "--output", "gateway.toml"];
    run(&folder, &args).succeeded();
    run(&folder, &["check", "--config", "gateway.toml"]).assert(0, "powertrain on can3");
    let before = fs::read(folder.path().join("gateway.toml")).unwrap();
    run(&folder, &["init", "-i", "can0", "-p", "vw_mqb"]).assert(2, "gateway.toml exists");
    assert_eq!(fs::read(folder.path().join("gateway.toml")).unwrap(), before);
    run(&folder, &["init", "-i", "body=can0", "-p", "vw_mqb", "--force"]).succeeded();
    let wrong = run(&folder, &["init", "-i", "x=can0", "-p", "vw_mqb", "-o", "other.toml"]);
    wrong.assert(2, "the profile has no bus x; it has body");
    let lacking = run(&folder, &["init", "-i", "can0", "-o", "other.toml"]);
    lacking.assert(2, "no answer on standard input: give --profile");
}
