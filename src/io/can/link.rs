//! The kernel's view of an interface, and its announcements of changes.

use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::os::unix::net::UnixDatagram;
use std::time::Duration;

use libc::c_int;
use tokio::io::unix::AsyncFd;
use tokio::time::{Instant, sleep_until};

use crate::core::can::link::LinkState;

/// The interval at which the state is read when nothing is announced.
const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// The index of an interface that is up, or the reason why it has none. An interface that was deleted and
/// made again has a new index.
pub(super) type Link = Result<c_int, LinkState>;

/// Watches one interface, by name, whether it exists or not.
pub(super) struct LinkWatch {
    interface: String,
    /// Socket for queries; any kind would do, and this one is never forbidden.
    query_socket: io::Result<UnixDatagram>,
    /// The kernel's announcements; without them the interval has to do.
    announcements: Option<AsyncFd<OwnedFd>>,
    next_poll: Instant,
}

impl LinkWatch {
    /// Starts watching. Changes from now on are announced.
    pub(super) fn new(interface: &str) -> Self {
        let announcements = link_announcements();
        if let Err(error) = &announcements {
            tracing::warn!(interface, %error, "the kernel does not announce link changes, polling every second");
        }
        Self {
            interface: interface.to_owned(),
            query_socket: UnixDatagram::unbound(),
            announcements: announcements.ok(),
            next_poll: Instant::now() + POLL_INTERVAL,
        }
    }

    /// The state of the interface now.
    ///
    /// Up is what the administrator set up. The carrier is not read: a controller loses it when it
    /// goes bus-off, and some drivers do not give it back when frames come again. Bus-off shows as an
    /// error frame and as silence.
    pub(super) fn look(&self) -> Link {
        let socket = self.query_socket.as_ref().map_err(failed)?;
        let index = query(socket, &self.interface, libc::SIOCGIFINDEX).map_err(|error| failed(&error))?;
        let flags = query(socket, &self.interface, libc::SIOCGIFFLAGS).map_err(|error| failed(&error))?;
        if flags & libc::IFF_UP == 0 { Err(LinkState::Down) } else { Ok(index) }
    }

    /// Waits until some link may have changed, a second at most.
    pub(super) async fn event(&mut self) {
        tokio::select! {
            () = announced(self.announcements.as_ref()) => {}
            () = sleep_until(self.next_poll) => {}
        }
        self.next_poll = Instant::now() + POLL_INTERVAL;
    }

    /// Waits until the state of the interface differs from `known`.
    pub(super) async fn changed_from(&mut self, known: Link) {
        while self.look() == known {
            self.event().await;
        }
    }
}

/// True for a CAN interface (`ARPHRD_CAN`), and for one whose kind cannot be read: using it will show. The
/// interface exists.
pub(super) fn is_can(interface: &str) -> bool {
    let kind = std::fs::read_to_string(format!("/sys/class/net/{interface}/type"));
    kind.ok().is_none_or(|kind| kind.trim() == libc::ARPHRD_CAN.to_string())
}

/// The state of an interface whose query failed.
fn failed(error: &io::Error) -> LinkState {
    match error.raw_os_error() {
        Some(libc::ENODEV | libc::ENXIO) => LinkState::Missing,
        code => LinkState::Failed(code.unwrap_or(libc::EIO)),
    }
}

/// Waits for an announcement and takes all there are: only that they came matters.
async fn announced(announcements: Option<&AsyncFd<OwnedFd>>) {
    let Some(socket) = announcements else { return std::future::pending().await };
    let Ok(mut ready) = socket.readable().await else { return std::future::pending().await };
    while discard(socket.get_ref()) {}
    ready.clear_ready();
}

/// The answer to a `SIOCGIF*` request whose result is an index or a set of flags.
#[allow(unsafe_code)]
fn query(socket: &UnixDatagram, interface: &str, request: libc::c_ulong) -> io::Result<c_int> {
    // SAFETY: ifreq is integers and a union of plain values; zero is a value of each.
    let mut about: libc::ifreq = unsafe { std::mem::zeroed() };
    if interface.is_empty() || interface.len() >= about.ifr_name.len() {
        return Err(io::Error::from_raw_os_error(libc::EINVAL));
    }
    for (to, from) in about.ifr_name.iter_mut().zip(interface.bytes()) {
        *to = libc::c_char::from_ne_bytes([from]);
    }
    // SAFETY: the kernel reads and writes one ifreq, which `about` is.
    if unsafe { libc::ioctl(socket.as_raw_fd(), request as _, &raw mut about) } < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: the kernel has filled the member the request is about.
    Ok(unsafe {
        if request == libc::SIOCGIFINDEX {
            about.ifr_ifru.ifru_ifindex
        } else {
            c_int::from(about.ifr_ifru.ifru_flags)
        }
    })
}

/// A non-blocking netlink socket to which every link change is announced.
#[allow(unsafe_code)]
fn link_announcements() -> io::Result<AsyncFd<OwnedFd>> {
    let kind = libc::SOCK_RAW | libc::SOCK_NONBLOCK | libc::SOCK_CLOEXEC;
    // SAFETY: no pointers are passed.
    let fd = unsafe { libc::socket(libc::AF_NETLINK, kind, libc::NETLINK_ROUTE) };
    if fd < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: the kernel has just given us this descriptor, nobody else knows it.
    let fd = unsafe { OwnedFd::from_raw_fd(fd) };
    // SAFETY: sockaddr_nl is integers throughout; zero is a value of each.
    let mut address: libc::sockaddr_nl = unsafe { std::mem::zeroed() };
    address.nl_family = libc::AF_NETLINK.try_into().unwrap_or_default();
    address.nl_groups = libc::RTMGRP_LINK.try_into().unwrap_or_default();
    let len = libc::socklen_t::try_from(size_of_val(&address)).unwrap_or_default();
    // SAFETY: pointer and length describe `address`, which the kernel only reads.
    if unsafe { libc::bind(fd.as_raw_fd(), (&raw const address).cast(), len) } < 0 {
        return Err(io::Error::last_os_error());
    }
    // SAFETY: the descriptor is owned, and an OwnedFd never changes it.
    Ok(unsafe { AsyncFd::register(fd)? })
}

/// Takes one announcement; false when there was none. An overrun counts as one.
#[allow(unsafe_code)]
fn discard(fd: &OwnedFd) -> bool {
    let mut byte = 0_u8; // the rest of the datagram is cut off
    // SAFETY: pointer and length describe `byte`.
    let taken = unsafe { libc::recv(fd.as_raw_fd(), (&raw mut byte).cast(), 1, libc::MSG_DONTWAIT) };
    taken >= 0 || io::Error::last_os_error().raw_os_error() == Some(libc::ENOBUFS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_missing_interface_and_an_impossible_one_differ_from_an_interface() {
        assert_eq!(LinkWatch::new("no-such-can").look(), Err(LinkState::Missing));
        let impossible = LinkState::Failed(libc::EINVAL);
        assert_eq!(LinkWatch::new("name-longer-than-any").look(), Err(impossible));
        assert_eq!(LinkWatch::new("").look(), Err(impossible));
    }

    #[tokio::test(start_paused = true)]
    async fn without_announcements_the_state_is_still_polled() {
        let mut watch = LinkWatch::new("no-such-can");
        watch.announcements = None;
        let before = Instant::now();
        watch.event().await;
        assert_eq!(before.elapsed(), POLL_INTERVAL);
    }
}
