//! A reader of our own outside our participant: samples that arrive there also arrive at other participants.
//!
//! A sample that a participant sends to itself returns even when no peer receives anything any more, e.g.
//! after thousands of participants were announced to it: its two threads work, but no peer is discovered, and
//! no peer receives from it. So a second, small participant runs next to it, which RustDDS knows only from
//! packets: it announces a reader of the echo, replaces that by another reader every few seconds, and reads
//! the samples sent to it. It uses no multicast and announces itself to no other participant.

use std::io;
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::time::{Duration, Instant};

use rustdds::{DomainParticipant, RTPSEntity as _};

use super::discovery_probe::{Prefix, prefix};

/// Time for which a reader is announced, before another replaces it.
const READER_LIFE: Duration = Duration::from_secs(2);
/// Interval at which announcements are repeated, since packets get lost.
const ANNOUNCEMENT_INTERVAL: Duration = Duration::from_millis(200);
/// Minimum time between two checks: samples may wake this side thousands of times a second.
const MIN_PAUSE: Duration = Duration::from_millis(20);
/// Maximum number of datagrams that are read at once.
const AT_ONCE: usize = 64;

const SPDP_WRITER: [u8; 4] = [0, 1, 0, 0xC2];
const SPDP_READER: [u8; 4] = [0, 1, 0, 0xC7];
const SUBSCRIPTIONS_WRITER: [u8; 4] = [0, 0, 4, 0xC2];
const SUBSCRIPTIONS_READER: [u8; 4] = [0, 0, 4, 0xC7];
const PARTICIPANT: [u8; 4] = [0, 0, 1, 0xC1];
/// Kind of a submessage with its flags: little-endian; data with a payload; a key with inline parameters;
/// final.
type Header = [u8; 2];
const DATA: Header = [0x15, 0x05];
const DISPOSAL: Header = [0x15, 0x0B];
const HEARTBEAT: Header = [0x07, 0x03];
/// It announces itself and its readers, and accepts no announcements. RustDDS 0.15 checks the bit for writer
/// announcements where it should check for reader announcements.
const ENDPOINTS: u32 = 0x15;
/// Lease, seconds: after this time without announcements, the participant forgets the witness.
const LEASE_S: u32 = 20;

/// The small participant and its present reader.
#[derive(Debug)]
pub(super) struct Witness {
    /// The prefix of the witness's participant.
    pub(super) prefix: Prefix,
    observed: Prefix,
    /// Address at which that participant listens for announcements.
    port: SocketAddrV4,
    topic: String,
    type_name: String,
    /// Socket for the witness's announcements.
    socket: UdpSocket,
    /// Socket of its present reader.
    reader: UdpSocket,
    number: u32,
    reader_since: Instant,
    last_look: Option<Instant>,
    announced: Option<Instant>,
    announcements: u32,
}

impl Witness {
    /// Creates a witness of this participant, and of its samples of this topic.
    pub(super) fn new(
        domain: &DomainParticipant,
        topic: &str,
        type_name: &str,
        now: Instant,
    ) -> Option<Self> {
        // Ports as RTPS prescribes them.
        let offset = domain.participant_id().checked_mul(2)?.checked_add(10)?;
        let port = domain.domain_id().checked_mul(250)?.checked_add(7400)?.checked_add(offset)?;
        let observed = prefix(&domain.guid().to_bytes());
        let mut prefix = observed;
        // RustDDS's identities begin with the vendor number and end randomly.
        prefix.iter_mut().take(4).for_each(|byte| *byte = !*byte);
        Some(Self {
            prefix,
            observed,
            port: SocketAddrV4::new(Ipv4Addr::LOCALHOST, port),
            topic: topic.to_owned(),
            type_name: type_name.to_owned(),
            socket: socket().ok()?,
            reader: socket().ok()?,
            number: 1,
            reader_since: now,
            last_look: None,
            announced: None,
            announcements: 0,
        })
    }

    /// Sends due announcements, and reads received samples; returns the number of samples.
    pub(super) fn look(&mut self, now: Instant) -> u64 {
        if self.last_look.is_some_and(|last| now.saturating_duration_since(last) < MIN_PAUSE) {
            return 0;
        }
        self.last_look = Some(now);
        let heard = self.take();
        if now.saturating_duration_since(self.reader_since) >= READER_LIFE
            && let Ok(reader) = socket()
        {
            (self.reader, self.number) = (reader, self.number.wrapping_add(1).max(1));
            (self.reader_since, self.announced) = (now, None);
        }
        let is_due =
            self.announced.is_none_or(|at| now.saturating_duration_since(at) >= ANNOUNCEMENT_INTERVAL);
        if is_due {
            self.announced = Some(now);
            self.announcements = self.announcements.wrapping_add(1).max(1);
            // Lost announcements are repeated.
            let _ = self.announcement().map(|packet| self.socket.send_to(&packet, self.port));
        }
        heard
    }

    /// Reads the packets for the present reader; returns the number of samples among them.
    fn take(&self) -> u64 {
        let mut datagram = [0; 1500];
        let _ = std::iter::repeat_with(|| self.socket.recv(&mut datagram)).take(AT_ONCE).find(Result::is_err);
        let received = (0..AT_ONCE).map_while(|_| {
            let length = self.reader.recv(&mut datagram).ok()?;
            Some(has_data(datagram.get(..length)?, &self.observed))
        });
        received.map(u64::from).sum()
    }

    /// Returns the announcement of its participant, the removed reader, and the present one; the two are
    /// numbered consecutively.
    fn announcement(&self) -> io::Result<Vec<u8>> {
        let mut packet = [b"RTPS", &[2, 4, 1, 0x12][..], &self.prefix].concat();
        let meta = locator(&self.socket)?;
        let participant = parameters(&[
            (0x15, &[2, 4, 0, 0]),
            (0x16, &[1, 0x12, 0, 0]),
            (0x50, &self.guid(PARTICIPANT)),
            (0x32, &meta),
            (0x31, &meta),
            (0x02, &[LEASE_S.to_le_bytes(), [0; 4]].concat()),
            (0x58, &ENDPOINTS.to_le_bytes()),
        ]);
        let spdp = data(SPDP_READER, SPDP_WRITER, self.announcements.into(), &[], &participant);
        submessage(&mut packet, DATA, &spdp);
        let last = 2 * u64::from(self.number);
        let ids = [SUBSCRIPTIONS_READER, SUBSCRIPTIONS_WRITER].concat();
        let available =
            [&ids[..], &number(last - 1), &number(last), &self.announcements.to_le_bytes()].concat();
        submessage(&mut packet, HEARTBEAT, &available);
        let (ours, theirs) = (SUBSCRIPTIONS_WRITER, SUBSCRIPTIONS_READER);
        let gone = parameters(&[(0x5A, &self.guid(reader_id(self.number - 1)))]);
        let disposed = [0x71, 0, 4, 0, 0, 0, 0, 3, 1, 0, 0, 0];
        submessage(&mut packet, DISPOSAL, &data(theirs, ours, last - 1, &disposed, &gone));
        let present = parameters(&[
            (0x5A, &self.guid(reader_id(self.number))),
            (0x50, &self.guid(PARTICIPANT)),
            (0x05, &text(&self.topic)),
            (0x07, &text(&self.type_name)),
            (0x2F, &locator(&self.reader)?),
        ]);
        submessage(&mut packet, DATA, &data(theirs, ours, last, &[], &present));
        Ok(packet)
    }

    fn guid(&self, entity: [u8; 4]) -> Vec<u8> {
        [&self.prefix[..], &entity].concat()
    }
}

fn socket() -> io::Result<UdpSocket> {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}

/// Returns the identity of a reader without a key.
fn reader_id(number: u32) -> [u8; 4] {
    let [_, a, b, c] = number.to_be_bytes();
    [a, b, c, 0x04]
}

/// Returns the address at which a socket receives.
fn locator(socket: &UdpSocket) -> io::Result<Vec<u8>> {
    let port = u32::from(socket.local_addr()?.port());
    Ok([&1_u32.to_le_bytes()[..], &port.to_le_bytes(), &[0; 12], &Ipv4Addr::LOCALHOST.octets()].concat())
}

/// Returns a text with its length and a terminating zero, padded to whole words.
fn text(text: &str) -> Vec<u8> {
    let length = u32::try_from(text.len() + 1).unwrap_or_default();
    let mut bytes = [&length.to_le_bytes()[..], text.as_bytes(), &[0]].concat();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

/// Returns a list of parameters in little-endian order, with its header.
fn parameters(parameters: &[(u16, &[u8])]) -> Vec<u8> {
    let mut list = vec![0, 3, 0, 0];
    for (id, value) in parameters {
        list.extend(id.to_le_bytes());
        list.extend(u16::try_from(value.len()).unwrap_or_default().to_le_bytes());
        list.extend(*value);
    }
    list.extend([1, 0, 0, 0]);
    list
}

fn data(reader: [u8; 4], writer: [u8; 4], sequence: u64, inline: &[u8], payload: &[u8]) -> Vec<u8> {
    [&[0, 0, 16, 0][..], &reader, &writer, &number(sequence), inline, payload].concat()
}

/// Returns the bytes of a sequence number: high half first.
fn number(number: u64) -> [u8; 8] {
    (number.rotate_left(32)).to_le_bytes()
}

fn submessage(packet: &mut Vec<u8>, header: Header, body: &[u8]) {
    packet.extend(header);
    packet.extend(u16::try_from(body.len()).unwrap_or_default().to_le_bytes());
    packet.extend(body);
}

/// Returns true for a message of the participant that contains data.
fn has_data(message: &[u8], sender: &Prefix) -> bool {
    if message.get(8..20) != Some(sender) {
        return false;
    }
    let mut rest = message.get(20..).unwrap_or_default();
    while let [kind, flags, a, b, after @ ..] = rest {
        if *kind == DATA[0] {
            return true;
        }
        let length = if flags & 1 == 1 { u16::from_le_bytes([*a, *b]) } else { u16::from_be_bytes([*a, *b]) };
        rest = after.get(usize::from(length)..).unwrap_or_default();
    }
    false
}
