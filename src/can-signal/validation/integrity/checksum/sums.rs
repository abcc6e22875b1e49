//! Sums of bytes and nibbles.

use crate::can::{CanId, MAX_DATA};

/// A sum of bytes modulo 256.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sum {
    /// Start value of the sum.
    pub start: u8,
    /// True if the bytes of the identifier are added.
    pub identifier: bool,
    /// True if the length of the data in bytes is added.
    pub length: bool,
    /// True if the result is inverted (255 minus the sum).
    pub inverted: bool,
    /// Number of bytes of the data to add, from the first; `None` = all.
    pub bytes: Option<usize>,
}

impl Sum {
    /// Only the bytes of the data.
    pub const PLAIN: Self = Self { start: 0, identifier: false, length: false, inverted: false, bytes: None };
    /// Toyota: length, identifier and data.
    pub const TOYOTA: Self = Self { identifier: true, length: true, ..Self::PLAIN };
    /// Tesla and Subaru Global: identifier and data.
    pub const IDENTIFIER: Self = Self { identifier: true, ..Self::PLAIN };
    /// Mazda's turn switch (0x091): 255 minus the first four bytes.
    pub const MAZDA: Self = Self { inverted: true, bytes: Some(4), ..Self::PLAIN };

    /// Returns the sum over `bytes`, which is `data` with zeros in place of the checksum.
    pub(super) fn of(self, id: CanId, data: &[u8], bytes: &[u8]) -> u8 {
        let add = |sum: u8, byte: &u8| sum.wrapping_add(*byte);
        let mut sum = bytes.iter().take(self.bytes.unwrap_or(MAX_DATA)).fold(self.start, add);
        if self.identifier {
            sum = id.number().to_be_bytes().iter().fold(sum, add);
        }
        if self.length {
            // A frame has at most 64 bytes.
            sum = sum.wrapping_add(u8::try_from(data.len()).unwrap_or(u8::MAX));
        }
        if self.inverted { !sum } else { sum }
    }
}

/// Computes the checksum of [`super::ChecksumRule::Honda`].
pub(super) fn honda(id: CanId, data: [u8; MAX_DATA]) -> u16 {
    let start: u8 = match id {
        CanId::Standard(_) => 8,
        CanId::Extended(_) => 8 + 3,
    };
    let sum = nibbles(&id.number().to_be_bytes()).wrapping_add(nibbles(&data));
    u16::from(start.wrapping_sub(sum) & 0xF)
}

/// Computes the checksum of [`super::ChecksumRule::Psa`].
pub(super) fn psa(start: u8, data: [u8; MAX_DATA]) -> u16 {
    let sum = nibbles(&data).wrapping_add(start);
    u16::from(15_u8.wrapping_sub(sum) & 0xF)
}

fn nibbles(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(byte & 0xF).wrapping_add(byte >> 4))
}
