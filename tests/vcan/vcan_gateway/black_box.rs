//! A fault on the road, replayed on the desk.

use std::path::Path;
use std::process::Command;

use super::{Folder, HAZARD, HAZARD_OFF, LEFT, OFF, PATIENT, Process, RIGHT, Sender, TURN, UNDEFINED, Vcan};
use crate::support::prerequisite::require;

#[test]
fn a_recording_of_a_fault_replays_to_the_same_decisions_byte_for_byte() {
    let vcan = require!(Vcan::new("vcan8"));
    let keys = "[black_box]\nfolder = \"box\"\nbefore_s = 300\nafter_s = 5\n[ros]\nenabled = false\n";
    let folder = Folder::with_demo_vehicle("vcan8", keys);
    folder.append("demo_vehicle.toml", PATIENT);
    let sender = Sender::start(&vcan, &[(TURN, OFF), (HAZARD, HAZARD_OFF)]);
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("hazard_lights: publishing");
    for (data, heard) in [(LEFT, "ENABLE_LEFT"), (UNDEFINED, "invalid"), (RIGHT, "ENABLE_RIGHT")] {
        sender.set(TURN, data);
        gateway.wait_for_log(heard);
    }
    vcan.bring_down();
    gateway.wait_for_log("vcan8 is down");
    sender.set(TURN, LEFT);
    vcan.bring_up();
    gateway.wait_for_log("black box written");
    gateway.stop("TERM");
    let logs = paths(&folder.path().join("box"), "log");
    let [log] = logs.as_slice() else { panic!("one fault opens one window: {logs:?}") };
    let decisions = std::fs::read_to_string(log.with_extension("decisions")).unwrap();
    for part in ["ENABLE_LEFT", "invalid: ", "ENABLE_RIGHT", "vcan8 is down", "no longer published"] {
        assert!(decisions.contains(part), "{part} is not in\n{decisions}");
    }
    let replay = Command::new(env!("CARGO_BIN_EXE_signal-gateway"))
        .args(["replay", log.to_str().unwrap(), "--config"])
        .arg(folder.path().join("gateway.toml"))
        .output()
        .unwrap();
    let replayed = String::from_utf8(replay.stdout).unwrap();
    // What the replay says before its first input, the gateway said at its start: before the recording
    // begins, or at its very beginning when the first frame was there already.
    let said_at_start = if decisions.lines().next() == replayed.lines().next() { 0 } else { 3 };
    let settled: String = replayed.lines().skip(said_at_start).map(|line| format!("{line}\n")).collect();
    let differing = settled.lines().zip(decisions.lines()).find(|(replayed, recorded)| replayed != recorded);
    let log = std::fs::read_to_string(log).unwrap();
    assert_eq!(differing, None, "replayed, recorded\n{settled}\n{decisions}\n{log}");
    assert_eq!(settled.lines().count(), decisions.lines().count(), "{settled}\n{decisions}\n{log}");
}

fn paths(folder: &Path, extension: &str) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|is| is == extension)).collect()
}
