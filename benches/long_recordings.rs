//! Long recordings through `replay`, `identify` and `check`: how fast, and that memory does not grow with the recording.
//!
//! `cargo bench --bench long_recordings` takes 100,000 and 1,000,000 frames of the demo, end to end, so that faults, silences
//! and changes come at their usual rate. For another length, or a candump log of a vehicle and its profile:
//! `cargo bench --bench long_recordings -- 10000000 drive.log.gz ford_falcon_fg`. With cantools, in the Python that
//! `SIGNAL_GATEWAY_PEER_PYTHON` names, the same file is read and what the profile's DBC knows is decoded.

#![allow(clippy::unwrap_used)] // a program for developers

use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;

const GATEWAY: &str = env!("CARGO_BIN_EXE_signal-gateway");
const MANY: u32 = 1_000_000;
/// The time between the end of a recording and its next round, ns.
const PAUSE_NS: u64 = 100_000_000;

/// Ten times the frames may take this much more memory, KiB, for what the system rounds and maps.
fn allowed(few_kib: i64) -> i64 {
    few_kib + few_kib / 5 + 2048
}

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    let many = arguments.first().map_or(MANY, |count| count.parse().unwrap());
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (source, profile) = match arguments.get(1..) {
        Some([log, profile]) => (PathBuf::from(log), profile.as_str()),
        _ => (project.join("config/demo.log.gz"), "demo_vehicle"),
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
    let has_grown = [
        ("replay", measured("replay", GATEWAY, &replay, &logs)),
        ("replay, gzip", measured("replay, gzip", GATEWAY, &replay, &packed)),
        ("identify", measured("identify", GATEWAY, &["identify"], &logs)),
        ("check", measured("check", GATEWAY, &["check", "--profile", profile], &logs)),
    ];
    cantools(folder.path(), profile, &logs);
    let grown: Vec<_> = has_grown.iter().filter(|(_, grown)| *grown).map(|(what, _)| *what).collect();
    if grown.is_empty() {
        return ExitCode::SUCCESS;
    }
    println!("memory grows with the length of the recording: {}", grown.join(", "));
    ExitCode::FAILURE
}

/// Prints time and memory of a command on each recording; true if the longer one took more memory.
fn measured(what: &str, program: &str, arguments: &[&str], logs: &[(u32, PathBuf); 2]) -> bool {
    let peaks = logs.each_ref().map(|(frames, path)| {
        let (time, peak_kib) = run(Command::new(program).args(arguments).arg(path));
        println!(
            "{what:<13}{frames:>9} frames {:>8.3} s {:>9.0} frames/s   peak memory {peak_kib} KiB",
            time.as_secs_f64(),
            f64::from(*frames) / time.as_secs_f64()
        );
        peak_kib
    });
    peaks[1] > allowed(peaks[0])
}

/// The same with cantools, if it is there.
fn cantools(folder: &Path, profile: &str, logs: &[(u32, PathBuf); 2]) {
    let Some(python) = std::env::var_os("SIGNAL_GATEWAY_PEER_PYTHON") else {
        println!(
            "skipped: comparison with cantools: SIGNAL_GATEWAY_PEER_PYTHON is not set (tests/run sets it)"
        );
        return;
    };
    let dbc = folder.join("profile.dbc");
    let show = ["profiles", "show", profile, "--dbc"];
    let shown = Command::new(GATEWAY).args(show).stdout(File::create(&dbc).unwrap()).status().unwrap();
    assert!(shown.success());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/cantools_log.py");
    let arguments = [script.to_str().unwrap(), dbc.to_str().unwrap()];
    measured("cantools", python.to_str().unwrap(), &arguments, logs);
}

/// Writes line by line: this process must stay smaller than those it measures.
fn write_frames(out: &mut impl Write, source: &Path, frames: u32) -> io::Result<()> {
    let (mut left, mut shift_ns) = (frames, 0);
    loop {
        let file = File::open(source)?;
        let is_packed = source.extension().is_some_and(|extension| extension == "gz");
        let log: Box<dyn Read> = if is_packed { Box::new(MultiGzDecoder::new(file)) } else { Box::new(file) };
        let (mut first_ns, mut last_ns) = (None, 0);
        for line in BufReader::new(log).lines() {
            if left == 0 {
                return Ok(());
            }
            let line = line?;
            let (stamp, rest) = line[1..].split_once(')').unwrap();
            let (seconds, micros) = stamp.split_once('.').unwrap();
            let [seconds, micros] = [seconds, micros].map(|number| number.parse::<u64>().unwrap());
            last_ns = seconds * 1_000_000_000 + micros * 1000;
            first_ns.get_or_insert(last_ns);
            let now_us = (last_ns + shift_ns) / 1000;
            writeln!(out, "({}.{:06}){rest}", now_us / 1_000_000, now_us % 1_000_000)?;
            left -= 1;
        }
        shift_ns += last_ns - first_ns.unwrap() + PAUSE_NS;
    }
}

/// Duration of a program that may find something, and its peak resident memory, KiB.
fn run(command: &mut Command) -> (Duration, i64) {
    let start = Instant::now();
    #[allow(clippy::zombie_processes)] // `wait` below reaps it
    let child = command.stdout(Stdio::null()).spawn().unwrap();
    let peak_kib = wait(libc::pid_t::try_from(child.id()).unwrap());
    let time = start.elapsed();
    // Until it became the program the child was this process, and Linux counts that in.
    let own = own_peak_kib();
    assert!(own < peak_kib, "{own} KiB here hide what the program needs");
    (time, peak_kib)
}

/// Waits until the process has ended, with 0, or with 4 for findings; its peak resident memory, KiB.
fn wait(pid: libc::pid_t) -> i64 {
    // SAFETY: all-zero is a valid `rusage`.
    #[allow(unsafe_code)]
    let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
    let mut status = 0;
    // SAFETY: both pointers are to live values of the right types; `pid` is our child, waited for once.
    #[allow(unsafe_code)]
    let waited = unsafe { libc::wait4(pid, &raw mut status, 0, &raw mut usage) };
    assert_eq!(waited, pid);
    assert!(libc::WIFEXITED(status) && [0, 4].contains(&libc::WEXITSTATUS(status)), "it failed: {status}");
    usage.ru_maxrss
}

fn own_peak_kib() -> i64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}
