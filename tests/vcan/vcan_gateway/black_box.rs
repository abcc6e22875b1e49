//! A fault on the road, replayed on the desk.

use std::path::Path;
use std::process::Command;

use super::{Folder, HAZARD, HAZARD_OFF, LEFT, OFF, PATIENT, Process, RIGHT, Sender, TURN, UNDEFINED, Vcan};
use crate::support::mcap::McapReaders;
use crate::support::prerequisite::{Missing, require};
use crate::support::tmpfs::Tmpfs;
use crate::support::waiting::wait_until;

#[test]
fn a_recording_of_a_fault_replays_to_the_same_decisions_byte_for_byte() {
    let vcan = require!(Vcan::new("vcan8"));
    let keys = "[black_box]\nfolder = \"box\"\nbefore_s = 300\nafter_s = 300\n[ros]\nenabled = false\n";
    let folder = Folder::with_demo_vehicle("vcan8", keys);
    folder.append("demo_vehicle.toml", PATIENT);
    let sender = Sender::start(&vcan, &[(TURN, OFF), (HAZARD, HAZARD_OFF)]);
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("hazard_lights: publishing");
    for (data, logged) in
        [(LEFT, "turn_indicators: left"), (UNDEFINED, "invalid"), (RIGHT, "turn_indicators: right")]
    {
        sender.set(TURN, data);
        gateway.wait_for_log(logged);
    }
    vcan.bring_down();
    gateway.wait_for_log("vcan8 is down");
    sender.set(TURN, LEFT);
    vcan.bring_up();
    gateway.wait_for_logs("turn_indicators: left", 2);
    // However long that took, it is one window, which the end closes.
    gateway.stop("TERM");
    let logs = paths(&folder.path().join("box"), "log");
    let [log] = logs.as_slice() else { panic!("one fault opens one window: {logs:?}") };
    let decisions = std::fs::read_to_string(log.with_extension("decisions")).unwrap();
    for part in [
        "turn_indicators  left",
        "invalid: ",
        "turn_indicators  right",
        "vcan8 is down",
        "no longer published",
    ] {
        assert!(decisions.contains(part), "{part} is not in\n{decisions}");
    }
    let replay = Command::new(env!("CARGO_BIN_EXE_signal-gateway"))
        .args(["replay", log.to_str().unwrap(), "--config"])
        .arg(folder.path().join("gateway.toml"))
        .output()
        .unwrap();
    let replayed = String::from_utf8(replay.stdout).unwrap();
    // The output of the replay before its first input is that of the gateway at its start: before the
    // recording begins, or at its very beginning when the first frame was there already.
    let lines_at_start = if decisions.lines().next() == replayed.lines().next() { 0 } else { 3 };
    let settled: String = replayed.lines().skip(lines_at_start).map(|line| format!("{line}\n")).collect();
    let differing = settled.lines().zip(decisions.lines()).find(|(replayed, recorded)| replayed != recorded);
    let log = std::fs::read_to_string(log).unwrap();
    assert_eq!(differing, None, "replayed, recorded\n{settled}\n{decisions}\n{log}");
    assert_eq!(settled.lines().count(), decisions.lines().count(), "{settled}\n{decisions}\n{log}");
}

/// A gateway with a black box on `box`, which `prepare` has made or has not, that publishes both reports.
struct Drive {
    _vcan: Vcan,
    sender: Sender,
    gateway: Process,
    folder: Folder,
}

impl Drive {
    fn start(name: &'static str, after_s: u32, prepare: impl FnOnce(&Path)) -> Result<Self, Missing> {
        let vcan = Vcan::new(name)?;
        let keys = format!("[black_box]\nfolder = \"box\"\nafter_s = {after_s}\n[ros]\nenabled = false\n");
        let folder = Folder::with_demo_vehicle(name, &keys);
        folder.append("demo_vehicle.toml", PATIENT);
        prepare(&folder.path().join("box"));
        let sender = Sender::start(&vcan, &[(TURN, OFF), (HAZARD, HAZARD_OFF)]);
        let mut gateway = Process::run(&folder);
        gateway.wait_for_log("hazard_lights: publishing");
        gateway.wait_for_log("turn_indicators: publishing");
        Ok(Self { _vcan: vcan, sender, gateway, folder })
    }

    /// A change to ERROR and back, `times` of them so far.
    fn fault(&mut self, times: usize) {
        self.sender.set(TURN, UNDEFINED);
        self.gateway.wait_for_logs("turn_indicators: invalid", times);
        self.sender.set(TURN, OFF);
        self.gateway.wait_for_logs("turn_indicators: publishing", times + 1);
    }

    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path().join("box")).unwrap();
        let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<_> = names.filter(|name| name.starts_with("fault-")).collect();
        names.sort();
        names
    }
}

#[test]
fn stop_within_the_window_writes_what_there_is() {
    let mut drive = require!(Drive::start("vcan16", 300, |_| ()));
    drive.fault(1);
    drive.gateway.stop("TERM");
    let files = drive.files();
    let extensions: Vec<_> = files.iter().map(|name| name.rsplit_once('.').unwrap().1).collect();
    assert_eq!(extensions, ["decisions", "log", "mcap"], "{files:?}");
    let decisions = std::fs::read_to_string(drive.folder.path().join("box").join(&files[0])).unwrap();
    assert!(decisions.contains("invalid"), "{decisions}");
}

#[test]
fn mcap_of_a_fault_has_the_frames_of_its_log_and_what_was_published() {
    let readers = require!(McapReaders::find());
    let mut drive = require!(Drive::start("vcan20", 300, |_| ()));
    drive.sender.set(TURN, LEFT);
    drive.gateway.wait_for_log("turn_indicators: left");
    drive.fault(1);
    drive.gateway.stop("TERM");
    let folder = drive.folder.path().join("box");
    let [log] = &paths(&folder, "log")[..] else { panic!("{:?}", drive.files()) };
    let messages = readers.messages(&log.with_extension("mcap"));
    let of = |topic: &str| messages.iter().filter(|message| message["topic"] == topic).collect::<Vec<_>>();
    let frames: Vec<_> = of("/body/from_can_bus")
        .into_iter()
        .map(|message| {
            let micros = message["log_time"].as_u64().unwrap() / 1_000;
            let fields = &message["fields"];
            let data = fields["data"].as_array().unwrap().iter();
            let data: String = data.map(|byte| format!("{:02X}", byte.as_u64().unwrap())).collect();
            let (id, interface) =
                (fields["id"].as_u64().unwrap(), fields["header"]["frame_id"].as_str().unwrap());
            format!("({}.{:06}) {interface} {id:03X}#{data}", micros / 1_000_000, micros % 1_000_000)
        })
        .collect();
    let log = std::fs::read_to_string(log).unwrap();
    let logged: Vec<_> = log.lines().filter(|line| !line.starts_with('#')).collect();
    assert!(logged.len() > 4, "{log}");
    assert_eq!(frames, logged);
    let reports = of("/vehicle/status/turn_indicators_status");
    let values: Vec<_> =
        reports.iter().map(|message| message["fields"]["report"].as_u64().unwrap()).collect();
    assert!(values.contains(&2), "ENABLE_LEFT was published: {values:?}");
    assert!(!of("/diagnostics").is_empty());
}

#[test]
fn folder_removed_while_running_is_made_again() {
    let mut drive = require!(Drive::start("vcan17", 1, |_| ()));
    drive.fault(1);
    drive.gateway.wait_for_logs("black box written", 1);
    std::fs::remove_dir_all(drive.folder.path().join("box")).unwrap();
    drive.fault(2);
    drive.gateway.wait_for_logs("black box written", 2);
    drive.gateway.stop("TERM");
    assert!(drive.files().iter().all(|name| name.starts_with("fault-000002-")), "{:?}", drive.files());
}

#[test]
fn read_only_folder_is_reported_and_used_once_it_can_be_written() {
    let mut tmpfs = None;
    let mut drive = require!(Drive::start("vcan18", 1, |folder| tmpfs = Some(Tmpfs::new(folder, "ro"))));
    let tmpfs = require!(tmpfs.unwrap());
    drive.gateway.wait_for_log("black_box: recordings cannot be written: Read-only file system");
    drive.fault(1);
    tmpfs.remount("rw");
    drive.gateway.wait_for_log("black_box: ready");
    drive.fault(2);
    drive.gateway.wait_for_log("black box written");
    drive.gateway.stop("TERM");
    assert!(!paths(&drive.folder.path().join("box"), "log").is_empty(), "{:?}", drive.files());
}

#[test]
fn full_disk_costs_the_recording_and_nothing_else() {
    let mut tmpfs = None;
    let mut drive = require!(Drive::start("vcan19", 1, |folder| tmpfs = Some(Tmpfs::new(folder, "size=1m"))));
    let _tmpfs = require!(tmpfs.unwrap());
    let filler = drive.folder.path().join("box/filler");
    // It is full before the last byte.
    assert!(std::fs::write(&filler, vec![0; 2 * 1024 * 1024]).is_err());
    drive.fault(1);
    drive.gateway.wait_for_log("black_box: recordings cannot be written: No space left on device");
    wait_until("nothing to be left of it", || drive.files().is_empty());
    std::fs::remove_file(&filler).unwrap();
    drive.fault(2);
    drive.gateway.wait_for_log("black box written");
    drive.gateway.stop("TERM");
    assert_eq!(drive.files().len(), 3, "{:?}", drive.files());
}

fn paths(folder: &Path, extension: &str) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|is| is == extension)).collect()
}
