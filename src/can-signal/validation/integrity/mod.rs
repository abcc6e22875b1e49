//! Integrity of the frames of one message: length, checksum, counter, E2E protection.
//!
//! The rules are set up once as a [`MessageIntegrity`]; an [`IntegrityChecker`] keeps the state and checks
//! frame by frame. All signals of a trusted frame are used, and no signal of a rejected frame.

pub mod checksum;
pub mod counter;
mod display;
pub mod e2e;
mod reject;
pub mod search;
mod send;
pub mod window;

use std::time::Duration;

use crate::can::Frame;
use checksum::Checksum;
use counter::{Counter, CounterError, CounterRule, CounterState};
use e2e::E2e;
use gateway_base::time::MonoTime;
pub use reject::{IntegrityCounts, Reject, RejectKind};
use window::{CheckStatus, E2eState, Window, WindowState};

/// Rules that the frames of a message must satisfy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MessageIntegrity {
    /// Required length in bytes; `None` = any length that includes all fields.
    pub length: Option<usize>,
    /// Checksum and counter of each frame.
    pub protection: Protection,
    /// Limits on the latest results together; `None` = each frame is judged separately.
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
    /// The AUTOSAR E2E profile, see [`Protection::e2e`].
    E2e {
        /// The profile as applied to the message.
        profile: E2e,
        /// Range and steps of its counter.
        counter: CounterRule,
    },
}

/// Checks the frames of one message, see [`Self::check`].
///
/// ```
/// use can_signal::can::frame::{CanId, Frame};
/// use can_signal::dbc::codec::{Layout, SignalCodec};
/// use gateway_base::time::MonoTime;
/// use can_signal::validation::integrity::checksum::{Checksum, ChecksumRule, Sum};
/// use can_signal::validation::integrity::{IntegrityChecker, MessageIntegrity, Protection, Reject};
///
/// let field = SignalCodec::new(Layout::unsigned(8, 8), 2).unwrap();
/// let checksum = Checksum::new(ChecksumRule::Sum(Sum::PLAIN), field).unwrap();
/// let protection = Protection::Fields { checksum: Some(checksum), counter: None };
/// let rules = MessageIntegrity { length: Some(2), protection, window: None, forget_after: None };
/// let mut checker = IntegrityChecker::new(rules);
/// let mut check = |data| checker.check(&Frame::classic(CanId::Standard(1), data).unwrap(), MonoTime::ZERO);
/// assert_eq!(check(&[7, 7]), Ok(()));
/// assert_eq!(check(&[7, 8]), Err(Reject::WrongChecksum { stored: 8, expected: 7 }));
/// ```
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
    /// Creates a profile with its own counter, tolerating steps of up to `max_step`.
    pub fn e2e(profile: E2e, max_step: u32) -> Result<Self, CounterError> {
        let (first, last) = profile.counter_range();
        let counter = CounterRule::new(first, last)?.with_max_step(max_step)?;
        Ok(Self::E2e { profile, counter })
    }

    /// Returns true if frames carry a checksum, as with every E2E profile.
    pub fn has_checksum(&self) -> bool {
        matches!(self, Self::Fields { checksum: Some(_), .. } | Self::E2e { .. })
    }

    /// Returns the rule of the counter that frames carry; every E2E profile has one.
    pub fn counter_rule(&self) -> Option<&CounterRule> {
        match self {
            Self::Fields { counter, .. } => counter.as_ref().map(Counter::rule),
            Self::E2e { counter, .. } => Some(counter),
        }
    }
}

impl IntegrityChecker {
    /// Creates a checker that has received no frame.
    pub fn new(rules: MessageIntegrity) -> Self {
        Self {
            rules,
            counter: CounterState::default(),
            window: WindowState::default(),
            last_intact: None,
            counts: IntegrityCounts::default(),
        }
    }

    /// Checks the next frame of the message; `Ok` if it may be used.
    pub fn check(&mut self, frame: &Frame, now: MonoTime) -> Result<(), Reject> {
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
        result.map(|_| ())
    }

    /// Resets the state, e.g. after the link was lost, but keeps the counts.
    pub fn forget(&mut self) {
        if let Some(rule) = self.rules.protection.counter_rule() {
            self.counter.forget(rule);
        }
        self.window = WindowState::default();
        self.last_intact = None;
    }

    /// Returns the number of frames checked so far, by verdict.
    pub fn counts(&self) -> IntegrityCounts {
        self.counts
    }

    /// Returns the state of the message as a whole; `None` without a window.
    pub fn e2e_state(&self) -> Option<E2eState> {
        self.rules.window.is_some().then_some(self.window.state)
    }

    /// Returns the rules that the frames of the message must satisfy.
    pub fn rules(&self) -> &MessageIntegrity {
        &self.rules
    }

    /// Checks the frame without the window and returns the number of frames lost before it.
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
                self.counter.step(counter.rule(), counter.value(frame), frame)
            }
            Protection::E2e { profile, counter } => self.counter.step(counter, profile.check(frame)?, frame),
        }
    }
}

/// Returns the status of a frame for the window: AUTOSAR's mapping since release 4.2.
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

#[cfg(test)]
mod tests;
