//! Message counters, which reveal lost, repeated and foreign frames.
//!
//! The results follow AUTOSAR's profile 1, which later profiles restrict: the first frame only initialises. A
//! step above the largest allowed is a wrong sequence, after which several frames in sequence are required
//! before a frame is accepted. The same applies after too many repetitions.

use super::reject::Reject;
use crate::can::Frame;
use crate::dbc::codec::SignalCodec;

/// Event at which a sender increments a counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum IncrementsOn {
    /// Every frame: an equal counter marks an old frame.
    #[default]
    Sends,
    /// New contents: an equal counter is correct if the whole frame is equal.
    Changes,
}

/// Range, steps and tolerance of a counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CounterRule {
    first: u32,
    last: u32,
    max_step: u32,
    /// Event at which the sender increments the counter.
    pub increments_on: IncrementsOn,
    /// How many repetitions in a row leave the sequence intact. Repetitions themselves are never accepted.
    pub tolerated_repeats: u8,
    /// How many frames in sequence are required after a wrong sequence or a silence before a frame is
    /// accepted; with 0 the next frame is accepted.
    pub sync_after: u8,
}

/// Reason why a [`CounterRule`] or [`Counter`] is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum CounterError {
    #[error("the counter runs from {first} to {last}, but needs at least two values")]
    Range { first: u32, last: u32 },
    /// The largest step is 0, or so large that a step back looks the same.
    #[error("the largest step is {max_step}, but this range allows 1 to {most}")]
    Step { max_step: u32, most: u32 },
    #[error("the counter's signal holds only {lowest} to {highest}")]
    Signal { lowest: i128, highest: i128 },
    #[error("a counter signal must be in every frame, but this one is multiplexed")]
    Multiplexed,
}

/// A counter carried by a signal of its message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counter {
    signal: SignalCodec,
    rule: CounterRule,
}

/// State of a counter: its last value, repetitions, and missing frames in sequence.
#[derive(Debug, Clone, Default)]
pub struct CounterState {
    last: Option<(u32, Option<Frame>)>,
    repeats: u8,
    syncing: u8,
}

impl CounterRule {
    /// Creates a counter from `first` to `last` (e.g. 0 to 14) and back to `first`, incremented by 1 with
    /// every frame. One repeated frame (CAN controllers retransmit after errors) is not a gap; after a gap or
    /// a silence one frame in sequence is required.
    pub fn new(first: u32, last: u32) -> Result<Self, CounterError> {
        if first >= last {
            return Err(CounterError::Range { first, last });
        }
        Ok(Self {
            first,
            last,
            max_step: 1,
            increments_on: IncrementsOn::Sends,
            tolerated_repeats: 1,
            sync_after: 1,
        })
    }

    /// Tolerates steps of up to `max_step`, so that `max_step - 1` frames may be lost. Fails for 0 and
    /// for more than `last - first`.
    pub fn with_max_step(self, max_step: u32) -> Result<Self, CounterError> {
        let most = self.last - self.first;
        let fits = (1..=most).contains(&max_step);
        fits.then_some(Self { max_step, ..self }).ok_or(CounterError::Step { max_step, most })
    }

    /// Returns the value that follows `value`.
    pub fn next(&self, value: u32) -> u32 {
        if (self.first..self.last).contains(&value) { value + 1 } else { self.first }
    }

    /// Returns the first and last value of the counter.
    pub fn range(&self) -> (u32, u32) {
        (self.first, self.last)
    }

    /// Returns the largest tolerated step.
    pub fn max_step(&self) -> u32 {
        self.max_step
    }

    /// Returns the number of steps between two values in range: 0 to `last - first`.
    fn steps(&self, from: u32, to: u32) -> u32 {
        // The number of values may be 2^32.
        to.checked_sub(from).unwrap_or_else(|| (self.last - from) + (to - self.first) + 1)
    }
}

impl Counter {
    /// Creates a counter that follows `rule` and is stored in `signal`.
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

    /// Returns the counter in a frame of at least [`Self::needed_length`] bytes.
    pub fn value(&self, frame: &Frame) -> u32 {
        // Negative or beyond 32 bits: outside every range except 0 to 2^32 - 1.
        u32::try_from(self.signal.value(frame.padded())).unwrap_or(u32::MAX)
    }

    /// Returns the smallest number of bytes in a frame that has the counter.
    pub fn needed_length(&self) -> usize {
        self.signal.needed_length()
    }

    /// Returns the range, steps and tolerance of the counter.
    pub fn rule(&self) -> &CounterRule {
        &self.rule
    }

    /// Returns the signal that holds the counter.
    pub fn signal(&self) -> &SignalCodec {
        &self.signal
    }
}

impl CounterState {
    /// Forgets the last value after a silence. The next frame only initialises; then as many frames in
    /// sequence are required as after a gap, unless there was no earlier value.
    pub fn forget(&mut self, rule: &CounterRule) {
        if self.last.is_some() {
            *self = Self { syncing: rule.sync_after, ..Self::default() };
        }
    }

    /// Compares the counter of the next frame, `to`, with the previous counter. Returns the number of frames
    /// lost in between. A value out of range leaves the state unchanged.
    pub fn step(&mut self, rule: &CounterRule, to: u32, frame: &Frame) -> Result<u32, Reject> {
        if !(rule.first..=rule.last).contains(&to) {
            return Err(Reject::CounterOutOfRange(to));
        }
        let contents = (rule.increments_on == IncrementsOn::Changes).then_some(*frame);
        let Some((from, before)) = self.last.replace((to, contents)) else {
            return Err(Reject::Initial);
        };
        let steps = rule.steps(from, to);
        if steps == 0 {
            return match rule.increments_on {
                IncrementsOn::Sends => {
                    self.repeats = self.repeats.saturating_add(1);
                    Err(Reject::Repeated)
                }
                IncrementsOn::Changes if before == contents => self.in_sequence(0),
                IncrementsOn::Changes => self.wrong_sequence(rule, from, to),
            };
        }
        if steps > rule.max_step {
            return self.wrong_sequence(rule, from, to);
        }
        if std::mem::take(&mut self.repeats) > rule.tolerated_repeats {
            self.syncing = self.syncing.max(rule.sync_after);
        }
        self.in_sequence(steps - 1)
    }

    fn in_sequence(&mut self, lost: u32) -> Result<u32, Reject> {
        if self.syncing > 0 {
            self.syncing -= 1;
            return Err(Reject::Syncing(self.syncing));
        }
        Ok(lost)
    }

    fn wrong_sequence(&mut self, rule: &CounterRule, from: u32, to: u32) -> Result<u32, Reject> {
        self.repeats = 0;
        self.syncing = rule.sync_after;
        Err(Reject::WrongSequence { from, to })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::CanId;
    use crate::dbc::codec::{ByteOrder, Layout};
    use proptest::prelude::*;

    fn rule(first: u32, last: u32) -> CounterRule {
        CounterRule::new(first, last).unwrap()
    }

    /// Steps through `values` with contents that differ from frame to frame.
    fn run(rule: &CounterRule, values: &[u32]) -> Vec<Result<u32, Reject>> {
        let mut state = CounterState::default();
        let frame = |at: usize| Frame::classic(CanId::Standard(1), &at.to_le_bytes()).unwrap();
        values.iter().enumerate().map(|(at, value)| state.step(rule, *value, &frame(at))).collect()
    }

    #[test]
    fn counter_wraps_after_last_value() {
        use Reject::{CounterOutOfRange, Initial};
        assert_eq!(
            run(&rule(0, 14), &[13, 14, 0, 15, 1]),
            [Err(Initial), Ok(0), Ok(0), Err(CounterOutOfRange(15)), Ok(0)]
        );
        assert_eq!(run(&rule(1, 3), &[3, 1, 2, 0]), [Err(Initial), Ok(0), Ok(0), Err(CounterOutOfRange(0))]);
        assert_eq!(run(&rule(0, u32::MAX), &[u32::MAX, 0]), [Err(Initial), Ok(0)]);
        assert_eq!((rule(0, 14).next(14), rule(1, 3).next(1), rule(1, 3).next(9)), (0, 2, 1));
    }

    #[test]
    fn step_beyond_max_requires_frames_in_sequence() {
        use Reject::{Initial, Syncing, WrongSequence};
        let rule = CounterRule { sync_after: 2, ..rule(0, 15).with_max_step(3).unwrap() };
        assert_eq!(
            run(&rule, &[0, 3, 4, 8, 9, 12, 13, 12]),
            [
                Err(Initial),
                Ok(2),
                Ok(0),
                Err(WrongSequence { from: 4, to: 8 }),
                Err(Syncing(1)),
                Err(Syncing(0)),
                Ok(0),
                Err(WrongSequence { from: 13, to: 12 })
            ]
        );
        let at_once = CounterRule { sync_after: 0, ..rule };
        assert_eq!(run(&at_once, &[0, 8, 9])[1..], [Err(WrongSequence { from: 0, to: 8 }), Ok(0)]);
    }

    #[test]
    fn too_many_repetitions_require_frames_in_sequence() {
        use Reject::{Initial, Repeated, Syncing};
        let rule = rule(0, 15);
        assert_eq!(run(&rule, &[0, 0, 1]), [Err(Initial), Err(Repeated), Ok(0)]);
        assert_eq!(
            run(&rule, &[0, 0, 0, 1, 2]),
            [Err(Initial), Err(Repeated), Err(Repeated), Err(Syncing(0)), Ok(0)]
        );
    }

    #[test]
    fn silence_requires_as_many_frames_in_sequence_as_a_gap() {
        use Reject::{Initial, Syncing};
        let rule = CounterRule { sync_after: 2, ..rule(0, 15) };
        let mut state = CounterState::default();
        let frame = Frame::classic(CanId::Standard(1), &[]).unwrap();
        state.forget(&rule);
        assert_eq!(
            [3, 4].map(|value| state.step(&rule, value, &frame)),
            [Err(Initial), Ok(0)],
            "none before"
        );
        for _ in 0..2 {
            state.forget(&rule);
        }
        let results = [9, 10, 11, 12].map(|value| state.step(&rule, value, &frame));
        assert_eq!(results, [Err(Initial), Err(Syncing(1)), Err(Syncing(0)), Ok(0)]);
    }

    #[test]
    fn equal_frames_may_have_equal_counters_when_counting_changes() {
        use Reject::{Initial, WrongSequence};
        let rule = CounterRule { increments_on: IncrementsOn::Changes, ..rule(0, 15) };
        let mut state = CounterState::default();
        let mut step =
            |value, data: u8| state.step(&rule, value, &Frame::classic(CanId::Standard(1), &[data]).unwrap());
        assert_eq!([step(4, 1), step(4, 1), step(4, 1), step(5, 2)], [Err(Initial), Ok(0), Ok(0), Ok(0)]);
        assert_eq!(step(5, 3), Err(WrongSequence { from: 5, to: 5 }));
    }

    #[test]
    fn invalid_counters_are_refused() {
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

    /// Calculates the same results by counting how often `next` must be called to get from one value to the
    /// other.
    fn reference(rule: &CounterRule, values: &[u32]) -> Vec<Result<u32, Reject>> {
        let (mut last, mut repeats, mut required) = (None, 0_u32, 0_u8);
        let mut results = Vec::new();
        for value in values.iter().copied() {
            if value < rule.first || value > rule.last {
                results.push(Err(Reject::CounterOutOfRange(value)));
                continue;
            }
            let Some(from) = last.replace(value) else {
                results.push(Err(Reject::Initial));
                continue;
            };
            let walk = std::iter::successors(Some(from), |at| Some(rule.next(*at)));
            let steps = u32::try_from(walk.take_while(|at| *at != value).count()).unwrap();
            results.push(if steps == 0 {
                repeats += 1;
                Err(Reject::Repeated)
            } else if steps > rule.max_step {
                (repeats, required) = (0, rule.sync_after);
                Err(Reject::WrongSequence { from, to: value })
            } else {
                if repeats > u32::from(rule.tolerated_repeats) {
                    required = required.max(rule.sync_after);
                }
                repeats = 0;
                match required.checked_sub(1) {
                    Some(rest) => {
                        required = rest;
                        Err(Reject::Syncing(rest))
                    }

                    None => Ok(steps - 1),
                }
            });
        }
        results
    }

    proptest! {
        #[test]
        fn sequence_agrees_with_counting_steps_one_by_one(
            first in 0_u32..3, more in 1_u32..20, max_step in 1_u32..20, tolerated in 0_u8..4, sync in 0_u8..4,
            steps in prop::collection::vec(prop_oneof![4 => Just(1_u32), 2 => 0_u32..3, 1 => 0_u32..30], 0..200),
        ) {
            let rule = rule(first, first + more).with_max_step(max_step.min(more)).unwrap();
            let rule = CounterRule { tolerated_repeats: tolerated, sync_after: sync, ..rule };
            let values: Vec<_> = steps.iter().scan(0, |at, step| {
                *at = (*at + step) % (first + more + 2);
                Some(*at)
            }).collect();
            prop_assert_eq!(run(&rule, &values), reference(&rule, &values));
        }
    }
}
