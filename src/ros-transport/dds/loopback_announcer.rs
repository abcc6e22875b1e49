//! Multicasts announcements on the loopback.
//!
//! RustDDS sends none there (`docs/development/rustdds.md`), but announces a participant to the ports of the
//! first twelve participants of this computer. So the gateway takes one of these ports, and forwards its own
//! participants' announcements for peers that have none of them, such as Cyclone DDS without an index.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddrV4, UdpSocket};

use super::discovery_probe::{Prefix, prefix};

/// Number of participants on this computer to which RustDDS announces its own.
const ANNOUNCED_TO: u16 = 12;
const GROUP: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 1);
/// Maximum number of datagrams read at once, so that a flood cannot block the worker.
const AT_ONCE: usize = 64;

/// A socket on one of the ports to which RustDDS announces its participants.
pub(super) struct LoopbackAnnouncer {
    socket: UdpSocket,
    /// Multicast address at which peers listen.
    group: SocketAddrV4,
}

impl LoopbackAnnouncer {
    /// Creates an announcer for this domain; `None` if these addresses do not include the loopback (all do if
    /// the list is empty), or if all the ports are in use.
    pub(super) fn new(domain: u16, only_networks: &[IpAddr]) -> Option<Self> {
        if !only_networks.is_empty() && !only_networks.contains(&Ipv4Addr::LOCALHOST.into()) {
            return None;
        }
        // Ports as RTPS prescribes them. The last ports are tried first: participants begin with the first.
        let multicast_port = domain.checked_mul(250)?.checked_add(7400)?;
        let mut unicast_ports = (0..ANNOUNCED_TO).rev().map(|participant| 10 + 2 * participant);
        // Bound to the loopback address, the socket also sends multicast there.
        let socket = unicast_ports.find_map(|offset| {
            UdpSocket::bind((Ipv4Addr::LOCALHOST, multicast_port.checked_add(offset)?)).ok()
        })?;
        socket.set_nonblocking(true).ok()?;
        Some(Self { socket, group: SocketAddrV4::new(GROUP, multicast_port) })
    }

    /// Forwards the announcements of participants with these prefixes since the last call.
    pub(super) fn send_on(&self, own: &[Prefix]) {
        let mut datagram = [0; 1500];
        for _ in 0..AT_ONCE {
            match self.socket.recv(&mut datagram) {
                Ok(length) => {
                    let message = datagram.get(..length).unwrap_or_default();
                    // The prefix of the sender follows `RTPS`, its version and its vendor.
                    let is_own = message.get(8..20).is_some_and(|sender| own.contains(&prefix(sender)));
                    if is_own {
                        // A lost announcement is repeated.
                        let _ = self.socket.send_to(message, self.group);
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                Err(_) => {} // of one datagram before
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::waiting::DEADLINE;

    /// A domain that no other test uses.
    const DOMAIN: u16 = 231;

    fn announcement(sender: Prefix, number: u8) -> Vec<u8> {
        [b"RTPS\x02\x04\x01\x12".as_slice(), &sender, &[number]].concat()
    }

    #[test]
    fn what_own_participants_announce_is_sent_on_and_nothing_else() {
        let announcer = LoopbackAnnouncer::new(DOMAIN, &[]).unwrap();
        let second = LoopbackAnnouncer::new(DOMAIN, &[]).unwrap();
        let ports = [&announcer, &second].map(|announcer| announcer.socket.local_addr().unwrap().port());
        assert_ne!(ports[0], ports[1], "each has a port of its own");
        let peer = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, announcer.group.port())).unwrap();
        peer.join_multicast_v4(&GROUP, &Ipv4Addr::LOCALHOST).unwrap();
        peer.set_read_timeout(Some(DEADLINE)).unwrap();

        let (own, foreign) = ([1; 12], [2; 12]);
        let sender = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let messages = [announcement(foreign, 0), vec![], b"RTPS".to_vec(), announcement(own, 1)];
        for message in &messages {
            sender.send_to(message, announcer.socket.local_addr().unwrap()).unwrap();
        }
        announcer.send_on(&[own]);
        let mut received = [0; 100];
        let length = peer.recv(&mut received).unwrap();
        assert_eq!(received[..length], messages[3]);
    }
}
