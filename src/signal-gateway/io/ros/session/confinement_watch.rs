//! Receives a network process's report of its confinement, and answers the kernel about refused system calls.

use std::io;
use std::os::fd::{AsRawFd as _, OwnedFd};
use std::sync::{Arc, Mutex};
use std::thread;

use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::Errno;

use crate::io::lock::lock;
use crate::process_status::confinement::Confinement;
use ros_transport::link::{Layers, confinement_report};
use ros_transport::system_call_name;

/// A thread that receives the report, and answers the kernel, until the process has ended.
#[derive(Debug)]
pub(super) struct ConfinementWatch(Arc<Mutex<Option<Confinement>>>);

impl ConfinementWatch {
    /// Starts listening at our end of the socket on which the process reports. `without` are layers that are
    /// missing without the process's knowledge.
    pub(super) fn start(socket: OwnedFd, without: Layers) -> io::Result<Self> {
        let known = Arc::new(Mutex::new(None));
        let shared = Arc::clone(&known);
        // Fails if the process has ended.
        let listen = move || drop(listen(socket, without, &shared));
        thread::Builder::new().name("ros confinement".to_owned()).spawn(listen)?;
        Ok(Self(known))
    }

    /// Returns the confinement; `None` until the process has reported it.
    pub(super) fn confinement(&self) -> Option<Confinement> {
        lock(&self.0).clone()
    }
}

fn listen(socket: OwnedFd, without: Layers, known: &Mutex<Option<Confinement>>) -> io::Result<()> {
    let Some((missing, listener)) = confinement_report::receive(&socket)? else { return Ok(()) };
    drop(socket);
    lock(known).get_or_insert_default().missing = missing.with(without);
    let Some(listener) = listener else { return Ok(()) };
    loop {
        let mut ready = [PollFd::new(&listener, PollFlags::IN)];
        poll(&mut ready, None)?;
        if !ready[0].revents().contains(PollFlags::IN) {
            return Ok(()); // the process has ended
        }
        let Some(call) = refuse(&listener)? else { continue };
        let name = system_call_name(call).unwrap_or("unknown");
        let mut known = lock(known);
        let count = known.get_or_insert_default().refused.entry(name).or_default();
        *count += 1;
        if *count == 1 {
            tracing::warn!("the network process was refused the system call {name}");
        }
    }
}

/// Refuses the next waiting call with `EPERM`. Returns `None` if its caller has ended meanwhile, or was
/// interrupted and will retry.
#[allow(unsafe_code)]
fn refuse(listener: &OwnedFd) -> io::Result<Option<usize>> {
    // SAFETY: all zeros are valid for each of these structures, which the kernel fills and reads.
    let (mut call, mut answer): (libc::seccomp_notif, libc::seccomp_notif_resp) =
        unsafe { (std::mem::zeroed(), std::mem::zeroed()) };
    // SAFETY: the requests belong to these structures.
    let outcome = unsafe {
        let received = libc::ioctl(listener.as_raw_fd(), libc::SECCOMP_IOCTL_NOTIF_RECV, &raw mut call);
        if received < 0 {
            received
        } else {
            (answer.id, answer.error) = (call.id, -libc::EPERM);
            libc::ioctl(listener.as_raw_fd(), libc::SECCOMP_IOCTL_NOTIF_SEND, &raw mut answer)
        }
    };
    if outcome >= 0 {
        return Ok(usize::try_from(call.data.nr).ok());
    }
    let error = io::Error::last_os_error();
    match Errno::from_io_error(&error) {
        Some(Errno::NOENT | Errno::INTR) => Ok(None),
        _ => Err(error),
    }
}
