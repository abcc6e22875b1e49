//! Verdicts on frames: reasons for rejection, and counts by verdict.

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

/// A [`Reject`] without the numbers of the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // as the variants of `Reject`
pub enum RejectKind {
    WrongLength,
    WrongChecksum,
    WrongDataId,
    CounterOutOfRange,
    Initial,
    Repeated,
    WrongSequence,
    Syncing,
    NotValid,
}

impl Reject {
    /// Returns the reason without the numbers of the frame.
    pub fn kind(self) -> RejectKind {
        match self {
            Self::WrongLength(_) => RejectKind::WrongLength,
            Self::WrongChecksum { .. } => RejectKind::WrongChecksum,
            Self::WrongDataId { .. } => RejectKind::WrongDataId,
            Self::CounterOutOfRange(_) => RejectKind::CounterOutOfRange,
            Self::Initial => RejectKind::Initial,
            Self::Repeated => RejectKind::Repeated,
            Self::WrongSequence { .. } => RejectKind::WrongSequence,
            Self::Syncing(_) => RejectKind::Syncing,
            Self::NotValid(_) => RejectKind::NotValid,
        }
    }
}

impl RejectKind {
    /// Returns true if the first frames of a sound message are rejected for this reason: the check needs
    /// several frames.
    pub fn is_usual_at_start(self) -> bool {
        match self {
            Self::Initial | Self::Syncing | Self::NotValid => true,
            Self::WrongLength
            | Self::WrongChecksum
            | Self::WrongDataId
            | Self::CounterOutOfRange
            | Self::Repeated
            | Self::WrongSequence => false,
        }
    }

    /// Returns the text of the reason.
    pub fn text(self) -> &'static str {
        match self {
            Self::WrongLength => "wrong length",
            Self::WrongChecksum => "wrong checksum",
            Self::WrongDataId => "wrong data ID",
            Self::CounterOutOfRange => "counter out of range",
            Self::Initial => "first frame, no counter before it",
            Self::Repeated => "repeated counter",
            Self::WrongSequence => "counter out of sequence",
            Self::Syncing => "counter not in sequence for long enough",
            Self::NotValid => "too few good frames",
        }
    }
}

/// Formats the reason with the numbers of the frame.
impl fmt::Display for Reject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reason = self.kind().text();
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
#[allow(missing_docs)] // others: frames rejected as the variant of `Reject`
pub struct IntegrityCounts {
    /// Frames that were trusted.
    pub trusted: u64,
    /// Frames missing before trusted frames according to the counter, including damaged frames.
    pub lost: u64,
    pub wrong_length: u64,
    pub wrong_checksum: u64,
    pub wrong_data_id: u64,
    pub counter_out_of_range: u64,
    pub initial: u64,
    pub repeated: u64,
    pub wrong_sequence: u64,
    pub syncing: u64,
    pub not_valid: u64,
}

impl IntegrityCounts {
    /// Returns the number of all rejected frames.
    pub fn rejected(&self) -> u64 {
        self.by_reason().iter().map(|(_, count)| count).sum()
    }

    /// Returns the number of rejected frames for each reason, with the text of [`RejectKind::text`],
    /// including zeros.
    pub fn by_reason(&self) -> [(&'static str, u64); 9] {
        [
            (RejectKind::Initial, self.initial),
            (RejectKind::WrongLength, self.wrong_length),
            (RejectKind::WrongChecksum, self.wrong_checksum),
            (RejectKind::WrongDataId, self.wrong_data_id),
            (RejectKind::CounterOutOfRange, self.counter_out_of_range),
            (RejectKind::Repeated, self.repeated),
            (RejectKind::WrongSequence, self.wrong_sequence),
            (RejectKind::Syncing, self.syncing),
            (RejectKind::NotValid, self.not_valid),
        ]
        .map(|(kind, count)| (kind.text(), count))
    }

    pub(super) fn add(&mut self, result: Result<u32, Reject>) {
        let count = match result.map_err(Reject::kind) {
            Ok(lost) => {
                self.lost += u64::from(lost);
                &mut self.trusted
            }
            Err(RejectKind::WrongLength) => &mut self.wrong_length,
            Err(RejectKind::WrongChecksum) => &mut self.wrong_checksum,
            Err(RejectKind::WrongDataId) => &mut self.wrong_data_id,
            Err(RejectKind::CounterOutOfRange) => &mut self.counter_out_of_range,
            Err(RejectKind::Initial) => &mut self.initial,
            Err(RejectKind::Repeated) => &mut self.repeated,
            Err(RejectKind::WrongSequence) => &mut self.wrong_sequence,
            Err(RejectKind::Syncing) => &mut self.syncing,
            Err(RejectKind::NotValid) => &mut self.not_valid,
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
