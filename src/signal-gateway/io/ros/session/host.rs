//! Host of a network side: a process, or a thread of this process.

use std::io;
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;
use std::process::Child;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use rustix::process::{DumpableBehavior, set_dumpable_behavior};
use tracing::level_filters::LevelFilter;

use super::child::{ProcessReading, failure, spawn};
use super::confinement_watch::ConfinementWatch;
use super::liveness::RestartDelay;
use super::supervisor::Supervised;
use crate::io::process_log;
use crate::io::ros::settings::Isolation;
use crate::process_status::confinement::Confinement;
use crate::process_status::network::{NetworkFailure, Place};
use ros_transport::link::{Layer, Layers, datagram};
use ros_transport::serve;

/// Starts one network side after the other.
pub(super) struct Hosts {
    isolation: Isolation,
    delay: RestartDelay,
    /// True if the service of the last network side did not start.
    has_no_service: bool,
}

/// A running network side.
#[derive(Debug)]
pub(super) enum Host {
    /// A child process, with its confinement.
    Process(Child, ConfinementWatch),
    /// A process of another user, with its confinement.
    Service(Supervised, ConfinementWatch),
    /// A thread, which cannot be ended from outside.
    Thread(JoinHandle<io::Result<()>>),
}

impl Hosts {
    pub(super) fn new(isolation: Isolation) -> Self {
        Self { isolation, delay: RestartDelay::default(), has_no_service: false }
    }

    /// Records an end, with the age since joining the network, and returns the delay before the next start. A
    /// service that fails to start is no longer used.
    pub(super) fn note_end(&mut self, failure: &NetworkFailure, age: Option<Duration>) -> Duration {
        self.has_no_service |= *failure == NetworkFailure::SupervisorEnded && age.is_none();
        self.delay.next(age)
    }

    /// Starts a network side and returns our end of its link. From the first process on, other processes of
    /// our user cannot read our memory.
    pub(super) fn start(&self) -> io::Result<(Host, UnixStream)> {
        let (ours, theirs) = UnixStream::pair()?;
        let Isolation::Process { program, memory_limit_mb, supervisor } = &self.isolation else {
            let thread = thread::Builder::new().name("ros network".to_owned());
            return Ok((
                Host::Thread(thread.spawn(|| serve(theirs, process_log::lost_lines, |_| Ok(())))?),
                ours,
            ));
        };
        set_dumpable_behavior(DumpableBehavior::NotDumpable)?;
        let (watched, reporting) = datagram::pair()?;
        let level = LevelFilter::current().to_string();
        let mut missing = Layers::default();
        if let Some(supervisor) = supervisor {
            let ends = [theirs.as_fd(), reporting.as_fd()];
            let refused = || Err(io::Error::other("its service did not start"));
            let start = || Supervised::start(supervisor, &level, *memory_limit_mb, ends);
            match if self.has_no_service { refused() } else { start() } {
                Ok(supervised) => {
                    return Ok((Host::Service(supervised, ConfinementWatch::start(watched, missing)?), ours));
                }
                Err(error) => {
                    tracing::warn!("the network process is confined without {}: {error}", Layer::OwnUser);
                    missing = [Layer::OwnUser].into_iter().collect();
                }
            }
        }
        let child = spawn(program, &level, *memory_limit_mb, theirs, reporting)?;
        Ok((Host::Process(child, ConfinementWatch::start(watched, missing)?), ours))
    }
}

impl Host {
    /// Returns where the network side runs.
    pub(super) fn place(&self) -> Place {
        match self {
            Self::Process(..) => Place::Process,
            Self::Service(..) => Place::Service,
            Self::Thread(_) => Place::Thread,
        }
    }

    /// Returns true if the network side runs in a separate process.
    pub(super) fn is_isolated(&self) -> bool {
        self.place() != Place::Thread
    }

    /// Kills the network side at once, if possible.
    pub(super) fn kill(&mut self) {
        match self {
            // A process that has ended by itself has been waited for, or will be.
            Self::Process(child, _) => drop(child.kill()),
            Self::Service(supervised, _) => supervised.kill(),
            Self::Thread(_) => {}
        }
    }

    /// Returns the cause of its end; `None` if it has not ended, or cannot be waited for.
    pub(super) fn end(&mut self) -> Option<NetworkFailure> {
        match self {
            Self::Process(child, _) => child.try_wait().ok().flatten().map(failure),
            Self::Service(supervised, _) => supervised.end(),
            Self::Thread(thread) if !thread.is_finished() => None,
            // The panic hook reports the panic of a thread.
            Self::Thread(_) => Some(NetworkFailure::Panicked),
        }
    }

    /// Reads the kernel's current measurements of the network process; values that cannot be read are `None`.
    pub(super) fn look(&self) -> ProcessReading {
        match self {
            Self::Process(child, _) => ProcessReading::of(child.id()),
            Self::Service(supervised, _) => supervised.look(),
            Self::Thread(_) => ProcessReading::default(),
        }
    }

    /// Returns the confinement of the network process; `None` until it has reported it.
    pub(super) fn confinement(&self) -> Option<Confinement> {
        match self {
            Self::Process(_, watch) | Self::Service(_, watch) => watch.confinement(),
            Self::Thread(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::process::{Command, Stdio};

    use super::*;
    use crate::waiting::wait_for;

    #[test]
    fn a_program_that_is_missing_is_an_error_and_one_that_ends_is_seen() {
        let start = |program: &str| {
            let program = program.into();
            Hosts::new(Isolation::Process { program, memory_limit_mb: 64, supervisor: None }).start()
        };
        assert!(start("/nowhere/signal-gateway").is_err());
        let (mut host, _link) = start("/bin/false").unwrap();
        let end = wait_for("the end of the program", || host.end());
        assert_eq!(end, NetworkFailure::Exited(1));
    }

    #[test]
    fn a_process_has_memory_of_its_own_until_it_is_killed() {
        let child = Command::new("cat").stdin(Stdio::piped()).spawn().unwrap();
        let (watched, _reporting) = datagram::pair().unwrap();
        let mut host = Host::Process(child, ConfinementWatch::start(watched, Layers::default()).unwrap());
        assert!(
            host.is_isolated()
                && host.look().memory_bytes.is_some_and(|bytes| bytes > 0 && bytes % 1024 == 0)
        );
        host.kill();
        let Host::Process(child, _) = &mut host else { panic!("it was a process") };
        child.wait().unwrap();
        assert_eq!((host.end(), host.look().memory_bytes), (Some(NetworkFailure::Signalled(9)), None));
        let thread = Host::Thread(thread::spawn(|| Ok(())));
        assert_eq!((thread.is_isolated(), thread.look().memory_bytes), (false, None));
    }
}
