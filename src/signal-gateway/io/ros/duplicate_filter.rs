//! Recognises samples that were received before: while a participant is being replaced, two of our
//! participants read the same writers, and a transient-local writer sends a new reader the samples that the
//! old reader already received.
//!
//! Sequence numbers far below the highest one count as received. A single packet under a writer's identity
//! can carry a number far ahead of it, so the highest number is discarded when the writer continues below it.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// GUID of a writer.
type Guid = [u8; 16];

/// Maximum number of writers; the one that has been silent longest is removed first.
const MAX_WRITERS: usize = 256;
/// Number of sequence numbers, from the highest down, that are tracked individually.
const WINDOW: i64 = 64;
/// Time for which the highest number is trusted, whatever arrives below it.
const BELIEVED: Duration = Duration::from_secs(1);
/// Number of consecutive new samples that establish a writer's position.
const SEVERAL: u32 = 3;
/// Minimum time between two of these samples: a writer resends its history in one burst, which says nothing
/// about its position.
const BURST: Duration = Duration::from_millis(20);
/// Number of remembered sequence numbers that the writer may never have reached.
const DOUBTFUL: usize = 8;

/// How a sample relates to the samples received before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Receipt {
    /// Received for the first time.
    First,
    /// New, and the writer continues far below a number that was received under its identity.
    TakenAnew,
    /// Received before, or counts as received.
    Again,
}

/// Remembers the newest samples of each writer.
#[derive(Debug, Default)]
pub(super) struct DuplicateFilter {
    writers: BTreeMap<Guid, KnownWriter>,
    turn: u64,
}

#[derive(Debug, Clone, Copy)]
struct KnownWriter {
    received: Numbers,
    /// Numbers received before the last jump over a whole window; `None` if no number below can be new.
    before: Option<Numbers>,
    /// Numbers that were received far ahead of the writer before it restarted.
    ahead: Option<Numbers>,
    /// Time at which the highest number was received.
    highest_at: Instant,
    /// Number of new samples below the window since then.
    below: u32,
    /// Time at which the last of them was counted.
    counted_at: Instant,
    /// Received numbers that the writer may never have reached, newest first; 0 marks an empty place.
    doubtful: [i64; DOUBTFUL],
    /// Position of the writer's last sample among the samples of all writers.
    turn: u64,
}

/// A window of sequence numbers.
#[derive(Debug, Clone, Copy)]
struct Numbers {
    /// The highest number of the window.
    highest: i64,
    /// Bit n: `highest - n` was received.
    bits: u64,
    /// The lowest number received since the window began.
    lowest: i64,
    /// Number of samples received since the window began.
    count: u32,
}

impl DuplicateFilter {
    /// Records a sample received at `now` and classifies it.
    pub(super) fn take(&mut self, guid: Guid, number: i64, now: Instant) -> Receipt {
        self.turn += 1;
        let turn = self.turn;
        if let Some(writer) = self.writers.get_mut(&guid) {
            writer.turn = turn;
            return writer.take(number, now);
        }
        self.forget_one();
        let received = Numbers::of(number);
        let writer = KnownWriter {
            received,
            before: Some(Numbers::NONE),
            ahead: None,
            highest_at: now,
            below: 0,
            counted_at: now,
            doubtful: [0; DOUBTFUL],
            turn,
        };
        self.writers.insert(guid, writer);
        Receipt::First
    }

    fn forget_one(&mut self) {
        if self.writers.len() >= MAX_WRITERS
            && let Some(oldest) =
                self.writers.iter().min_by_key(|(_, writer)| writer.turn).map(|(guid, _)| *guid)
        {
            self.writers.remove(&oldest);
        }
    }
}

impl KnownWriter {
    fn take(&mut self, number: i64, now: Instant) -> Receipt {
        if self.doubtful.contains(&number) {
            return Receipt::Again;
        }
        if number > self.received.highest {
            self.go_on_to(number);
            (self.highest_at, self.below) = (now, 0);
            let is_known = self.ahead.is_some_and(|ahead| ahead.has(number));
            return if is_known { Receipt::Again } else { Receipt::First };
        }
        if self.received.has_in_window(number) {
            return if self.received.record(number) { Receipt::First } else { Receipt::Again };
        }
        let is_believed = now.saturating_duration_since(self.highest_at) < BELIEVED;
        let Some(before) = self.before.as_mut().filter(|_| !is_believed && number < self.received.lowest)
        else {
            return Receipt::Again;
        };
        let is_new = number > before.highest || before.has_in_window(number);
        if !is_new || !before.record(number) {
            return Receipt::Again;
        }
        if self.below == 0 || now.saturating_duration_since(self.counted_at) >= BURST {
            (self.below, self.counted_at) = (self.below + 1, now);
        }
        if self.below < SEVERAL {
            return Receipt::Again;
        }
        (self.ahead, self.received, self.before) = (Some(self.received), *before, None);
        (self.highest_at, self.below) = (now, 0);
        Receipt::TakenAnew
    }

    /// Records a number above the highest one. If it is more than a window ahead, the numbers received before
    /// are kept, unless they are so few that they may themselves be far ahead of the writer.
    fn go_on_to(&mut self, number: i64) {
        if number.saturating_sub(self.received.highest) < WINDOW {
            self.received.record(number);
            return;
        }
        if self.received.count >= SEVERAL {
            self.before = Some(self.received);
        } else {
            for number in self.received.numbers() {
                self.doubtful.rotate_right(1);
                self.doubtful[0] = number;
            }
        }
        self.received = Numbers::of(number);
    }
}

impl Numbers {
    /// Sequence numbers begin with 1.
    const NONE: Self = Self { highest: 0, bits: 0, lowest: i64::MAX, count: 0 };

    fn of(number: i64) -> Self {
        Self { highest: number, bits: 1, lowest: number, count: 1 }
    }

    fn has_in_window(&self, number: i64) -> bool {
        number <= self.highest && self.highest.saturating_sub(number) < WINDOW
    }

    /// Returns the numbers of the window that were received.
    fn numbers(self) -> impl Iterator<Item = i64> {
        let ages = (0..WINDOW).filter(move |age| self.bits >> age & 1 == 1);
        ages.map(move |age| self.highest.saturating_sub(age))
    }

    /// Returns true if a number was received or counts as received.
    fn has(&self, number: i64) -> bool {
        let age = u32::try_from(self.highest.saturating_sub(number)).unwrap_or(u32::MAX);
        let is_recorded = 1_u64.checked_shl(age).is_none_or(|bit| self.bits & bit != 0);
        (self.lowest..=self.highest).contains(&number) && is_recorded
    }

    /// Records a number in the window or above it; returns true if it is new.
    fn record(&mut self, number: i64) -> bool {
        if number > self.highest {
            let shift = u32::try_from(number.saturating_sub(self.highest)).unwrap_or(u32::MAX);
            self.bits = self.bits.checked_shl(shift).unwrap_or(0);
            self.highest = number;
        }
        let age = u32::try_from(self.highest.saturating_sub(number)).unwrap_or(u32::MAX);
        let bit = 1_u64.checked_shl(age).unwrap_or(0);
        let is_first = self.bits & bit == 0;
        self.bits |= bit;
        self.lowest = self.lowest.min(number);
        self.count = self.count.saturating_add(u32::from(is_first));
        is_first
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    fn guid(number: u16) -> Guid {
        let mut bytes = [0; 16];
        bytes[..2].copy_from_slice(&number.to_be_bytes());
        bytes
    }

    /// Returns the receipts of one writer's samples, each given as a number and a time in ms.
    fn receipts(samples: impl IntoIterator<Item = (i64, u64)>) -> Vec<Receipt> {
        let (start, mut duplicate_filter) = (Instant::now(), DuplicateFilter::default());
        let take = |(number, ms)| duplicate_filter.take(guid(1), number, start + Duration::from_millis(ms));
        samples.into_iter().map(take).collect()
    }

    /// Returns the given numbers that count as new; all of them arrive at once.
    fn first(numbers: &[i64]) -> Vec<i64> {
        let receipts = receipts(numbers.iter().map(|number| (*number, 0)));
        let pairs = numbers.iter().zip(receipts);
        pairs.filter(|(_, receipt)| *receipt != Receipt::Again).map(|(number, _)| *number).collect()
    }

    #[test]
    fn each_number_is_first_once_in_whatever_order() {
        assert_eq!(first(&[5, 5, 6, 4, 6, 4, 5, 9, 7, 8, 7]), [5, 6, 4, 9, 7, 8]);
        assert_eq!(first(&[100, 37, 36, 37]), [100, 37], "64 below the highest is too old to be told apart");
        assert_eq!(first(&[1, i64::MAX, i64::MIN, 1]), [1, i64::MAX]);
        assert_eq!(first(&[1, 64, 65, 1, 2]), [1, 64, 65, 2]);
    }

    #[test]
    fn writers_do_not_share_numbers_and_are_bounded() {
        let (now, mut duplicate_filter) = (Instant::now(), DuplicateFilter::default());
        let mut is_first = |writer| duplicate_filter.take(guid(writer), 1, now) == Receipt::First;
        let most = u16::try_from(MAX_WRITERS).unwrap();
        assert!((0..most).all(&mut is_first));
        assert!(!is_first(0));
        assert!(is_first(most), "replaces writer 1");
        assert!(!is_first(0) && is_first(1));
        assert_eq!(duplicate_filter.writers.len(), MAX_WRITERS);
    }

    /// Simulates a writer of ten samples per second, with one forged number under its identity after `after`
    /// samples. Returns the writer's samples that count as new, and whether a restart was detected.
    fn with_forged(after: i64, forged: i64, samples: i64) -> (Vec<i64>, bool) {
        let own = |number: i64| (number, number.unsigned_abs() * 100);
        let all = (1..=after).map(own).chain([(forged, after.unsigned_abs() * 100 + 1)]);
        let all: Vec<_> = all.chain((after + 1..=samples).map(own)).collect();
        let receipts = receipts(all.iter().copied());
        let carried_out = all.iter().zip(&receipts).filter(|(_, receipt)| **receipt != Receipt::Again);
        (carried_out.map(|((number, _), _)| *number).collect(), receipts.contains(&Receipt::TakenAnew))
    }

    #[test]
    fn a_writer_that_goes_on_below_a_number_far_ahead_is_taken_anew_after_a_second() {
        for (after, forged) in [(0, 1 << 62), (1, 1 << 62), (20, i64::MAX), (20, 1_000)] {
            let (carried_out, is_anew) = with_forged(after, forged, 60);
            let expected: Vec<_> = (1..=after).chain([forged]).chain(after + 13..=60).collect();
            assert_eq!(carried_out, expected, "{forged} after {after}");
            assert!(is_anew);
        }
        // If the window still contains the next numbers, it does no harm.
        for forged in [83, 84] {
            let all: Vec<_> = (1..=20).chain([forged]).chain(21..=60).collect();
            assert_eq!(with_forged(20, forged, 60), (all, false));
        }
    }

    #[test]
    fn two_numbers_far_ahead_are_as_harmless_as_one() {
        let forged = [(1_000_000, 1_001), (2_000_000, 1_002)];
        let own = |numbers: std::ops::RangeInclusive<i64>| {
            numbers.map(|number| (number, number.unsigned_abs() * 100))
        };
        let receipts = receipts(own(1..=10).chain(forged).chain(own(11..=40)));
        assert_eq!(receipts.iter().filter(|receipt| **receipt == Receipt::TakenAnew).count(), 1);
        assert_eq!(receipts.last(), Some(&Receipt::First));
    }

    #[test]
    fn what_a_transient_local_writer_keeps_is_carried_out_once_whenever_it_comes_again() {
        // A thousand samples, of which a hundred were lost in an outage of 10 s; all are resent repeatedly.
        let own = |number: i64| (number, number.unsigned_abs() * 100);
        let received = (500..=900).chain(1_000..=1_500).map(own);
        let kept = |at: u64| (500..=1_500).map(move |number| (number, at));
        let receipts = receipts(received.clone().chain(kept(160_000)).chain(kept(200_000)));
        assert!(receipts.iter().take(902).all(|receipt| *receipt == Receipt::First));
        let again = receipts.iter().skip(902).filter(|receipt| **receipt != Receipt::Again).count();
        // Only samples that were never received may count as new.
        assert!(again <= 99, "{again}");
    }

    #[test]
    fn a_writer_that_is_seldom_heard_is_carried_out_once_as_well() {
        let (received, kept) = ([(3, 0), (67, 0), (200, 1_000)], (1..=200).map(|number| (number, 5_000)));
        let receipts = receipts(received.into_iter().chain(kept));
        assert_eq!(receipts[..3], [Receipt::First; 3]);
        let again = |number: usize| receipts[2 + number] == Receipt::Again;
        assert!(again(3) && again(67) && again(200));
    }

    /// An event on the way from a writer to its reader.
    #[derive(Debug, Clone)]
    enum Event {
        /// The next sample arrives this many ms after the last event.
        Next(u64),
        /// This many samples are lost, and some arrive.
        Lost(i64),
        /// The last samples are resent after a time.
        Kept(i64, u64),
    }

    fn events() -> impl Strategy<Value = Vec<Event>> {
        let event = prop_oneof![
            6 => (0..300_u64).prop_map(Event::Next),
            1 => (1..400_i64).prop_map(Event::Lost),
            1 => (1..1_500_i64, 0..20_000_u64).prop_map(|(count, ms)| Event::Kept(count, ms)),
        ];
        prop::collection::vec(event, 1..400)
    }

    proptest! {
        /// Against a memory of all numbers: nothing is carried out twice, and each next sample is carried
        /// out.
        #[test]
        fn nothing_is_carried_out_twice(events in events()) {
            let (start, mut duplicate_filter) = (Instant::now(), DuplicateFilter::default());
            let (mut ms, mut number, mut carried_out) = (0, 0, BTreeSet::new());
            for event in events {
                let numbers = match event {
                    Event::Next(pause) => {
                        (ms, number) = (ms + pause, number + 1);
                        number..=number
                    }
                    Event::Lost(count) => {
                        let first = number + count;
                        number = first + i64::from(SEVERAL) - 1;
                        first..=number
                    }
                    Event::Kept(count, pause) => {
                        ms += pause;
                        (number - count).max(0) + 1..=number
                    }
                };
                for number in numbers.clone() {
                    let receipt = duplicate_filter.take(guid(1), number, start + Duration::from_millis(ms));
                    if receipt != Receipt::Again {
                        prop_assert!(carried_out.insert(number), "{} again", number);
                    }
                }
                prop_assert!(carried_out.contains(numbers.end()) || number == 0, "{} was left out", number);
            }
        }

        /// Whatever came before: a writer of ten samples a second is followed within two after a number far
        /// ahead.
        #[test]
        fn a_number_far_ahead_costs_two_seconds_at_most(before in events(), far in 64..i64::MAX / 2) {
            let (start, mut duplicate_filter) = (Instant::now(), DuplicateFilter::default());
            let (mut ms, mut number) = (0, 0);
            let mut take = |number: i64, ms: u64| {
                duplicate_filter.take(guid(1), number, start + Duration::from_millis(ms))
            };
            for event in before {
                match event {
                    Event::Next(pause) => {
                        (ms, number) = (ms + pause, number + 1);
                        take(number, ms);
                    }
                    Event::Lost(count) => number += count,
                    Event::Kept(..) => {}
                }
            }
            // Some in a row, as a writer that is followed sends them.
            for _ in 0..SEVERAL {
                (ms, number) = (ms + 100, number + 1);
                take(number, ms);
            }
            take(number + far, ms);
            for _ in 0..20 {
                (ms, number) = (ms + 100, number + 1);
                take(number, ms);
            }
            prop_assert_eq!(take(number + 1, ms + 100), Receipt::First);
        }
    }
}
