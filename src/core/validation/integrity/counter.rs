//! Message counters: has a frame been lost, repeated, or does it not belong here at all?
//!
//! The results are those of AUTOSAR's profile 1, which later profiles are a part of: the first
//! frame only initialises; a jump beyond the largest step is a wrong sequence, after which so many
//! frames in sequence are needed before one is good again; and so it is after too many repetitions.

use crate::core::can::frame::Frame;
use crate::core::dbc::codec::SignalCodec;

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
    /// A step that is not a step, or one that could not be told from a step back.
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
    /// A counter of `first..=last` (e.g. 0 to 14), back to `first` after `last`, that counts sends and
    /// makes steps of 1. A frame that comes twice (CAN does that after some errors) is not a gap; after
    /// a gap one frame in sequence is needed.
    pub fn new(first: u32, last: u32) -> Result<Self, CounterError> {
        if first >= last {
            return Err(CounterError::Range { first, last });
        }
        Ok(Self { first, last, max_step: 1, counts: Counts::Sends, tolerated_repeats: 1, sync_after: 1 })
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
    /// never good themselves.)
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

    /// Largest step that is tolerated.
    pub fn max_step(&self) -> u32 {
        self.max_step
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::can::frame::CanId;
    use crate::core::dbc::codec::{ByteOrder, Layout};
    use proptest::prelude::*;

    fn rule(first: u32, last: u32) -> CounterRule {
        CounterRule::new(first, last).unwrap()
    }

    /// Contents that differ with every frame; the counter itself is given apart.
    fn run(rule: &CounterRule, values: &[u32]) -> Vec<Sequence> {
        let mut state = CounterState::default();
        let frame = |at: usize| Frame::classic(CanId::Standard(1), &at.to_le_bytes()).unwrap();
        values.iter().enumerate().map(|(at, value)| state.step(rule, *value, &frame(at))).collect()
    }

    #[test]
    fn a_running_counter_wraps_at_its_last_value() {
        use Sequence::{Initial, Ok, OutOfRange};
        assert_eq!(run(&rule(0, 14), &[13, 14, 0, 15, 1]), [Initial, Ok, Ok, OutOfRange(15), Ok]);
        assert_eq!(run(&rule(1, 3), &[3, 1, 2, 0]), [Initial, Ok, Ok, OutOfRange(0)]);
        assert_eq!(run(&rule(0, u32::MAX), &[u32::MAX, 0]), [Initial, Ok]);
        assert_eq!((rule(0, 14).next(14), rule(1, 3).next(1), rule(1, 3).next(9)), (0, 2, 1));
    }

    #[test]
    fn a_step_beyond_the_largest_has_to_be_made_good() {
        use Sequence::{Initial, Ok, OkSomeLost, Syncing, WrongSequence};
        let rule = rule(0, 15).with_max_step(3).unwrap().with_sync_after(2);
        assert_eq!(
            run(&rule, &[0, 3, 4, 8, 9, 12, 13, 12]),
            [
                Initial,
                OkSomeLost(2),
                Ok,
                WrongSequence { from: 4, to: 8 },
                Syncing(1),
                Syncing(0),
                Ok,
                WrongSequence { from: 13, to: 12 }
            ]
        );
        let at_once = rule.with_sync_after(0);
        assert_eq!(run(&at_once, &[0, 8, 9])[1..], [WrongSequence { from: 0, to: 8 }, Ok]);
    }

    #[test]
    fn too_many_repetitions_break_the_sequence() {
        use Sequence::{Initial, Ok, Repeated, Syncing};
        let rule = rule(0, 15);
        assert_eq!(run(&rule, &[0, 0, 1]), [Initial, Repeated, Ok]);
        assert_eq!(run(&rule, &[0, 0, 0, 1, 2]), [Initial, Repeated, Repeated, Syncing(0), Ok]);
        let mut state = CounterState::default();
        let frame = Frame::classic(CanId::Standard(1), &[]).unwrap();
        state.step(&rule, 0, &frame);
        state.stand();
        state.stand();
        assert_eq!(state.step(&rule, 1, &frame), Syncing(0), "frames that did not come count as well");
    }

    #[test]
    fn a_counter_of_changes_may_stand_while_nothing_changes() {
        use Sequence::{Initial, Ok, WrongSequence};
        let rule = rule(0, 15).with_counts(Counts::Changes);
        let mut state = CounterState::default();
        let mut step =
            |value, data: u8| state.step(&rule, value, &Frame::classic(CanId::Standard(1), &[data]).unwrap());
        assert_eq!([step(4, 1), step(4, 1), step(4, 1), step(5, 2)], [Initial, Ok, Ok, Ok]);
        assert_eq!(step(5, 3), WrongSequence { from: 5, to: 5 });
    }

    #[test]
    fn counters_that_cannot_run_are_refused() {
        let signal = |length, signed| {
            SignalCodec::new(Layout { start: 0, length, order: ByteOrder::Intel, signed }, 8).unwrap()
        };
        assert_eq!(CounterRule::new(3, 3), Err(CounterError::Range { first: 3, last: 3 }));
        for max_step in [0, 15] {
            assert_eq!(rule(0, 14).with_max_step(max_step), Err(CounterError::Step { max_step, most: 14 }));
        }
        assert_eq!(
            Counter::new(rule(0, 15), signal(3, false)),
            Err(CounterError::Signal { lowest: 0, highest: 7 })
        );
        let multiplexed = signal(4, false).multiplexed(&signal(1, false), &[1..=1]);
        assert_eq!(Counter::new(rule(0, 15), multiplexed), Err(CounterError::Multiplexed));
        let negative = Counter::new(rule(0, 7), signal(4, true)).unwrap();
        let frame = Frame::classic(CanId::Standard(1), &[0x0F]).unwrap();
        assert_eq!(negative.value(&frame), u32::MAX, "out of range");
    }

    /// The rule told by walking: how often `next` leads from one value to the other.
    fn reference(rule: &CounterRule, values: &[u32]) -> Vec<Sequence> {
        let (mut last, mut standing, mut needed) = (None, 0_u32, 0_u8);
        let mut told = Vec::new();
        for value in values.iter().copied() {
            if value < rule.first || value > rule.last {
                told.push(Sequence::OutOfRange(value));
                continue;
            }
            let Some(from) = last.replace(value) else {
                told.push(Sequence::Initial);
                continue;
            };
            let walk = std::iter::successors(Some(from), |at| Some(rule.next(*at)));
            let steps = u32::try_from(walk.take_while(|at| *at != value).count()).unwrap();
            told.push(if steps == 0 {
                standing += 1;
                Sequence::Repeated
            } else if steps > rule.max_step {
                (standing, needed) = (0, rule.sync_after);
                Sequence::WrongSequence { from, to: value }
            } else {
                if standing > u32::from(rule.tolerated_repeats) {
                    needed = needed.max(rule.sync_after);
                }
                standing = 0;
                match needed.checked_sub(1) {
                    Some(rest) => {
                        needed = rest;
                        Sequence::Syncing(rest)
                    }
                    None if steps == 1 => Sequence::Ok,
                    None => Sequence::OkSomeLost(steps - 1),
                }
            });
        }
        told
    }

    proptest! {
        #[test]
        fn the_counter_does_what_walking_says(
            first in 0_u32..3, more in 1_u32..20, max_step in 1_u32..20, tolerated in 0_u8..4, sync in 0_u8..4,
            steps in prop::collection::vec(prop_oneof![4 => Just(1_u32), 2 => 0_u32..3, 1 => 0_u32..30], 0..200),
        ) {
            let rule = rule(first, first + more).with_max_step(max_step.min(more)).unwrap();
            let rule = rule.with_tolerated_repeats(tolerated).with_sync_after(sync);
            let values: Vec<_> = steps.iter().scan(0, |at, step| {
                *at = (*at + step) % (first + more + 2);
                Some(*at)
            }).collect();
            prop_assert_eq!(run(&rule, &values), reference(&rule, &values));
        }
    }
}
