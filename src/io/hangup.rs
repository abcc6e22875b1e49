//! SIGHUP, the request to reload the configuration: sent to another process, or not meant for this one.

use std::io;

/// Sends SIGHUP.
///
/// # Errors
/// That of the kernel: `ESRCH` without such a process, `EPERM` for one of another user.
#[allow(unsafe_code)]
pub fn hang_up(pid: u32) -> io::Result<()> {
    // 0 and negative numbers stand for groups of processes.
    let pid = i32::try_from(pid).ok().filter(|pid| *pid > 0);
    let pid = pid.ok_or_else(|| io::Error::from_raw_os_error(libc::ESRCH))?;
    // SAFETY: no pointers are passed.
    if unsafe { libc::kill(pid, libc::SIGHUP) } < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

/// Ignores SIGHUP from now on, in a process that has no configuration of its own.
#[allow(unsafe_code)]
pub fn ignore_hangup() {
    // SAFETY: no handler is installed.
    unsafe { libc::signal(libc::SIGHUP, libc::SIG_IGN) };
}
