//! Evidence from the frames of one bound message.

use std::time::Duration;

use super::gaps::GapDistribution;
use super::unused::{UnusedChecksum, UnusedCounter};
use can_signal::can::{Frame, source_address};
use can_signal::dbc::model::Message;
use can_signal::validation::integrity::{IntegrityChecker, Protection};
use can_signal::validation::table::{BoundMessage, Timing};
use gateway_base::time::MonoTime;

/// Number of frames from which a rule is proven, or refuted.
pub(super) const MIN_FRAMES: u64 = 10;

/// The evidence of one message.
#[derive(Debug, Clone)]
pub struct MessageEvidence {
    /// The message, as it is bound.
    pub bound: BoundMessage,
    /// Length of its frames in the DBC, bytes.
    pub length: usize,
    /// Period in the DBC; `None` if unknown.
    pub cycle: Option<Duration>,
    /// Number of frames received, from the first sender only.
    pub frames: u64,
    /// The first sender of a message that may have several senders.
    sender: Option<u8>,
    /// Number of frames of another length, and the first such length.
    pub wrong_length: (u64, usize),
    /// Times between the frames.
    pub gaps: GapDistribution,
    integrity: Option<IntegrityChecker>,
    pub(super) unused_counter: Option<UnusedCounter>,
    pub(super) unused_checksum: Option<UnusedChecksum>,
}

/// Result of the counters and checksums of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// The profile has no rule.
    None,
    /// Too few frames for a result.
    Open,
    /// The rule holds for these frames, apart from damaged and lost ones.
    Holds {
        /// Number of frames for which it holds.
        frames: u64,
        /// True with a checksum, which other messages never fulfil by chance.
        checksum: bool,
    },
    /// The rule does not hold for most frames.
    Fails {
        /// Number of frames for which it does not hold.
        frames: u64,
    },
}

impl MessageEvidence {
    pub(super) fn new(bound: &BoundMessage, described: Option<&Message>) -> Self {
        let protection = bound.integrity.as_ref().map(|rules| &rules.protection);
        let has_checksum = protection.is_some_and(Protection::has_checksum);
        let has_counter = protection.and_then(Protection::counter_rule).is_some();
        Self {
            length: described.map_or(0, |message| message.length),
            cycle: described.and_then(|message| message.cycle_ms).map(|ms| Duration::from_millis(ms.into())),
            frames: 0,
            sender: None,
            wrong_length: (0, 0),
            gaps: GapDistribution::default(),
            integrity: bound.integrity.clone().map(IntegrityChecker::new),
            unused_counter: described.filter(|_| !has_counter).and_then(UnusedCounter::of),
            unused_checksum: described.filter(|_| !has_checksum).and_then(UnusedChecksum::of),
            bound: bound.clone(),
        }
    }

    /// Adds the next frame. Returns true if its signals may be used.
    pub(super) fn frame(&mut self, frame: &Frame, now: MonoTime) -> bool {
        let sender = source_address(frame.id()).filter(|_| self.bound.ids.has_several_senders());
        if sender.is_some_and(|sender| *self.sender.get_or_insert(sender) != sender) {
            return false;
        }
        self.frames += 1;
        self.gaps.frame(now);
        let length = frame.data().len();
        if length != self.length {
            let (frames, first) = self.wrong_length;
            self.wrong_length = (frames + 1, if frames == 0 { length } else { first });
        }
        if let Some(unused) = &mut self.unused_counter {
            unused.frame(frame);
        }
        if let Some(unused) = &mut self.unused_checksum {
            unused.frame(frame);
        }
        self.integrity.as_mut().is_none_or(|checker| checker.check(frame, now).is_ok())
    }

    /// Returns the result of its counter and checksum.
    pub fn proof(&self) -> Proof {
        let Some(checker) = &self.integrity else { return Proof::None };
        let (checksum, counts) = (checker.rules().protection.has_checksum(), checker.counts());
        let broken = counts.wrong_checksum
            + counts.wrong_data_id
            + counts.counter_out_of_range
            + counts.wrong_sequence;
        // A few duplicates are normal; a counter that stands still is not.
        let fails = broken + counts.repeated;
        // A frame after a gap has an intact checksum, and proves no more about a counter than the first
        // frame.
        let judged = counts.trusted + fails;
        if judged < MIN_FRAMES {
            Proof::Open
        } else if fails > counts.trusted {
            Proof::Fails { frames: fails }
        } else if broken * 10 <= counts.trusted {
            Proof::Holds { frames: counts.trusted, checksum }
        } else {
            Proof::Open
        }
    }

    /// Returns the relation of the usual gap between its frames to the profile.
    pub fn rhythm(&self) -> Rhythm {
        let Some(median) = self.gaps.median() else { return Rhythm::Open };
        let timeout = self.bound.timing.timeout();
        if timeout.is_some_and(|timeout| median > timeout) {
            return Rhythm::TooSlow;
        }
        match self.cycle {
            Some(cycle) if self.frames >= MIN_FRAMES => {
                let ratio = median.as_secs_f64() / cycle.as_secs_f64();
                if (0.8..=1.25).contains(&ratio) {
                    Rhythm::AsDescribed
                } else if ratio > 2.0 && self.bound.timing != Timing::Event {
                    Rhythm::Slower
                } else if ratio < 0.5 {
                    Rhythm::Faster
                } else {
                    Rhythm::Open
                }
            }
            _ => Rhythm::Open,
        }
    }
}

/// Relation of the usual gap between the frames of a message to the profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rhythm {
    /// No period is described, or there are too few frames.
    Open,
    /// The period of the DBC.
    AsDescribed,
    /// Less than half of the period of the DBC, as for a message that is also sent on change.
    Faster,
    /// More than twice the period of the DBC.
    Slower,
    /// More than the timeout, so that its values are unknown most of the time.
    TooSlow,
}
