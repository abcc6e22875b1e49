//! The report of the network process on its confinement, sent once over a separate socket: the missing
//! layers, and the descriptor through which the kernel asks about each refused system call. The holder of the
//! descriptor decides on the calls, so the process does not keep it.

use std::io;
use std::os::fd::{AsFd, OwnedFd};

use super::datagram;
use super::layers::Layers;

/// Sends a report to the gateway.
pub fn send(socket: impl AsFd, missing: Layers, listener: Option<&OwnedFd>) -> io::Result<()> {
    datagram::send(socket, &missing.bits().to_le_bytes(), listener.map(AsFd::as_fd).as_slice())
}

/// Waits for a report; `None` if the other end closes without sending one.
pub fn receive(socket: impl AsFd) -> io::Result<Option<(Layers, Option<OwnedFd>)>> {
    let mut bits = [0; 2];
    let (length, descriptors) = datagram::receive(socket, &mut bits)?;
    let listener = descriptors.into_iter().next();
    Ok((length == bits.len()).then(|| (Layers::from_bits(u16::from_le_bytes(bits)), listener)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::layers::Layer;

    #[test]
    fn a_report_comes_with_or_without_a_descriptor_and_nothing_else_is_one() {
        let (ours, theirs) = datagram::pair().unwrap();
        let missing: Layers = [Layer::Landlock].into_iter().collect();
        send(&theirs, missing, None).unwrap();
        assert!(matches!(receive(&ours).unwrap(), Some((layers, None)) if layers == missing));
        let (listener, _other) = datagram::pair().unwrap();
        send(&theirs, Layers::default(), Some(&listener)).unwrap();
        assert!(matches!(receive(&ours).unwrap(), Some((_, Some(_)))));
        rustix::io::write(&theirs, &[1]).unwrap();
        assert!(receive(&ours).unwrap().is_none());
        drop(theirs);
        assert!(receive(&ours).unwrap().is_none());
    }
}
