//! The command line as a user meets it: output, errors and exit codes of the built binary.

#![allow(clippy::unwrap_used)] // helpers of tests

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use crate::support::program::{Ran, program, run};
use crate::support::sources::project;

pub(super) const DEMO: &str = "config/demo.toml";

pub(super) fn gateway(args: &[&str]) -> Ran {
    run(project(), args)
}

pub(super) fn out(args: &[&str]) -> String {
    gateway(args).succeeded()
}

pub(super) fn refused(code: i32, args: &[&str]) -> String {
    let ran = gateway(args);
    ran.assert(code, "");
    ran.error
}

#[test]
fn every_command_explains_itself_with_examples() {
    let help = out(&["--help"]);
    for part in ["Exit codes:", "man signal-gateway", "/usr/share/doc/signal-gateway"] {
        assert!(help.contains(part), "{part}");
    }
    for command in
        ["run", "demo", "replay", "check", "decode", "lights", "decide", "vehicle", "discover", "init"]
    {
        assert!(out(&[command, "--help"]).contains("Examples:"), "{command}");
    }
}

#[test]
fn the_version_names_the_distribution() {
    let distribution = match (cfg!(feature = "jazzy"), cfg!(feature = "humble")) {
        (true, _) => "ROS 2 Jazzy",
        (_, true) => "ROS 2 Humble",
        _ => "without ROS 2",
    };
    let begin = format!("signal-gateway {} ({distribution}", env!("CARGO_PKG_VERSION"));
    let version = out(&["--version"]);
    assert!(version.starts_with(&begin) && version.ends_with(")\n"), "{version}");
}

#[test]
fn json_lines_have_the_three_fields_and_come_out_the_same_each_time() {
    let lines = out(&["replay", "--config", DEMO, "--json"]);
    assert_eq!(lines, out(&["replay", "--config", DEMO, "--json"]));
    let mut last = 0.0;
    let mut topics = std::collections::BTreeMap::new();
    for line in lines.lines() {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        let fields: Vec<_> = line.as_object().unwrap().keys().cloned().collect();
        assert_eq!(fields, ["t", "topic", "data"]);
        let t = line["t"].as_f64().unwrap();
        assert!(t >= last, "time runs forward");
        last = t;
        *topics.entry(line["topic"].as_str().unwrap().to_owned()).or_insert(0) += 1;
        if line["topic"] == "/vehicle/status/turn_indicators_status" {
            assert!((1..=3).contains(&line["data"]["report"].as_u64().unwrap()));
            assert!(line["data"]["stamp"]["sec"].as_i64().unwrap() > 1_700_000_000);
        }
    }
    // A minute: lights, gear, mode and doors at 10 Hz, the turn report with three silences of about 2 s;
    // velocity and steering at up to 50 Hz, the velocity with a silence of 3 s.
    let expected = [
        ("/diagnostics", 15..=30),
        ("/vehicle/doors/status", 590..=610),
        ("/vehicle/status/control_mode", 590..=610),
        ("/vehicle/status/gear_status", 590..=610),
        ("/vehicle/status/hazard_lights_status", 590..=610),
        ("/vehicle/status/steering_status", 2_900..=3_010),
        ("/vehicle/status/turn_indicators_status", 530..=550),
        ("/vehicle/status/velocity_status", 2_750..=2_860),
    ];
    assert_eq!(topics.len(), expected.len(), "{topics:?}");
    for (topic, count) in expected {
        assert!(count.contains(&topics[topic]), "{topic}: {topics:?}");
    }
}

#[test]
fn a_timed_replay_prints_the_same_lines() {
    let (folder, log) = log_of(&["(1.000000) can0 2A5#", "(1.100000) can0 2C1#"]);
    let args = ["replay", log.to_str().unwrap(), "--config", DEMO, "--json"];
    let virtual_time = out(&args);
    assert_eq!(out(&[&args[..], &["--speed", "20"]].concat()), virtual_time);
    drop(folder);
}

#[test]
fn decode_prints_signals_with_their_meaning() {
    let text = out(&["decode", "--config", DEMO, "--changes"]);
    assert!(text.contains(" can0 2A5 BCM_TurnIndicators.TurnIndicatorState = 1 (0x1) turn left\n"), "{text}");
    assert!(text.contains("TurnIndicatorState = 5 (0x5) turn UNDEFINED\n"));
    assert!(text.contains("HazardLightsState = 1 (0x1) hazard on\n"));
    let all = out(&["decode", "--config", DEMO]);
    let states = |text: &str| text.matches("TurnIndicatorState = ").count();
    assert!(states(&all) > 10 * states(&text));
}

#[test]
fn check_finds_a_turn_that_bends_the_other_way() {
    let map = std::fs::read_to_string("config/maps/crossing/lanelet2_map.osm").unwrap();
    let (_folder, path) = file("crossing.osm", &map.replace("v=\"left\"", "v=\"right\""));
    let checked = gateway(&["check", path.to_str().unwrap()]);
    checked.assert(4, "tagged right, but it bends 89° to the left\n");
}

#[test]
fn the_shipped_configurations_and_that_of_the_readme_are_accepted() {
    for shipped in ["config/gateway.toml", "config/command_bench.toml"] {
        assert!(out(&["check", "--config", shipped]).contains("0 warnings"), "{shipped}");
    }
    let readme = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    let (_, behind) = readme.split_once("```toml\n").unwrap();
    let (shown, _) = behind.split_once("```").unwrap();
    let (folder, path) = file("gateway.toml", shown);
    assert!(out(&["check", "--config", path.to_str().unwrap()]).contains("0 warnings"));
    drop(folder);
}

#[test]
fn names_cannot_control_the_terminal() {
    let profile = "name = \"Car\\u001b[2J\"\n[turn]\nfitted = false\n[hazard]\nfrom = \"not_fitted\"\n";
    let (folder, path) = file("car.toml", profile);
    let (log_folder, log) = log_of(&["(1.0) can\u{1b}0 111#00"]);
    let text = gateway(&["check", log.to_str().unwrap(), "--profile", path.to_str().unwrap()]).out;
    assert!(text.contains("vehicle    Car\\u{1b}[2J\n") && text.contains("on can\\u{1b}0\n"), "{text:?}");
    assert!(!text.contains('\u{1b}'), "{text:?}");
    let refused = gateway(&["replay", "/no\u{1b}where", "--profile", path.to_str().unwrap()]);
    assert!(refused.error.contains("/no\\u{1b}where: "));
    drop((folder, log_folder));
}

/// What a reader that stops early gets of a command that has more to say.
#[test]
fn output_may_be_cut_off_anywhere() {
    for args in [
        &["completions", "bash"][..],
        &["completions", "zsh"],
        &["man"],
        &["check", "--config", DEMO],
        &["replay", "--config", DEMO],
        &["replay", "--config", DEMO, "--json"],
        &["decode", "--config", DEMO],
        &["identify", "config/demo.log.gz"],
        &["profiles", "list"],
        &["profiles", "show", "hyundai_kia"],
        &["lights", "bench"],
        &["decide", "crossing_left"],
        &["vehicle", "--profile", "hyundai_kia", "--candump"],
        &["--help"],
        &["lights", "--help"],
    ] {
        let mut command = program(project(), args);
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = command.stdout(writer).stderr(Stdio::piped()).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && text.is_empty(), "{args:?}: {}: {text}", output.status);
    }
}

#[test]
fn examples_of_the_help_can_be_copied() {
    for command in
        ["run", "demo", "replay", "check", "decode", "lights", "decide", "vehicle", "discover", "init"]
    {
        let help = out(&[command, "--help"]);
        let (_, examples) = help.split_once("Examples:\n").unwrap();
        let (examples, _) = examples.split_once("\n\n").unwrap_or((examples, ""));
        let mut continues = false;
        for line in examples.lines() {
            assert!(continues || line.contains("signal-gateway "), "{command}: a torn example: {line}");
            assert!(line.chars().count() <= 90, "{command}: {line}");
            continues = line.ends_with('\\');
        }
        assert!(!continues);
    }
    let codes = out(&["--help"]);
    assert!(codes.contains("5  the scenario of lights failed, or an expectation of decide was not met\n"));
}

#[test]
fn a_recording_can_come_through_a_pipe_and_the_output_may_be_cut_off() {
    let mut command = program(project(), &["decode", "-", "--config", DEMO]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    writeln!(input, "(1.000000) can0 2A5#0000000000000000").unwrap();
    drop(input);
    let output = child.wait_with_output().unwrap();
    assert!(String::from_utf8(output.stdout).unwrap().contains("turn off"));
    // A reader that stops early is not a failure.
    let mut command = program(project(), &["decode", "--config", DEMO]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The simulated vehicle as a log: its uses according to the guide.
#[test]
fn a_simulated_vehicle_writes_the_same_log_each_time_and_its_replay_shows_its_requests() {
    let (folder, script) =
        file("day.txt", "2 stalk left  # signal\n\n5 stalk off\n6 fault bulb left\n7 hazard on\n");
    let profile = "config/vehicles/subaru_global.toml";
    let script = script.to_str().unwrap();
    let write = || out(&["vehicle", "--profile", profile, "--script", script, "--until", "12", "--candump"]);
    let log = write();
    assert_eq!(log, write());
    assert_eq!(log.lines().next(), Some("(1700000000.000000) can0 390#9300000000000000"));
    let path = folder.path().join("day.log");
    std::fs::write(&path, &log).unwrap();
    let timeline = out(&["replay", path.to_str().unwrap(), "--profile", profile]);
    for part in ["turn_indicators  left", "turn_indicators  off", "hazard_lights    on"] {
        assert!(timeline.contains(part), "{part} is not in\n{timeline}");
    }
}

pub(super) fn log_of(lines: &[&str]) -> (tempfile::TempDir, PathBuf) {
    file("drive.log", &(lines.join("\n") + "\n"))
}

pub(super) fn file(name: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = Path::new(folder.path()).join(name);
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

#[test]
fn a_request_without_effect_is_reported_beside_the_log_of_a_simulated_vehicle() {
    let mut script = tempfile::NamedTempFile::new().unwrap();
    write!(script, "0.1 fault drop NO_SUCH_MESSAGE\n0.2 stalk left\n").unwrap();
    let path = script.path().to_str().unwrap();
    let profile = "config/vehicles/bmw_e9x.toml";
    let Ran { code, out, error } =
        gateway(&["vehicle", "--profile", profile, "--candump", "--until", "1", "--script", path]);
    assert!(code == 0 && !out.is_empty());
    assert_eq!(error.matches("without effect on the bus").count(), 1, "{error}");
}

/// The binary alone, in a folder without anything.
#[test]
fn profiles_maps_drives_and_scenarios_are_in_the_binary() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| run(&folder, args);
    let list = run(&["profiles", "list"]).succeeded();
    let kia = list.lines().find(|line| line.starts_with("hyundai_kia ")).unwrap();
    assert!(kia.ends_with("  VSG·THD··  Hyundai and Kia"), "{kia}");
    run(&["profiles", "show", "hyundai_kia"]).assert(0, "name = \"Hyundai and Kia\"");
    let dbc = run(&["profiles", "show", "hyundai_kia", "--dbc"]).out;
    assert!(dbc.starts_with("VERSION"), "{dbc}");
    let sources = run(&["profiles", "show", "hyundai_kia", "--provenance"]);
    sources.assert(0, "nothing    turn, hazard: dbc hyundai_can_generated.dbc of commaai/opendbc at ");
    sources.assert(0, "recording  turn.off, hazard.off, message.CGW1.timing: Kona: off in all 98 frames, ");
    let mistyped = run(&["profiles", "show", "hyunday_kia"]);
    mistyped.assert(2, "did you mean the built-in profile hyundai_kia?");

    let checked = run(&["check", "--profile", "hyundai_kia"]);
    checked.assert(0, "powertrain on can0: built-in dbc/hyundai_kia.dbc, ");
    checked.assert(0, "\nunverified turn.left, turn.right, hazard.on, ");
    run(&["decide", "crossing_left"]).succeeded();
    run(&["lights", "bench", "--until", "1"]).succeeded();
    run(&["decide", "crosing_left"]).assert(3, "did you mean the built-in drive crossing_left");

    let config =
        "profile = \"hyundai_kia\"\n[can.body]\ninterface = \"can0\"\n[turn_signal]\nmap = \"crossing\"\n";
    std::fs::write(folder.path().join("gateway.toml"), config).unwrap();
    let refused = run(&["check", "--config", "gateway.toml"]);
    refused.assert(3, "gateway.toml:2:");
    refused.assert(3, "powertrain");
    std::fs::write(folder.path().join("gateway.toml"), config.replace("body", "powertrain")).unwrap();
    let checked = run(&["check", "--config", "gateway.toml"]);
    assert!(checked.out.contains("map built-in map crossing: "), "{checked:?}");
}
