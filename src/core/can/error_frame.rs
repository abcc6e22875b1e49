//! What an error frame says: class bits and eight data bytes (`linux/can/error.h`).
//!
//! A driver fills in what its controller can tell and leaves the rest zero.

use std::fmt;

/// Bits of the class (`CAN_ERR_*`).
pub mod class {
    /// No free mailbox or line for too long.
    pub const TX_TIMEOUT: u32 = 0x1;
    /// Lost against a frame of higher priority.
    pub const LOST_ARBITRATION: u32 = 0x2;
    /// State of the controller, see [`super::controller`].
    pub const CONTROLLER: u32 = 0x4;
    /// A breach of the protocol on the wire.
    pub const PROTOCOL: u32 = 0x8;
    /// A fault of the wiring, as the transceiver sees it.
    pub const TRANSCEIVER: u32 = 0x10;
    /// Nobody acknowledged a frame.
    pub const NO_ACK: u32 = 0x20;
    /// The controller has left the bus.
    pub const BUS_OFF: u32 = 0x40;
    /// An error on the bus; there may be very many of these.
    pub const BUS_ERROR: u32 = 0x80;
    /// The controller was restarted after bus-off.
    pub const RESTARTED: u32 = 0x100;
    /// Error counters are given (Linux 6.0 and newer say so).
    pub const COUNTERS: u32 = 0x200;
}

/// Bits of the controller byte (`CAN_ERR_CRTL_*`).
pub mod controller {
    /// The controller had no room for a received frame, or for one to send.
    pub const OVERFLOW: u8 = 0x03;
    /// 96 errors or more, receiving or sending.
    pub const WARNING: u8 = 0x0C;
    /// 128 errors or more, receiving or sending.
    pub const PASSIVE: u8 = 0x30;
    /// Back below all limits.
    pub const ACTIVE: u8 = 0x40;
}

/// One error frame, as received or recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ErrorFrame {
    class: u32,
    data: [u8; 8],
}

/// Errors a controller has counted; it counts up by 1 or 8 and down by 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ErrorCounters {
    /// While sending, 0 to 65535. An error frame cannot say more than 255.
    pub tx: u16,
    /// While receiving, likewise.
    pub rx: u16,
}

/// State of a CAN controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ControllerState {
    /// Fewer than 96 errors.
    ErrorActive,
    /// 96 errors or more.
    Warning,
    /// 128 errors or more: it no longer disturbs others with its error flags.
    Passive,
    /// More than 255 errors while sending: it has left the bus.
    BusOff,
    /// Restarted after bus-off, and has not received since.
    Restarted,
    /// Not working at all, or asleep, as the kernel says.
    Stopped,
}

impl ErrorFrame {
    /// An error frame with these class bits. Bytes that are missing are zero, those beyond eight no
    /// error frame has.
    pub fn new(class: u32, data: &[u8]) -> Self {
        let mut bytes = [0; 8];
        for (to, from) in bytes.iter_mut().zip(data) {
            *to = *from;
        }
        Self { class, data: bytes }
    }

    /// The class bits.
    pub fn class(self) -> u32 {
        self.class
    }

    /// The data bytes.
    pub fn data(self) -> [u8; 8] {
        self.data
    }

    /// As candump writes it: `20000040#0000000000000000`.
    pub fn log_text(self) -> String {
        let data: String = self.data.iter().map(|byte| format!("{byte:02X}")).collect();
        format!("{:08X}#{data}", self.class | 0x2000_0000)
    }

    fn has(self, bit: u32) -> bool {
        self.class & bit != 0
    }

    /// Bit position at which arbitration was lost, 1 to 255; 0 when the controller cannot tell.
    pub fn lost_arbitration(self) -> Option<u8> {
        self.has(class::LOST_ARBITRATION).then_some(self.data[0])
    }

    /// The controller byte, bits of [`controller`]; 0 when unspecified.
    pub fn controller(self) -> Option<u8> {
        self.has(class::CONTROLLER).then_some(self.data[1])
    }

    /// Kind (`CAN_ERR_PROT_*` bits) and place within the frame (`CAN_ERR_PROT_LOC_*`).
    pub fn protocol(self) -> Option<(u8, u8)> {
        self.has(class::PROTOCOL).then_some((self.data[2], self.data[3]))
    }

    /// The transceiver's code, CAN-H in the low and CAN-L in the high half.
    pub fn transceiver(self) -> Option<u8> {
        self.has(class::TRANSCEIVER).then_some(self.data[4])
    }

    /// The controller's error counters. Before Linux 6.0 drivers gave them without saying so; then
    /// two zeros mean that there are none.
    pub fn counters(self) -> Option<ErrorCounters> {
        let [.., tx, rx] = self.data;
        let told = self.has(class::COUNTERS)
            || self.has(class::CONTROLLER | class::PROTOCOL | class::BUS_ERROR) && (tx, rx) != (0, 0);
        told.then_some(ErrorCounters { tx: tx.into(), rx: rx.into() })
    }

    /// The state it announces, the worst if sending and receiving differ.
    pub fn state(self) -> Option<ControllerState> {
        if self.has(class::BUS_OFF) {
            return Some(ControllerState::BusOff);
        }
        if self.has(class::RESTARTED) {
            return Some(ControllerState::Restarted);
        }
        let bits = self.controller()?;
        [
            (controller::PASSIVE, ControllerState::Passive),
            (controller::WARNING, ControllerState::Warning),
            (controller::ACTIVE, ControllerState::ErrorActive),
        ]
        .into_iter()
        .find_map(|(mask, state)| (bits & mask != 0).then_some(state))
    }

    /// Whether it announces a state and nothing else: no error on the wire, no lost frame.
    pub fn is_state_alone(self) -> bool {
        let only = class::CONTROLLER | class::COUNTERS | class::BUS_OFF | class::RESTARTED;
        let overflow = self.controller().is_some_and(|bits| bits & controller::OVERFLOW != 0);
        self.state().is_some() && self.class & !only == 0 && !overflow
    }
}

/// In words, for people: `protocol (bit stuffing at CRC), bus-error, tx 96, rx 0`.
impl fmt::Display for ErrorFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for bit in bits(self.class).filter(|bit| *bit != class::COUNTERS) {
            write!(f, "{separator}{}", class_name(bit))?;
            separator = ", ";
            match bit {
                class::LOST_ARBITRATION if self.data[0] != 0 => write!(f, " at bit {}", self.data[0])?,
                class::CONTROLLER => named(f, self.data[1], &CONTROLLER_NAMES, "")?,
                class::PROTOCOL => named(f, self.data[2], &PROTOCOL_NAMES, place(self.data[3]))?,
                class::TRANSCEIVER => write!(f, " ({})", wiring(self.data[4]))?,
                _ => {}
            }
        }
        match self.counters() {
            Some(ErrorCounters { tx, rx }) => write!(f, "{separator}tx {tx}, rx {rx}"),
            None if separator.is_empty() => f.write_str("no class"),
            None => Ok(()),
        }
    }
}

/// The bits of a class one by one.
pub fn bits(class: u32) -> impl Iterator<Item = u32> {
    (0..u32::BITS).map(|shift| 1 << shift).filter(move |bit| class & bit != 0)
}

/// Name of a class bit.
pub fn class_name(bit: u32) -> &'static str {
    match bit {
        class::TX_TIMEOUT => "tx-timeout",
        class::LOST_ARBITRATION => "lost-arbitration",
        class::CONTROLLER => "controller",
        class::PROTOCOL => "protocol",
        class::TRANSCEIVER => "transceiver",
        class::NO_ACK => "no-ack",
        class::BUS_OFF => "bus-off",
        class::BUS_ERROR => "bus-error",
        class::RESTARTED => "restarted",
        class::COUNTERS => "counters",
        _ => "other",
    }
}

const CONTROLLER_NAMES: [&str; 8] = [
    "receive overflow",
    "send overflow",
    "rx warning",
    "tx warning",
    "rx passive",
    "tx passive",
    "active again",
    "other",
];

const PROTOCOL_NAMES: [&str; 8] = [
    "single bit",
    "frame format",
    "bit stuffing",
    "dominant bit not sent",
    "recessive bit not sent",
    "bus overload",
    "active error announcement",
    "while sending",
];

/// ` (name, name at place)`, or nothing when there is nothing to say.
fn named(f: &mut fmt::Formatter<'_>, byte: u8, names: &[&str; 8], place: &str) -> fmt::Result {
    if byte == 0 && place.is_empty() {
        return Ok(());
    }
    f.write_str(" (")?;
    let mut separator = "";
    for (_, name) in (0..8).zip(names).filter(|(bit, _)| byte & (1 << bit) != 0) {
        write!(f, "{separator}{name}")?;
        separator = ", ";
    }
    match place {
        "" => f.write_str(")"),
        place if byte == 0 => write!(f, "at {place})"),
        place => write!(f, " at {place})"),
    }
}

/// Where in a frame an error was found; empty when unspecified.
fn place(code: u8) -> &'static str {
    match code {
        0x00 => "",
        0x02 | 0x06 | 0x07 | 0x0E | 0x0F => "the identifier",
        0x03 => "the start of the frame",
        0x04 | 0x05 | 0x0C => "the bits beside the identifier",
        0x08 => "CRC",
        0x09 | 0x0D => "a reserved bit",
        0x0A => "data",
        0x0B => "length",
        0x12 => "the pause between frames",
        0x18 => "the CRC delimiter",
        0x19 => "acknowledgement",
        0x1A => "the end of the frame",
        0x1B => "the acknowledgement delimiter",
        _ => "an unknown place",
    }
}

fn wiring(code: u8) -> &'static str {
    match code {
        0x00 => "unspecified",
        0x04 => "CAN-H has no wire",
        0x05 => "CAN-H shorted to battery",
        0x06 => "CAN-H shorted to VCC",
        0x07 => "CAN-H shorted to ground",
        0x40 => "CAN-L has no wire",
        0x50 => "CAN-L shorted to battery",
        0x60 => "CAN-L shorted to VCC",
        0x70 => "CAN-L shorted to ground",
        0x80 => "CAN-L shorted to CAN-H",
        _ => "several faults",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_of_an_error_frame_is_told_in_words() {
        for (class, data, words) in [
            (0x004, [0, 0x0C, 0, 0, 0, 0, 0, 0], "controller (rx warning, tx warning)"),
            (0x204, [0, 0x20, 0, 0, 0, 0, 130, 20], "controller (tx passive), tx 130, rx 20"),
            (0x004, [0; 8], "controller"),
            (0x088, [0, 0, 0x04, 0x08, 0, 0, 0, 0], "protocol (bit stuffing at CRC), bus-error"),
            (0x008, [0, 0, 0, 0x19, 0, 0, 0, 0], "protocol (at acknowledgement)"),
            (0x002, [17, 0, 0, 0, 0, 0, 0, 0], "lost-arbitration at bit 17"),
            (0x010, [0, 0, 0, 0, 0x80, 0, 0, 0], "transceiver (CAN-L shorted to CAN-H)"),
            (0x040, [0; 8], "bus-off"),
            (0x300, [0; 8], "restarted, tx 0, rx 0"),
            (0x021, [0; 8], "tx-timeout, no-ack"),
            (0, [0; 8], "no class"),
        ] {
            assert_eq!(ErrorFrame::new(class, &data).to_string(), words);
        }
    }

    #[test]
    fn the_worse_direction_decides_on_the_state() {
        let state = |class, bits| ErrorFrame::new(class, &[0, bits]).state();
        assert_eq!(state(0x4, 0x40), Some(ControllerState::ErrorActive));
        assert_eq!(state(0x4, 0x48), Some(ControllerState::Warning), "the other direction is active");
        assert_eq!(state(0x4, 0x18), Some(ControllerState::Passive));
        assert_eq!(state(0x44, 0x20), Some(ControllerState::BusOff));
        assert_eq!(state(0x4, 0x01), None, "an overflow is not a state");
        assert_eq!(state(0x88, 0x20), None, "the byte counts with its class alone");
    }

    #[test]
    fn a_state_is_told_from_a_loss() {
        let alone = |class, bits| ErrorFrame::new(class, &[0, bits]).is_state_alone();
        assert!(alone(0x204, 0x08) && alone(0x40, 0) && alone(0x100, 0));
        assert!(!alone(0x8C, 0x08), "an error on the wire beside it");
        assert!(!alone(0x4, 0x09), "an overflow beside it");
        assert!(!alone(0x4, 0), "no state at all");
    }

    #[test]
    fn counters_of_older_kernels_are_taken_unless_both_are_zero() {
        let counters = |class, tx| ErrorFrame::new(class, &[0, 0, 0, 0, 0, 0, tx, 0]).counters();
        assert_eq!(counters(0x4, 96), Some(ErrorCounters { tx: 96, rx: 0 }));
        assert_eq!(counters(0x4, 0), None);
        assert_eq!(counters(0x204, 0), Some(ErrorCounters { tx: 0, rx: 0 }));
        assert_eq!(counters(0x20, 96), None, "what a driver means by it there is its own matter");
    }
}
