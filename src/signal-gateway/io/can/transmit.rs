//! Sends frames through the receiving socket of an interface.
//!
//! The kernel loops frames back to all sockets except the sending one. Since the gateway sends on its
//! receiving socket, it never receives its own frames, so a frame with one of their identifiers is foreign.

use std::io;
use std::os::fd::{AsFd as _, OwnedFd};
use std::sync::{Arc, Mutex};

use rustix::net::{SendFlags, send};
use tokio::sync::Notify;

use super::socket::CanSocket;
use super::wire;
use crate::io::lock::lock;
use can_signal::can::{ErrorFrame, Frame};
use gateway_core::command::sender::SendFailure;

/// Sends on one interface; shared by the receiving task and the senders.
#[derive(Debug, Clone, Default)]
pub struct Transmitter(Arc<SharedTarget>);

#[derive(Debug, Default)]
struct SharedTarget {
    target: Mutex<TransmitTarget>,
    lost: Notify,
}

#[derive(Debug, Default)]
enum TransmitTarget {
    #[default]
    Closed,
    Open(OwnedFd),
    /// The kernel has reported, as it does only once, that the interface is down or gone.
    Lost,
}

impl Transmitter {
    /// Passes a frame to the kernel without waiting. Returns the kernel's error, classified by its remedy;
    /// `ENETDOWN` if the bus is not open.
    pub fn send(&self, frame: &Frame) -> Result<(), SendFailure> {
        let (bytes, length) = wire::bytes(frame);
        self.send_bytes(bytes.get(..length).unwrap_or_default())
    }

    /// Sends an error frame to all other sockets on a virtual interface, as if their driver had created it.
    pub fn send_error(&self, error: ErrorFrame) -> Result<(), SendFailure> {
        self.send_bytes(&wire::error_bytes(error))
    }

    fn send_bytes(&self, bytes: &[u8]) -> Result<(), SendFailure> {
        let mut target = lock(&self.0.target);
        let TransmitTarget::Open(socket) = &*target else { return Err(SendFailure::Refused(libc::ENETDOWN)) };
        let Err(error) = send(socket, bytes, SendFlags::DONTWAIT) else { return Ok(()) };
        let errno = error.raw_os_error();
        if matches!(errno, libc::ENETDOWN | libc::ENODEV | libc::ENXIO) {
            // The kernel reports this only once, so the receiver is notified from here.
            *target = TransmitTarget::Lost;
            self.0.lost.notify_one();
        }
        Err(match errno {
            libc::ENOBUFS | libc::EAGAIN | libc::EINTR => SendFailure::QueueFull,
            _ => SendFailure::Refused(errno),
        })
    }

    /// Opens the transmitter on a socket until the result is dropped.
    pub(super) fn open(&self, socket: &CanSocket) -> io::Result<Opened> {
        *lock(&self.0.target) = TransmitTarget::Open(socket.as_fd().try_clone_to_owned()?);
        Ok(Opened(self.clone()))
    }

    /// Waits until a failed send has shown that the link is lost.
    pub(super) async fn lost(&self) {
        while !matches!(*lock(&self.0.target), TransmitTarget::Lost) {
            self.0.lost.notified().await;
        }
    }
}

/// Closes the transmitter when it is dropped.
pub(super) struct Opened(Transmitter);

impl Drop for Opened {
    fn drop(&mut self) {
        *lock(&self.0.0.target) = TransmitTarget::Closed;
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixDatagram;

    use super::*;
    use can_signal::can::CanId;

    fn frame() -> Frame {
        Frame::classic(CanId::Standard(0x130), &[1]).unwrap()
    }

    #[tokio::test]
    async fn an_interface_that_is_not_open_refuses_frames_and_reports_no_loss() {
        let transmitter = Transmitter::default();
        assert_eq!(transmitter.send(&frame()), Err(SendFailure::Refused(libc::ENETDOWN)));
        tokio::select! {
            biased;
            () = transmitter.lost() => panic!("it was never there"),
            () = tokio::task::yield_now() => {}
        }
    }

    /// Checks the kernel's errors with a datagram socket, which accepts datagrams as a CAN socket accepts
    /// frames.
    #[test]
    fn a_frame_goes_out_whole_or_its_error_is_told() {
        let (own, other) = UnixDatagram::pair().unwrap();
        let transmitter = Transmitter::default();
        *lock(&transmitter.0.target) = TransmitTarget::Open(own.into());
        assert_eq!(transmitter.send(&frame()), Ok(()));
        let mut received = [0; 100];
        let length = other.recv(&mut received).unwrap();
        let (sent, sent_length) = wire::bytes(&frame());
        assert_eq!(received[..length], sent[..sent_length]);
        let results: Vec<_> =
            (0..100_000).map(|_| transmitter.send(&frame())).take_while(Result::is_ok).collect();
        assert!(results.len() < 100_000);
        assert_eq!(transmitter.send(&frame()), Err(SendFailure::QueueFull));
        drop(other);
        assert_eq!(transmitter.send(&frame()), Err(SendFailure::Refused(libc::ECONNREFUSED)));
        assert!(matches!(*lock(&transmitter.0.target), TransmitTarget::Open(_)), "no sign of a lost link");
    }
}
