//! Checksum algorithms of vehicle manufacturers.
//!
//! The stored checksum is read through its signal in the DBC, so a rule defines only the calculation, not the
//! position of the result. The field that holds the checksum is never part of its own sum.

mod crcs;
mod sums;

pub use crcs::{CrcParameters, CrcRule, Extra};
pub use sums::Sum;

use std::ops::Range;

use crate::can::{CanId, Frame, MAX_DATA};
use crate::dbc::codec::SignalCodec;

/// Algorithm of a checksum.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChecksumRule {
    /// Honda, 4 bits: 8 minus all nibbles of identifier and data, plus 3 for a 29-bit identifier.
    Honda,
    /// PSA, 4 bits: 15 minus the message's start value and all nibbles of the data.
    Psa {
        /// `CHK_INI` of the message, 0 to 15.
        start: u8,
    },
    /// 8 bits: the sum of bytes.
    Sum(Sum),
    /// 8 bits: exclusive or of all bytes and a start value (usually 0). Used by VW PQ.
    Xor {
        /// Start value, combined with the bytes.
        start: u8,
    },
    /// 8 or 16 bits: a CRC.
    Crc(CrcRule),
}

/// A rule and the field that holds its result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checksum {
    rule: ChecksumRule,
    field: SignalCodec,
    /// Bytes of the data that overlap the field.
    field_bytes: Range<usize>,
}

/// Reason why a signal cannot hold a checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum ChecksumError {
    #[error("the checksum has {rule} bits, but its signal has {signal}")]
    Width { rule: u32, signal: u32 },
    #[error("a checksum signal must be unsigned")]
    Signed,
    #[error("a checksum signal must be in every frame, but this one is multiplexed")]
    Multiplexed,
    /// The signal shares a byte with other signals, but the rule skips whole bytes.
    #[error("this checksum fills whole bytes, but its signal does not")]
    NotWholeBytes,
}

impl Checksum {
    /// Creates a checksum by `rule`, stored in `field`.
    pub fn new(rule: ChecksumRule, field: SignalCodec) -> Result<Self, ChecksumError> {
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
        // In range, so it fits.
        let _ = field.write(highest, &mut bits);
        let start = bits.iter().take_while(|byte| **byte == 0).count();
        let end = start + bits.iter().filter(|byte| **byte != 0).count();
        let partial = bits.iter().any(|byte| !matches!(byte, 0 | 0xFF));
        if partial && width >= 8 {
            return Err(ChecksumError::NotWholeBytes);
        }
        Ok(Self { rule, field, field_bytes: start..end })
    }

    /// Returns the checksum stored in the frame and the checksum of its contents; `None` if the frame ends
    /// before the field.
    pub fn compare(&self, frame: &Frame) -> Option<(u16, u16)> {
        let stored = self.field.value(frame.padded());
        let expected = self.expected(frame.id(), frame.data())?;
        // Unsigned and at most 16 bits.
        Some((u16::try_from(stored).unwrap_or(u16::MAX), expected))
    }

    /// Returns the checksum of `data`, ignoring the content of the field; `None` if `data` ends before the
    /// field or is too long for a frame.
    pub fn expected(&self, id: CanId, data: &[u8]) -> Option<u16> {
        let Range { start: first, end } = self.field_bytes;
        if data.len() > MAX_DATA || data.len() < end {
            return None;
        }
        Some(match &self.rule {
            ChecksumRule::Honda => sums::honda(id, self.without_field(data)),
            ChecksumRule::Psa { start } => sums::psa(*start, self.without_field(data)),
            ChecksumRule::Sum(sum) => sum.of(id, data, &self.without_field(data)[..data.len()]).into(),
            ChecksumRule::Xor { start } => {
                self.without_field(data).iter().fold(*start, |sum, byte| sum ^ byte).into()
            }
            ChecksumRule::Crc(crc) => crc.of(id, &data[..first], &data[end..], data),
        })
    }

    /// Writes the checksum of `data` into its field. Returns `false` and writes nothing if `data` ends before
    /// the field.
    pub fn protect(&self, id: CanId, data: &mut [u8]) -> bool {
        let Some(expected) = self.expected(id, data) else { return false };
        let mut bytes = [0; MAX_DATA];
        bytes[..data.len()].copy_from_slice(data);
        let fits = self.field.write(expected.into(), &mut bytes).is_ok();
        data.copy_from_slice(&bytes[..data.len()]);
        fits
    }

    /// Returns the algorithm of the checksum.
    pub fn rule(&self) -> &ChecksumRule {
        &self.rule
    }

    /// Returns the data padded with zeros, with the field cleared.
    fn without_field(&self, data: &[u8]) -> [u8; MAX_DATA] {
        let mut bytes = [0; MAX_DATA];
        bytes[..data.len()].copy_from_slice(data);
        // Zero is in range of every unsigned field.
        let _ = self.field.write(0, &mut bytes);
        bytes
    }
}

impl ChecksumRule {
    fn width(&self) -> u32 {
        match self {
            Self::Honda | Self::Psa { .. } => 4,
            Self::Sum(_) | Self::Xor { .. } => 8,
            Self::Crc(crc) => crc.width(),
        }
    }
}

#[cfg(test)]
mod tests;
