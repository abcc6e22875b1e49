//! `discover` on recordings, and `init`: what is written is accepted, and nothing is overwritten unasked.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::support::prerequisite::{peer_python, require};

fn gateway(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.current_dir(folder).env_remove("RUST_LOG").args(args).output().unwrap()
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

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
    let log = gateway(folder.path(), &args);
    assert!(log.status.success(), "{}", text(&log));
    fs::write(folder.path().join("drive.log"), log.stdout).unwrap();
    folder
}

#[test]
fn a_marked_recording_becomes_a_configuration_that_check_accepts() {
    let folder = recorded("mazda_2017");
    let args = ["discover", "drive.log", "--marks", "marks", "--name", "My car"];
    let found = gateway(folder.path(), &args);
    // 4: accepted, with warnings about what the simulated vehicle does not send.
    assert!(matches!(found.status.code(), Some(0 | 4)), "{}", text(&found));
    assert!(text(&found).contains("followed 2 of 2 requests to the left"), "{}", text(&found));
    for file in ["my_car.dbc", "my_car.toml", "gateway.toml"] {
        assert!(folder.path().join("my_car").join(file).exists(), "{file}");
    }
    let replayed = gateway(folder.path(), &["replay", "drive.log", "--config", "my_car/gateway.toml"]);
    let text_of = text(&replayed);
    for state in ["ENABLE_LEFT", "ENABLE_RIGHT"] {
        assert_eq!(text_of.matches(state).count(), 2, "{text_of}");
    }
    let again = gateway(folder.path(), &args);
    assert_eq!(again.status.code(), Some(1));
    assert!(text(&again).contains("nothing is overwritten unasked"), "{}", text(&again));
}

/// Two messages, of which the one with the indicators pauses for six seconds: it is not taken for one that is sent when
/// something changes, which needs another message that proves the bus alive.
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
    let found = gateway(folder.path(), &["discover", "drive.log", "--marks", "marks", "--output", "car"]);
    assert!(matches!(found.status.code(), Some(0 | 4)), "{}", text(&found));
    let profile = fs::read_to_string(folder.path().join("car/new_car.toml")).unwrap();
    assert!(profile.contains("timeout_ms = ") && !profile.contains("timing = \"event\""), "{profile}");
}

#[test]
fn the_written_dbc_is_read_by_cantools() {
    let python = require!(peer_python());
    let folder = recorded("mazda_2017");
    let found = gateway(folder.path(), &["discover", "drive.log", "--marks", "marks", "--output", "car"]);
    assert!(matches!(found.status.code(), Some(0 | 4)), "{}", text(&found));
    let checked = gateway(folder.path(), &["check", "--config", "car/gateway.toml"]);
    assert_eq!(checked.status.code(), Some(0), "{}", text(&checked));
    fs::write(folder.path().join("requests"), "file car/new_car.dbc\n").unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/cantools_decode.py");
    let mut decode = Command::new(python);
    let read = decode.current_dir(folder.path()).arg(script).arg("requests").output().unwrap();
    assert_eq!(text(&read), "file whole\n");
}

#[test]
fn what_is_not_sure_is_not_written() {
    let folder = recorded("mazda_2017");
    let marks: String = (1..7).map(|at| format!("{} left\n{} off\n", at * 9, at * 9 + 5)).collect();
    fs::write(folder.path().join("marks"), marks).unwrap();
    let found = gateway(folder.path(), &["discover", "drive.log", "--marks", "marks", "--output", "car"]);
    assert_eq!(found.status.code(), Some(4), "{}", text(&found));
    assert!(text(&found).contains("Nothing is written"), "{}", text(&found));
    assert_eq!(fs::read_dir(folder.path().join("car")).unwrap().count(), 0);
    let unmarked = gateway(folder.path(), &["discover", "drive.log", "--output", "other"]);
    assert_eq!(unmarked.status.code(), Some(2));
    assert!(text(&unmarked).contains("no mark says what the driver did"), "{}", text(&unmarked));
}

#[test]
fn init_writes_a_configuration_that_check_accepts_and_overwrites_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["init", "--interface", "can3", "--profile", "hyundai_kia", "--output", "gateway.toml"];
    let written = gateway(folder.path(), &args);
    assert!(written.status.success(), "{}", text(&written));
    let checked = gateway(folder.path(), &["check", "--config", "gateway.toml"]);
    assert_eq!(checked.status.code(), Some(0), "{}", text(&checked));
    assert!(text(&checked).contains("powertrain on can3"), "{}", text(&checked));
    let before = fs::read(folder.path().join("gateway.toml")).unwrap();
    let again = gateway(folder.path(), &["init", "-i", "can0", "-p", "vw_mqb"]);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again).contains("gateway.toml exists"), "{}", text(&again));
    assert_eq!(fs::read(folder.path().join("gateway.toml")).unwrap(), before);
    let forced = gateway(folder.path(), &["init", "-i", "body=can0", "-p", "vw_mqb", "--force"]);
    assert!(forced.status.success(), "{}", text(&forced));
    let wrong = gateway(folder.path(), &["init", "-i", "x=can0", "-p", "vw_mqb", "-o", "other.toml"]);
    assert!(text(&wrong).contains("the profile has no bus x; it has body"), "{}", text(&wrong));
    let lacking = gateway(folder.path(), &["init", "-i", "can0", "-o", "other.toml"]);
    assert!(text(&lacking).contains("no answer on standard input: give --profile"), "{}", text(&lacking));
}
