//! Error frames: class bits and eight data bytes (`linux/can/error.h`).
//!
//! A driver fills in what its controller reports and leaves the rest zero.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gateway_base::names::display_by_name;

/// Class bits of an error frame (`CAN_ERR_*`).
pub mod class {
    /// A frame waited too long for a free mailbox or for the bus.
    pub const TX_TIMEOUT: u32 = 0x1;
    /// Arbitration was lost to a frame of higher priority.
    pub const LOST_ARBITRATION: u32 = 0x2;
    /// The controller byte is given, see [`super::controller`].
    pub const CONTROLLER: u32 = 0x4;
    /// A protocol violation on the wire.
    pub const PROTOCOL: u32 = 0x8;
    /// The transceiver detected a wiring fault.
    pub const TRANSCEIVER: u32 = 0x10;
    /// A frame was not acknowledged.
    pub const NO_ACK: u32 = 0x20;
    /// The controller has left the bus.
    pub const BUS_OFF: u32 = 0x40;
    /// An error on the bus, which may be very frequent.
    pub const BUS_ERROR: u32 = 0x80;
    /// The controller was restarted after bus-off.
    pub const RESTARTED: u32 = 0x100;
    /// Error counters are given (set by Linux 6.0 and newer).
    pub const COUNTERS: u32 = 0x200;
}

/// Bits of the controller byte (`CAN_ERR_CRTL_*`).
pub mod controller {
    /// The receive or transmit buffer overflowed.
    pub const OVERFLOW: u8 = 0x03;
    /// An error counter is 96 or more.
    pub const WARNING: u8 = 0x0C;
    /// An error counter is 128 or more.
    pub const PASSIVE: u8 = 0x30;
    /// Both error counters are below 96 again.
    pub const ACTIVE: u8 = 0x40;
}

/// An error frame as received or recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ErrorFrame {
    /// Class bits (`CAN_ERR_*`).
    pub class: u32,
    /// Data bytes.
    pub data: [u8; 8],
}

/// Error counters of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ErrorCounters {
    /// Transmit error counter, 0 to 65535; at most 255 in an error frame.
    pub tx: u16,
    /// Receive error counter in the same range.
    pub rx: u16,
}

/// Error state of a CAN controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ControllerState {
    /// Both error counters are below 96.
    ErrorActive,
    /// An error counter is 96 or more.
    #[serde(rename = "error-warning")]
    Warning,
    /// An error counter is 128 or more, so that it sends no active error flags.
    #[serde(rename = "error-passive")]
    Passive,
    /// The transmit error counter exceeded 255 and the controller has left the bus.
    BusOff,
    /// The controller was restarted after bus-off and has not received since.
    Restarted,
    /// The kernel reports the controller as stopped or sleeping.
    Stopped,
}

// Names as printed by `ip -details link`.
display_by_name!(ControllerState);

impl ErrorFrame {
    /// Creates an error frame with these class bits. Missing bytes are zero, bytes beyond eight are ignored.
    pub fn new(class: u32, data: &[u8]) -> Self {
        let mut bytes = [0; 8];
        for (to, from) in bytes.iter_mut().zip(data) {
            *to = *from;
        }
        Self { class, data: bytes }
    }

    /// Returns the notation of candump, `20000040#0000000000000000`.
    pub fn log_text(self) -> String {
        let data: String = self.data.iter().map(|byte| format!("{byte:02X}")).collect();
        format!("{:08X}#{data}", self.class | 0x2000_0000)
    }

    fn has(self, bit: u32) -> bool {
        self.class & bit != 0
    }

    /// Returns the controller byte with the bits of [`controller`], 0 when unspecified; `None` without its
    /// class.
    pub fn controller(self) -> Option<u8> {
        self.has(class::CONTROLLER).then_some(self.data[1])
    }

    /// Returns the error counters of the controller; `None` when they are not given. Before Linux 6.0,
    /// drivers set the counters without the class bit; two zeros then mean that there are none.
    pub fn counters(self) -> Option<ErrorCounters> {
        let [.., tx, rx] = self.data;
        let given = self.has(class::COUNTERS)
            || self.has(class::CONTROLLER | class::PROTOCOL | class::BUS_ERROR) && (tx, rx) != (0, 0);
        given.then_some(ErrorCounters { tx: tx.into(), rx: rx.into() })
    }

    /// Returns the announced state, the worse state if transmit and receive states differ; `None` when no
    /// state is announced.
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

    /// Returns true if the frame announces only the return to a sound state.
    pub fn is_recovery(self) -> bool {
        let is_sound =
            matches!(self.state(), Some(ControllerState::ErrorActive | ControllerState::Restarted));
        is_sound && self.is_state_alone()
    }

    /// Returns true if the frame announces a state without an error on the wire or a lost frame.
    pub fn is_state_alone(self) -> bool {
        let only = class::CONTROLLER | class::COUNTERS | class::BUS_OFF | class::RESTARTED;
        let overflow = self.controller().is_some_and(|bits| bits & controller::OVERFLOW != 0);
        self.state().is_some() && self.class & !only == 0 && !overflow
    }
}

/// Formats the frame for diagnostics: `protocol (stuff error at CRC), bus-error, tx 96, rx 0`.
impl fmt::Display for ErrorFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for bit in bits(self.class).filter(|bit| *bit != class::COUNTERS) {
            write!(f, "{separator}{}", class_name(bit))?;
            separator = ", ";
            match bit {
                class::LOST_ARBITRATION if self.data[0] != 0 => write!(f, " at bit {}", self.data[0])?,
                class::CONTROLLER => named(f, self.data[1], &CONTROLLER_NAMES, "")?,
                class::PROTOCOL => named(f, self.data[2], &PROTOCOL_NAMES, location(self.data[3]))?,
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

/// Returns the single bits of `class`, lowest first.
pub fn bits(class: u32) -> impl Iterator<Item = u32> {
    (0..u32::BITS).map(|shift| 1 << shift).filter(move |bit| class & bit != 0)
}

/// Returns the name of a class bit in diagnostics.
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
    "rx overflow",
    "tx overflow",
    "rx warning",
    "tx warning",
    "rx passive",
    "tx passive",
    "back to error-active",
    "other",
];

const PROTOCOL_NAMES: [&str; 8] = [
    "bit error",
    "form error",
    "stuff error",
    "dominant bit not sent",
    "recessive bit not sent",
    "bus overload",
    "active error announcement",
    "on transmission",
];

/// Writes ` (name, name at location)`, or nothing when both are unspecified.
fn named(f: &mut fmt::Formatter<'_>, byte: u8, names: &[&str; 8], location: &str) -> fmt::Result {
    if byte == 0 && location.is_empty() {
        return Ok(());
    }
    f.write_str(" (")?;
    let mut separator = "";
    for (_, name) in (0..8).zip(names).filter(|(bit, _)| byte & (1 << bit) != 0) {
        write!(f, "{separator}{name}")?;
        separator = ", ";
    }
    match location {
        "" => f.write_str(")"),
        location if byte == 0 => write!(f, "at {location})"),
        location => write!(f, " at {location})"),
    }
}

/// Returns the location of a protocol error in a frame; empty when unspecified.
fn location(code: u8) -> &'static str {
    match code {
        0x00 => "",
        0x02 | 0x06 | 0x07 | 0x0E | 0x0F => "the identifier",
        0x03 => "the start of the frame",
        0x04 | 0x05 | 0x0C => "SRR, IDE or RTR",
        0x08 => "CRC",
        0x09 | 0x0D => "a reserved bit",
        0x0A => "data",
        0x0B => "DLC",
        0x12 => "intermission",
        0x18 => "the CRC delimiter",
        0x19 => "acknowledgement",
        0x1A => "the end of the frame",
        0x1B => "the acknowledgement delimiter",
        _ => "an unknown location",
    }
}

fn wiring(code: u8) -> &'static str {
    match code {
        0x00 => "unspecified",
        0x04 => "CAN-H open circuit",
        0x05 => "CAN-H shorted to battery",
        0x06 => "CAN-H shorted to VCC",
        0x07 => "CAN-H shorted to ground",
        0x40 => "CAN-L open circuit",
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
    fn every_part_of_error_frame_has_a_text() {
        for (class, data, text) in [
            (0x004, [0, 0x0C, 0, 0, 0, 0, 0, 0], "controller (rx warning, tx warning)"),
            (0x204, [0, 0x20, 0, 0, 0, 0, 130, 20], "controller (tx passive), tx 130, rx 20"),
            (0x004, [0; 8], "controller"),
            (0x088, [0, 0, 0x04, 0x08, 0, 0, 0, 0], "protocol (stuff error at CRC), bus-error"),
            (0x008, [0, 0, 0, 0x19, 0, 0, 0, 0], "protocol (at acknowledgement)"),
            (0x002, [17, 0, 0, 0, 0, 0, 0, 0], "lost-arbitration at bit 17"),
            (0x010, [0, 0, 0, 0, 0x80, 0, 0, 0], "transceiver (CAN-L shorted to CAN-H)"),
            (0x040, [0; 8], "bus-off"),
            (0x300, [0; 8], "restarted, tx 0, rx 0"),
            (0x021, [0; 8], "tx-timeout, no-ack"),
            (0, [0; 8], "no class"),
        ] {
            assert_eq!(ErrorFrame::new(class, &data).to_string(), text);
        }
    }

    #[test]
    fn worse_direction_decides_state() {
        let state = |class, bits| ErrorFrame::new(class, &[0, bits]).state();
        assert_eq!(state(0x4, 0x40), Some(ControllerState::ErrorActive));
        assert_eq!(state(0x4, 0x48), Some(ControllerState::Warning), "the other direction is active");
        assert_eq!(state(0x4, 0x18), Some(ControllerState::Passive));
        assert_eq!(state(0x44, 0x20), Some(ControllerState::BusOff));
        assert_eq!(state(0x4, 0x01), None, "an overflow is not a state");
        assert_eq!(state(0x88, 0x20), None, "the byte counts with its class alone");
    }

    #[test]
    fn pure_state_change_is_distinguished_from_loss() {
        let alone = |class, bits| ErrorFrame::new(class, &[0, bits]).is_state_alone();
        assert!(alone(0x204, 0x08) && alone(0x40, 0) && alone(0x100, 0));
        assert!(!alone(0x8C, 0x08), "an error on the wire as well");
        assert!(!alone(0x4, 0x09), "an overflow as well");
        assert!(!alone(0x4, 0), "no state at all");
    }

    #[test]
    fn counters_of_older_kernels_are_read_unless_both_zero() {
        let counters = |class, tx| ErrorFrame::new(class, &[0, 0, 0, 0, 0, 0, tx, 0]).counters();
        assert_eq!(counters(0x4, 96), Some(ErrorCounters { tx: 96, rx: 0 }));
        assert_eq!(counters(0x4, 0), None);
        assert_eq!(counters(0x204, 0), Some(ErrorCounters { tx: 0, rx: 0 }));
        assert_eq!(counters(0x20, 96), None, "what a driver means by it there is its own matter");
    }
}
