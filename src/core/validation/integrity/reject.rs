//! Verdicts on frames: the reasons to reject one, and their counts.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::window::E2eState;

/// Reason why a frame is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reject {
    /// The frame is too short for its fields or not of the required length; its length in bytes.
    WrongLength(usize),
    /// The checksum or CRC differs from the checksum of the contents.
    WrongChecksum {
        /// Checksum in the frame.
        stored: u64,
        /// Checksum of the contents.
        expected: u64,
    },
    /// The Data ID belongs to another message.
    WrongDataId {
        /// Data ID in the frame.
        stored: u32,
        /// Data ID of this message.
        expected: u32,
    },
    /// The counter is outside its range.
    CounterOutOfRange(u32),
    /// The first frame, whose counter has no predecessor.
    Initial,
    /// The counter is the same as before.
    Repeated,
    /// The counter made a step larger than the tolerated one.
    WrongSequence {
        /// Counter of the frame before.
        from: u32,
        /// Counter of this frame.
        to: u32,
    },
    /// In sequence after a gap, with the number of frames in sequence still required.
    Syncing(u8),
    /// Intact by itself, but the message as a whole is not trusted.
    NotValid(E2eState),
}

impl Reject {
    /// Returns the reason without the numbers of the frame.
    pub fn reason(self) -> &'static str {
        match self {
            Self::WrongLength(_) => "wrong length",
            Self::WrongChecksum { .. } => "wrong checksum",
            Self::WrongDataId { .. } => "wrong data ID",
            Self::CounterOutOfRange(_) => "counter out of range",
            Self::Initial => "first frame, no counter before it",
            Self::Repeated => "repeated counter",
            Self::WrongSequence { .. } => "counter out of sequence",
            Self::Syncing(_) => "counter not in sequence for long enough",
            Self::NotValid(_) => "too few good frames",
        }
    }
}

/// The reason with the numbers of the frame.
impl fmt::Display for Reject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reason = self.reason();
        match self {
            Self::WrongLength(length) => write!(f, "{reason}: {length} bytes"),
            Self::WrongChecksum { stored, expected } => {
                write!(f, "{reason}: 0x{stored:X}, not 0x{expected:X}")
            }
            Self::WrongDataId { stored, expected } => write!(f, "{reason}: 0x{stored:X}, not 0x{expected:X}"),
            Self::CounterOutOfRange(value) => write!(f, "{reason}: {value}"),
            Self::WrongSequence { from, to } => write!(f, "{reason}: {to} after {from}"),
            Self::Syncing(missing) => write!(f, "{reason}: {missing} more needed"),
            Self::NotValid(state) => write!(f, "{reason}: {state:?}"),
            Self::Initial | Self::Repeated => f.write_str(reason),
        }
    }
}

/// Number of checked frames since start, by verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct IntegrityCounts {
    /// Frames that were trusted.
    pub trusted: u64,
    /// Frames missing before trusted ones according to the counter, damaged ones included.
    pub lost: u64,
    /// Frames rejected as [`Reject::WrongLength`].
    pub wrong_length: u64,
    /// Frames rejected as [`Reject::WrongChecksum`].
    pub wrong_checksum: u64,
    /// Frames rejected as [`Reject::WrongDataId`].
    pub wrong_data_id: u64,
    /// Frames rejected as [`Reject::CounterOutOfRange`].
    pub counter_out_of_range: u64,
    /// Frames rejected as [`Reject::Initial`].
    pub initial: u64,
    /// Frames rejected as [`Reject::Repeated`].
    pub repeated: u64,
    /// Frames rejected as [`Reject::WrongSequence`].
    pub wrong_sequence: u64,
    /// Frames rejected as [`Reject::Syncing`].
    pub syncing: u64,
    /// Frames rejected as [`Reject::NotValid`].
    pub not_valid: u64,
}

impl IntegrityCounts {
    /// Returns the number of all rejected frames.
    pub fn rejected(&self) -> u64 {
        self.by_reason().iter().map(|(_, count)| count).sum()
    }

    /// Returns the number of rejected frames for each reason, with the text of [`Reject::reason`], including zeros.
    pub fn by_reason(&self) -> [(&'static str, u64); 9] {
        [
            (Reject::Initial, self.initial),
            (Reject::WrongLength(0), self.wrong_length),
            (Reject::WrongChecksum { stored: 0, expected: 0 }, self.wrong_checksum),
            (Reject::WrongDataId { stored: 0, expected: 0 }, self.wrong_data_id),
            (Reject::CounterOutOfRange(0), self.counter_out_of_range),
            (Reject::Repeated, self.repeated),
            (Reject::WrongSequence { from: 0, to: 0 }, self.wrong_sequence),
            (Reject::Syncing(0), self.syncing),
            (Reject::NotValid(E2eState::NoData), self.not_valid),
        ]
        .map(|(reject, count)| (reject.reason(), count))
    }

    pub(super) fn add(&mut self, result: Result<u32, Reject>) {
        let count = match result {
            Ok(lost) => {
                self.lost += u64::from(lost);
                &mut self.trusted
            }
            Err(Reject::WrongLength(_)) => &mut self.wrong_length,
            Err(Reject::WrongChecksum { .. }) => &mut self.wrong_checksum,
            Err(Reject::WrongDataId { .. }) => &mut self.wrong_data_id,
            Err(Reject::CounterOutOfRange(_)) => &mut self.counter_out_of_range,
            Err(Reject::Initial) => &mut self.initial,
            Err(Reject::Repeated) => &mut self.repeated,
            Err(Reject::WrongSequence { .. }) => &mut self.wrong_sequence,
            Err(Reject::Syncing(_)) => &mut self.syncing,
            Err(Reject::NotValid(_)) => &mut self.not_valid,
        };
        *count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_by_reason_add_up_to_rejected() {
        let counts = IntegrityCounts {
            trusted: 1_000,
            lost: 2_000,
            initial: 1,
            wrong_length: 2,
            wrong_checksum: 4,
            wrong_data_id: 8,
            counter_out_of_range: 16,
            repeated: 32,
            wrong_sequence: 64,
            syncing: 128,
            not_valid: 256,
        };
        let reasons = counts.by_reason();
        assert_eq!(reasons.iter().map(|(_, count)| count).sum::<u64>(), counts.rejected());
        assert!(reasons.contains(&("wrong checksum", 4)) && reasons.contains(&("repeated counter", 32)));
    }
}
