//! The report of the network process on its confinement, sent once over a socket of its own: the layers that are missing, and with them the
//! descriptor at which the kernel asks about each system call that is refused. Who holds it decides, so the process keeps none.

use std::io::{self, IoSlice, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};

use rustix::net::{
    AddressFamily, RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer,
    SendAncillaryMessage, SendFlags, SocketFlags, SocketType, recvmsg, sendmsg, socketpair,
};

use crate::core::gateway::confinement::Layers;

/// Both ends; messages stay apart.
pub fn pair() -> io::Result<(OwnedFd, OwnedFd)> {
    Ok(socketpair(AddressFamily::UNIX, SocketType::SEQPACKET, SocketFlags::CLOEXEC, None)?)
}

/// Sends a report.
pub fn send(socket: impl AsFd, missing: Layers, listener: Option<&OwnedFd>) -> io::Result<()> {
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut ancillary = SendAncillaryBuffer::new(&mut space);
    let descriptors = listener.map(AsFd::as_fd);
    if descriptors.is_some() {
        ancillary.push(SendAncillaryMessage::ScmRights(descriptors.as_slice()));
    }
    sendmsg(socket, &[IoSlice::new(&missing.bits().to_le_bytes())], &mut ancillary, SendFlags::NOSIGNAL)?;
    Ok(())
}

/// Waits for a report; `None` when the other end closes without one.
pub fn receive(socket: impl AsFd) -> io::Result<Option<(Layers, Option<OwnedFd>)>> {
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut ancillary = RecvAncillaryBuffer::new(&mut space);
    let mut bits = [0; 2];
    let message =
        recvmsg(socket, &mut [IoSliceMut::new(&mut bits)], &mut ancillary, RecvFlags::CMSG_CLOEXEC)?;
    if message.bytes != bits.len() {
        return Ok(None);
    }
    let listener = ancillary.drain().find_map(|message| {
        let RecvAncillaryMessage::ScmRights(mut descriptors) = message else { return None };
        descriptors.next()
    });
    Ok(Some((Layers::from_bits(u16::from_le_bytes(bits)), listener)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::gateway::confinement::Layer;

    #[test]
    fn a_report_comes_with_or_without_a_descriptor_and_nothing_else_is_one() {
        let (ours, theirs) = pair().unwrap();
        let missing: Layers = [Layer::Landlock].into_iter().collect();
        send(&theirs, missing, None).unwrap();
        assert!(matches!(receive(&ours).unwrap(), Some((layers, None)) if layers == missing));
        let (listener, _other) = pair().unwrap();
        send(&theirs, Layers::default(), Some(&listener)).unwrap();
        assert!(matches!(receive(&ours).unwrap(), Some((_, Some(_)))));
        rustix::io::write(&theirs, &[1]).unwrap();
        assert!(receive(&ours).unwrap().is_none());
        drop(theirs);
        assert!(receive(&ours).unwrap().is_none());
    }
}
