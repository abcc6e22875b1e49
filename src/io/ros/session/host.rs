//! The host of a network side: a process, or a thread of this one.

use std::fs;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, Command, ExitStatus};
use std::thread::{self, JoinHandle};

use rustix::process::{DumpableBehavior, set_dumpable_behavior};
use tracing::level_filters::LevelFilter;

use super::confinement_watch::ConfinementWatch;
use super::threads::Threads;
use crate::core::gateway::confinement::Confinement;
use crate::core::gateway::network::NetworkFailure;
use crate::io::ros::link::confinement_report;
use crate::io::ros::network::process::PANICKED;
use crate::io::ros::network::serve;
use crate::io::ros::settings::Isolation;

/// Environment variables that the process keeps: what its log needs.
const KEPT: [&str; 4] = ["RUST_LOG", "RUST_BACKTRACE", "JOURNAL_STREAM", "NO_COLOR"];
/// Arenas of the C library's allocator; each of its threads would have one, and hold memory of its own.
const ARENAS: &str = "2";

/// A running network side.
#[derive(Debug)]
pub(super) enum Host {
    /// A process, and what is known of its confinement.
    Process(Child, ConfinementWatch),
    /// A thread, which cannot be ended from outside.
    Thread(JoinHandle<io::Result<()>>),
}

impl Host {
    /// Starts a network side; gives our end of its link.
    pub(super) fn start(isolation: &Isolation) -> io::Result<(Self, UnixStream)> {
        let (ours, theirs) = UnixStream::pair()?;
        let host = match isolation {
            Isolation::Process { program, memory_limit_mb } => {
                let (watched, reporting) = confinement_report::pair()?;
                let child = spawn(program, *memory_limit_mb, theirs, reporting)?;
                Self::Process(child, ConfinementWatch::start(watched)?)
            }
            Isolation::Thread => Self::Thread(
                thread::Builder::new().name("ros network".to_owned()).spawn(|| serve(theirs, |_| Ok(())))?,
            ),
        };
        Ok((host, ours))
    }

    /// True for a process of its own.
    pub(super) fn is_isolated(&self) -> bool {
        matches!(self, Self::Process(..))
    }

    /// Ends it at once, if it can be ended.
    pub(super) fn kill(&mut self) {
        if let Self::Process(child, _) = self {
            // One that has ended by itself was waited for by us, or still will be.
            let _ = child.kill();
        }
    }

    /// The cause of its end; `None` while it has not ended, or cannot be waited for.
    pub(super) fn end(&mut self) -> Option<NetworkFailure> {
        match self {
            Self::Process(child, _) => child.try_wait().ok().flatten().map(failure),
            Self::Thread(thread) if !thread.is_finished() => None,
            // The panic of a thread that has ended is reported by its hook.
            Self::Thread(_) => Some(NetworkFailure::Panicked),
        }
    }

    /// The threads of its own process; `None` if they cannot be read.
    pub(super) fn threads(&self) -> Option<Threads> {
        match self {
            Self::Process(child, _) => Threads::read(child.id()),
            Self::Thread(_) => None,
        }
    }

    /// How its own process is confined; `None` as long as it has not said so.
    pub(super) fn confinement(&self) -> Option<Confinement> {
        match self {
            Self::Process(_, watch) => watch.confinement(),
            Self::Thread(_) => None,
        }
    }

    /// Memory of its own process that is in use, bytes.
    pub(super) fn memory_bytes(&self) -> Option<u64> {
        let Self::Process(child, _) = self else { return None };
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
        let kilobytes: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
        kilobytes.checked_mul(1024)
    }
}

/// Starts the program with its end of the link as standard input, and of the report of its confinement as standard output. All
/// other descriptors of ours close by themselves. From now on no process of our user looks into our memory.
fn spawn(program: &Path, memory_limit_mb: u32, socket: UnixStream, report: OwnedFd) -> io::Result<Child> {
    set_dumpable_behavior(DumpableBehavior::NotDumpable)?;
    let kept = KEPT.into_iter().filter_map(|name| std::env::var_os(name).map(|value| (name, value)));
    Command::new(program)
        .arg0("signal-gateway")
        .args(["network", &LevelFilter::current().to_string(), &memory_limit_mb.to_string()])
        .env_clear()
        .envs(kept)
        .env("MALLOC_ARENA_MAX", ARENAS)
        .current_dir("/")
        .stdin(OwnedFd::from(socket))
        .stdout(report)
        // Signals of a terminal are for the gateway, which tells the other side to leave.
        .process_group(0)
        .spawn()
}

fn failure(status: ExitStatus) -> NetworkFailure {
    match (status.code(), status.signal()) {
        (Some(PANICKED), _) => NetworkFailure::Panicked,
        (Some(code), _) => NetworkFailure::Exited(code),
        // A panic has an exit code, so what aborts is the allocator.
        (None, Some(libc::SIGABRT)) => NetworkFailure::OutOfMemory,
        (None, signal) => NetworkFailure::Signalled(signal.unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use std::process::Stdio;

    use super::*;
    use crate::waiting::wait_for;

    #[test]
    fn the_end_of_a_process_names_its_cause() {
        let ended = |raw| failure(ExitStatus::from_raw(raw));
        assert_eq!(ended(3 << 8), NetworkFailure::Exited(3));
        assert_eq!(ended(101 << 8), NetworkFailure::Panicked);
        assert_eq!(ended(6), NetworkFailure::OutOfMemory);
        assert_eq!(ended(9), NetworkFailure::Signalled(9));
    }

    #[test]
    fn a_program_that_is_missing_is_an_error_and_one_that_ends_is_seen() {
        let start =
            |program: &str| Host::start(&Isolation::Process { program: program.into(), memory_limit_mb: 64 });
        assert!(start("/nowhere/signal-gateway").is_err());
        let (mut host, _link) = start("/bin/false").unwrap();
        let end = wait_for("the end of the program", || host.end());
        assert_eq!(end, NetworkFailure::Exited(1));
    }

    #[test]
    fn a_process_has_memory_of_its_own_until_it_is_killed() {
        let child = Command::new("cat").stdin(Stdio::piped()).spawn().unwrap();
        let (watched, _reporting) = confinement_report::pair().unwrap();
        let mut host = Host::Process(child, ConfinementWatch::start(watched).unwrap());
        assert!(
            host.is_isolated() && host.memory_bytes().is_some_and(|bytes| bytes > 0 && bytes % 1024 == 0)
        );
        host.kill();
        let Host::Process(child, _) = &mut host else { panic!("it was a process") };
        child.wait().unwrap();
        assert_eq!((host.end(), host.memory_bytes()), (Some(NetworkFailure::Signalled(9)), None));
        let thread = Host::Thread(thread::spawn(|| Ok(())));
        assert_eq!((thread.is_isolated(), thread.memory_bytes()), (false, None));
    }
}
