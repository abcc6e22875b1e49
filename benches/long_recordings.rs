//! Long recordings through `replay`, `decode`, `identify` and `check`: how fast, and that memory does not
//! grow with the recording.
//!
//! `cargo bench --bench long_recordings` takes 100,000 and 1,000,000 frames of the demo, end to end, so that
//! faults, silences and changes come at their usual rate. For another length, or a candump log of a vehicle
//! and its profile: `cargo bench --bench long_recordings -- 10000000 drive.log.gz ford_falcon_fg`. With
//! cantools, in the Python that `SIGNAL_GATEWAY_PEER_PYTHON` names, the same file is read and what the
//! profile's DBC knows is decoded.

#![allow(clippy::unwrap_used)] // a program for developers

#[path = "comparison.rs"]
mod comparison;
#[path = "demo_frames.rs"]
mod demo_frames;

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use comparison::{Row, figure, peers, point, run};
use demo_frames::{LIGHTS_VEHICLE, write_frames};
use flate2::write::GzEncoder;

const GATEWAY: &str = env!("CARGO_BIN_EXE_signal-gateway");
const MANY: u32 = 1_000_000;

/// Ten times the frames may take this much more memory, KiB, for what the system rounds and maps.
fn allowed(few_kib: i64) -> i64 {
    few_kib + few_kib / 5 + 2048
}

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    let many = arguments.first().map_or(MANY, |count| count.parse().unwrap());
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (source, profile, with_dbc) = match arguments.get(1..) {
        Some([log, profile]) => (PathBuf::from(log), profile.as_str(), profile.as_str()),
        _ => (project.join("config/demo.log.gz"), LIGHTS_VEHICLE, "demo_vehicle"),
    };
    let folder = tempfile::tempdir().unwrap();
    let logs = [many / 10, many].map(|frames| (frames, folder.path().join(format!("{frames}.log"))));
    for (frames, path) in &logs {
        let mut out = BufWriter::new(File::create(path).unwrap());
        write_frames(&mut out, &source, *frames).unwrap();
        out.flush().unwrap();
    }
    let packed = [many / 10, many].map(|frames| (frames, folder.path().join(format!("{frames}.log.gz"))));
    for (frames, path) in &packed {
        let mut out =
            GzEncoder::new(BufWriter::new(File::create(path).unwrap()), flate2::Compression::fast());
        write_frames(&mut out, &source, *frames).unwrap();
        out.finish().unwrap().flush().unwrap();
    }
    let replay = ["replay", "--json", "--profile", profile];
    let decode = ["decode", "--profile", profile];
    let ours = [
        measured("replay --json", GATEWAY, &replay, &logs),
        measured("replay --json, gzip", GATEWAY, &replay, &packed),
        measured("decode", GATEWAY, &decode, &logs),
        measured("identify", GATEWAY, &["identify"], &logs),
        measured("check", GATEWAY, &["check", "--profile", profile], &logs),
    ];
    let cantools = cantools(folder.path(), with_dbc, &logs);
    let mut good = true;
    if let Some(peers) = peers(&["lines", logs[1].1.to_str().unwrap()]) {
        let mut row = |ours: &Measured, peer, theirs, aim, limit| {
            good &=
                Row { what: ours.what, ours: ours.frame_ns, peer, theirs, unit: "ns a frame", aim, limit }
                    .print();
        };
        let sscanf = figure(&peers, "read a frame with sscanf");
        for ours in &ours {
            // Unpacking is beyond what sscanf does.
            let (aim, limit) = if ours.what.ends_with("gzip") { (None, 2.5) } else { (Some(0.5), 1.2) };
            row(ours, "read the frame with sscanf", sscanf, aim, limit);
        }
        row(
            &ours[0],
            "find the line's end with memchr",
            figure(&peers, "find the end of a line with memchr"),
            None,
            250.0,
        );
        if let Some(cantools) = cantools {
            row(&ours[0], "decode with cantools", cantools.frame_ns, None, 0.5);
        }
    }
    let grown: Vec<_> = ours.iter().filter(|ours| ours.has_grown).map(|ours| ours.what).collect();
    if !grown.is_empty() {
        println!("memory grows with the length of the recording: {}", grown.join(", "));
    }
    if good && grown.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The cost of a command.
struct Measured {
    what: &'static str,
    /// Processor time for each frame beyond those of the short recording, nanoseconds.
    frame_ns: f64,
    /// True if the longer recording took more memory.
    has_grown: bool,
}

/// Prints time and memory of a command on each recording.
fn measured(what: &'static str, program: &str, arguments: &[&str], logs: &[(u32, PathBuf); 2]) -> Measured {
    let [(few, few_kib), (many, many_kib)] = logs.each_ref().map(|(frames, path)| {
        let (time, peak_kib) = run(Command::new(program).args(arguments).arg(path));
        let seconds = time.as_secs_f64();
        println!(
            "{what:<20}{frames:>9} frames {seconds:>8.3} s of processor time, peak memory {peak_kib} KiB"
        );
        point(&format!("recording: {what}"), "s", f64::from(*frames), seconds);
        (seconds, peak_kib)
    });
    let frames = f64::from(logs[1].0 - logs[0].0);
    Measured { what, frame_ns: (many - few).max(0.0) * 1e9 / frames, has_grown: many_kib > allowed(few_kib) }
}

/// The same with cantools, if it is there.
fn cantools(folder: &Path, profile: &str, logs: &[(u32, PathBuf); 2]) -> Option<Measured> {
    let Some(python) = std::env::var_os("SIGNAL_GATEWAY_PEER_PYTHON") else {
        println!(
            "skipped: comparison with cantools: SIGNAL_GATEWAY_PEER_PYTHON is not set (tests/run sets it)"
        );
        return None;
    };
    let dbc = folder.join("profile.dbc");
    let show = ["profiles", "show", profile, "--dbc"];
    let shown = Command::new(GATEWAY).args(show).stdout(File::create(&dbc).unwrap()).status().unwrap();
    assert!(shown.success());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/cantools_log.py");
    let arguments = [script.to_str().unwrap(), dbc.to_str().unwrap()];
    Some(measured("cantools", python.to_str().unwrap(), &arguments, logs))
}
