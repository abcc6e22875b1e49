//! RTPS packets as an attacker makes them: byte by byte, and with numbers that no sane peer sends.

use std::net::UdpSocket;
use std::time::Duration;

use rand_pcg::Pcg32;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};

use super::waiting::{let_pass, wait_for};

/// The participant that the packets pretend to come from.
const PREFIX: [u8; 12] = [1, 0x10, 0xBA, 0xD0, 0xBA, 0xD0, 1, 2, 3, 4, 5, 6];
/// Where that is in a packet.
const PREFIX_AT: std::ops::Range<usize> = 8..20;
const SPDP_WRITER: [u8; 4] = [0, 1, 0, 0xC2];
const SPDP_READER: [u8; 4] = [0, 1, 0, 0xC7];
const PUBLICATIONS_WRITER: [u8; 4] = [0, 0, 3, 0xC2];
const PUBLICATIONS_READER: [u8; 4] = [0, 0, 3, 0xC7];

/// A number that would take for ever to count to.
const FAR: u64 = 1 << 62;
/// Participants of one host that are looked for.
const PARTICIPANTS: u16 = 4;

/// An attack of one packet.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Attack {
    /// A writer that claims to have sent 2⁶² samples.
    Heartbeat,
    /// One that declares 2⁶² of them irrelevant.
    Gap,
    /// A first fragment of a sample of almost 4 GiB.
    Fragment,
}

impl Attack {
    /// The packet; a higher count makes it a new one.
    pub(crate) fn packet(self, count: u32) -> Vec<u8> {
        let ids = [PUBLICATIONS_READER, PUBLICATIONS_WRITER].concat();
        match self {
            Self::Heartbeat => {
                let body = [ids, number(1), number(FAR), count.to_le_bytes().to_vec()].concat();
                packet(0x07, 0x01, &body)
            }
            Self::Gap => packet(0x08, 0x01, &[ids, number(1), number(FAR), vec![0; 4]].concat()),
            Self::Fragment => {
                let size = 0xF000_0000_u32.to_le_bytes();
                let fragment = [&1_u32.to_le_bytes()[..], &[1, 0], &[0, 4], &size].concat();
                let number = number(u64::from(count));
                let body = [vec![0, 0, 28, 0], ids, number, fragment, vec![0; 1024]].concat();
                packet(0x16, 0x01, &body)
            }
        }
    }
}

/// A packet that claims to come from another's writer, with a number far ahead of it.
#[allow(dead_code)] // not every test forges them
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FarAhead {
    /// All samples below it do not exist.
    Gap,
    /// All samples below it are gone.
    Heartbeat,
    /// It is a sample.
    Data,
    /// It is a sample, and those below it do not exist.
    DataAfterGap,
}

#[allow(dead_code)]
impl FarAhead {
    /// The packet under a writer's GUID; a sample has this content, in CDR with its header.
    pub(crate) fn packet(self, guid: [u8; 16], content: &[u8]) -> Vec<u8> {
        let (prefix, writer) = guid.split_at(12);
        // To whatever reader.
        let ids = [&[0; 4], writer].concat();
        let gap = submessage(0x08, 0x01, &[&ids[..], &number(1), &number(FAR), &[0; 4]].concat());
        let count = (1_u32 << 30).to_le_bytes();
        let heartbeat = submessage(0x07, 0x03, &[&ids[..], &number(FAR), &number(FAR), &count].concat());
        let data = submessage(0x15, 0x05, &[&[0, 0, 16, 0], &ids[..], &number(FAR), content].concat());
        let submessages = match self {
            Self::Gap => gap,
            Self::Heartbeat => heartbeat,
            Self::Data => data,
            Self::DataAfterGap => [gap, data].concat(),
        };
        [b"RTPS", &[2, 4, 1, 0x10][..], prefix, &submessages].concat()
    }
}

/// What fills a participant: the announcement of a reader by one of many participants, which are there for 68
/// years.
#[allow(dead_code)]
pub(crate) fn crowd(
    participant: u32,
    packet_number: u32,
    port: u16,
    (topic, type_name): (&str, &str),
) -> Vec<u8> {
    let mut prefix = PREFIX;
    prefix[8..].copy_from_slice(&participant.to_be_bytes());
    if packet_number == 0 {
        let mut packet = announcement(port, 1);
        let starts = 0..=packet.len() - PREFIX.len();
        for start in starts.filter(|start| packet[*start..].starts_with(&PREFIX)).collect::<Vec<_>>() {
            packet[start..start + PREFIX.len()].copy_from_slice(&prefix);
        }
        let lease = [2, 0, 8, 0, 10, 0, 0, 0];
        let at = packet.windows(lease.len()).position(|window| window == lease).unwrap() + 4;
        packet[at..at + 4].copy_from_slice(&i32::MAX.to_le_bytes());
        return packet;
    }
    let locator =
        [&1_u32.to_le_bytes()[..], &u32::from(port).to_le_bytes(), &[0; 12], &[127, 0, 0, 1]].concat();
    let entity = &[&packet_number.to_be_bytes()[1..], &[4]].concat();
    let text = |text: &str| {
        let mut bytes =
            [&u32::try_from(text.len() + 1).unwrap().to_le_bytes()[..], text.as_bytes(), &[0]].concat();
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes
    };
    let list = parameters(&[
        (0x5A, &[&prefix[..], entity].concat()),
        (0x05, &text(topic)),
        (0x07, &text(type_name)),
        // Reliable.
        (0x1A, &[2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]),
        (0x2F, &locator),
    ]);
    let ids = [0, 0, 4, 0xC7, 0, 0, 4, 0xC2];
    let body = [&[0, 0, 16, 0][..], &ids, &number(u64::from(packet_number)), &list].concat();
    [b"RTPS", &[2, 4, 1, 0x10][..], &prefix, &submessage(0x15, 0x05, &body)].concat()
}

/// Announces the attacker's participant, which is said to listen on this port of the loopback.
pub(crate) fn announcement(port: u16, count: u32) -> Vec<u8> {
    let locator =
        [&1_u32.to_le_bytes()[..], &u32::from(port).to_le_bytes(), &[0; 12], &[127, 0, 0, 1]].concat();
    let guid = [&PREFIX[..], &[0, 0, 1, 0xC1]].concat();
    let list = parameters(&[
        (0x15, &[2, 4, 0, 0]),
        (0x16, &[1, 0x10, 0, 0]),
        (0x50, &guid),
        (0x32, &locator),
        (0x31, &locator),
        (0x02, &[10, 0, 0, 0, 0, 0, 0, 0]),
        (0x58, &[0x3F, 0x0C, 0, 0]),
    ]);
    let ids = [SPDP_READER, SPDP_WRITER].concat();
    packet(0x15, 0x05, &[vec![0, 0, 16, 0], ids, number(u64::from(count)), list].concat())
}

/// The announcement of another of 256 participants.
#[allow(dead_code)] // not every test needs a crowd
pub(crate) fn announcement_of(participant: u8, port: u16) -> Vec<u8> {
    let mut packet = announcement(port, 1);
    let starts = 0..=packet.len() - PREFIX.len();
    for start in starts.filter(|start| packet[*start..].starts_with(&PREFIX)).collect::<Vec<_>>() {
        packet[start + PREFIX.len() - 1] = participant;
    }
    packet
}

/// A list of parameters with its header.
fn parameters(parameters: &[(u16, &[u8])]) -> Vec<u8> {
    let mut list = vec![0, 3, 0, 0];
    for (id, value) in parameters {
        list.extend(id.to_le_bytes());
        list.extend(u16::try_from(value.len()).unwrap().to_le_bytes());
        list.extend(*value);
    }
    list.extend([1, 0, 0, 0]);
    list
}

/// A sequence number: the high half first.
fn number(number: u64) -> Vec<u8> {
    let [high, low] =
        [number >> 32, number & 0xFFFF_FFFF].map(|half| u32::try_from(half).unwrap().to_le_bytes());
    [high, low].concat()
}

/// A message with one submessage.
fn packet(kind: u8, flags: u8, body: &[u8]) -> Vec<u8> {
    [b"RTPS", &[2, 4, 1, 0x10][..], &PREFIX, &submessage(kind, flags, body)].concat()
}

fn submessage(kind: u8, flags: u8, body: &[u8]) -> Vec<u8> {
    let length = u16::try_from(body.len()).unwrap().to_le_bytes();
    [&[kind, flags], &length[..], body].concat()
}

/// Packets of all kinds in which some bytes are others, the same in each run.
pub(crate) struct Mutations {
    random: Pcg32,
    captured: Vec<Vec<u8>>,
    count: u32,
}

impl Mutations {
    /// Of packets that were captured, and of those that are made here.
    pub(crate) fn of(captured: Vec<Vec<u8>>) -> Self {
        Self { random: Pcg32::seed_from_u64(1), captured, count: 0 }
    }

    /// The next one; its participant is said to listen on this port.
    pub(crate) fn next(&mut self, port: u16) -> Vec<u8> {
        self.count += 1;
        let kinds = if self.captured.is_empty() { 4 } else { 8 };
        let mut packet = match self.below(kinds) {
            0 => announcement(port, self.count),
            1 => Attack::Heartbeat.packet(self.count),
            2 => Attack::Gap.packet(self.count),
            3 => Attack::Fragment.packet(self.count),
            _ => {
                let which = self.below(self.captured.len());
                self.captured[which].clone()
            }
        };
        for _ in 0..=self.below(8) {
            let at = 8 + self.below(packet.len() - 8);
            packet[at] = u8::try_from(self.below(256)).unwrap();
        }
        packet.truncate(packet.len() - self.below(packet.len() / 4));
        packet
    }

    fn below(&mut self, end: usize) -> usize {
        self.random.next_u32() as usize % end
    }
}

/// Where participants of a domain on this host listen for each other.
pub(crate) struct Target {
    socket: UdpSocket,
    ports: Vec<u16>,
}

impl Target {
    pub(crate) fn new(domain: u16) -> Self {
        Self::of_first(PARTICIPANTS, domain)
    }

    /// Only those that were first on this host, as they are numbered by their ports.
    pub(crate) fn of_first(count: u16, domain: u16) -> Self {
        let base = 7400 + 250 * domain;
        let ports =
            (0..count).flat_map(|participant| [base + 10 + 2 * participant, base + 11 + 2 * participant]);
        Self { socket: UdpSocket::bind(("127.0.0.1", 0)).unwrap(), ports: ports.collect() }
    }

    /// What the participants send to one that announces itself, as if it came from that one. Waits until
    /// there is a participant that sends something.
    pub(crate) fn capture(&self) -> Vec<Vec<u8>> {
        self.socket.set_nonblocking(true).unwrap();
        let mut count = 0;
        let first = wait_for("an answer to an announcement", || {
            count += 1;
            self.send(&announcement(self.own_port(), count));
            let_pass(Duration::from_millis(100), "for the way there and back");
            self.receive()
        });
        let_pass(Duration::from_millis(500), "for what follows the first packet, as far as it comes");
        let rest = std::iter::from_fn(|| self.receive()).take(100);
        let mut packets: Vec<_> = std::iter::once(first).chain(rest).collect();
        self.socket.set_nonblocking(false).unwrap();
        packets.retain(|packet| packet.starts_with(b"RTPS") && packet.len() > PREFIX_AT.end);
        for packet in &mut packets {
            packet[PREFIX_AT].copy_from_slice(&PREFIX);
        }
        packets
    }

    /// The next packet, if there is one.
    fn receive(&self) -> Option<Vec<u8>> {
        let mut packet = vec![0; 65536];
        let length = self.socket.recv(&mut packet).ok()?;
        packet.truncate(length);
        Some(packet)
    }

    /// The port that packets come from.
    pub(crate) fn own_port(&self) -> u16 {
        self.socket.local_addr().unwrap().port()
    }

    /// Sends a packet to all of them; where nobody listens, it is lost.
    pub(crate) fn send(&self, packet: &[u8]) {
        for port in &self.ports {
            let _ = self.socket.send_to(packet, ("127.0.0.1", *port));
        }
    }
}
