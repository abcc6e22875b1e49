//! AUTOSAR E2E profiles that fit into CAN frames: 1, 2, 4, 5, 6, 7, 11 and 22.
//!
//! A profile protects a message with a CRC over data, counter and Data ID, in a header at a fixed position.
//! This module checks one frame by itself; [`super::counter`] checks the sequence of frames, and
//! [`super::window`] combines all results.
//!
//! The crate autosar-e2e knows six of the profiles. The tests compare against it. It is not used here because
//! it rebuilds its tables and error texts for every frame, panics on an offset outside the frame, and assumes
//! that a counter of 0 preceded the first frame.

mod profile;

pub use profile::{DataIdMode, E2eProfile};
use profile::{read, write};

use std::ops::Range;

use super::reject::Reject;
use crate::can::{Frame, MAX_DATA};

/// A profile applied to a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct E2e {
    profile: E2eProfile,
    offset: usize,
    length: usize,
}

/// Reason why a profile cannot be applied to a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum E2eError {
    #[error("the header takes bytes {offset} to {last}, but the message has {length} bytes")]
    Header { offset: usize, last: usize, length: usize },
    #[error("a frame has at most 64 bytes, but the message has {0}")]
    Length(usize),
    /// The Data ID has more than 12 bits; four bits are sent and eight enter the CRC.
    #[error("in low-nibble mode the Data ID is 0x000 to 0xFFF, not 0x{0:X}")]
    DataId(u16),
}

impl E2e {
    /// Applies `profile` to a message of `length` bytes, with the header `offset` bytes from the start.
    pub fn new(profile: E2eProfile, offset: usize, length: usize) -> Result<Self, E2eError> {
        if length > MAX_DATA {
            return Err(E2eError::Length(length));
        }
        let last = offset.saturating_add(profile.header().bytes - 1);
        if last >= length {
            return Err(E2eError::Header { offset, last, length });
        }
        if let E2eProfile::P01 { data_id, mode: DataIdMode::Nibble } = profile
            && data_id > 0xFFF
        {
            return Err(E2eError::DataId(data_id));
        }
        Ok(Self { profile, offset, length })
    }

    /// Checks CRC, Data ID and length of a frame and returns its counter.
    pub fn check(&self, frame: &Frame) -> Result<u32, Reject> {
        let data = frame.data();
        if data.len() != self.length {
            return Err(Reject::WrongLength(data.len()));
        }
        let (layout, header) = (self.profile.header(), &data[self.offset..]);
        let (stored, expected) = (layout.stored_crc(header), self.crc(data));
        if stored != expected {
            return Err(Reject::WrongChecksum { stored, expected });
        }
        if let Some(field) = &layout.data_id {
            let (stored, expected) = (read(header, field), self.profile.sent_data_id());
            if stored != expected {
                return Err(Reject::WrongDataId { stored, expected });
            }
        }
        if layout.length.as_ref().is_some_and(|field| read(header, field) as usize != self.length) {
            return Err(Reject::WrongLength(self.length));
        }
        Ok(read(header, &layout.counter))
    }

    /// Writes header and CRC into `data`, with the lowest bits of `counter`. Returns false and writes nothing
    /// if `data` does not have the length of the message.
    pub fn protect(&self, counter: u32, data: &mut [u8]) -> bool {
        if data.len() != self.length {
            return false;
        }
        self.write_header(counter, self.length, data);
        let crc = self.crc(data);
        self.profile.header().write_crc(crc, &mut data[self.offset..]);
        true
    }

    /// Returns the profile with its Data ID.
    pub fn profile(&self) -> &E2eProfile {
        &self.profile
    }

    /// Returns the first and last value of the counter.
    pub fn counter_range(&self) -> (u32, u32) {
        (0, self.profile.header().last_counter)
    }

    fn write_header(&self, counter: u32, length: usize, data: &mut [u8]) {
        let (layout, header) = (self.profile.header(), &mut data[self.offset..]);
        write(counter.into(), &layout.counter, header);
        if let Some(field) = &layout.length {
            write(length as u64, field, header);
        }
        if let Some(field) = &layout.data_id {
            write(self.profile.sent_data_id().into(), field, header);
        }
    }

    fn crc(&self, data: &[u8]) -> u64 {
        let (layout, header) = (self.profile.header(), &data[self.offset..]);
        let Range { start, end } = layout.crc_bytes();
        self.profile.crc(&data[..self.offset + start], &header[end..], read(header, &layout.counter))
    }
}

#[cfg(test)]
mod tests;
