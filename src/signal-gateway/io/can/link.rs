//! Queries the kernel's state of an interface, and waits for announced changes.

use std::io;
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::net::UnixDatagram;
use std::time::Duration;

use libc::c_int;
use rustix::io::Errno;
use rustix::net::{AddressFamily, RecvFlags, SocketFlags, SocketType, bind, netlink, recv, socket_with};
use tokio::io::unix::AsyncFd;
use tokio::time::{Instant, sleep_until};

use can_signal::can::LinkState;

/// Interval at which the state is polled if announcements are not available.
const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// The index of an interface that is up, or why it has none. A recreated interface has a new index.
pub(super) type Link = Result<c_int, LinkState>;

/// Watches one interface by name. It need not exist.
pub(super) struct LinkWatch {
    interface: String,
    /// Socket for queries. No sandbox forbids sockets of this kind.
    query_socket: io::Result<UnixDatagram>,
    /// The kernel's announcements; `None` if they are not available.
    announcements: Option<AsyncFd<OwnedFd>>,
    next_poll: Instant,
}

impl LinkWatch {
    /// Starts watching; changes are announced from now on.
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

    /// Queries the state of the interface.
    ///
    /// The administrative state counts, not the carrier: a controller loses the carrier when it goes bus-off,
    /// and some drivers do not set it again when frames return. Bus-off shows as an error frame and as
    /// silence.
    pub(super) fn look(&self) -> Link {
        let socket = self.query_socket.as_ref().map_err(failed)?;
        let index = query(socket, &self.interface, libc::SIOCGIFINDEX).map_err(|error| failed(&error))?;
        let flags = query(socket, &self.interface, libc::SIOCGIFFLAGS).map_err(|error| failed(&error))?;
        if flags & libc::IFF_UP == 0 { Err(LinkState::Down) } else { Ok(index) }
    }

    /// Waits until a link may have changed, for at most one second.
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

/// Returns true for a CAN interface (`ARPHRD_CAN`), and for an existing interface whose kind cannot be read,
/// since opening it will show.
pub(super) fn is_can(interface: &str) -> bool {
    let kind = std::fs::read_to_string(format!("/sys/class/net/{interface}/type"));
    kind.ok().is_none_or(|kind| kind.trim() == libc::ARPHRD_CAN.to_string())
}

fn failed(error: &io::Error) -> LinkState {
    match error.raw_os_error() {
        Some(libc::ENODEV | libc::ENXIO) => LinkState::Missing,
        code => LinkState::Failed(code.unwrap_or(libc::EIO)),
    }
}

/// Waits for an announcement, then discards all that are queued.
async fn announced(announcements: Option<&AsyncFd<OwnedFd>>) {
    let Some(socket) = announcements else { return std::future::pending().await };
    let Ok(mut ready) = socket.readable().await else { return std::future::pending().await };
    while discard(socket.get_ref()) {}
    ready.clear_ready();
}

/// Performs a `SIOCGIF*` request whose result is an index or a set of flags.
#[allow(unsafe_code)]
fn query(socket: &UnixDatagram, interface: &str, request: libc::c_ulong) -> io::Result<c_int> {
    // SAFETY: ifreq consists of integers and a union of plain values; zero is valid for each.
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
    // SAFETY: the kernel has filled the union member that belongs to the request.
    Ok(unsafe {
        if request == libc::SIOCGIFINDEX {
            about.ifr_ifru.ifru_ifindex
        } else {
            c_int::from(about.ifr_ifru.ifru_flags)
        }
    })
}

/// Opens a non-blocking netlink socket for announcements of link changes.
#[allow(unsafe_code)]
fn link_announcements() -> io::Result<AsyncFd<OwnedFd>> {
    let flags = SocketFlags::NONBLOCK | SocketFlags::CLOEXEC;
    // No protocol (0) means `NETLINK_ROUTE`.
    let fd = socket_with(AddressFamily::NETLINK, SocketType::RAW, flags, None)?;
    let groups = libc::RTMGRP_LINK.try_into().unwrap_or_default();
    bind(&fd, &netlink::SocketAddrNetlink::new(0, groups))?;
    // SAFETY: the descriptor is owned, and an OwnedFd never changes it.
    Ok(unsafe { AsyncFd::register(fd)? })
}

/// Discards one announcement; returns false if there is none. An overrun counts as an announcement.
fn discard(fd: &OwnedFd) -> bool {
    let mut byte = [0_u8]; // the rest of the datagram is cut off
    matches!(recv(fd, &mut byte, RecvFlags::DONTWAIT), Ok(_) | Err(Errno::NOBUFS))
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
