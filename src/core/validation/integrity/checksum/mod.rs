//! Checksums that vehicle makers put into their messages.
//!
//! What is stored is read through the signal of the DBC, so a rule says only what is added up, not
//! where the result lies. The field that holds the checksum never takes part in its own sum.

mod crcs;
mod sums;

pub use crcs::{Crc8, Crc16, Extra, Parameters};
pub use sums::Sum;

use crate::core::can::frame::{CanId, Frame, MAX_DATA};
use crate::core::dbc::codec::SignalCodec;

/// How a checksum is computed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Rule {
    /// Honda, 4 bits: 8 less all nibbles of identifier and data, and 3 more for 29-bit identifiers.
    Honda,
    /// PSA, 4 bits: what makes all nibbles of the data plus the message's start value 15.
    Psa {
        /// `CHK_INI` of the message, 0 to 15.
        start: u8,
    },
    /// 8 bits: bytes added up.
    Sum(Sum),
    /// 8 bits: all bytes and a start value (usually 0) combined by exclusive or. VW PQ.
    Xor {
        /// Start value.
        start: u8,
    },
    /// 8 bits: a CRC.
    Crc8(Crc8),
    /// 16 bits: a CRC.
    Crc16(Crc16),
}

/// A rule, and the field that holds its result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checksum {
    rule: Rule,
    field: SignalCodec,
    /// First byte of the field, and the one behind its last.
    field_bytes: (usize, usize),
}

/// Why a signal cannot hold a checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ChecksumError {
    /// Another number of bits than the rule's result.
    #[error("the checksum has {rule} bits, its signal {signal}")]
    Width {
        /// Bits of the result.
        rule: u32,
        /// Bits of the signal.
        signal: u32,
    },
    /// A signal with a sign.
    #[error("a checksum signal is unsigned")]
    Signed,
    /// A signal that a multiplexor takes out of some frames.
    #[error("a checksum signal is in every frame, this one is multiplexed")]
    Multiplexed,
    /// A signal that shares a byte with others, under a rule that leaves out whole bytes.
    #[error("this checksum fills whole bytes, its signal does not")]
    NotWholeBytes,
}

impl Checksum {
    /// A checksum by `rule`, stored in `field`.
    pub fn new(rule: Rule, field: SignalCodec) -> Result<Self, ChecksumError> {
        let width = rule.width();
        if field.bit_length() != width {
            return Err(ChecksumError::Width { rule: width, signal: field.bit_length() });
        }
        let (lowest, highest) = field.range();
        if lowest < 0 {
            return Err(ChecksumError::Signed);
        }
        if field.is_multiplexed() {
            return Err(ChecksumError::Multiplexed);
        }
        let mut bits = [0; MAX_DATA];
        // In range, so it does fit.
        let _ = field.write(highest, &mut bits);
        let first = bits.iter().take_while(|byte| **byte == 0).count();
        let count = bits.iter().filter(|byte| **byte != 0).count();
        let partial = bits.iter().any(|byte| !matches!(byte, 0 | 0xFF));
        if partial && width >= 8 {
            return Err(ChecksumError::NotWholeBytes);
        }
        Ok(Self { rule, field, field_bytes: (first, first + count) })
    }

    /// Whether the frame holds the checksum it should. A frame without the field does not.
    pub fn holds(&self, id: CanId, frame: &Frame) -> bool {
        self.compare(id, frame).is_some_and(|(stored, expected)| stored == expected)
    }

    /// The checksum in the frame and the one that should be there; `None` when the frame ends
    /// before the field.
    pub fn compare(&self, id: CanId, frame: &Frame) -> Option<(u16, u16)> {
        let stored = self.field.value(frame.padded());
        let expected = self.expected(id, frame.data())?;
        // At most 16 bits without a sign.
        Some((u16::try_from(stored).unwrap_or(u16::MAX), expected))
    }

    /// The checksum that belongs to `data`; `None` when it ends before the field or is too long
    /// for a frame. What the field holds does not matter.
    pub fn expected(&self, id: CanId, data: &[u8]) -> Option<u16> {
        let (first, end) = self.field_bytes;
        if data.len() > MAX_DATA || data.len() < end {
            return None;
        }
        Some(match &self.rule {
            Rule::Honda => sums::honda(id, self.without_field(data)),
            Rule::Psa { start } => sums::psa(*start, self.without_field(data)),
            Rule::Sum(sum) => sum.of(id, data, &self.without_field(data)[..data.len()]).into(),
            Rule::Xor { start } => {
                self.without_field(data).iter().fold(*start, |sum, byte| sum ^ byte).into()
            }
            Rule::Crc8(crc) => crc.of(id, &data[..first], &data[end..], data).into(),
            Rule::Crc16(crc) => crc.of(id, &data[..first], &data[end..], data),
        })
    }

    /// Writes the checksum that belongs to `data` into it; `false`, and nothing written, when
    /// there is no room for it.
    pub fn protect(&self, id: CanId, data: &mut [u8]) -> bool {
        let Some(expected) = self.expected(id, data) else { return false };
        let mut bytes = [0; MAX_DATA];
        bytes[..data.len()].copy_from_slice(data);
        let fits = self.field.write(expected.into(), &mut bytes).is_ok();
        data.copy_from_slice(&bytes[..data.len()]);
        fits
    }

    /// Bytes a frame must have so that the checksum can be read.
    pub fn needed_length(&self) -> usize {
        self.field_bytes.1
    }

    /// How the checksum is computed.
    pub fn rule(&self) -> &Rule {
        &self.rule
    }

    /// The data with zeros behind it, and in the field.
    fn without_field(&self, data: &[u8]) -> [u8; MAX_DATA] {
        let mut bytes = [0; MAX_DATA];
        bytes[..data.len()].copy_from_slice(data);
        // Zero is in range of every unsigned field.
        let _ = self.field.write(0, &mut bytes);
        bytes
    }
}

impl Rule {
    /// Bits of the result.
    fn width(&self) -> u32 {
        match self {
            Self::Honda | Self::Psa { .. } => 4,
            Self::Sum(_) | Self::Xor { .. } | Self::Crc8(_) => 8,
            Self::Crc16(_) => 16,
        }
    }
}

#[cfg(test)]
mod tests;
