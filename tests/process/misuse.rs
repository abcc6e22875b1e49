//! What people type that means something else: the answer says what was meant.

use std::fs;
use std::process::{Command, Stdio};

use super::cli::{file, gateway, log_of, refused};

#[test]
fn arguments_that_mean_something_else_are_answered_with_what_was_meant() {
    for (arguments, tip) in [
        (&["check", "car/gateway.toml", "drive.log"][..], "given with --config car/gateway.toml"),
        (&["check", "drive.log", "car.toml"], "a profile with --profile car.toml"),
        (&["check", "--log", "drive.log"], "the recording stands by itself: check drive.log"),
        (&["replay", "--log=drive.log"], "the recording stands by itself: replay drive.log"),
        (&["profiles", "hyundai_kia"], "to print it: profiles show hyundai_kia"),
        (&["profiles", "my_car"], "profiles list shows the names"),
        (&["run", "--interface", "can0"], "to write one: init --interface can0 --profile NAME"),
        (&["identify"], "or listen to a bus: identify --live can0"),
    ] {
        let text = refused(2, arguments);
        assert!(text.contains(tip), "{arguments:?}: {text}");
    }
}

#[test]
fn the_same_is_said_about_an_interface_by_every_command() {
    let texts =
        [&["identify", "--live", "nosuchcan7"], &["discover", "--live", "nosuchcan7"]].map(|arguments| {
            let folder = tempfile::tempdir().unwrap();
            let output = folder.path().join("car");
            let output: &[&str] =
                if arguments[0] == "discover" { &["-o", output.to_str().unwrap()] } else { &[] };
            refused(1, &[&arguments[..], output].concat())
        });
    assert_eq!(texts[0], texts[1]);
    assert!(
        texts[0].starts_with("error: nosuchcan7 is missing\n") && texts[0].contains("= help: "),
        "{}",
        texts[0]
    );
}

#[test]
fn a_recording_without_times_is_named() {
    for line in ["  can0  123   [8]  01 02 03 04 05 06 07 08", "can0 123#0102", "  vcan0  18FECA00   [0]"] {
        let (_folder, log) = log_of(&[line]);
        let text = refused(1, &["identify", log.to_str().unwrap()]);
        assert!(text.contains("candump without times\n"), "{text}");
        assert!(text.contains("= help: record it with candump -L; "), "{text}");
    }
}

#[test]
fn a_profile_that_is_not_that_of_the_recording_leads_to_identify() {
    let wrong = gateway(&["check", "config/demo.log.gz", "--profile", "vw_mqb"]);
    let text = String::from_utf8(wrong.stderr).unwrap();
    assert_eq!(wrong.status.code(), Some(4));
    assert!(text.contains("signal-gateway identify config/demo.log.gz"), "{text}");
    let right = gateway(&["check", "config/demo.log.gz", "--profile", "demo_vehicle"]);
    assert_eq!(String::from_utf8(right.stderr).unwrap(), "");
}

#[test]
fn fix_says_when_there_is_nothing_to_add() {
    let output = gateway(&["check", "--profile", "demo_vehicle", "--fix"]);
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(output.stdout.is_empty(), "{text}");
    assert!(text.contains("nothing to add to the profile: give a recording"), "{text}");
}

#[test]
fn a_profile_in_a_file_needs_its_dbc_beside_it() {
    let show = |output: Stdio| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
        let shown = command.args(["profiles", "show", "hyundai_kia"]).stdout(output).output().unwrap();
        String::from_utf8(shown.stderr).unwrap()
    };
    let text = show(tempfile::tempfile().unwrap().into());
    assert!(text.contains("signal-gateway profiles show hyundai_kia --dbc"), "{text}");
    assert_eq!(show(Stdio::piped()), "");
}

#[test]
fn init_looks_at_the_profile_before_it_asks_about_a_file() {
    let (_folder, path) = file("gateway.toml", "mine\n");
    let text = refused(3, &["init", "-i", "can0", "-p", "hyunday_kia", "-o", path.to_str().unwrap()]);
    assert!(text.contains("did you mean the built-in profile hyundai_kia?"), "{text}");
    assert!(!text.contains("exists"), "{text}");
    assert_eq!(fs::read_to_string(path).unwrap(), "mine\n");
}
