//! One raw CAN socket: filters, buffer, stamps, batches.

use std::io;
use std::mem::{size_of, size_of_val, zeroed};
use std::num::NonZero;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd, RawFd};
use std::ptr::null_mut;

use libc::{c_int, c_uint, socklen_t};
use rustix::net::sockopt::{
    set_socket_recv_buffer_size, set_socket_recv_buffer_size_force, socket_recv_buffer_size,
};
use rustix::net::{AddressFamily, Protocol, SocketFlags, SocketType, socket_with};
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use super::wire::{self, CONTROL_SPACE, LossCount, SocketMessage};
use crate::io::clock::Clock;
use can_signal::can::{BusIndex, CanInput, IdMatch};

/// Maximum number of messages per call.
pub(super) const BATCH: usize = 64;

/// A bound, non-blocking socket with its buffers.
pub(super) struct CanSocket {
    fd: OwnedFd,
    buffers: Box<[Buffer; BATCH]>,
    losses: LossCount,
    /// Size of the receive buffer as the kernel accounts it, bytes: twice the granted size.
    pub(super) receive_buffer: usize,
}

#[derive(Clone, Copy)]
#[repr(align(8))] // control messages start with a `usize`
struct Buffer {
    control: [u8; CONTROL_SPACE],
    message: [u8; libc::CANFD_MTU],
}

impl CanSocket {
    /// Opens a socket on the interface with this index, which receives data frames with these `ids` (none for
    /// an empty list, all for `None`) and all error frames.
    ///
    /// The receive buffer exceeds the system's limit if we have the privilege. Returns the kernel's error,
    /// e.g. `EAFNOSUPPORT` without CAN, `ENODEV` for an interface that is not a CAN interface, `EINVAL` for
    /// more than 512 ids.
    pub(super) fn open(interface: c_int, ids: Option<&[IdMatch]>, receive_buffer: usize) -> io::Result<Self> {
        let fd = raw_can_socket()?;
        // Before bind, since frames that arrive in between would be queued unfiltered.
        filter_frames(&fd, ids)?;
        set_option(&fd, libc::SOL_CAN_RAW, libc::CAN_RAW_ERR_FILTER, &[libc::CAN_ERR_MASK])?;
        // A kernel without CAN FD has no FD frames to miss.
        let _no_fd = set_option(&fd, libc::SOL_CAN_RAW, libc::CAN_RAW_FD_FRAMES, &[1]);
        let requested = receive_buffer.min(i32::MAX.unsigned_abs() as usize);
        set_socket_recv_buffer_size_force(&fd, requested)
            .or_else(|_not_privileged| set_socket_recv_buffer_size(&fd, requested))?;
        set_option(&fd, libc::SOL_SOCKET, libc::SO_TIMESTAMPNS_NEW, &[1])?;
        set_option(&fd, libc::SOL_SOCKET, libc::SO_RXQ_OVFL, &[1])?;
        bind(&fd, interface)?;
        let receive_buffer = socket_recv_buffer_size(&fd)?;
        let empty = Buffer { control: [0; CONTROL_SPACE], message: [0; libc::CANFD_MTU] };
        Ok(Self { fd, buffers: Box::new([empty; BATCH]), losses: LossCount::default(), receive_buffer })
    }

    /// Events to wait for: a lost link shows as an error.
    pub(super) const INTEREST: Interest = Interest::READABLE.add(Interest::ERROR);

    #[allow(unsafe_code)]
    pub(super) fn watched(self) -> io::Result<AsyncFd<Self>> {
        // SAFETY: the socket owns its descriptor and never replaces it.
        Ok(unsafe { AsyncFd::register_with_interest(self, Self::INTEREST)? })
    }

    /// Appends up to [`BATCH`] queued messages and returns their number. Returns `WouldBlock` if nothing is
    /// queued, and once `ENETDOWN` or `ENODEV` when the interface went down or away.
    pub(super) fn receive(&mut self, bus: BusIndex, inputs: &mut Vec<CanInput>) -> io::Result<usize> {
        let lengths = receive_batch(&self.fd, &mut self.buffers)?;
        let count = lengths.iter().flatten().count();
        inputs.reserve(count);
        for (buffer, length) in self.buffers.iter().zip(lengths.iter().flatten()) {
            let controls = wire::controls(buffer.control.get(..length.control).unwrap_or_default());
            let lost = controls.lost.map_or(0, |count| self.losses.advance(count));
            if lost > 0 {
                inputs.push(CanInput::Drops { bus, lost });
            }
            match wire::message(buffer.message.get(..length.message).unwrap_or_default()) {
                Some(SocketMessage::Data(frame)) => {
                    let stamp = controls.stamp.unwrap_or_else(|| Clock::start().now().wall);
                    inputs.push(CanInput::Frame { bus, frame, stamp });
                }
                Some(SocketMessage::Error(error)) => inputs.push(CanInput::ErrorFrame { bus, error }),
                None => {}
            }
        }
        Ok(count)
    }
}

/// Lets data frames with these `ids` through: none for an empty list, all for `None`.
pub(super) fn filter_frames(fd: &OwnedFd, ids: Option<&[IdMatch]>) -> io::Result<()> {
    let filters = ids.map_or(vec![wire::EVERY_DATA_FRAME], |ids| {
        ids.iter().flat_map(|ids| ids.masks()).map(wire::filter).collect()
    });
    set_option(fd, libc::SOL_CAN_RAW, libc::CAN_RAW_FILTER, &filters)
}

impl AsFd for CanSocket {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }
}

impl AsRawFd for CanSocket {
    fn as_raw_fd(&self) -> RawFd {
        self.fd.as_raw_fd()
    }
}

#[derive(Clone, Copy)]
struct Lengths {
    control: usize,
    message: usize,
}

/// Returns the kernel's error for a CAN socket: `EAFNOSUPPORT` or `EPROTONOSUPPORT` without CAN, `EPERM` or
/// `EACCES` where it is forbidden. The socket is bound to nothing.
pub fn check_can_sockets() -> io::Result<()> {
    raw_can_socket().map(drop)
}

fn raw_can_socket() -> io::Result<OwnedFd> {
    let flags = SocketFlags::NONBLOCK | SocketFlags::CLOEXEC;
    let protocol = NonZero::new(libc::CAN_RAW.cast_unsigned()).map(Protocol::from_raw);
    Ok(socket_with(AddressFamily::CAN, SocketType::RAW, flags, protocol)?)
}

/// Sets an option whose value is a sequence of kernel structures or integers.
#[allow(unsafe_code)]
fn set_option<T: Copy>(fd: &OwnedFd, level: c_int, name: c_int, value: &[T]) -> io::Result<()> {
    let len = length(size_of_val(value));
    // SAFETY: pointer and length describe `value`, which the kernel only reads.
    checked(unsafe { libc::setsockopt(fd.as_raw_fd(), level, name, value.as_ptr().cast(), len) })
}

#[allow(unsafe_code)]
fn bind(fd: &OwnedFd, interface: c_int) -> io::Result<()> {
    // SAFETY: sockaddr_can is integers throughout; zero is a value of each.
    let mut address: libc::sockaddr_can = unsafe { zeroed() };
    address.can_family = libc::AF_CAN.try_into().unwrap_or_default();
    address.can_ifindex = interface;
    let len = length(size_of::<libc::sockaddr_can>());
    // SAFETY: pointer and length describe `address`, which the kernel only reads.
    checked(unsafe { libc::bind(fd.as_raw_fd(), (&raw const address).cast(), len) })
}

/// Fills the buffers with queued messages; the lengths of the filled ones come first.
#[allow(unsafe_code)]
fn receive_batch(fd: &OwnedFd, buffers: &mut [Buffer; BATCH]) -> io::Result<[Option<Lengths>; BATCH]> {
    // SAFETY: zero bytes are null pointers and zero lengths, values of these structures.
    let (mut parts, mut headers): ([libc::iovec; BATCH], [libc::mmsghdr; BATCH]) = unsafe { zeroed() };
    for ((buffer, part), header) in buffers.iter_mut().zip(&mut parts).zip(&mut headers) {
        part.iov_base = buffer.message.as_mut_ptr().cast();
        part.iov_len = buffer.message.len();
        header.msg_hdr.msg_iov = part;
        header.msg_hdr.msg_iovlen = 1;
        header.msg_hdr.msg_control = buffer.control.as_mut_ptr().cast();
        header.msg_hdr.msg_controllen = buffer.control.len();
    }
    let count = loop {
        let most = c_uint::try_from(BATCH).unwrap_or(1);
        let flags = libc::MSG_DONTWAIT;
        // SAFETY: every header points to its own part and buffer, with their lengths; all of them
        // outlive the call, and nothing else uses them meanwhile.
        let count = unsafe { libc::recvmmsg(fd.as_raw_fd(), headers.as_mut_ptr(), most, flags, null_mut()) };
        match checked(count) {
            Ok(()) => break usize::try_from(count).unwrap_or(0),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    };
    let mut lengths = [None; BATCH];
    for (length, header) in lengths.iter_mut().zip(&headers).take(count) {
        *length = Some(Lengths { control: header.msg_hdr.msg_controllen, message: header.msg_len as usize });
    }
    Ok(lengths)
}

/// Returns the last error for a negative `result`.
fn checked(result: c_int) -> io::Result<()> {
    if result < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

fn length(bytes: usize) -> socklen_t {
    socklen_t::try_from(bytes).unwrap_or(socklen_t::MAX)
}
