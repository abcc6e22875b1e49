//! The network side as a process, run by the hidden command `network`.

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

/// Time to leave the network properly after the gateway has ended without an order to stop.
const TIME_TO_LEAVE: Duration = Duration::from_secs(1);

/// Closes descriptors that the parent passed on unintentionally, e.g. from a shell. Standard streams stay
/// open. Must be called before anything is opened here.
///
/// # Errors
/// Returns the kernel's error: `ENOSYS` before Linux 5.9.
#[allow(unsafe_code)]
pub fn close_inherited() -> io::Result<()> {
    // SAFETY: no pointers are passed, and nothing has been opened here yet.
    let closed = unsafe { libc::syscall(libc::SYS_close_range, 3, libc::c_uint::MAX, 0) };
    if closed < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

/// Serves the gateway that has started this process, over the socket on its standard input, confined by
/// `confinement`, with `memory_mb` MB of private writable memory at most. `confined` is called once the
/// confinement is in effect, before any contact with the network.
pub fn run(memory_mb: u32, lost_lines: fn() -> LostLines, confined: impl FnOnce()) -> io::Result<()> {
    end_with_any_panic();
    let socket = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
    // Another standard input, such as a terminal, is not a gateway.
    socket.peer_addr()?;
    // Shown in process lists; otherwise they would show the name of the link to the program.
    let _ = rustix::thread::set_name(c"signal-gw-net");
    let mut missing = confinement::confine(u64::from(memory_mb) << 20);
    let end = socket.try_clone()?;
    serve(socket, lost_lines, |engine| {
        let listener = confinement::confine_to(engine, &mut missing);
        for (layer, reason) in &missing.0 {
            let note = format!("the network process is confined without {layer}: {reason}");
            // Older kernels lack these two, or parts of them.
            if matches!(layer, Layer::Landlock | Layer::CallNames) {
                tracing::info!("{note}");
            } else {
                tracing::warn!("{note}");
            }
        }
        // A person who started it by hand does not read the report.
        let _ = confinement_report::send(io::stdout(), missing.layers(), listener.as_ref());
        // Started only now, so that the thread is confined as well; until now the end of the socket is read.
        end_after_the_gateway(end)?;
        confined();
        Ok(())
    })
}

/// Ends the process shortly after the gateway has closed its end of the socket, unless it has left by itself
/// by then: DDS may hang.
fn end_after_the_gateway(socket: UnixStream) -> io::Result<()> {
    let wait = move || {
        // Waits only for the end of the socket. If waiting fails, the end is assumed.
        let _ready = poll(&mut [PollFd::new(&socket, PollFlags::empty())], None);
        thread::sleep(TIME_TO_LEAVE);
        process::exit(1);
    };
    thread::Builder::new().name("gateway's end".to_owned()).spawn(wait)?;
    Ok(())
}

/// A panic in a thread of RustDDS leaves a process that looks alive. Here it ends the process, with an exit
/// code that a lack of memory never has.
fn end_with_any_panic() {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        hook(panic);
        process::exit(PANICKED);
    }));
}
