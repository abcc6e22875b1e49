//! SIGHUP, the request to reload the configuration: sending it to another process, and ignoring it in this
//! one.

use std::{fs, io};

use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process};

/// Sends SIGHUP. Returns `ESRCH` if there is no such process, `EPERM` for a process of another user.
pub fn hang_up(pid: u32) -> io::Result<()> {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw).ok_or(Errno::SRCH)?;
    Ok(kill_process(pid, Signal::HUP)?)
}

/// Returns why a process would not reload its configuration on SIGHUP; `None` if it would, or if that is
/// unknown.
pub fn refuses_hangup(pid: u32) -> Option<&'static str> {
    let is_in = |set: &str| {
        let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
        let mask = status.lines().find_map(|line| line.strip_prefix(set)?.strip_prefix(':'))?;
        let mask = u64::from_str_radix(mask.trim(), 16).ok()?;
        Some(mask & (1 << (libc::SIGHUP - 1)) != 0)
    };
    let stream = |number: u8| fs::read_link(format!("/proc/{pid}/fd/{number}")).ok();
    let is_terminal = |number| {
        stream(number).is_some_and(|path| path.starts_with("/dev/pts") || path.starts_with("/dev/tty"))
    };
    if is_in("SigIgn")? {
        Some("it plays a recording, or is not a gateway with a configuration of its own")
    } else if !is_in("SigCgt")? {
        Some("it has no answer to SIGHUP, which would end it")
    } else if (0..3).any(is_terminal) {
        Some("it runs on a terminal, where SIGHUP stops it")
    } else {
        None
    }
}

/// Ignores SIGHUP from now on, in a process whose configuration cannot change.
#[allow(unsafe_code)]
pub fn ignore_hangup() {
    // SAFETY: no handler is installed.
    unsafe { libc::signal(libc::SIGHUP, libc::SIG_IGN) };
}
