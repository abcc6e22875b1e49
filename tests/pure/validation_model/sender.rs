//! A sender whose frames a bad road garbles, and the vehicle it belongs to.

use std::sync::OnceLock;

use gateway_core::gateway::GatewaySettings;
use proptest::prelude::*;

use crate::support::files::MemoryFiles;

/// The protection of the message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Protection {
    /// J1850 in the last byte, four bits of counter, sent again and again.
    Fields,
    /// Likewise, but sent on change only.
    EventFields,
    /// AUTOSAR profile 1A with a window.
    E2e,
}

/// Longest silence in which a cyclic message is valid; and in which a bus is awake.
pub(crate) const TIMEOUT_MS: u64 = 300;
pub(crate) const ALIVE_MS: u64 = 1_000;
/// Identifiers of the message and of the other one that keeps the bus awake.
pub(crate) const TURN: u16 = 0x100;
pub(crate) const ALIVE: u16 = 0x101;
const DATA_ID: [u8; 2] = [0x23, 0x01];

/// What happens on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Act {
    /// The next frame, with this value, comes.
    Send(u8),
    /// It is lost.
    Lose(u8),
    /// It is late: others come before it.
    Delay(u8),
    /// The oldest of the late ones comes.
    Late,
    /// The newest frame, or one so many before it, comes again.
    Again(usize),
    /// It comes with these bits changed.
    Corrupt(u8, u64),
    /// It comes cut to so many bytes.
    Cut(u8, usize),
    /// It comes four bytes longer than it should be, with a checksum that is right for them.
    Stretch(u8),
    /// Its counter jumps by so much, its checksum is right.
    Jump(u8, u8),
    /// Nothing comes but the bus stays awake.
    Silence,
    /// Nothing at all comes for long enough that the bus is asleep.
    Sleep,
    /// The link is lost and comes back at once.
    LinkLost,
}

pub(crate) fn any_act() -> impl Strategy<Value = Act> {
    let value = || prop_oneof![8 => 0..3_u8, 1 => Just(3)];
    prop_oneof![
        12 => value().prop_map(Act::Send),
        2 => value().prop_map(Act::Lose),
        1 => value().prop_map(Act::Delay),
        1 => Just(Act::Late),
        2 => (0..6_usize).prop_map(Act::Again),
        2 => (value(), 0..64).prop_map(|(value, bit)| Act::Corrupt(value, 1_u64 << bit)),
        1 => (value(), 1..=u64::MAX).prop_map(|(value, bits)| Act::Corrupt(value, bits)),
        1 => (value(), 1..8_usize).prop_map(|(value, length)| Act::Cut(value, length)),
        1 => value().prop_map(Act::Stretch),
        2 => (value(), 0..16_u8).prop_map(|(value, by)| Act::Jump(value, by)),
        1 => Just(Act::Silence),
        1 => Just(Act::Sleep),
        1 => Just(Act::LinkLost),
    ]
}

/// The sender: its counter, and the frames under way.
#[derive(Debug, Clone)]
pub(crate) struct Sender {
    pub(crate) protection: Protection,
    counter: u8,
    sent: Vec<Vec<u8>>,
    late: Vec<Vec<u8>>,
}

impl Sender {
    pub(crate) fn new(protection: Protection) -> Self {
        Self { protection, counter: 0, sent: vec![], late: vec![] }
    }

    /// The frame that comes to the receiver, if one does.
    pub(crate) fn act(&mut self, act: Act) -> Option<Vec<u8>> {
        match act {
            Act::Send(value) => {
                let frame = self.next(value, 1);
                self.sent.push(frame.clone());
                Some(frame)
            }
            Act::Lose(value) => {
                self.next(value, 1);
                None
            }
            Act::Delay(value) => {
                let frame = self.next(value, 1);
                self.late.push(frame);
                None
            }
            Act::Late => (!self.late.is_empty()).then(|| self.late.remove(0)),
            Act::Again(before) => self.sent.iter().rev().nth(before).cloned(),
            Act::Corrupt(value, bits) => {
                let frame = self.next(value, 1);
                Some(frame.iter().zip(bits.to_le_bytes()).map(|(byte, bits)| byte ^ bits).collect())
            }
            Act::Cut(value, length) => Some(self.next(value, 1)[..length].to_vec()),
            Act::Stretch(value) => {
                let mut frame = self.next(value, 1);
                frame.extend([0; 4]);
                match self.protection {
                    Protection::E2e => frame[0] = right_crc(self.protection, &frame),
                    Protection::Fields | Protection::EventFields => {
                        frame[7] = right_crc(self.protection, &frame);
                    }
                }
                Some(frame)
            }
            Act::Jump(value, by) => Some(self.next(value, by)),
            Act::Silence | Act::Sleep | Act::LinkLost => None,
        }
    }

    fn next(&mut self, value: u8, step: u8) -> Vec<u8> {
        self.counter = (self.counter + step) % values(self.protection);
        protect(self.protection, self.counter, value)
    }
}

/// How many values the counter has.
pub(crate) fn values(protection: Protection) -> u8 {
    if protection == Protection::E2e { 15 } else { 16 }
}

/// The counter in the second byte, the value in the third, and contents that distinguish frames.
fn protect(protection: Protection, counter: u8, value: u8) -> Vec<u8> {
    let mut data = vec![0, counter | 0x50, value, 0xA5, counter.wrapping_mul(29), 0, 0, 0];
    match protection {
        Protection::E2e => data[0] = right_crc(protection, &data),
        Protection::Fields | Protection::EventFields => data[7] = right_crc(protection, &data),
    }
    data
}

/// The CRC that eight bytes or more should hold.
pub(crate) fn right_crc(protection: Protection, data: &[u8]) -> u8 {
    match protection {
        Protection::E2e => crc(0, [DATA_ID.as_slice(), &data[1..]].concat()),
        Protection::Fields | Protection::EventFields => !crc(0xFF, [&data[..7], &data[8..]].concat()),
    }
}

/// Polynomial 0x1D, bit by bit.
fn crc(start: u8, data: Vec<u8>) -> u8 {
    data.into_iter().fold(start, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc, _| if crc & 0x80 == 0 { crc << 1 } else { crc << 1 ^ 0x1D })
    })
}

/// The vehicle as the project reads it from files; each is read once.
pub(crate) fn settings(protection: Protection) -> GatewaySettings {
    static READ: [OnceLock<GatewaySettings>; 3] = [const { OnceLock::new() }; 3];
    let read = || {
        let files = MemoryFiles::new([("gateway.toml", GATEWAY), ("car.dbc", DBC)]);
        files.with("profile.toml", profile(protection)).settings().gateway
    };
    READ[protection as usize].get_or_init(read).clone()
}

fn profile(protection: Protection) -> String {
    let fields = "checksum = { kind = \"j1850\", signal = \"CRC\" }\n\
                  counter = { signal = \"COUNTER\", max_step = 2 }\nlength = 8\n";
    let message = match protection {
        Protection::Fields => format!("timeout_ms = {TIMEOUT_MS}\n{fields}"),
        Protection::EventFields => format!("timing = \"event\"\n{fields}"),
        Protection::E2e => format!(
            "timeout_ms = {TIMEOUT_MS}\ne2e = {{ profile = \"1A\", data_id = 0x0123, max_step = 2 }}\n\
             window = {{ init = {{ size = 3, min_ok = 2, max_error = 1 }}, \
             valid = {{ size = 5, min_ok = 2, max_error = 2 }}, \
             invalid = {{ size = 4, min_ok = 3, max_error = 0 }} }}\n"
        ),
    };
    format!(
        "name = \"Car\"\n[bus.body]\ndbc = \"car.dbc\"\nheartbeat_messages = [\"ALIVE\"]\nalive_timeout_ms = {ALIVE_MS}\n\
         may_sleep = true\n[message.TURN]\n{message}[turn]\nsignal = \"TURN.STATE\"\noff = [0]\nleft = [1]\n\
         right = [2]\n[hazard]\nfrom = \"not_visible\"\n"
    )
}

const GATEWAY: &str = "profile = \"profile.toml\"\n[can.body]\ninterface = \"can0\"\n[reports]\n\
                       publish = \"on_change\"\n";

const DBC: &str = "\
BO_ 256 TURN: 8 X
 SG_ COUNTER : 8|4@1+ (1,0) [0|15] \"\" X
 SG_ STATE : 16|2@1+ (1,0) [0|3] \"\" X
 SG_ CRC : 56|8@1+ (1,0) [0|255] \"\" X
BO_ 257 ALIVE: 1 X
BA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\",\"StandardCAN_FD\";
BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN_FD\";
";
