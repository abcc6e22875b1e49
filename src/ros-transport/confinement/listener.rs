//! System call filters for all threads, and the descriptor through which the kernel asks about refused calls.

use std::io;
use std::os::fd::{FromRawFd as _, OwnedFd};

use seccompiler::{BpfProgram, sock_filter};

/// The kernel answers with an error number, the low 16 bits.
const ERRNO: u32 = libc::SECCOMP_RET_ERRNO;

/// Returns the program of a filter with some of its answers replaced.
pub(super) fn answering(program: &BpfProgram, replace: impl Fn(u32) -> u32) -> BpfProgram {
    let is_answer = |instruction: &sock_filter| u32::from(instruction.code) == libc::BPF_RET | libc::BPF_K;
    let replaced = program.iter().map(|instruction| {
        let k = if is_answer(instruction) { replace(instruction.k) } else { instruction.k };
        sock_filter { k, ..instruction.clone() }
    });
    replaced.collect()
}

pub(super) fn error(errno: libc::c_int) -> u32 {
    ERRNO | errno.unsigned_abs()
}

pub(super) fn apply(program: &BpfProgram) -> io::Result<()> {
    install(program, libc::SECCOMP_FILTER_FLAG_TSYNC).map(drop)
}

/// Applies a program to all threads; returns the descriptor through which the kernel asks about calls for
/// which the program answers `SECCOMP_RET_USER_NOTIF`.
#[allow(unsafe_code)]
pub(super) fn apply_with_listener(program: &BpfProgram) -> io::Result<OwnedFd> {
    // Without ESRCH, a thread's id would look like a descriptor.
    let flags = libc::SECCOMP_FILTER_FLAG_NEW_LISTENER
        | libc::SECCOMP_FILTER_FLAG_TSYNC
        | libc::SECCOMP_FILTER_FLAG_TSYNC_ESRCH;
    let descriptor = install(program, flags)?;
    // SAFETY: it is new, and has no other owner.
    Ok(unsafe { OwnedFd::from_raw_fd(descriptor) })
}

#[allow(unsafe_code)]
fn install(program: &BpfProgram, flags: libc::c_ulong) -> io::Result<libc::c_int> {
    // Irrevocable: without privileges, a filter cannot be installed in any other way.
    rustix::thread::set_no_new_privs(true)?;
    let len = program.len().try_into().map_err(io::Error::other)?;
    let filter = libc::sock_fprog { len, filter: program.as_ptr().cast_mut().cast() };
    // SAFETY: the kernel copies exactly this many instructions, and seccompiler's `sock_filter` has the
    // kernel's layout.
    let outcome =
        unsafe { libc::syscall(libc::SYS_seccomp, libc::SECCOMP_SET_MODE_FILTER, flags, &raw const filter) };
    match libc::c_int::try_from(outcome).map_err(io::Error::other)? {
        error if error < 0 => Err(io::Error::last_os_error()),
        thread if thread > 0 && flags == libc::SECCOMP_FILTER_FLAG_TSYNC => {
            Err(io::Error::other(format!("thread {thread} has filters of its own")))
        }
        descriptor => Ok(descriptor),
    }
}
