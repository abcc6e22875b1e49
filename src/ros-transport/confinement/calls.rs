//! The system calls that each engine needs; for calls with many functions, only the functions that it needs.
//! All others fail with `EPERM` and never end the process. So the network process cannot run a program, open
//! a file (with Zenoh: for writing), inspect other processes, set their limits or priorities, cause signals
//! to them, or open sockets other than IP and the kernel's interface list: it reaches neither CAN nor the
//! service manager. With DDS it has no stream sockets, and so no TCP.
//!
//! The kernel asks the gateway about each refused call so that the gateway can name it; the answer is always
//! a refusal.

use std::collections::BTreeMap;
use std::io;
use std::os::fd::OwnedFd;

use seccompiler::{
    BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule,
};

use super::error::ConfinementError;
use super::listener::{answering, apply, apply_with_listener, error};
use crate::settings::Transport;

/// Allowed system calls, each in these cases; in all cases if the list is empty.
type Calls = BTreeMap<i64, Vec<SeccompRule>>;

/// Restricts all threads to the calls that an engine needs. If this kernel cannot notify the gateway, calls
/// are refused without a report.
pub(super) fn allow_only(engine: &Transport) -> Result<io::Result<OwnedFd>, ConfinementError> {
    let errno = |errno: i32| SeccompAction::Errno(errno.unsigned_abs());
    let (allow, no_call, not_permitted) = (SeccompAction::Allow, errno(libc::ENOSYS), errno(libc::EPERM));
    // The C library tries `clone3`, whose flags a filter cannot read, and falls back to `clone` without it.
    // The stricter of two filters applies: an errno answer takes precedence over allowing or asking.
    let clone3 = BTreeMap::from([(libc::SYS_clone3, vec![])]);
    for (calls, answer) in [(clone3, no_call), (unasked(engine)?, not_permitted.clone())] {
        apply(&program(calls, allow.clone(), answer)?)?;
    }
    let silent = program(allowed(engine)?, not_permitted, allow)?;
    let refused = error(libc::EPERM);
    let asked =
        answering(&silent, |answer| if answer == refused { libc::SECCOMP_RET_USER_NOTIF } else { answer });
    match apply_with_listener(&asked) {
        Ok(listener) => Ok(Ok(listener)),
        Err(why) => Ok(apply(&silent).map(|()| Err(why))?),
    }
}

/// Builds a filter with one answer for the listed calls, and another for all others.
fn program(
    calls: Calls,
    other: SeccompAction,
    listed: SeccompAction,
) -> Result<BpfProgram, ConfinementError> {
    let arch = std::env::consts::ARCH.try_into()?;
    let program: BpfProgram = SeccompFilter::new(calls, other, listed, arch)?.try_into()?;
    // Calls of another architecture, which a 64-bit process could make, do not exist.
    let (kill, none) = (libc::SECCOMP_RET_KILL_PROCESS, error(libc::ENOSYS));
    Ok(answering(&program, |answer| if answer == kill { none } else { answer }))
}

/// Calls that are also refused in normal operation, so they are not reported. When RustDDS lists interfaces,
/// it tries a thousand times to read data that a desktop's network manager keeps, and can do without it; so
/// can the C library without the name cache, which it looks for when Zenoh resolves names.
fn unasked(engine: &Transport) -> Result<Calls, ConfinementError> {
    let is_dds = matches!(engine, Transport::Dds);
    let files = [libc::SYS_openat, libc::SYS_newfstatat, libc::SYS_statx];
    let mut calls: Calls = files.into_iter().filter(|_| is_dds).map(|call| (call, Vec::new())).collect();
    let kinds = if is_dds { &[libc::SOCK_DGRAM][..] } else { &[libc::SOCK_DGRAM, libc::SOCK_STREAM] };
    let service = kinds.iter().map(|of| rule(&[(0, SeccompCmpOp::Eq, number(libc::AF_UNIX)), kind(*of)]));
    calls.insert(libc::SYS_socket, service.collect::<Result<_, _>>()?);
    Ok(calls)
}

fn allowed(engine: &Transport) -> Result<Calls, ConfinementError> {
    let mut calls: Calls = always().iter().map(|call| (*call, Vec::new())).collect();
    // Threads, but no processes.
    let thread = number(libc::CLONE_THREAD);
    calls.insert(libc::SYS_clone, vec![rule(&[(0, SeccompCmpOp::MaskedEq(thread), thread)])?]);
    // Only the function that sets a thread's name.
    calls.insert(libc::SYS_prctl, one_of(0, &[number(libc::PR_SET_NAME)])?);
    // `abort` sends a signal to its own process.
    let own = (0, SeccompCmpOp::Eq, u64::from(std::process::id()));
    calls.insert(libc::SYS_tgkill, vec![rule(&[own])?]);
    // Its own limits, for reading.
    calls.insert(libc::SYS_prlimit64, vec![rule(&[(0, SeccompCmpOp::Eq, 0), (2, SeccompCmpOp::Eq, 0)])?]);
    let commands = [libc::F_GETFD, libc::F_SETFD, libc::F_GETFL, libc::F_DUPFD_CLOEXEC].map(number);
    let mut descriptor = one_of(1, &commands)?;
    // No notification of events by signals.
    let is_silent = (2, SeccompCmpOp::MaskedEq(number(libc::O_ASYNC)), 0);
    descriptor.push(rule(&[(1, SeccompCmpOp::Eq, number(libc::F_SETFL)), is_silent])?);
    calls.insert(libc::SYS_fcntl, descriptor);
    calls.insert(libc::SYS_ioctl, one_of(1, &REQUESTS)?);
    // Memory that counts towards the limit.
    let private = (3, SeccompCmpOp::MaskedEq(MAP_TYPE), number(libc::MAP_PRIVATE));
    // All code is already loaded, except that the C library may load its own library for name lookup.
    let no_code = (2, SeccompCmpOp::MaskedEq(number(libc::PROT_EXEC)), 0);
    let is_dds = matches!(engine, Transport::Dds);
    let memory = if is_dds { rule(&[private, no_code.clone()])? } else { rule(&[private])? };
    calls.insert(libc::SYS_mmap, vec![memory]);
    calls.insert(libc::SYS_mprotect, if is_dds { vec![rule(&[no_code])?] } else { Vec::new() });
    let streams = [(0, SeccompCmpOp::Eq, number(libc::AF_UNIX)), kind(libc::SOCK_STREAM)];
    calls.insert(libc::SYS_socketpair, vec![rule(&streams)?]);
    calls.insert(libc::SYS_socket, sockets(is_dds)?);
    if !is_dds {
        for call in [libc::SYS_listen, libc::SYS_accept4, libc::SYS_lseek, libc::SYS_statx] {
            calls.insert(call, Vec::new());
        }
        calls.insert(libc::SYS_newfstatat, Vec::new());
        // Certificates and host name files, for reading.
        let changing = number(libc::O_ACCMODE | libc::O_CREAT | libc::O_TRUNC | O_TMPFILE);
        let reading = |flags: u8| rule(&[(flags, SeccompCmpOp::MaskedEq(changing), 0)]);
        calls.insert(libc::SYS_openat, vec![reading(2)?]);
        #[cfg(target_arch = "x86_64")]
        calls.insert(libc::SYS_open, vec![reading(1)?]);
    }
    Ok(calls)
}

/// The flags of `mmap` that say whether the memory is private or shared.
const MAP_TYPE: u64 = 0xF;
/// The flag of `open` for a file without a name.
const O_TMPFILE: libc::c_int = 0o20_000_000;
/// Requests of `ioctl` that an engine needs: `FIONBIO`, `FIONREAD`, `FIOCLEX`, `TCGETS` (is this a
/// terminal?), `SIOCGIFNAME` and `SIOCGIFINDEX`. Their type in libc differs between C libraries.
const REQUESTS: [u64; 6] = [0x5421, 0x541B, 0x5451, 0x5401, 0x8910, 0x8933];

/// IP datagrams, `NETLINK_ROUTE`, and, except with DDS, IP streams.
fn sockets(is_dds: bool) -> Result<Vec<SeccompRule>, ConfinementError> {
    let family = |family| (0, SeccompCmpOp::Eq, number(family));
    let routes = (2, SeccompCmpOp::Eq, number(libc::NETLINK_ROUTE));
    let mut rules = vec![rule(&[family(libc::AF_NETLINK), routes])?];
    for ip in [libc::AF_INET, libc::AF_INET6] {
        rules.push(rule(&[family(ip), kind(libc::SOCK_DGRAM)])?);
        if !is_dds {
            rules.push(rule(&[family(ip), kind(libc::SOCK_STREAM)])?);
        }
    }
    Ok(rules)
}

/// Returns the condition on the kind of a socket; the remaining bits of the argument are flags.
fn kind(kind: libc::c_int) -> (u8, SeccompCmpOp, u64) {
    (1, SeccompCmpOp::MaskedEq(0xF), number(kind))
}

/// Returns the cases in which an argument has one of these values.
fn one_of(argument: u8, values: &[u64]) -> Result<Vec<SeccompRule>, ConfinementError> {
    values.iter().map(|value| rule(&[(argument, SeccompCmpOp::Eq, *value)])).collect()
}

/// Returns a case in which all conditions hold: position of the argument, comparison, value.
fn rule(conditions: &[(u8, SeccompCmpOp, u64)]) -> Result<SeccompRule, ConfinementError> {
    let conditions = conditions.iter().map(|(argument, comparison, value)| {
        SeccompCondition::new(*argument, SeccompCmpArgLen::Dword, comparison.clone(), *value)
    });
    Ok(SeccompRule::new(conditions.collect::<Result<_, _>>()?)?)
}

/// Returns the system calls that every engine needs, in all cases: for the C library, the Rust libraries,
/// RustDDS and Zenoh.
fn always() -> Vec<i64> {
    #[cfg_attr(not(target_arch = "x86_64"), expect(unused_mut))]
    let mut calls = vec![
        // Memory.
        libc::SYS_brk,
        libc::SYS_munmap,
        libc::SYS_mremap,
        libc::SYS_madvise,
        libc::SYS_membarrier,
        // Threads, and exit.
        libc::SYS_clone3,
        libc::SYS_set_robust_list,
        libc::SYS_rseq,
        libc::SYS_futex,
        libc::SYS_sched_yield,
        libc::SYS_sched_getaffinity,
        libc::SYS_getcpu,
        libc::SYS_gettid,
        libc::SYS_getpid,
        libc::SYS_exit,
        libc::SYS_exit_group,
        libc::SYS_restart_syscall,
        // Signals to itself.
        libc::SYS_rt_sigaction,
        libc::SYS_rt_sigprocmask,
        libc::SYS_rt_sigreturn,
        libc::SYS_sigaltstack,
        // Time and random numbers.
        libc::SYS_clock_gettime,
        libc::SYS_clock_getres,
        libc::SYS_clock_nanosleep,
        libc::SYS_nanosleep,
        libc::SYS_gettimeofday,
        libc::SYS_timerfd_create,
        libc::SYS_timerfd_settime,
        libc::SYS_getrandom,
        // Descriptors.
        libc::SYS_read,
        libc::SYS_pread64,
        libc::SYS_write,
        libc::SYS_readv,
        libc::SYS_writev,
        libc::SYS_close,
        libc::SYS_fstat,
        libc::SYS_dup,
        libc::SYS_pipe2,
        libc::SYS_eventfd2,
        libc::SYS_ppoll,
        libc::SYS_epoll_create1,
        libc::SYS_epoll_ctl,
        libc::SYS_epoll_pwait,
        libc::SYS_epoll_pwait2,
        // Open sockets.
        libc::SYS_bind,
        libc::SYS_connect,
        libc::SYS_getsockname,
        libc::SYS_getpeername,
        libc::SYS_getsockopt,
        libc::SYS_setsockopt,
        libc::SYS_sendto,
        libc::SYS_sendmsg,
        libc::SYS_sendmmsg,
        libc::SYS_recvfrom,
        libc::SYS_recvmsg,
        libc::SYS_recvmmsg,
        libc::SYS_shutdown,
        // Information about this computer.
        libc::SYS_uname,
        libc::SYS_sysinfo,
        libc::SYS_getuid,
        libc::SYS_geteuid,
    ];
    // Older names of the same calls.
    #[cfg(target_arch = "x86_64")]
    calls.extend([libc::SYS_poll, libc::SYS_epoll_wait, libc::SYS_time]);
    calls
}

/// Flags and families are never negative.
fn number(flags: libc::c_int) -> u64 {
    flags.unsigned_abs().into()
}
