//! The network side as a process: what the hidden command `network` runs.

use std::io;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::time::Duration;
use std::{panic, process, thread};

use rustix::event::{PollFd, PollFlags, poll};

use crate::PANICKED;
use crate::confinement;
use crate::link::{Layer, LostLines, confinement_report};
use crate::serving::serve;

/// Time to leave the network in order after the gateway has ended without a word.
const TIME_TO_LEAVE: Duration = Duration::from_secs(1);

/// Closes whatever the parent had open without knowing, such as what a shell left it. Standard streams stay.
/// To be called before anything is opened here.
///
/// # Errors
/// The error of the kernel: `ENOSYS` before Linux 5.9.
#[allow(unsafe_code)]
pub fn close_inherited() -> io::Result<()> {
    // SAFETY: no pointers are passed, and nothing has been opened here yet.
    let closed = unsafe { libc::syscall(libc::SYS_close_range, 3, libc::c_uint::MAX, 0) };
    if closed < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

/// Serves the gateway that has started this process, over the socket that is its standard input, and confined
/// as `confinement` has it, to this much private writable memory in MB. `confined` is called once that is so,
/// before anything of the network is there.
pub fn run(memory_mb: u32, lost_lines: fn() -> LostLines, confined: impl FnOnce()) -> io::Result<()> {
    end_with_any_panic();
    let socket = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
    // Another standard input, such as a terminal, is not a gateway.
    socket.peer_addr()?;
    // As lists of processes show it; otherwise it would be the name of the link to the program.
    let _ = rustix::thread::set_name(c"signal-gw-net");
    let mut missing = confinement::confine(u64::from(memory_mb) << 20);
    let end = socket.try_clone()?;
    serve(socket, lost_lines, |engine| {
        let listener = confinement::confine_to(engine, &mut missing);
        for (layer, reason) in &missing.0 {
            let note = format!("the network process is confined without {layer}: {reason}");
            // Older kernels have these two not, or in part.
            if matches!(layer, Layer::Landlock | Layer::CallNames) {
                tracing::info!("{note}");
            } else {
                tracing::warn!("{note}");
            }
        }
        // Whoever started it by hand does not listen.
        let _ = confinement_report::send(io::stdout(), missing.layers(), listener.as_ref());
        // Not before, so that it is confined as well; until then the end is read.
        end_after_the_gateway(end)?;
        confined();
        Ok(())
    })
}

/// Ends the process a little after the gateway has closed its end of the socket, should it not have left by
/// itself until then: DDS may hang.
fn end_after_the_gateway(socket: UnixStream) -> io::Result<()> {
    let wait = move || {
        // Nothing but the end is waited for. It is there at once when waiting fails.
        let _ready = poll(&mut [PollFd::new(&socket, PollFlags::empty())], None);
        thread::sleep(TIME_TO_LEAVE);
        process::exit(1);
    };
    thread::Builder::new().name("gateway's end".to_owned()).spawn(wait)?;
    Ok(())
}

/// A thread of RustDDS that panics leaves a process that looks alive. Here it ends the process, with a code
/// that no lack of memory has.
fn end_with_any_panic() {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        hook(panic);
        process::exit(PANICKED);
    }));
}
