//! Every byte of recorded frames against an independent encoder: `cantools` with the same DBC, and
//! checksums of its script's own.

use std::path::Path;
use std::process::Command;

use super::recording::RecordedFrame;
use super::vehicles::Vehicle;
use crate::support::prerequisite::peer_python;
use crate::support::process::Folder;

/// Has all frames decoded, and made again from their requests and their index in the recording. They
/// must request each of `states` at least once.
pub(crate) fn check(folder: &Folder, vehicle: &Vehicle, frames: &[RecordedFrame], states: &[&str]) {
    let line = |frame: &RecordedFrame| {
        let data: String = frame.data.iter().map(|byte| format!("{byte:02X}")).collect();
        let width = if frame.id >> 31 == 0 { 3 } else { 8 };
        let at = frame.at.as_secs_f64();
        let request = vehicle.request(&frame.data);
        format!("({at:.6}) can0 {:0width$X}#{data} {request}\n", frame.id & 0x1FFF_FFFF)
    };
    folder.write("bus.log", &frames.iter().map(line).collect::<String>());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/command_frames.py");
    let mut command = Command::new(peer_python().unwrap());
    command.arg(script).args([vehicle.name, "vehicle.dbc", "bus.log"]).current_dir(folder.path());
    let output = command.output().unwrap();
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{stdout}{}", String::from_utf8_lossy(&output.stderr));
    println!("{}: cantools makes the same of {}", vehicle.name, stdout.trim());
    let first = stdout.split_whitespace().next().and_then(|count| count.parse().ok());
    assert_eq!(first, Some(frames.len()), "{stdout}");
    for state in states {
        assert!(stdout.contains(&format!(" {state}:")), "no frame requested {state}: {stdout}");
    }
}
