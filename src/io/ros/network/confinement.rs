//! The confinement of the network process before it meets the network, so that whoever takes it over gains little.
//!
//! - It goes on when its parent ends, should it have been stopped, so as to end as well. It is the first that the kernel takes when memory is short, and leaves no core dump.
//! - Its memory and its descriptors are limited. The limit is one of private writable memory (`RLIMIT_DATA`), since
//!   threads and allocators reserve much more address space than they use.
//! - System calls that it never needs fail: to run a program or to fork, to open a file for writing or to change the
//!   file system, to look into other processes or to send them signals, and sockets other than IP, the kernel's list of
//!   interfaces, and what the C library opens to ask for one. So it reaches neither CAN nor the service manager. What
//!   is refused is listed, and all else is let through: what a kernel or a C library to come may ask for cannot be
//!   listed, and a network side that fails on a new computer protects nobody.

use std::collections::BTreeMap;
use std::fs;

use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};
use seccompiler::{
    BpfProgram, SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule,
    apply_filter_all_threads,
};

/// Open descriptors. A participant has 60 and some for each interface; now and then there are two.
const DESCRIPTORS: u64 = 1024;
/// Likelihood to be taken when memory is short, from -1000 to 1000.
const OOM_SCORE: &str = "500";

/// Gives up what is not needed, and all private writable memory beyond so many bytes; gives what the system would not let
/// go, as texts.
pub(super) fn confine(memory: u64) -> Vec<String> {
    let limit = |resource, limit| {
        setrlimit(resource, Rlimit { current: Some(limit), maximum: Some(limit) })
            .map_err(|error| error.to_string())
    };
    let outcomes = [
        (
            "a signal of the parent's end",
            set_parent_process_death_signal(Some(Signal::CONT)).map_err(|error| error.to_string()),
        ),
        ("OOM score", fs::write("/proc/self/oom_score_adj", OOM_SCORE).map_err(|error| error.to_string())),
        ("memory limit", limit(Resource::Data, memory)),
        ("descriptor limit", limit(Resource::Nofile, DESCRIPTORS)),
        ("core dumps", limit(Resource::Core, 0)),
        ("system calls", refuse_system_calls(|program| apply_filter_all_threads(program))),
    ];
    let refused =
        |(what, outcome): (&str, Result<(), String>)| outcome.err().map(|why| format!("{what}: {why}"));
    outcomes.into_iter().filter_map(refused).collect()
}

/// Applies filters that also forbid whom they are applied to, for ever, to gain privileges.
fn refuse_system_calls(apply: impl Fn(&BpfProgram) -> seccompiler::Result<()>) -> Result<(), String> {
    // The C library tries `clone3`, whose flags a filter cannot read, and falls back to `clone` without it.
    let clone3 = BTreeMap::from([(libc::SYS_clone3, vec![])]);
    for (calls, errno) in [(refused()?, libc::EPERM), (clone3, libc::ENOSYS)] {
        let errno = SeccompAction::Errno(errno.unsigned_abs());
        let arch = std::env::consts::ARCH.try_into().map_err(text)?;
        let filter = SeccompFilter::new(calls, SeccompAction::Allow, errno, arch).map_err(text)?;
        let program: BpfProgram = filter.try_into().map_err(text)?;
        apply(&program).map_err(text)?;
    }
    Ok(())
}

/// The system calls that fail, each with the cases in which it does; always without any.
fn refused() -> Result<BTreeMap<i64, Vec<SeccompRule>>, String> {
    let mut calls: BTreeMap<_, _> = always().iter().map(|call| (*call, Vec::new())).collect();
    calls.insert(libc::SYS_openat, writing(2)?);
    #[cfg(target_arch = "x86_64")]
    calls.insert(libc::SYS_open, writing(1)?);
    let is_process = SeccompCmpOp::MaskedEq(number(libc::CLONE_THREAD));
    calls.insert(libc::SYS_clone, vec![rule(&[(0, is_process, 0)])?]);
    // `abort` is a signal to oneself.
    let own = u64::from(std::process::id());
    for call in [libc::SYS_kill, libc::SYS_tgkill, libc::SYS_rt_sigqueueinfo, libc::SYS_rt_tgsigqueueinfo] {
        calls.insert(call, vec![rule(&[(0, SeccompCmpOp::Ne, own)])?]);
    }
    calls.insert(libc::SYS_socket, sockets()?);
    Ok(calls)
}

/// An open for writing, by the position of its flags.
fn writing(flags: u8) -> Result<Vec<SeccompRule>, String> {
    let mode = SeccompCmpOp::MaskedEq(number(libc::O_ACCMODE));
    let create = SeccompCmpOp::MaskedEq(number(libc::O_CREAT));
    Ok(vec![
        rule(&[(flags, mode.clone(), number(libc::O_WRONLY))])?,
        rule(&[(flags, mode, number(libc::O_RDWR))])?,
        rule(&[(flags, create, number(libc::O_CREAT))])?,
    ])
}

/// Sockets but for IP, `NETLINK_ROUTE`, and unconnected ones within the computer.
fn sockets() -> Result<Vec<SeccompRule>, String> {
    let families = [libc::AF_INET, libc::AF_INET6, libc::AF_NETLINK, libc::AF_UNIX];
    let other = families.map(|family| (0, SeccompCmpOp::Ne, number(family)));
    let netlink = (0, SeccompCmpOp::Eq, number(libc::AF_NETLINK));
    let not_routes = (2, SeccompCmpOp::Ne, number(libc::NETLINK_ROUTE));
    let unix = (0, SeccompCmpOp::Eq, number(libc::AF_UNIX));
    // The rest of the type are flags.
    let not_datagrams =
        [libc::SOCK_STREAM, libc::SOCK_SEQPACKET].map(|kind| (1, SeccompCmpOp::MaskedEq(0xF), number(kind)));
    let raw = [libc::AF_INET, libc::AF_INET6].map(|family| {
        rule(&[
            (0, SeccompCmpOp::Eq, number(family)),
            (1, SeccompCmpOp::MaskedEq(0xF), number(libc::SOCK_RAW)),
        ])
    });
    let mut rules = vec![rule(&other)?, rule(&[netlink, not_routes])?];
    for kind in not_datagrams {
        rules.push(rule(&[unix.clone(), kind])?);
    }
    for rule in raw {
        rules.push(rule?);
    }
    Ok(rules)
}

/// A case in which all conditions hold: position of the argument, comparison, value.
fn rule(conditions: &[(u8, SeccompCmpOp, u64)]) -> Result<SeccompRule, String> {
    let conditions = conditions.iter().map(|(argument, comparison, value)| {
        SeccompCondition::new(*argument, SeccompCmpArgLen::Dword, comparison.clone(), *value).map_err(text)
    });
    SeccompRule::new(conditions.collect::<Result<_, _>>()?).map_err(text)
}

/// System calls that a network side never needs.
fn always() -> Vec<i64> {
    let mut calls = vec![
        // Programs and other processes.
        libc::SYS_execve,
        libc::SYS_execveat,
        libc::SYS_ptrace,
        libc::SYS_process_vm_readv,
        libc::SYS_process_vm_writev,
        libc::SYS_process_madvise,
        libc::SYS_kcmp,
        libc::SYS_pidfd_getfd,
        libc::SYS_pidfd_send_signal,
        libc::SYS_tkill,
        // The file system.
        libc::SYS_openat2,
        libc::SYS_unlinkat,
        libc::SYS_renameat,
        libc::SYS_renameat2,
        libc::SYS_mkdirat,
        libc::SYS_mknodat,
        libc::SYS_linkat,
        libc::SYS_symlinkat,
        libc::SYS_fchmodat,
        libc::SYS_fchownat,
        libc::SYS_truncate,
        libc::SYS_setxattr,
        libc::SYS_removexattr,
        libc::SYS_open_by_handle_at,
        libc::SYS_mount,
        libc::SYS_umount2,
        libc::SYS_pivot_root,
        libc::SYS_chroot,
        libc::SYS_move_mount,
        libc::SYS_fsopen,
        libc::SYS_open_tree,
        // The system.
        libc::SYS_unshare,
        libc::SYS_setns,
        libc::SYS_bpf,
        libc::SYS_perf_event_open,
        libc::SYS_userfaultfd,
        libc::SYS_io_uring_setup,
        libc::SYS_io_uring_enter,
        libc::SYS_io_uring_register,
        libc::SYS_add_key,
        libc::SYS_request_key,
        libc::SYS_keyctl,
        libc::SYS_init_module,
        libc::SYS_finit_module,
        libc::SYS_delete_module,
        libc::SYS_kexec_load,
        libc::SYS_reboot,
        libc::SYS_settimeofday,
        libc::SYS_clock_settime,
        libc::SYS_sethostname,
        libc::SYS_swapon,
        libc::SYS_quotactl,
    ];
    #[cfg(target_arch = "x86_64")]
    calls.extend([
        libc::SYS_fork,
        libc::SYS_vfork,
        libc::SYS_creat,
        libc::SYS_unlink,
        libc::SYS_rename,
        libc::SYS_mkdir,
        libc::SYS_rmdir,
        libc::SYS_mknod,
        libc::SYS_link,
        libc::SYS_symlink,
        libc::SYS_chmod,
        libc::SYS_chown,
        libc::SYS_lchown,
        libc::SYS_ioperm,
        libc::SYS_iopl,
    ]);
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
    use std::net::UdpSocket;
    use std::os::unix::net::{UnixDatagram, UnixStream};
    use std::process::Command;
    use std::thread;

    use rustix::process::{getpid, getppid, test_kill_process};
    use socketcan::{CanSocket, Socket as _};

    use super::*;

    /// In a thread of its own, since what is given up is never given back.
    #[test]
    fn what_is_listed_is_refused_and_the_network_works() {
        let confined = thread::spawn(|| {
            refuse_system_calls(|program| seccompiler::apply_filter(program)).unwrap();
            let is_refused = |outcome: io::Result<()>| {
                outcome.is_err_and(|error| error.raw_os_error() == Some(libc::EPERM))
            };
            let dir = std::env::temp_dir();
            for (what, outcome) in [
                ("a new file", File::create(dir.join("signal-gateway-confined")).map(drop)),
                ("to write", OpenOptions::new().write(true).open("/dev/null").map(drop)),
                ("a folder", fs::create_dir(dir.join("signal-gateway-confined"))),
                ("to remove", fs::remove_file(dir.join("signal-gateway-confined"))),
                ("a program", Command::new("/bin/true").status().map(drop)),
                ("CAN", CanSocket::open_iface(1).map(drop)),
                ("a service of the computer", UnixStream::connect("/run/none").map(drop)),
                ("the parent", getppid().map_or(Ok(()), test_kill_process).map_err(io::Error::from)),
            ] {
                assert!(is_refused(outcome), "{what} is not refused");
            }
            UdpSocket::bind("127.0.0.1:0").unwrap();
            UnixDatagram::unbound().unwrap();
            fs::read("/proc/self/status").unwrap();
            test_kill_process(getpid()).unwrap();
            thread::spawn(|| assert!(is_confined())).join().unwrap();
        });
        confined.join().unwrap();
        assert!(!is_confined(), "other threads are not concerned");
    }

    fn is_confined() -> bool {
        let status = fs::read_to_string("/proc/thread-self/status").unwrap();
        status.lines().any(|line| line.starts_with("Seccomp:") && line.ends_with('2'))
    }
}
