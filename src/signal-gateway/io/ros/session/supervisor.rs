//! A network process with a user of its own. systemd starts it, as one service per connection to a socket,
//! since the gateway cannot change to another user. The gateway also cannot signal, wait for or inspect
//! another user's process, so a second process of that user, the supervisor, starts the network process and
//! does this for the gateway.

use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, ExitStatus};
use std::sync::Mutex;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
use rustix::process::{DumpableBehavior, Pid, PidfdFlags, pidfd_open, set_dumpable_behavior};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::child::{ProcessReading, failure, spawn};
use crate::io::hangup::ignore_hangup;
use crate::io::lock::lock;
use crate::process_status::network::NetworkFailure;
use ros_transport::link::datagram;

/// Maximum length of a message, bytes: several readings of 64 threads.
const MAX_MESSAGE: usize = 16 * 1024;
/// Maximum time for a supervisor to read the kernel's measurements of its network process.
const PATIENCE: Duration = Duration::from_millis(100);
/// Time that a network process has to end by itself after its gateway has ended.
const TIME_TO_LEAVE: Duration = Duration::from_secs(2);

/// Orders of the gateway to a supervisor.
#[derive(Debug, Serialize, Deserialize)]
enum SupervisorOrder {
    /// Start the network process; its ends of the link and the report are attached.
    Start {
        /// Log level, unless the environment sets one.
        log_level: String,
        /// Maximum private writable memory of the network process, MB.
        memory_limit_mb: u32,
    },
    /// Read the kernel's measurements of the network process.
    Look,
    /// Kill the network process.
    Kill,
}

/// Reports of a supervisor on its network process.
#[derive(Debug, Serialize, Deserialize)]
enum SupervisorReport {
    /// The kernel's measurements.
    Reading(ProcessReading),
    /// The process has ended, with this status of `wait`.
    Ended(i32),
}

/// A network process behind a supervisor.
#[derive(Debug)]
pub(super) struct Supervised {
    socket: OwnedFd,
    seen: Mutex<ObservedService>,
}

/// Reports received from its supervisor.
#[derive(Debug, Default)]
struct ObservedService {
    reading: Option<ProcessReading>,
    end: Option<NetworkFailure>,
}

impl Supervised {
    /// Orders the supervisor behind a socket to start a network process with these ends of the link and the
    /// report.
    pub(super) fn start(
        path: &Path,
        log_level: &str,
        memory_limit_mb: u32,
        ends: [BorrowedFd<'_>; 2],
    ) -> io::Result<Self> {
        // A socket without a server must not delay its clients.
        let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
        let socket = socket_with(AddressFamily::UNIX, SocketType::SEQPACKET, flags, None)?;
        connect(&socket, &SocketAddrUnix::new(path)?)?;
        let log_level = log_level.to_owned();
        send(&socket, &SupervisorOrder::Start { log_level, memory_limit_mb }, &ends)?;
        Ok(Self { socket, seen: Mutex::default() })
    }

    /// Kills the network process, as soon as the supervisor runs.
    pub(super) fn kill(&self) {
        // If the supervisor has ended, so has its network process.
        let _ = send(&self.socket, &SupervisorOrder::Kill, &[]);
    }

    /// Returns the cause of its end; `None` if it has not ended.
    pub(super) fn end(&self) -> Option<NetworkFailure> {
        let mut seen = lock(&self.seen);
        seen.take(&self.socket);
        seen.end.clone()
    }

    /// Reads its measurements now; all are `None` if the supervisor does not answer at once.
    pub(super) fn look(&self) -> ProcessReading {
        let mut seen = lock(&self.seen);
        seen.reading = None;
        if seen.end.is_none() && send(&self.socket, &SupervisorOrder::Look, &[]).is_ok() {
            // The answer to an earlier request that timed out may come first; it serves as well.
            let _ = poll(&mut [PollFd::new(&self.socket, PollFlags::IN)], Some(&timespec(PATIENCE)));
            seen.take(&self.socket);
        }
        seen.reading.clone().unwrap_or_default()
    }
}

impl ObservedService {
    /// Processes the reports received from the supervisor so far.
    fn take(&mut self, socket: &OwnedFd) {
        while self.end.is_none() {
            match receive(socket) {
                Ok(Some((SupervisorReport::Reading(reading), _))) => self.reading = Some(reading),
                Ok(Some((SupervisorReport::Ended(status), _))) => {
                    self.end = Some(failure(ExitStatus::from_raw(status)));
                }
                Err(error) => match Errno::from_io_error(&error) {
                    Some(Errno::AGAIN) => return,
                    // It has ended without reading all our orders; its own reports follow.
                    Some(Errno::CONNRESET) => {}
                    _ => self.end = Some(NetworkFailure::SupervisorEnded),
                },
                Ok(None) => self.end = Some(NetworkFailure::SupervisorEnded),
            }
        }
    }
}

/// Supervises a network process, which runs this program, for the gateway at the other end of standard input.
/// The hidden command `network-supervisor` calls this. Fails if standard input is not such a connection, or a
/// process cannot be started.
pub fn run(program: &Path) -> io::Result<()> {
    ignore_hangup();
    set_dumpable_behavior(DumpableBehavior::NotDumpable)?;
    supervise(&io::stdin().as_fd().try_clone_to_owned()?, program)
}

fn supervise(gateway: &OwnedFd, program: &Path) -> io::Result<()> {
    let refused = || io::Error::from(io::ErrorKind::InvalidData);
    let (order, ends) = receive(gateway)?.ok_or_else(refused)?;
    let SupervisorOrder::Start { log_level, memory_limit_mb } = order else { return Err(refused()) };
    let [link, report] = <[OwnedFd; 2]>::try_from(ends).map_err(|_| refused())?;
    let mut child = spawn(program, &log_level, memory_limit_mb, UnixStream::from(link), report)?;
    let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw).ok_or_else(refused)?;
    let ended = pidfd_open(pid, PidfdFlags::empty())?;
    loop {
        let mut ready = [PollFd::new(&ended, PollFlags::IN), PollFd::new(gateway, PollFlags::IN)];
        poll(&mut ready, None)?;
        if !ready[0].revents().is_empty() {
            return send(gateway, &SupervisorReport::Ended(child.wait()?.into_raw()), &[]);
        }
        match receive(gateway) {
            Ok(Some((SupervisorOrder::Look, _))) => {
                send(gateway, &SupervisorReport::Reading(ProcessReading::of(child.id())), &[])?;
            }
            Ok(Some((SupervisorOrder::Kill, _))) => child.kill()?,
            Ok(Some((SupervisorOrder::Start { .. }, _)) | None) | Err(_) => {
                return see_off(&mut child, &ended);
            }
        }
    }
}

/// Waits for a network process whose gateway has ended, and kills it if necessary.
fn see_off(child: &mut Child, ended: &OwnedFd) -> io::Result<()> {
    poll(&mut [PollFd::new(ended, PollFlags::IN)], Some(&timespec(TIME_TO_LEAVE)))?;
    child.kill()?;
    child.wait().map(drop)
}

fn timespec(duration: Duration) -> Timespec {
    Timespec { tv_sec: duration.as_secs().cast_signed(), tv_nsec: duration.subsec_nanos().into() }
}

fn send(socket: &OwnedFd, message: &impl Serialize, descriptors: &[BorrowedFd<'_>]) -> io::Result<()> {
    datagram::send(socket, &serde_json::to_vec(message)?, descriptors)
}

/// Returns the next message; `None` if the other end is closed.
fn receive<T: DeserializeOwned>(socket: &OwnedFd) -> io::Result<Option<(T, Vec<OwnedFd>)>> {
    let mut space = vec![0; MAX_MESSAGE];
    let (length, descriptors) = datagram::receive(socket, &mut space)?;
    if length == 0 {
        return Ok(None);
    }
    Ok(Some((serde_json::from_slice(space.get(..length).unwrap_or_default())?, descriptors)))
}

#[cfg(test)]
mod tests {
    use std::thread::{self, JoinHandle};

    use super::*;
    use crate::waiting::wait_for;

    /// Starts a supervisor of a program; returns it with our ends of its connection, the link and the report.
    fn supervised(program: &'static str) -> (JoinHandle<io::Result<()>>, Supervised, [OwnedFd; 2]) {
        let (ours, theirs) = datagram::pair().unwrap();
        rustix::io::ioctl_fionbio(&ours, true).unwrap();
        let ((link, their_link), (report, their_report)) =
            (UnixStream::pair().unwrap(), datagram::pair().unwrap());
        let start = SupervisorOrder::Start { log_level: "info".to_owned(), memory_limit_mb: 64 };
        send(&ours, &start, &[their_link.as_fd(), their_report.as_fd()]).unwrap();
        let supervisor = thread::spawn(move || supervise(&theirs, Path::new(program)));
        (supervisor, Supervised { socket: ours, seen: Mutex::default() }, [OwnedFd::from(link), report])
    }

    #[test]
    fn a_process_that_ends_is_reported_with_its_cause() {
        let (supervisor, process, _ends) = supervised("/bin/false");
        assert_eq!(wait_for("its end", || process.end()), NetworkFailure::Exited(1));
        assert_eq!(process.end(), Some(NetworkFailure::Exited(1)), "for good");
        supervisor.join().unwrap().unwrap();
        let (supervisor, process, _ends) = supervised("/nowhere");
        assert!(supervisor.join().unwrap().is_err());
        assert_eq!(process.end(), Some(NetworkFailure::SupervisorEnded));
    }

    /// `yes` writes until its reader is gone.
    #[test]
    fn a_process_is_looked_at_and_killed_for_the_gateway() {
        let (supervisor, process, _ends) = supervised("/usr/bin/yes");
        let reading =
            wait_for("a reading", || Some(process.look()).filter(|reading| reading.threads.is_some()));
        assert!(reading.memory_bytes.is_some_and(|bytes| bytes > 0));
        assert_eq!(process.end(), None);
        process.kill();
        assert_eq!(wait_for("its end", || process.end()), NetworkFailure::Signalled(9));
        assert!(process.look().threads.is_none());
        supervisor.join().unwrap().unwrap();
    }

    #[test]
    fn what_a_supervisor_has_said_counts_also_when_it_has_ended_without_reading_all() {
        let (ours, theirs) = datagram::pair().unwrap();
        let process = Supervised { socket: ours, seen: Mutex::default() };
        send(&theirs, &SupervisorReport::Ended(9), &[]).unwrap();
        process.kill();
        drop(theirs);
        assert_eq!(process.end(), Some(NetworkFailure::Signalled(9)));
    }

    #[test]
    fn a_process_ends_with_its_gateway() {
        let (supervisor, process, _ends) = supervised("/usr/bin/yes");
        wait_for("a reading", || process.look().threads);
        drop(process);
        supervisor.join().unwrap().unwrap();
    }

    #[test]
    fn what_is_no_order_starts_nothing_and_what_is_no_report_is_an_end() {
        for message in
            [&b"junk"[..], b"\"Look\"", b"{\"Start\":{\"log_level\":\"info\",\"memory_limit_mb\":64}}"]
        {
            let (ours, theirs) = datagram::pair().unwrap();
            datagram::send(&ours, message, &[]).unwrap();
            assert!(supervise(&theirs, Path::new("/bin/false")).is_err());
            let process = Supervised { socket: ours, seen: Mutex::default() };
            datagram::send(&theirs, message, &[]).unwrap();
            assert_eq!(process.end(), Some(NetworkFailure::SupervisorEnded));
        }
    }
}
