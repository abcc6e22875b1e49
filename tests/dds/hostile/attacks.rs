//! What somebody who has taken the network process over might try. Each is harmless where it succeeds.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Error};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::os::fd::AsRawFd;
use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::process::Command;

use libc::c_long;

/// What was there before the process was confined.
pub(super) struct Attacker {
    folder: PathBuf,
    /// Opened to be read.
    file: File,
    udp: UdpSocket,
    /// A service of this computer.
    service: TcpListener,
    parent: c_long,
}

impl Attacker {
    pub(super) fn new() -> Self {
        let folder = std::env::temp_dir().join(format!("signal-gateway-hostile-{}", std::process::id()));
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join("there"), "something").unwrap();
        Self {
            file: File::open(folder.join("there")).unwrap(),
            udp: UdpSocket::bind("127.0.0.1:0").unwrap(),
            service: TcpListener::bind("127.0.0.1:0").unwrap(),
            parent: std::os::unix::process::parent_id().into(),
            folder,
        }
    }

    /// Removes what it made, if it may.
    pub(super) fn end(self) {
        let _ = fs::remove_dir_all(self.folder);
    }
}

type Attempt = fn(&Attacker) -> io::Result<()>;

/// What is tried, in words, and how.
pub(super) const ATTACKS: [(&str, Attempt); 60] = [
    // Files.
    ("make a file", |a| File::create(a.folder.join("made")).map(drop)),
    ("write a file", |_| OpenOptions::new().write(true).open("/dev/null").map(drop)),
    ("read a file of the user", |a| File::open(a.folder.join("there")).map(drop)),
    ("read what the C library reads", |_| File::open("/etc/passwd").map(drop)),
    ("empty a file that it may read", |a| {
        let path = c_path(&a.folder.join("there"));
        call(
            libc::SYS_openat,
            [libc::AT_FDCWD.into(), address(path.as_c_str()), (libc::O_RDONLY | libc::O_TRUNC).into(), 0],
        )
    }),
    ("truncate a file", |a| {
        call(libc::SYS_truncate, [address(c_path(&a.folder.join("there")).as_c_str()), 0, 0, 0])
    }),
    ("make a folder", |a| fs::create_dir(a.folder.join("folder"))),
    ("rename a file", |a| fs::rename(a.folder.join("there"), a.folder.join("there"))),
    ("link to a file", |a| fs::hard_link(a.folder.join("there"), a.folder.join("link"))),
    ("remove a file", |a| fs::remove_file(a.folder.join("there"))),
    ("change the permissions of an open file", |a| call(libc::SYS_fchmod, [fd(&a.file), 0o600, 0, 0])),
    ("change the owner of an open file", |a| call(libc::SYS_fchown, [fd(&a.file), -1, -1, 0])),
    ("change the times of an open file", |a| call(libc::SYS_utimensat, [fd(&a.file), 0, 0, 0])),
    ("set an attribute of an open file", |a| call(libc::SYS_fsetxattr, [fd(&a.file), 0, 0, 0])),
    ("watch files", |_| call(libc::SYS_inotify_init1, [0; 4])),
    ("mount a file system", |_| call(libc::SYS_mount, [0; 4])),
    ("change its root", |_| call(libc::SYS_chroot, [0; 4])),
    // Processes.
    ("run a program", |_| Command::new("/bin/true").status().map(drop)),
    ("make a process", |_| clone(libc::SIGCHLD)),
    ("send the gateway a signal", |a| call(libc::SYS_kill, [a.parent, 0, 0, 0])),
    ("send a thread of the gateway a signal", |a| call(libc::SYS_tgkill, [a.parent, a.parent, 0, 0])),
    ("have signals of its socket sent to the gateway", |a| fcntl(a, libc::F_SETOWN, a.parent)),
    ("choose the signal for that", |a| fcntl(a, F_SETSIG, libc::SIGKILL.into())),
    ("switch these signals on", |a| fcntl(a, libc::F_SETFL, libc::O_ASYNC.into())),
    ("do the same by ioctl", |a| call(libc::SYS_ioctl, [fd(&a.udp), FIOSETOWN, address(&a.parent), 0])),
    ("read the gateway's limits", |a| call(libc::SYS_prlimit64, [a.parent, NOFILE, 0, 0])),
    ("set limits of its own", |_| {
        let limit = [1024_u64, 1024];
        call(libc::SYS_prlimit64, [0, NOFILE, address(&limit), 0])
    }),
    ("set the gateway's priority", |a| {
        call(libc::SYS_setpriority, [libc::PRIO_PROCESS.into(), a.parent, 0, 0])
    }),
    ("set the gateway's scheduler", |a| {
        call(libc::SYS_sched_setscheduler, [a.parent, libc::SCHED_OTHER.into(), address(&0_i32), 0])
    }),
    ("bind the gateway to a processor", |a| {
        call(libc::SYS_sched_setaffinity, [a.parent, 8, address(&1_u64), 0])
    }),
    ("open the gateway's memory", |a| File::open(format!("/proc/{}/mem", a.parent)).map(drop)),
    ("read the gateway's memory", |a| call(libc::SYS_process_vm_readv, [a.parent, 0, 0, 0])),
    ("trace the gateway", |a| call(libc::SYS_ptrace, [0x4206, a.parent, 0, 0])),
    ("open the gateway as a process", |a| call(libc::SYS_pidfd_open, [a.parent, 0, 0, 0])),
    ("enter a namespace", |a| call(libc::SYS_setns, [fd(&a.file), 0, 0, 0])),
    ("make a namespace", |_| call(libc::SYS_unshare, [0; 4])),
    // Sockets.
    ("open a CAN socket", |_| socket(libc::AF_CAN, libc::SOCK_RAW, 1)),
    ("open a packet socket", |_| socket(libc::AF_PACKET, libc::SOCK_RAW, 0)),
    ("open a raw IP socket", |_| socket(libc::AF_INET, libc::SOCK_RAW, 1)),
    ("open a netlink socket for other than interfaces", |_| socket(libc::AF_NETLINK, libc::SOCK_RAW, 16)),
    ("open a Bluetooth socket", |_| socket(31, libc::SOCK_RAW, 1)),
    ("open a VM socket", |_| socket(40, libc::SOCK_STREAM, 0)),
    ("speak to a service of the computer", |_| socket(libc::AF_UNIX, libc::SOCK_STREAM, 0)),
    ("speak to the service manager", |_| UnixDatagram::unbound().map(drop)),
    ("connect over TCP", |a| TcpStream::connect(a.service.local_addr()?).map(drop)),
    ("listen over TCP", |_| TcpListener::bind("127.0.0.1:0").map(drop)),
    ("take an interface down by netlink", |_| interface_down()),
    ("the same by ioctl", |a| call(libc::SYS_ioctl, [fd(&a.udp), SIOCSIFFLAGS, address(&INTERFACE), 0])),
    // Memory.
    ("have memory that does not count", |_| call(libc::SYS_memfd_create, [address(c"a"), 0, 0, 0])),
    ("have memory that is shared", |_| map(4096, libc::PROT_READ, libc::MAP_SHARED)),
    ("have a thousand megabytes", |_| map(1 << 30, libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE)),
    ("have memory with code", |_| map(4096, libc::PROT_READ | libc::PROT_EXEC, libc::MAP_PRIVATE)),
    ("have a segment of System V", |_| call(libc::SYS_shmget, [0; 4])),
    // The kernel.
    ("set the clock", |_| call(libc::SYS_settimeofday, [0; 4])),
    ("load a program into the kernel", |_| call(libc::SYS_bpf, [0; 4])),
    ("load a module", |_| call(libc::SYS_finit_module, [-1, 0, 0, 0])),
    ("open an I/O ring", |_| call(libc::SYS_io_uring_setup, [0; 4])),
    ("watch the processor's events", |_| call(libc::SYS_perf_event_open, [0; 4])),
    ("handle page faults", |_| call(libc::SYS_userfaultfd, [-1, 0, 0, 0])),
    ("read keys of the kernel", |_| call(libc::SYS_keyctl, [0, -3, 0, 0])),
];

const F_SETSIG: libc::c_int = 10;
const FIOSETOWN: c_long = 0x8901;
const SIOCSIFFLAGS: c_long = 0x8914;
/// An interface of no name, with no flags.
const INTERFACE: [u8; 40] = [0; 40];
const NOFILE: c_long = 7;

fn fd(of: &impl AsRawFd) -> c_long {
    of.as_raw_fd().into()
}

fn c_path(path: &std::path::Path) -> std::ffi::CString {
    std::ffi::CString::new(path.to_str().unwrap()).unwrap()
}

fn address<T: ?Sized>(of: &T) -> c_long {
    c_long::try_from(std::ptr::from_ref(of).cast::<()>().addr()).unwrap()
}

fn fcntl(attacker: &Attacker, command: libc::c_int, value: c_long) -> io::Result<()> {
    call(libc::SYS_fcntl, [fd(&attacker.udp), command.into(), value, 0])
}

fn socket(family: libc::c_int, kind: libc::c_int, protocol: libc::c_int) -> io::Result<()> {
    call(libc::SYS_socket, [family.into(), kind.into(), protocol.into(), 0])
}

fn map(bytes: c_long, protection: libc::c_int, kind: libc::c_int) -> io::Result<()> {
    call(libc::SYS_mmap, [0, bytes, protection.into(), (kind | libc::MAP_ANONYMOUS).into()])
}

#[allow(unsafe_code)]
fn call(number: c_long, [a, b, c, d]: [c_long; 4]) -> io::Result<()> {
    // SAFETY: addresses are those of values that outlive the call, and nothing that it makes is used.
    if unsafe { libc::syscall(number, a, b, c, d, -1, 0) } < 0 { Err(Error::last_os_error()) } else { Ok(()) }
}

/// Makes a process, which ends at once.
#[allow(unsafe_code)]
fn clone(flags: libc::c_int) -> io::Result<()> {
    // SAFETY: the new process does nothing but end.
    match unsafe { libc::syscall(libc::SYS_clone, c_long::from(flags), 0, 0, 0, 0) } {
        // SAFETY: it takes no pointer.
        0 => unsafe { libc::_exit(0) },
        ..0 => Err(Error::last_os_error()),
        _ => Ok(()),
    }
}

/// Asks the kernel's list of interfaces to change the first one, to what it is.
#[allow(unsafe_code)]
fn interface_down() -> io::Result<()> {
    const SET_LINK: u16 = 19;
    let family = u16::try_from(libc::AF_NETLINK).unwrap();
    let mut request = Vec::new();
    request.extend(32_u32.to_ne_bytes());
    request.extend(SET_LINK.to_ne_bytes());
    request.extend(5_u16.to_ne_bytes()); // a request that is acknowledged
    request.extend([0; 8]);
    request.extend([0; 4]);
    request.extend(1_i32.to_ne_bytes()); // the loopback interface
    request.extend([0; 8]); // changes none of its flags
    let mut answer = [0_u8; 4096];
    let address = [family.to_ne_bytes(), [0; 2], [0; 2], [0; 2], [0; 2], [0; 2]].concat();
    // SAFETY: lengths are those of the buffers; the socket is closed with the process.
    let received = unsafe {
        let socket = libc::socket(libc::AF_NETLINK, libc::SOCK_RAW, 0);
        libc::connect(socket, address.as_ptr().cast(), 12);
        libc::send(socket, request.as_ptr().cast(), request.len(), 0);
        libc::recv(socket, answer.as_mut_ptr().cast(), answer.len(), 0)
    };
    if received < 20 {
        return Err(Error::last_os_error());
    }
    match i32::from_ne_bytes(answer[16..20].try_into().unwrap()) {
        0 => Ok(()),
        error => Err(Error::from_raw_os_error(-error)),
    }
}
