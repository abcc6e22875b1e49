//! A network process that runs as a child of this process.

use std::fs;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, ExitStatus};

use serde::{Deserialize, Serialize};

use super::threads::Threads;
use crate::process_status::network::NetworkFailure;
use ros_transport::PANICKED;

/// Environment variables passed to the process, as its log needs them.
const KEPT: [&str; 4] = ["RUST_LOG", "RUST_BACKTRACE", "JOURNAL_STREAM", "NO_COLOR"];
/// Number of arenas of the C library's allocator. Otherwise each thread would have its own, with its own
/// reserve of memory.
const ARENAS: &str = "2";

/// The kernel's measurements of a process.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct ProcessReading {
    pub(super) threads: Option<Threads>,
    /// Memory in use, bytes.
    pub(super) memory_bytes: Option<u64>,
}

impl ProcessReading {
    /// Reads the current state of a process.
    pub(super) fn of(process: u32) -> Self {
        Self { threads: Threads::read(process), memory_bytes: memory_bytes(process) }
    }
}

/// Returns the memory in use by a process, bytes.
fn memory_bytes(process: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    kilobytes.checked_mul(1024)
}

/// Starts the program with its end of the link as standard input, and its end of the confinement report as
/// standard output. All our other descriptors are close-on-exec.
pub(super) fn spawn(
    program: &Path,
    log_level: &str,
    memory_limit_mb: u32,
    link: UnixStream,
    report: OwnedFd,
) -> io::Result<Child> {
    let kept = KEPT.into_iter().filter_map(|name| std::env::var_os(name).map(|value| (name, value)));
    Command::new(program)
        .arg0("signal-gateway")
        .args(["network", log_level, &memory_limit_mb.to_string()])
        .env_clear()
        .envs(kept)
        .env("MALLOC_ARENA_MAX", ARENAS)
        .current_dir("/")
        .stdin(OwnedFd::from(link))
        .stdout(report)
        // Signals from a terminal go only to the gateway, which then tells the network side to leave.
        .process_group(0)
        .spawn()
}

pub(super) fn failure(status: ExitStatus) -> NetworkFailure {
    match (status.code(), status.signal()) {
        (Some(PANICKED), _) => NetworkFailure::Panicked,
        (Some(code), _) => NetworkFailure::Exited(code),
        // A panic has an exit code, so an abort comes from the allocator.
        (None, Some(libc::SIGABRT)) => NetworkFailure::OutOfMemory,
        (None, signal) => NetworkFailure::Signalled(signal.unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_process_names_its_cause() {
        let ended = |raw| failure(ExitStatus::from_raw(raw));
        assert_eq!(ended(3 << 8), NetworkFailure::Exited(3));
        assert_eq!(ended(101 << 8), NetworkFailure::Panicked);
        assert_eq!(ended(6), NetworkFailure::OutOfMemory);
        assert_eq!(ended(9), NetworkFailure::Signalled(9));
    }
}
