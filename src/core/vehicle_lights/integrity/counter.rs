//! Message counters: has a frame been lost, repeated, or does it not belong here at all?
//!
//! The results are those of AUTOSAR's profile 1, which later profiles are a part of: the first
//! frame only initialises; a jump beyond the largest step is a wrong sequence, after which so many
//! frames in sequence are needed before one is good again; and so it is after too many repetitions.

use crate::core::dbc::codec::SignalCodec;
use crate::core::frame::Frame;

/// What a counter counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Counts {
    /// Every frame: an equal counter is an old frame.
    #[default]
    Sends,
    /// New contents: an equal counter is right when the whole frame is equal.
    Changes,
}

/// How a counter should run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CounterRule {
    first: u32,
    last: u32,
    max_step: u32,
    counts: Counts,
    tolerated_repeats: u8,
    sync_after: u8,
}

/// Why a counter cannot run like that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum CounterError {
    /// Fewer than two values.
    #[error("the counter runs from {first} to {last}: it needs two values at least")]
    Range {
        /// First value.
        first: u32,
        /// Last value.
        last: u32,
    },
    /// A step that is no step, or one that could not be told from a step back.
    #[error("the largest step is {max_step}: 1 to {most} with this range")]
    Step {
        /// Largest step wanted.
        max_step: u32,
        /// Largest step possible.
        most: u32,
    },
    /// Values the signal cannot hold.
    #[error("the counter's signal holds {lowest} to {highest} only")]
    Signal {
        /// Lowest raw value.
        lowest: i128,
        /// Highest raw value.
        highest: i128,
    },
    /// A signal that a multiplexor takes out of some frames.
    #[error("a counter signal is in every frame, this one is multiplexed")]
    Multiplexed,
}

/// What the counter of a frame says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sequence {
    /// The first frame: there is nothing to compare with.
    Initial,
    /// The next value; or, of [`Counts::Changes`], the same frame again.
    Ok,
    /// A step that is tolerated; as many frames are missing.
    OkSomeLost(u32),
    /// In sequence, but after a gap; as many more are needed.
    Syncing(u8),
    /// The same value again.
    Repeated,
    /// A step that is not tolerated.
    WrongSequence {
        /// The value before.
        from: u32,
        /// This value.
        to: u32,
    },
    /// A value outside the counter's range. Changes nothing.
    OutOfRange(u32),
}

/// A counter that is a signal of its message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counter {
    signal: SignalCodec,
    rule: CounterRule,
}

/// Where a counter stands.
#[derive(Debug, Clone, Default)]
pub struct CounterState {
    last: Option<(u32, Option<Frame>)>,
    /// Repetitions and missing frames since the last step.
    standing: u8,
    /// Frames in sequence that are still needed.
    syncing: u8,
}

impl CounterRule {
    /// A counter of `first..=last` (e.g. 0 to 14), back to `first` after `last`, each step 1.
    pub fn new(first: u32, last: u32) -> Result<Self, CounterError> {
        if first >= last {
            return Err(CounterError::Range { first, last });
        }
        Ok(Self { first, last, max_step: 1, counts: Counts::Sends, tolerated_repeats: 0, sync_after: 1 })
    }

    /// Tolerates steps of up to `max_step`: one less than that many frames may be lost. At most one
    /// less than the counter has values.
    pub fn with_max_step(self, max_step: u32) -> Result<Self, CounterError> {
        let most = self.last - self.first;
        let fits = (1..=most).contains(&max_step);
        fits.then_some(Self { max_step, ..self }).ok_or(CounterError::Step { max_step, most })
    }

    /// Sets what is counted.
    pub fn with_counts(self, counts: Counts) -> Self {
        Self { counts, ..self }
    }

    /// Sets after how many repetitions in a row the sequence counts as broken. (Repetitions are
    /// never good themselves.) 0: after any.
    pub fn with_tolerated_repeats(self, tolerated_repeats: u8) -> Self {
        Self { tolerated_repeats, ..self }
    }

    /// Sets how many frames in sequence are needed after a broken one before one is good again.
    /// 0: the next one is.
    pub fn with_sync_after(self, sync_after: u8) -> Self {
        Self { sync_after, ..self }
    }

    /// The value after `value`.
    pub fn next(&self, value: u32) -> u32 {
        if (self.first..self.last).contains(&value) { value + 1 } else { self.first }
    }

    /// First and last value.
    pub fn range(&self) -> (u32, u32) {
        (self.first, self.last)
    }

    /// Steps from one value to another, both in range: 0 to `last - first`.
    fn steps(&self, from: u32, to: u32) -> u32 {
        // The number of values may be 2^32.
        to.checked_sub(from).unwrap_or_else(|| (self.last - from) + (to - self.first) + 1)
    }
}

impl Counter {
    /// A counter by `rule`, stored in `signal`.
    pub fn new(rule: CounterRule, signal: SignalCodec) -> Result<Self, CounterError> {
        let (lowest, highest) = signal.range();
        if i128::from(rule.first) < lowest || i128::from(rule.last) > highest {
            return Err(CounterError::Signal { lowest, highest });
        }
        if signal.is_multiplexed() {
            return Err(CounterError::Multiplexed);
        }
        Ok(Self { signal, rule })
    }

    /// The counter in a frame of at least [`Self::needed_length`] bytes.
    pub fn value(&self, frame: &Frame) -> u32 {
        // Negative or beyond 32 bits: outside of every range but the widest, of 0 to 2^32 - 1.
        u32::try_from(self.signal.value(frame.padded())).unwrap_or(u32::MAX)
    }

    /// Bytes a frame must have so that the counter can be read.
    pub fn needed_length(&self) -> usize {
        self.signal.needed_length()
    }

    /// How the counter should run.
    pub fn rule(&self) -> &CounterRule {
        &self.rule
    }

    /// The signal that holds it.
    pub fn signal(&self) -> &SignalCodec {
        &self.signal
    }
}

impl CounterState {
    /// Takes the counter of the next frame.
    pub fn step(&mut self, rule: &CounterRule, to: u32, frame: &Frame) -> Sequence {
        if !(rule.first..=rule.last).contains(&to) {
            return Sequence::OutOfRange(to);
        }
        let contents = (rule.counts == Counts::Changes).then_some(*frame);
        let Some((from, before)) = self.last.replace((to, contents)) else {
            return Sequence::Initial;
        };
        let steps = rule.steps(from, to);
        if steps == 0 {
            return match rule.counts {
                Counts::Sends => {
                    self.stand();
                    Sequence::Repeated
                }
                Counts::Changes if before == contents => self.in_sequence(0),
                Counts::Changes => self.broken(rule, from, to),
            };
        }
        if steps > rule.max_step {
            return self.broken(rule, from, to);
        }
        if std::mem::take(&mut self.standing) > rule.tolerated_repeats {
            self.syncing = self.syncing.max(rule.sync_after);
        }
        self.in_sequence(steps - 1)
    }

    /// A frame was due and did not come.
    pub fn stand(&mut self) {
        self.standing = self.standing.saturating_add(1);
    }

    fn in_sequence(&mut self, lost: u32) -> Sequence {
        if self.syncing > 0 {
            self.syncing -= 1;
            return Sequence::Syncing(self.syncing);
        }
        if lost == 0 { Sequence::Ok } else { Sequence::OkSomeLost(lost) }
    }

    fn broken(&mut self, rule: &CounterRule, from: u32, to: u32) -> Sequence {
        self.standing = 0;
        self.syncing = rule.sync_after;
        Sequence::WrongSequence { from, to }
    }
}
