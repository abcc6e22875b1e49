//! Messages with preserved boundaries and attached descriptors.

use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

use rustix::net::{
    AddressFamily, RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, ReturnFlags, SendAncillaryBuffer,
    SendAncillaryMessage, SendFlags, SocketFlags, SocketType, recvmsg, sendmsg, socketpair,
};

/// Maximum number of descriptors per message.
const MAX_DESCRIPTORS: usize = 2;

/// Creates two connected sockets.
pub fn pair() -> io::Result<(OwnedFd, OwnedFd)> {
    Ok(socketpair(AddressFamily::UNIX, SocketType::SEQPACKET, SocketFlags::CLOEXEC, None)?)
}

/// Sends a message with at most two descriptors.
pub fn send(socket: impl AsFd, message: &[u8], descriptors: &[BorrowedFd<'_>]) -> io::Result<()> {
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(MAX_DESCRIPTORS))];
    let mut ancillary = SendAncillaryBuffer::new(&mut space);
    if descriptors.len() > MAX_DESCRIPTORS {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    if !descriptors.is_empty() {
        ancillary.push(SendAncillaryMessage::ScmRights(descriptors));
    }
    sendmsg(socket, &[IoSlice::new(message)], &mut ancillary, SendFlags::NOSIGNAL)?;
    Ok(())
}

/// Receives a message into `space`; returns its length, which is 0 once the other end is closed, and its
/// descriptors. A message longer than `space` is an error.
pub fn receive(socket: impl AsFd, space: &mut [u8]) -> io::Result<(usize, Vec<OwnedFd>)> {
    let mut ancillary_space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(MAX_DESCRIPTORS))];
    let mut ancillary = RecvAncillaryBuffer::new(&mut ancillary_space);
    let received = recvmsg(socket, &mut [IoSliceMut::new(space)], &mut ancillary, RecvFlags::CMSG_CLOEXEC)?;
    let descriptors = ancillary.drain().filter_map(|message| {
        let RecvAncillaryMessage::ScmRights(descriptors) = message else { return None };
        Some(descriptors)
    });
    let descriptors = descriptors.flatten().collect();
    if received.flags.contains(ReturnFlags::TRUNC) {
        return Err(io::ErrorKind::InvalidData.into());
    }
    Ok((received.bytes, descriptors))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_stay_apart_and_bring_their_descriptors() {
        let (ours, theirs) = pair().unwrap();
        send(&theirs, b"none", &[]).unwrap();
        send(&theirs, b"two", &[ours.as_fd(), theirs.as_fd()]).unwrap();
        send(&theirs, &[7; 9], &[]).unwrap();
        assert!(send(&theirs, b"three", &[ours.as_fd(); 3]).is_err());
        drop(theirs);
        let mut space = [0; 8];
        let mut next = || receive(&ours, &mut space).map(|(length, descriptors)| (length, descriptors.len()));
        assert_eq!(next().unwrap(), (4, 0));
        assert_eq!(next().unwrap(), (3, 2));
        assert_eq!(next().unwrap_err().kind(), io::ErrorKind::InvalidData, "longer than the space");
        assert_eq!(next().unwrap(), (0, 0), "closed");
    }
}
