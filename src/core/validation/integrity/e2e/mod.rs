//! AUTOSAR E2E profiles that fit into CAN frames: 1, 2, 4, 5, 6, 7, 11 and 22.
//!
//! A profile protects a message with a CRC over data, counter and the message's identity (its Data
//! ID), in a header at a fixed place. Here is only what one frame can show; [`super::counter`] has
//! what the counter says, [`super::window`] what all results together say.
//!
//! The crate autosar-e2e knows six of the profiles. It is the second opinion in the tests and not
//! used here: it builds its tables and error texts anew with every frame, ends in a panic when an
//! offset lies outside, and takes the counter 0 for known before the first frame.

mod profile;

pub use profile::{DataIdMode, Profile};

use std::ops::Range;

use crate::core::can::frame::{Frame, MAX_DATA};

/// A profile, applied to a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct E2e {
    profile: Profile,
    offset: usize,
    length: usize,
}

/// Why a profile cannot be applied to a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum E2eError {
    /// The header does not fit.
    #[error("the header takes bytes {offset} to {last}, the message has {length} bytes")]
    Header {
        /// First byte of the header.
        offset: usize,
        /// Last byte of the header.
        last: usize,
        /// Bytes of the message.
        length: usize,
    },
    /// A message longer than a CAN FD frame.
    #[error("a frame has 64 bytes at most, the message {0}")]
    Length(usize),
    /// More than 12 bits where four of them are sent and eight go into the CRC.
    #[error("with a nibble of it in the frame the Data ID is 0x000 to 0xFFF, not 0x{0:X}")]
    DataId(u16),
}

/// What is wrong with a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum E2eFault {
    /// Not the length of the message.
    Length,
    /// The CRC is another than it should be.
    Crc {
        /// In the frame.
        stored: u64,
        /// What it should be.
        expected: u64,
    },
    /// The Data ID in the header is another message's.
    DataId {
        /// In the frame.
        stored: u32,
        /// What it should be.
        expected: u32,
    },
    /// The length in the header is not the frame's.
    LengthField(u32),
}

impl E2e {
    /// `profile` for a message of `length` bytes, its header `offset` bytes from the start.
    pub fn new(profile: Profile, offset: usize, length: usize) -> Result<Self, E2eError> {
        if length > MAX_DATA {
            return Err(E2eError::Length(length));
        }
        let header = profile.header_length();
        if offset.saturating_add(header) > length {
            let last = offset.saturating_add(header - 1);
            return Err(E2eError::Header { offset, last, length });
        }
        match profile {
            Profile::P01 { data_id, mode: DataIdMode::Nibble } if data_id > 0xFFF => {
                Err(E2eError::DataId(data_id))
            }
            Profile::P01 { .. }
            | Profile::P02 { .. }
            | Profile::P04 { .. }
            | Profile::P05 { .. }
            | Profile::P06 { .. }
            | Profile::P07 { .. } => Ok(Self { profile, offset, length }),
        }
    }

    /// The counter of a frame whose CRC, Data ID and length are right.
    pub fn check(&self, frame: &Frame) -> Result<u32, E2eFault> {
        let data = frame.data();
        if data.len() != self.length {
            return Err(E2eFault::Length);
        }
        let header = &data[self.offset..];
        let (stored, expected) = (self.profile.stored_crc(header), self.crc(data));
        if stored != expected {
            return Err(E2eFault::Crc { stored, expected });
        }
        if let Some((stored, expected)) = self.profile.data_id(header).filter(|(a, b)| a != b) {
            return Err(E2eFault::DataId { stored, expected });
        }
        if let Some(stored) = self.profile.length_field(header)
            && usize::try_from(stored).ok() != Some(self.length)
        {
            return Err(E2eFault::LengthField(stored));
        }
        Ok(self.profile.counter(header))
    }

    /// Writes header and CRC into `data` for this counter, of which the lowest bits count. `false`,
    /// and nothing written, when `data` has not the length of the message.
    pub fn protect(&self, counter: u32, data: &mut [u8]) -> bool {
        if data.len() != self.length {
            return false;
        }
        self.profile.write_header(counter, self.length, &mut data[self.offset..]);
        let crc = self.crc(data);
        self.profile.write_crc(crc, &mut data[self.offset..]);
        true
    }

    /// The profile.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// First and last value of the counter.
    pub fn counter_range(&self) -> (u32, u32) {
        self.profile.counter_range()
    }

    /// Bytes of the message.
    pub fn length(&self) -> usize {
        self.length
    }

    fn crc(&self, data: &[u8]) -> u64 {
        let Range { start, end } = self.profile.crc_bytes();
        let (before, behind) = (&data[..self.offset + start], &data[self.offset + end..]);
        self.profile.crc(before, behind, self.profile.counter(&data[self.offset..]))
    }
}

#[cfg(test)]
mod tests;
