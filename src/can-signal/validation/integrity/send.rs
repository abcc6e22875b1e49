//! Sender side: counter values in sequence, and protection of frames with them.

use super::Protection;
use crate::can::{CanId, MAX_DATA};

impl Protection {
    /// Returns the first counter value; 0 without a counter.
    pub fn first_counter(&self) -> u32 {
        self.counter_rule().map_or(0, |rule| rule.range().0)
    }

    /// Returns the counter value that follows `value`.
    pub fn next_counter(&self, value: u32) -> u32 {
        self.counter_rule().map_or(value, |rule| rule.next(value))
    }

    /// Writes counter and checksum into the first `length` bytes of `data`. Returns `false` when they do not
    /// fit.
    #[must_use]
    pub fn protect(&self, id: CanId, counter_value: u32, data: &mut [u8; MAX_DATA], length: usize) -> bool {
        match self {
            Self::Fields { checksum, counter } => {
                let counter_written = counter
                    .as_ref()
                    .is_none_or(|counter| counter.signal().write(counter_value.into(), data).is_ok());
                let checksum_written =
                    |data: &mut [u8]| checksum.as_ref().is_none_or(|checksum| checksum.protect(id, data));
                counter_written && data.get_mut(..length).is_some_and(checksum_written)
            }
            Self::E2e { profile, .. } => {
                data.get_mut(..length).is_some_and(|data| profile.protect(counter_value, data))
            }
        }
    }
}
