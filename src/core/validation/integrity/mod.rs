//! Integrity of the frames of one message: length, checksum, counter, E2E protection.
//!
//! The rules are set up once as a [`MessageIntegrity`]; an [`IntegrityChecker`] keeps the state and
//! checks frame by frame. All signals of a trusted frame are used, and none of a rejected one.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub mod checksum;
pub mod counter;
mod display;
pub mod e2e;
pub mod search;
mod send;
pub mod window;

use std::fmt;
use std::time::Duration;

use crate::core::can::frame::Frame;
use crate::core::time::MonoTime;
use checksum::Checksum;
use counter::{Counter, CounterError, CounterRule, CounterState, Sequence};
use e2e::{E2e, E2eFault};
use window::{CheckStatus, E2eState, Window, WindowState};

/// Rules that the frames of a message must satisfy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MessageIntegrity {
    /// Required length in bytes; `None` = any length that has all fields.
    pub length: Option<usize>,
    /// Checksum and counter of each frame.
    pub protection: Protection,
    /// Limits on the latest results together; `None` = each frame is checked by itself.
    pub window: Option<Window>,
    /// Silence after which the state is reset; `None` = never.
    pub forget_after: Option<Duration>,
}

/// Protection of the contents of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Protection {
    /// Checksum and counter signals of the vehicle manufacturer.
    Fields {
        /// Checksum over the data; `None` = no checksum.
        checksum: Option<Checksum>,
        /// Message counter; `None` = no counter.
        counter: Option<Counter>,
    },
    /// An AUTOSAR E2E profile; see [`Protection::e2e`].
    E2e {
        /// The profile as applied to the message.
        profile: E2e,
        /// Range and steps of its counter.
        counter: CounterRule,
    },
}

/// Verdict of an [`IntegrityChecker`] on a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IntegrityVerdict {
    /// The frame may be used.
    Trusted,
    /// The frame must not be used.
    Rejected(Reject),
}

/// Reason why a frame is rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reject {
    /// The frame is too short for its fields or not of the required length; its length in bytes.
    WrongLength(usize),
    /// The checksum or CRC differs from that of the contents.
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
    /// The reason without the numbers of the frame.
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
    /// Trusted frames.
    pub trusted: u64,
    /// Frames missing before trusted ones according to the counter, damaged ones included.
    pub lost: u64,
    /// [`Reject::WrongLength`].
    pub wrong_length: u64,
    /// [`Reject::WrongChecksum`].
    pub wrong_checksum: u64,
    /// [`Reject::WrongDataId`].
    pub wrong_data_id: u64,
    /// [`Reject::CounterOutOfRange`].
    pub counter_out_of_range: u64,
    /// [`Reject::Initial`].
    pub initial: u64,
    /// [`Reject::Repeated`].
    pub repeated: u64,
    /// [`Reject::WrongSequence`].
    pub wrong_sequence: u64,
    /// [`Reject::Syncing`].
    pub syncing: u64,
    /// [`Reject::NotValid`].
    pub not_valid: u64,
}

/// Checks the frames of one message.
#[derive(Debug, Clone)]
pub struct IntegrityChecker {
    rules: MessageIntegrity,
    counter: CounterState,
    window: WindowState,
    /// Receive time of the last intact frame of this message.
    last_intact: Option<MonoTime>,
    counts: IntegrityCounts,
}

impl Protection {
    /// A profile with its own counter, tolerating steps of up to `max_step`.
    pub fn e2e(profile: E2e, max_step: u32) -> Result<Self, CounterError> {
        let (first, last) = profile.counter_range();
        let counter = CounterRule::new(first, last)?.with_max_step(max_step)?;
        Ok(Self::E2e { profile, counter })
    }

    /// True if frames carry a checksum, as those of every E2E profile do.
    pub fn has_checksum(&self) -> bool {
        matches!(self, Self::Fields { checksum: Some(_), .. } | Self::E2e { .. })
    }

    /// True if frames carry a counter, as those of every E2E profile do.
    pub fn has_counter(&self) -> bool {
        matches!(self, Self::Fields { counter: Some(_), .. } | Self::E2e { .. })
    }
}

impl IntegrityChecker {
    /// A checker that has received no frame.
    pub fn new(rules: MessageIntegrity) -> Self {
        Self {
            rules,
            counter: CounterState::default(),
            window: WindowState::default(),
            last_intact: None,
            counts: IntegrityCounts::default(),
        }
    }

    /// Checks the next frame of the message.
    pub fn check(&mut self, frame: &Frame, now: MonoTime) -> IntegrityVerdict {
        if let (Some(limit), Some(before)) = (self.rules.forget_after, self.last_intact)
            && now.since(before) > limit
        {
            self.forget();
        }
        let single = self.check_single(frame);
        let status = check_status(single);
        if status != CheckStatus::Error {
            self.last_intact = Some(now);
        }
        let state = self.rules.window.map(|window| self.window.step(&window, status));
        let result = match (single, state) {
            (Ok(_), Some(state @ (E2eState::NoData | E2eState::Init | E2eState::Invalid))) => {
                Err(Reject::NotValid(state))
            }
            (single, _) => single,
        };
        self.counts.add(result);
        result.map_or_else(IntegrityVerdict::Rejected, |_| IntegrityVerdict::Trusted)
    }

    /// Resets the state, e.g. after the link was lost, but keeps the counts.
    pub fn forget(&mut self) {
        match &self.rules.protection {
            Protection::Fields { counter: Some(counter), .. } => self.counter.forget(counter.rule()),
            Protection::E2e { counter, .. } => self.counter.forget(counter),
            Protection::Fields { counter: None, .. } => {}
        }
        self.window = WindowState::default();
        self.last_intact = None;
    }

    /// Number of frames checked so far, by verdict.
    pub fn counts(&self) -> IntegrityCounts {
        self.counts
    }

    /// State of the message as a whole; `None` without a window.
    pub fn e2e_state(&self) -> Option<E2eState> {
        self.rules.window.is_some().then(|| self.window.state())
    }

    /// Rules that the frames of the message must satisfy.
    pub fn rules(&self) -> &MessageIntegrity {
        &self.rules
    }

    /// Checks the frame without the window; returns the number of frames lost before it.
    fn check_single(&mut self, frame: &Frame) -> Result<u32, Reject> {
        let length = frame.data().len();
        if self.rules.length.is_some_and(|right| right != length) {
            return Err(Reject::WrongLength(length));
        }
        match &self.rules.protection {
            Protection::Fields { checksum, counter } => {
                if let Some(checksum) = checksum {
                    let (stored, expected) = checksum.compare(frame).ok_or(Reject::WrongLength(length))?;
                    if stored != expected {
                        return Err(Reject::WrongChecksum {
                            stored: stored.into(),
                            expected: expected.into(),
                        });
                    }
                }
                let Some(counter) = counter else { return Ok(0) };
                if counter.needed_length() > length {
                    return Err(Reject::WrongLength(length));
                }
                lost_frames(self.counter.step(counter.rule(), counter.value(frame), frame))
            }
            Protection::E2e { profile, counter } => {
                let value = profile.check(frame).map_err(|fault| match fault {
                    E2eFault::Length | E2eFault::LengthField(_) => Reject::WrongLength(length),
                    E2eFault::Crc { stored, expected } => Reject::WrongChecksum { stored, expected },
                    E2eFault::DataId { stored, expected } => Reject::WrongDataId { stored, expected },
                })?;
                lost_frames(self.counter.step(counter, value, frame))
            }
        }
    }
}

fn lost_frames(sequence: Sequence) -> Result<u32, Reject> {
    match sequence {
        Sequence::Ok => Ok(0),
        Sequence::OkSomeLost(lost) => Ok(lost),
        Sequence::Initial => Err(Reject::Initial),
        Sequence::Syncing(missing) => Err(Reject::Syncing(missing)),
        Sequence::Repeated => Err(Reject::Repeated),
        Sequence::WrongSequence { from, to } => Err(Reject::WrongSequence { from, to }),
        Sequence::OutOfRange(value) => Err(Reject::CounterOutOfRange(value)),
    }
}

/// Status of a frame for the window: AUTOSAR's mapping since release 4.2.
fn check_status(single: Result<u32, Reject>) -> CheckStatus {
    match single {
        Ok(_) | Err(Reject::Syncing(_) | Reject::NotValid(_)) => CheckStatus::Ok,
        Err(Reject::Repeated) => CheckStatus::Repeated,
        Err(Reject::Initial | Reject::WrongSequence { .. }) => CheckStatus::WrongSequence,
        Err(
            Reject::WrongLength(_)
            | Reject::WrongChecksum { .. }
            | Reject::WrongDataId { .. }
            | Reject::CounterOutOfRange(_),
        ) => CheckStatus::Error,
    }
}

impl IntegrityCounts {
    /// Total number of rejected frames.
    pub fn rejected(&self) -> u64 {
        self.wrong_length
            + self.wrong_checksum
            + self.wrong_data_id
            + self.counter_out_of_range
            + self.initial
            + self.repeated
            + self.wrong_sequence
            + self.syncing
            + self.not_valid
    }

    fn add(&mut self, result: Result<u32, Reject>) {
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
mod tests;
