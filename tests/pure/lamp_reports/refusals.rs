//! Lamps that frames cannot resolve: refusals of the commands, before anything is published.

use std::process::{Command, Output};

use crate::pure::lamp_reports::car::{DBC, GATEWAY, NOT_VISIBLE, lamp_keys, profile};

/// Output of the commands for lamps in a message of this cycle time and with these `lamp` keys.
fn outputs(commands: [&str; 2], cycle_ms: u32, lamp: &str) -> [Output; 2] {
    let folder = tempfile::tempdir().unwrap();
    let turn = lamp_keys("hazard", lamp);
    let lights = format!("[message.LAMPS]\ntimeout_ms = 5000\n[turn]\n{turn}{NOT_VISIBLE}");
    let dbc = format!(
        "{DBC}BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_ \"GenMsgCycleTime\" BO_ 256 {cycle_ms};\n"
    );
    let ended = "source = \"recording\"\n";
    let recording = "[recording]\nfile = \"drive.log\"\nspeed = 1000.0\n[ros]\nenabled = false\n";
    let gateway = format!("{ended}{GATEWAY}{recording}");
    let log = "(1.000000) can0 104#00\n(1.100000) can0 104#00\n".to_owned();
    let texts =
        [("gateway.toml", gateway), ("profile.toml", profile(&lights)), ("car.dbc", dbc), ("drive.log", log)];
    for (name, text) in texts {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    commands.map(|command| {
        Command::new(env!("CARGO_BIN_EXE_signal-gateway"))
            .args([command, "--config", "gateway.toml"])
            .current_dir(folder.path())
            .output()
            .unwrap()
    })
}

#[test]
fn a_message_that_comes_once_a_second_is_refused_with_its_place() {
    let by_dbc = (
        "profile.toml:9:15\n",
        "turn.left_signal: LAMPS: a flashing lamp in a message sent every 1s cannot be distinguished",
    );
    let by_key = (
        "profile.toml:12:22\n",
        "turn.lamp.period_ms: LAMPS: a flashing lamp in a message sent every 1s cannot be",
    );
    for (cycle_ms, lamp, (place, text)) in [(1000, "", by_dbc), (50, "period_ms = 1000", by_key)] {
        for output in outputs(["check", "run"], cycle_ms, lamp) {
            let stderr = String::from_utf8(output.stderr).unwrap();
            assert!(stderr.contains(place) && stderr.contains(text), "{stderr}");
            assert!(stderr.contains("bind a logical or request signal"), "{stderr}");
            assert_eq!(output.status.code(), Some(3));
        }
    }
}

#[test]
fn short_flashes_that_may_fall_between_frames_are_worth_a_note() {
    let note = "LAMPS.LEFT and LAMPS.RIGHT: frames are further apart than the shortest legal flash";
    for (cycle_ms, noted) in [(200, true), (100, false)] {
        let [check, replay] = outputs(["check", "replay"], cycle_ms, "");
        let check = String::from_utf8(check.stdout).unwrap();
        assert_eq!(check.contains(&format!("note       {note}")), noted, "{check}");
        let log = String::from_utf8(replay.stderr).unwrap();
        assert_eq!(log.contains(note), noted, "{log}");
    }
}
