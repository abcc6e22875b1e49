//! What is known of the confinement of a network process, and the answers for the kernel when it refuses a
//! system call.

use std::io;
use std::os::fd::{AsRawFd as _, OwnedFd};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::Errno;

use crate::process_status::confinement::Confinement;
use ros_transport::link::{Layers, confinement_report};
use ros_transport::system_call_name;

/// A thread that receives its report, and answers, until the process has ended.
#[derive(Debug)]
pub(super) struct ConfinementWatch(Arc<Mutex<Option<Confinement>>>);

impl ConfinementWatch {
    /// Begins to listen at our end of the socket on which the process reports; it cannot know that it is
    /// `without` these.
    pub(super) fn start(socket: OwnedFd, without: Layers) -> io::Result<Self> {
        let known = Arc::new(Mutex::new(None));
        let shared = Arc::clone(&known);
        // Fails for a process that has ended.
        let listen = move || drop(listen(socket, without, &shared));
        thread::Builder::new().name("ros confinement".to_owned()).spawn(listen)?;
        Ok(Self(known))
    }

    /// What is known; `None` as long as the process has not reported.
    pub(super) fn confinement(&self) -> Option<Confinement> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

fn listen(socket: OwnedFd, without: Layers, known: &Mutex<Option<Confinement>>) -> io::Result<()> {
    let Some((missing, listener)) = confinement_report::receive(&socket)? else { return Ok(()) };
    drop(socket);
    let note = |note: &dyn Fn(&mut Confinement)| {
        note(known.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_default());
    };
    note(&|confinement| confinement.missing = missing.with(without));
    let Some(listener) = listener else { return Ok(()) };
    loop {
        let mut ready = [PollFd::new(&listener, PollFlags::IN)];
        poll(&mut ready, None)?;
        if !ready[0].revents().contains(PollFlags::IN) {
            return Ok(()); // the process has ended
        }
        let Some(call) = refuse(&listener)? else { continue };
        let name = system_call_name(call).unwrap_or("unknown");
        note(&|confinement| {
            let count = confinement.refused.entry(name).or_default();
            *count += 1;
            if *count == 1 {
                tracing::warn!("the network process was refused the system call {name}");
            }
        });
    }
}

/// Takes the next call that waits for an answer, and refuses it with `EPERM`. `None` if who made it has ended
/// meanwhile, or was interrupted and will ask again.
#[allow(unsafe_code)]
fn refuse(listener: &OwnedFd) -> io::Result<Option<usize>> {
    // SAFETY: all zeros are a value of each of these structures, which the kernel fills and reads.
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
