//! A recording of a million frames through `signal-gateway replay --json`: how fast, and that
//! memory does not grow with the recording.
//!
//! `cargo bench --bench replay_million`. The recordings are the demo's, end to end until the count
//! is reached, so faults, silences and changes come at their usual rate.

#![allow(clippy::unwrap_used)] // a program for developers

use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;

const FEW: u32 = 100_000;
const MANY: u32 = 1_000_000;

/// Ten times the frames may take this much more memory, KiB, for what the system rounds and maps.
fn allowed(few_kib: i64) -> i64 {
    few_kib + few_kib / 5 + 2048
}

fn main() -> ExitCode {
    let folder = tempfile::tempdir().unwrap();
    let mut grown = false;
    for packed in [false, true] {
        let peaks = [FEW, MANY].map(|frames| {
            let path = folder.path().join(format!("{frames}.log{}", if packed { ".gz" } else { "" }));
            record(&path, frames, packed).unwrap();
            let (time, peak_kib) = replay(&path);
            println!(
                "{:<8}{frames:>9} frames {:>7.3} s {:>11.0} frames/s   peak memory {peak_kib} KiB",
                if packed { "gzip" } else { "plain" },
                time.as_secs_f64(),
                f64::from(frames) / time.as_secs_f64()
            );
            peak_kib
        });
        grown |= peaks[1] > allowed(peaks[0]);
    }
    if grown {
        println!("memory grows with the length of the recording");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

/// Writes line by line: this process must stay smaller than the one it measures.
fn record(path: &Path, frames: u32, packed: bool) -> io::Result<()> {
    let file = BufWriter::new(File::create(path)?);
    if packed {
        let mut out = GzEncoder::new(file, flate2::Compression::fast());
        write_frames(&mut out, frames)?;
        out.finish()?.flush()
    } else {
        let mut out = file;
        write_frames(&mut out, frames)?;
        out.flush()
    }
}

fn write_frames(out: &mut impl Write, frames: u32) -> io::Result<()> {
    let mut left = frames;
    for round in 0_u64.. {
        let demo = File::open(Path::new(env!("CARGO_MANIFEST_DIR")).join("config/demo.log.gz"))?;
        for line in BufReader::new(MultiGzDecoder::new(demo)).lines() {
            if left == 0 {
                return Ok(());
            }
            let line = line?;
            let (seconds, rest) = line[1..].split_once('.').unwrap();
            // The recording is just over 45 s long.
            let seconds = seconds.parse::<u64>().unwrap() + 46 * round;
            writeln!(out, "({seconds}.{rest}")?;
            left -= 1;
        }
    }
    Ok(())
}

/// Duration of the replay, and its peak resident memory, KiB.
fn replay(log: &Path) -> (Duration, i64) {
    let start = Instant::now();
    #[allow(clippy::zombie_processes)] // `wait` below reaps it
    let child = Command::new(env!("CARGO_BIN_EXE_signal-gateway"))
        .args(["replay", "--json", "--config", "config/demo.toml"])
        .arg(log)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let peak_kib = wait(libc::pid_t::try_from(child.id()).unwrap());
    let time = start.elapsed();
    // Until it became the gateway the child was this process, and Linux counts that in.
    let own = own_peak_kib();
    assert!(own < peak_kib, "{own} KiB here hide what the replay needs");
    (time, peak_kib)
}

/// Waits until the process has ended well; its peak resident memory, KiB.
fn wait(pid: libc::pid_t) -> i64 {
    // SAFETY: all-zero is a valid `rusage`.
    #[allow(unsafe_code)]
    let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
    let mut status = 0;
    // SAFETY: both pointers are to live values of the right types; `pid` is our child, waited for once.
    #[allow(unsafe_code)]
    let waited = unsafe { libc::wait4(pid, &raw mut status, 0, &raw mut usage) };
    assert_eq!((waited, status), (pid, 0), "the replay failed");
    usage.ru_maxrss
}

fn own_peak_kib() -> i64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}
