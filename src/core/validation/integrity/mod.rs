//! Whether a frame of one message may be believed.
//!
//! Everything that must hold is set up once, as a [`MessageIntegrity`]; a [`IntegrityChecker`] holds what was
//! seen so far and judges frame by frame. A frame is trusted or it is not: its signals are used all
//! or none.

pub mod checksum;
pub mod counter;
mod display;
pub mod e2e;
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

/// What a message must prove.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MessageIntegrity {
    /// The only length that is right, in bytes; `None` = any that has all fields.
    pub length: Option<usize>,
    /// What its own bytes must show.
    pub protection: Protection,
    /// What its latest frames together must show; `None` = each frame stands for itself.
    pub window: Option<Window>,
    /// After a silence longer than this, everything starts anew; `None` = never.
    pub forget_after: Option<Duration>,
}

/// How a message protects its contents.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Protection {
    /// In the vehicle maker's own way.
    Fields {
        /// Checksum.
        checksum: Option<Checksum>,
        /// Counter.
        counter: Option<Counter>,
    },
    /// With an AUTOSAR profile; see [`Protection::e2e`].
    E2e {
        /// The profile.
        profile: E2e,
        /// How its counter runs.
        counter: CounterRule,
    },
}

/// What the guard says of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IntegrityVerdict {
    /// Use it.
    Trusted,
    /// Do not.
    Rejected(Reject),
}

/// Why a frame is not trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reject {
    /// Too short for its fields, or not the length it must have; bytes.
    WrongLength(usize),
    /// The checksum or CRC is not that of the contents.
    WrongChecksum {
        /// In the frame.
        stored: u64,
        /// What it should be.
        expected: u64,
    },
    /// Whole, but another message's Data ID.
    WrongDataId {
        /// In the frame.
        stored: u32,
        /// What it should be.
        expected: u32,
    },
    /// A counter outside its range.
    CounterOutOfRange(u32),
    /// The first frame: its counter has nothing to follow.
    Initial,
    /// The counter has not moved.
    Repeated,
    /// The counter made a step that is not tolerated.
    WrongSequence {
        /// The value before.
        from: u32,
        /// This value.
        to: u32,
    },
    /// In sequence, but after a gap; as many more are needed.
    Syncing(u8),
    /// Right by itself, but the message as a whole is not yet, or no more, trusted.
    NotValid(E2eState),
}

impl Reject {
    /// What is wrong, in words that stay the same from frame to frame.
    pub fn words(self) -> &'static str {
        match self {
            Self::WrongLength(_) => "wrong length",
            Self::WrongChecksum { .. } => "wrong checksum",
            Self::WrongDataId { .. } => "wrong data ID",
            Self::CounterOutOfRange(_) => "counter out of range",
            Self::Initial => "first frame, its counter has nothing to follow",
            Self::Repeated => "repeated counter",
            Self::WrongSequence { .. } => "counter out of sequence",
            Self::Syncing(_) => "counter not in sequence for long enough",
            Self::NotValid(_) => "too few good frames",
        }
    }
}

/// With the numbers.
impl fmt::Display for Reject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = self.words();
        match self {
            Self::WrongLength(length) => write!(f, "{words}: {length} bytes"),
            Self::WrongChecksum { stored, expected } => {
                write!(f, "{words}: 0x{stored:X}, not 0x{expected:X}")
            }
            Self::WrongDataId { stored, expected } => write!(f, "{words}: 0x{stored:X}, not 0x{expected:X}"),
            Self::CounterOutOfRange(value) => write!(f, "{words}: {value}"),
            Self::WrongSequence { from, to } => write!(f, "{words}: {to} after {from}"),
            Self::Syncing(missing) => write!(f, "{words}: {missing} more needed"),
            Self::NotValid(phase) => write!(f, "{words}: {phase:?}"),
            Self::Initial | Self::Repeated => f.write_str(words),
        }
    }
}

/// Frames judged since start, by verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct IntegrityCounts {
    /// Trusted.
    pub trusted: u64,
    /// Missing before trusted ones, by their counters; damaged ones are missing too.
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

/// Judges the frames of one message.
#[derive(Debug, Clone)]
pub struct IntegrityChecker {
    rules: MessageIntegrity,
    counter: CounterState,
    window: WindowState,
    /// When the last frame came that was whole and this message's.
    last_whole: Option<MonoTime>,
    counts: IntegrityCounts,
}

impl Protection {
    /// A profile with the counter it has, tolerating steps of up to `max_step`.
    pub fn e2e(profile: E2e, max_step: u32) -> Result<Self, CounterError> {
        let (first, last) = profile.counter_range();
        let counter = CounterRule::new(first, last)?.with_max_step(max_step)?;
        Ok(Self::E2e { profile, counter })
    }
}

impl IntegrityChecker {
    /// Nothing seen yet.
    pub fn new(rules: MessageIntegrity) -> Self {
        Self {
            rules,
            counter: CounterState::default(),
            window: WindowState::default(),
            last_whole: None,
            counts: IntegrityCounts::default(),
        }
    }

    /// Judges the next frame of the message.
    pub fn check(&mut self, frame: &Frame, now: MonoTime) -> IntegrityVerdict {
        if let (Some(limit), Some(before)) = (self.rules.forget_after, self.last_whole)
            && now.since(before) > limit
        {
            self.forget();
        }
        let alone = self.check_alone(frame);
        let outcome = outcome(alone);
        if outcome != CheckStatus::Error {
            self.last_whole = Some(now);
        }
        let together = self.rules.window.map(|window| self.window.step(&window, outcome));
        let judged = match (alone, together) {
            (Ok(_), Some(phase @ (E2eState::NoData | E2eState::Init | E2eState::Invalid))) => {
                Err(Reject::NotValid(phase))
            }
            (alone, Some(_) | None) => alone,
        };
        self.counts.add(judged);
        judged.map_or_else(IntegrityVerdict::Rejected, |_| IntegrityVerdict::Trusted)
    }

    /// A frame was due and did not come: counts like a repetition, and as no good one in the window.
    pub fn no_new_data(&mut self) {
        self.counter.stand();
        if let Some(window) = &self.rules.window {
            self.window.step(window, CheckStatus::NoNewData);
        }
    }

    /// Back to the start, e.g. after the bus was lost. Counts stay.
    pub fn forget(&mut self) {
        self.counter = CounterState::default();
        self.window = WindowState::default();
        self.last_whole = None;
    }

    /// Frames judged so far.
    pub fn counts(&self) -> IntegrityCounts {
        self.counts
    }

    /// Where the message as a whole stands; `None` without a window.
    pub fn phase(&self) -> Option<E2eState> {
        self.rules.window.is_some().then(|| self.window.phase())
    }

    /// What the message must prove.
    pub fn rules(&self) -> &MessageIntegrity {
        &self.rules
    }

    /// What the frame shows with those before it, apart from the window: frames lost before it.
    fn check_alone(&mut self, frame: &Frame) -> Result<u32, Reject> {
        let length = frame.data().len();
        if self.rules.length.is_some_and(|right| right != length) {
            return Err(Reject::WrongLength(length));
        }
        match &self.rules.protection {
            Protection::Fields { checksum, counter } => {
                if let Some(checksum) = checksum {
                    let (stored, expected) =
                        checksum.compare(frame.id(), frame).ok_or(Reject::WrongLength(length))?;
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

/// What a frame means for the window: AUTOSAR's mapping since release 4.2.
fn outcome(alone: Result<u32, Reject>) -> CheckStatus {
    match alone {
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
    /// Frames that were not trusted.
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

    fn add(&mut self, judged: Result<u32, Reject>) {
        let count = match judged {
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
