//! The confinement of the network process before it meets the network, so that whoever takes it over gains little.
//!
//! - It goes on when its parent ends, should it have been stopped, so as to end as well. It is the first that the kernel takes when memory is short, and leaves no core dump.
//! - Its memory and its descriptors are limited. The limit is one of private writable memory (`RLIMIT_DATA`), since
//!   threads and allocators reserve much more address space than they use; memory that it would not count, which is shared or in
//!   files, cannot be had.
//! - It has no capability, not even where root started it, and none of the descriptors that its parent did not mean for it.
//! - Once the gateway has said which engine is to run, the system calls that this engine needs are all that is left, and of
//!   those with many meanings the meanings that it needs. All others fail with `EPERM`, and kill nobody. So it can neither run a
//!   program nor open a file (with Zenoh: to write), look into other processes, set their limits or priorities, have signals
//!   sent to them, or open sockets other than IP and the kernel's list of interfaces: it reaches neither CAN nor the service
//!   manager. With DDS it has no streams, and so no TCP.

use std::collections::BTreeMap;
use std::fs;

use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};
use rustix::thread::{CapabilitySet, CapabilitySets, clear_ambient_capability_set, set_capabilities};
use seccompiler::{
    BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule,
    apply_filter_all_threads,
};

use crate::io::ros::settings::Transport;

/// Open descriptors. A participant has 60 and some for each interface; now and then there are two.
const DESCRIPTORS: u64 = 1024;
/// Likelihood to be taken when memory is short, from -1000 to 1000.
const OOM_SCORE: &str = "500";

/// Gives up what no engine needs, and all private writable memory beyond so many bytes; gives what the system would not let
/// go, as texts.
pub(super) fn confine(memory: u64) -> Vec<String> {
    let limit = |resource, limit| {
        setrlimit(resource, Rlimit { current: Some(limit), maximum: Some(limit) })
            .map_err(|error| error.to_string())
    };
    let outcomes = [
        ("capabilities", drop_capabilities().map_err(|error| error.to_string())),
        (
            "a signal of the parent's end",
            set_parent_process_death_signal(Some(Signal::CONT)).map_err(|error| error.to_string()),
        ),
        ("OOM score", fs::write("/proc/self/oom_score_adj", OOM_SCORE).map_err(|error| error.to_string())),
        ("memory limit", limit(Resource::Data, memory)),
        ("descriptor limit", limit(Resource::Nofile, DESCRIPTORS)),
        ("core dumps", limit(Resource::Core, 0)),
    ];
    let refused =
        |(what, outcome): (&str, Result<(), String>)| outcome.err().map(|why| format!("{what}: {why}"));
    outcomes.into_iter().filter_map(refused).collect()
}

/// Gives up the system calls that an engine does not need, in all threads; the error is what the system would not let go.
pub(super) fn confine_to(engine: &Transport) -> Result<(), String> {
    allow_only(&allowed(engine)?, |program| apply_filter_all_threads(program))
        .map_err(|error| format!("system calls: {error}"))
}

fn drop_capabilities() -> rustix::io::Result<()> {
    let none = CapabilitySet::empty();
    clear_ambient_capability_set()?;
    set_capabilities(None, CapabilitySets { effective: none, permitted: none, inheritable: none })
}

/// System calls that are let through, each in these cases; in all without any.
type Calls = BTreeMap<i64, Vec<SeccompRule>>;

/// Applies filters that also forbid whom they are applied to, for ever, to gain privileges.
fn allow_only(allowed: &Calls, apply: impl Fn(&BpfProgram) -> seccompiler::Result<()>) -> Result<(), String> {
    // The C library tries `clone3`, whose flags a filter cannot read, and falls back to `clone` without it. A filter that came
    // before says more than one that lets through.
    let clone3 = BTreeMap::from([(libc::SYS_clone3, vec![])]);
    let errno = |errno: i32| SeccompAction::Errno(errno.unsigned_abs());
    for (calls, other, listed) in [
        (&clone3, SeccompAction::Allow, errno(libc::ENOSYS)),
        (allowed, errno(libc::EPERM), SeccompAction::Allow),
    ] {
        let arch = std::env::consts::ARCH.try_into().map_err(text)?;
        let filter = SeccompFilter::new(calls.clone(), other, listed, arch).map_err(text)?;
        let program: BpfProgram = filter.try_into().map_err(text)?;
        apply(&program).map_err(text)?;
    }
    Ok(())
}

/// What an engine needs.
fn allowed(engine: &Transport) -> Result<Calls, String> {
    let mut calls: Calls = always().iter().map(|call| (*call, Vec::new())).collect();
    // Threads, and no processes.
    let thread = number(libc::CLONE_THREAD);
    calls.insert(libc::SYS_clone, vec![rule(&[(0, SeccompCmpOp::MaskedEq(thread), thread)])?]);
    // A name, and none of its other meanings.
    calls.insert(libc::SYS_prctl, one_of(0, &[number(libc::PR_SET_NAME)])?);
    // `abort` is a signal to oneself.
    let own = (0, SeccompCmpOp::Eq, u64::from(std::process::id()));
    calls.insert(libc::SYS_tgkill, vec![rule(&[own])?]);
    // One's own limits, to be read.
    calls.insert(libc::SYS_prlimit64, vec![rule(&[(0, SeccompCmpOp::Eq, 0), (2, SeccompCmpOp::Eq, 0)])?]);
    let commands = [libc::F_GETFD, libc::F_SETFD, libc::F_GETFL, libc::F_DUPFD_CLOEXEC].map(number);
    let mut descriptor = one_of(1, &commands)?;
    // Not to be told of events by signals.
    let is_silent = (2, SeccompCmpOp::MaskedEq(number(libc::O_ASYNC)), 0);
    descriptor.push(rule(&[(1, SeccompCmpOp::Eq, number(libc::F_SETFL)), is_silent])?);
    calls.insert(libc::SYS_fcntl, descriptor);
    calls.insert(libc::SYS_ioctl, one_of(1, &REQUESTS)?);
    // Memory that counts for the limit.
    let private = (3, SeccompCmpOp::MaskedEq(MAP_TYPE), number(libc::MAP_PRIVATE));
    // What is loaded is loaded; but the C library may look up names by a library of its own.
    let no_code = (2, SeccompCmpOp::MaskedEq(number(libc::PROT_EXEC)), 0);
    let is_dds = matches!(engine, Transport::Dds);
    let memory = if is_dds { rule(&[private, no_code.clone()])? } else { rule(&[private])? };
    calls.insert(libc::SYS_mmap, vec![memory]);
    calls.insert(libc::SYS_mprotect, if is_dds { vec![rule(&[no_code])?] } else { Vec::new() });
    let streams = [(0, SeccompCmpOp::Eq, number(libc::AF_UNIX)), kind(libc::SOCK_STREAM)];
    calls.insert(libc::SYS_socketpair, vec![rule(&streams)?]);
    calls.insert(libc::SYS_socket, sockets(is_dds)?);
    if !is_dds {
        for call in [libc::SYS_listen, libc::SYS_accept4, libc::SYS_lseek, libc::SYS_pread64, libc::SYS_statx]
        {
            calls.insert(call, Vec::new());
        }
        calls.insert(libc::SYS_newfstatat, Vec::new());
        // Certificates and names of hosts, to be read.
        let changing = number(libc::O_ACCMODE | libc::O_CREAT | libc::O_TRUNC | O_TMPFILE);
        let reading = |flags: u8| rule(&[(flags, SeccompCmpOp::MaskedEq(changing), 0)]);
        calls.insert(libc::SYS_openat, vec![reading(2)?]);
        #[cfg(target_arch = "x86_64")]
        calls.insert(libc::SYS_open, vec![reading(1)?]);
    }
    Ok(calls)
}

/// The part of the flags of `mmap` that says whose the memory is.
const MAP_TYPE: u64 = 0xF;
/// The flag of `open` that stands for a file without a name.
const O_TMPFILE: libc::c_int = 0o20_000_000;
/// Requests of `ioctl` that an engine needs: `FIONBIO`, `FIONREAD`, `FIOCLEX`, `TCGETS` (is this a terminal?), `SIOCGIFNAME` and
/// `SIOCGIFINDEX`. In libc, their type differs between C libraries.
const REQUESTS: [u64; 6] = [0x5421, 0x541B, 0x5451, 0x5401, 0x8910, 0x8933];

/// IP datagrams, `NETLINK_ROUTE`, and IP streams but for DDS.
fn sockets(is_dds: bool) -> Result<Vec<SeccompRule>, String> {
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

/// The kind of a socket; the rest of the argument are flags.
fn kind(kind: libc::c_int) -> (u8, SeccompCmpOp, u64) {
    (1, SeccompCmpOp::MaskedEq(0xF), number(kind))
}

/// The cases in which an argument has one of these values.
fn one_of(argument: u8, values: &[u64]) -> Result<Vec<SeccompRule>, String> {
    values.iter().map(|value| rule(&[(argument, SeccompCmpOp::Eq, *value)])).collect()
}

/// A case in which all conditions hold: position of the argument, comparison, value.
fn rule(conditions: &[(u8, SeccompCmpOp, u64)]) -> Result<SeccompRule, String> {
    let conditions = conditions.iter().map(|(argument, comparison, value)| {
        SeccompCondition::new(*argument, SeccompCmpArgLen::Dword, comparison.clone(), *value).map_err(text)
    });
    SeccompRule::new(conditions.collect::<Result<_, _>>()?).map_err(text)
}

/// System calls that every engine needs, in all cases: of the C library, the libraries of Rust, RustDDS and Zenoh.
fn always() -> Vec<i64> {
    let mut calls = vec![
        // Memory.
        libc::SYS_brk,
        libc::SYS_munmap,
        libc::SYS_mremap,
        libc::SYS_madvise,
        libc::SYS_membarrier,
        // Threads, and the end.
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
        // Time and chance.
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
        // Sockets that are open.
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
        // What computer this is.
        libc::SYS_uname,
        libc::SYS_sysinfo,
        libc::SYS_getuid,
        libc::SYS_geteuid,
    ];
    // The same in older words.
    #[cfg(target_arch = "x86_64")]
    calls.extend([libc::SYS_poll, libc::SYS_epoll_wait, libc::SYS_time]);
    calls
}

/// Flags and families are never negative.
fn number(flags: libc::c_int) -> u64 {
    flags.unsigned_abs().into()
}

#[allow(clippy::needless_pass_by_value)] // for map_err
fn text(error: impl ToString) -> String {
    error.to_string()
}

#[cfg(test)]
mod tests {
    use std::fs::{File, OpenOptions};
    use std::io;
    use std::net::{TcpListener, TcpStream, UdpSocket};
    use std::os::unix::net::{UnixDatagram, UnixStream};
    use std::process::Command;
    use std::thread;

    use socketcan::{CanSocket, Socket as _};

    use super::*;
    use crate::io::ros::settings::ZenohSettings;

    /// What somebody who has taken the process over might try.
    struct Attacker {
        /// A file that was opened before.
        file: File,
        socket: UdpSocket,
    }

    type Attack = (&'static str, fn(&Attacker) -> io::Result<()>);

    const ATTACKS: [Attack; 27] = [
        ("to make a file", |_| File::create(std::env::temp_dir().join("signal-gateway-confined")).map(drop)),
        ("to write a file", |_| OpenOptions::new().write(true).open("/dev/null").map(drop)),
        ("to empty a file that is only read", |_| {
            call(libc::SYS_openat, [libc::AT_FDCWD.into(), path(), 0o1000, 0])
        }),
        ("to make a folder", |_| fs::create_dir(std::env::temp_dir().join("signal-gateway-confined"))),
        ("to remove a file", |_| fs::remove_file(std::env::temp_dir().join("signal-gateway-confined"))),
        ("to change a file's permissions", |a| call(libc::SYS_fchmod, [fd(&a.file), 0o777, 0, 0])),
        ("to change a file's owner", |a| call(libc::SYS_fchown, [fd(&a.file), 0, 0, 0])),
        ("to change a file's times", |a| call(libc::SYS_utimensat, [fd(&a.file), 0, 0, 0])),
        ("to run a program", |_| Command::new("/bin/true").status().map(drop)),
        ("CAN", |_| CanSocket::open_iface(1).map(drop)),
        ("a service of the computer", |_| UnixStream::connect("/run/none").map(drop)),
        ("the service manager", |_| UnixDatagram::unbound().map(drop)),
        ("packets", |_| call(libc::SYS_socket, [libc::AF_PACKET.into(), libc::SOCK_RAW.into(), 0, 0])),
        ("raw IP", |_| call(libc::SYS_socket, [libc::AF_INET.into(), libc::SOCK_RAW.into(), 1, 0])),
        ("to send the parent a signal", |_| call(libc::SYS_kill, [parent(), 0, 0, 0])),
        ("to have signals sent to the parent", |a| {
            call(libc::SYS_fcntl, [fd(&a.socket), F_SETOWN, parent(), 0])
        }),
        ("another signal for events", |a| call(libc::SYS_fcntl, [fd(&a.socket), F_SETSIG, 9, 0])),
        ("signals for events", |a| call(libc::SYS_fcntl, [fd(&a.socket), F_SETFL, libc::O_ASYNC.into(), 0])),
        ("the same by another call", |a| call(libc::SYS_ioctl, [fd(&a.socket), 0x8901, 0, 0])),
        ("the parent's limits", |_| call(libc::SYS_prlimit64, [parent(), libc::RLIMIT_NOFILE.into(), 0, 0])),
        ("limits of its own", |_| call(libc::SYS_prlimit64, [0, libc::RLIMIT_DATA.into(), path(), 0])),
        ("a priority", |_| call(libc::SYS_setpriority, [libc::PRIO_PROCESS.into(), parent(), 19, 0])),
        ("a scheduler", |_| {
            call(libc::SYS_sched_setscheduler, [parent(), libc::SCHED_IDLE.into(), path(), 0])
        }),
        ("an affinity", |_| call(libc::SYS_sched_setaffinity, [parent(), 8, path(), 0])),
        ("memory that does not count", |_| call(libc::SYS_memfd_create, [path(), 0, 0, 0])),
        ("memory that is shared", |_| {
            let flags = libc::MAP_SHARED | libc::MAP_ANONYMOUS;
            call(libc::SYS_mmap, [0, 4096, libc::PROT_READ.into(), flags.into()])
        }),
        ("a clone", |_| call(libc::SYS_clone, [libc::SIGCHLD.into(), 0, 0, 0])),
    ];
    const F_SETOWN: libc::c_long = 8;
    const F_SETSIG: libc::c_long = 10;
    const F_SETFL: libc::c_long = 4;

    #[allow(unsafe_code)]
    fn call(number: libc::c_long, [a, b, c, d]: [libc::c_long; 4]) -> io::Result<()> {
        // SAFETY: a filter refuses it; pointers are those of texts, or null.
        if unsafe { libc::syscall(number, a, b, c, d, -1, 0) } < 0 {
            Err(io::Error::last_os_error())
        } else {
            Ok(())
        }
    }

    fn path() -> libc::c_long {
        libc::c_long::try_from(c"/dev/null".as_ptr().addr()).unwrap()
    }

    fn fd(of: &impl std::os::fd::AsRawFd) -> libc::c_long {
        of.as_raw_fd().into()
    }

    fn parent() -> libc::c_long {
        std::os::unix::process::parent_id().into()
    }

    fn attacker() -> Attacker {
        Attacker { file: File::open("/dev/null").unwrap(), socket: UdpSocket::bind("127.0.0.1:0").unwrap() }
    }

    fn is_refused(outcome: io::Result<()>) -> bool {
        outcome.is_err_and(|error| error.raw_os_error() == Some(libc::EPERM))
    }

    /// In a thread of its own, since what is given up is never given back.
    fn confined(engine: Transport, then: impl FnOnce() + Send + 'static) {
        let confined = thread::spawn(move || {
            allow_only(&allowed(&engine).unwrap(), |program| seccompiler::apply_filter(program)).unwrap();
            then();
        });
        confined.join().unwrap();
        assert!(!is_confined(), "other threads are not concerned");
    }

    fn is_confined() -> bool {
        let status = fs::read_to_string("/proc/thread-self/status").unwrap();
        status.lines().any(|line| line.starts_with("Seccomp:") && line.ends_with('2'))
    }

    #[test]
    fn what_is_not_needed_is_refused_and_the_network_works() {
        for engine in [Transport::Dds, Transport::Zenoh(ZenohSettings::default())] {
            let attacker = attacker();
            let is_dds = matches!(engine, Transport::Dds);
            confined(engine, move || {
                for (what, attack) in ATTACKS {
                    assert!(is_refused(attack(&attacker)), "{what} is not refused");
                }
                let stream = TcpStream::connect("127.0.0.1:1").map(drop);
                assert_eq!(is_refused(stream), is_dds);
                assert_eq!(is_refused(TcpListener::bind("127.0.0.1:0").map(drop)), is_dds);
                assert_eq!(is_refused(fs::read("/proc/self/status").map(drop)), is_dds);
                UdpSocket::bind("127.0.0.1:0").unwrap();
                UnixStream::pair().unwrap();
                thread::spawn(thread::yield_now).join().unwrap();
                assert!(!if_addrs::get_if_addrs().unwrap().is_empty());
            });
        }
    }

    /// Otherwise a refusal would not be the filter's.
    #[test]
    fn without_a_filter_such_attacks_succeed() {
        let attacker = attacker();
        for (what, attack) in ATTACKS {
            let is_harmless =
                ["signal", "memory", "to run", "service manager"].iter().any(|word| what.contains(word));
            if is_harmless && !what.contains("parent") {
                assert!(attack(&attacker).is_ok(), "{what} fails anyhow");
            }
        }
    }
}
