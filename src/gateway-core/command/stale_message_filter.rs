//! Filters out messages of a topic that were meant for another time: messages stored for late joiners
//! (transient local), delivered long after they were sent, or overtaken by a later message.
//!
//! Messages of each writer are ordered by sequence number. Stamps of different writers are never compared,
//! and a stamp affects only the first messages of a writer after silence, so a wrong clock cannot silence an
//! active writer.

use std::time::Duration;

use super::origin::{SampleId, WriterId};
use gateway_base::time::{MonoTime, Now, WallStamp};

/// Stored messages arrive in one burst; the next message of an active sender arrives later.
const BURST: Duration = Duration::from_millis(50);

/// Largest number of remembered writers; the writer with the oldest message is forgotten first.
const MAX_WRITERS: usize = 16;

/// Longest time for which a message causes earlier messages to be rejected, so that a writer that restarts
/// under its old identity is soon accepted.
const MAX_ORDER_MEMORY: Duration = Duration::from_secs(1);

/// Reason why a message was meant for another time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Untimely {
    /// A later message of the same writer was received first.
    Overtaken,
    /// Its writer was not active, and its stamp is older than the limit or precedes the start.
    Stale,
}

/// Recognises untimely messages of one topic.
#[derive(Debug, Clone)]
pub(super) struct StaleMessageFilter {
    started: WallStamp,
    limit: Duration,
    writers: Vec<WriterHistory>,
}

#[derive(Debug, Clone, Copy)]
struct WriterHistory {
    id: WriterId,
    last_received: MonoTime,
    /// Sequence number and receive time of the last message that was used.
    last_used: Option<(i64, MonoTime)>,
    /// Receive time of the first message of the current burst of stale messages.
    suspected_at: Option<MonoTime>,
}

impl StaleMessageFilter {
    /// Creates a filter for a topic subscribed to since `started`. A writer is active for `limit` after each
    /// used message.
    pub(super) fn new(started: WallStamp, limit: Duration) -> Self {
        Self { started, limit, writers: Vec::new() }
    }

    /// Checks a message; `Ok` if it is to be used. From its second message on, a writer is accepted
    /// regardless of its clock; a message without a stamp (zero) or with `ignores_stamp` is accepted
    /// immediately.
    pub(super) fn check(
        &mut self,
        sample: SampleId,
        stamp: WallStamp,
        ignores_stamp: bool,
        now: Now,
    ) -> Result<(), Untimely> {
        let (is_old, limit) = (!ignores_stamp && self.is_old(stamp, now), self.limit);
        let writer = self.writer(sample.writer, now.mono);
        let used_within = |limit| writer.last_used.filter(|(_, at)| now.mono.since(*at) <= limit);
        let is_active = used_within(limit).is_some();
        if used_within(limit.min(MAX_ORDER_MEMORY)).is_some_and(|(newest, _)| sample.sequence <= newest) {
            return Err(Untimely::Overtaken);
        }
        let waited = writer.suspected_at.map(|at| now.mono.since(at));
        if !is_active && is_old && waited.is_none_or(|waited| waited < BURST) {
            writer.suspected_at = writer.suspected_at.or(Some(now.mono));
            return Err(Untimely::Stale);
        }
        writer.suspected_at = None;
        writer.last_used = Some((sample.sequence, now.mono));
        Ok(())
    }

    /// Returns true if a stamp is older than the limit or precedes the start.
    fn is_old(&self, stamp: WallStamp, now: Now) -> bool {
        let age_ns = now.wall.as_nanos().saturating_sub(stamp.as_nanos());
        let is_late = u64::try_from(age_ns).is_ok_and(|age_ns| Duration::from_nanos(age_ns) > self.limit);
        let is_earlier = stamp.as_nanos() < self.started.as_nanos();
        stamp != WallStamp::default() && (is_late || is_earlier)
    }

    /// Returns the history of a writer, which is created if needed.
    fn writer(&mut self, id: WriterId, now: MonoTime) -> &mut WriterHistory {
        let known = self.writers.iter().position(|writer| writer.id == id);
        let at = known.unwrap_or_else(|| {
            let oldest = self.writers.iter().enumerate().min_by_key(|(_, writer)| writer.last_received);
            let new = WriterHistory { id, last_received: now, last_used: None, suspected_at: None };
            match oldest.map(|(at, _)| at).filter(|_| self.writers.len() >= MAX_WRITERS) {
                Some(at) => {
                    self.writers[at] = new;
                    at
                }
                None => {
                    self.writers.push(new);
                    self.writers.len() - 1
                }
            }
        });
        let writer = &mut self.writers[at];
        writer.last_received = now;
        writer
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const LIMIT: Duration = Duration::from_secs(1);

    fn wall(ms: i64) -> WallStamp {
        WallStamp::from_nanos((100_000 + ms) * 1_000_000)
    }

    fn now(ms: u64) -> Now {
        Now { mono: MonoTime::from_millis(ms), wall: wall(i64::try_from(ms).unwrap()) }
    }

    fn sample(writer: u8, sequence: i64) -> SampleId {
        SampleId { writer: WriterId([writer; 16]), sequence }
    }

    /// Returns whether each message of one writer is rejected, given its receive time and stamp in ms since
    /// the start of the gateway at 100 s.
    fn rejected(messages: &[(u64, i64)]) -> Vec<bool> {
        let mut filter = StaleMessageFilter::new(wall(0), LIMIT);
        let mut sequence = 0;
        let take = |(ms, stamp): &(u64, i64)| {
            sequence += 1;
            filter.check(sample(1, sequence), wall(*stamp), false, now(*ms)).is_err()
        };
        messages.iter().map(take).collect()
    }

    #[test]
    fn a_message_from_before_the_start_is_rejected_and_a_sender_that_continues_is_accepted() {
        assert_eq!(rejected(&[(10, -1), (110, 100)]), [true, false]);
        assert_eq!(rejected(&[(10, 5)]), [false], "sent since the start");
        assert_eq!(rejected(&[(10, 90_000)]), [false], "a clock that is ahead");
        let other_clock: Vec<_> = (0..5).map(|n| (10 + n * 100, -90_000)).collect();
        assert_eq!(rejected(&other_clock), [true, false, false, false, false]);
        let without_stamps = -100_000;
        assert_eq!(rejected(&[(10, without_stamps), (60_000, without_stamps)]), [false, false]);
    }

    #[test]
    fn all_messages_of_one_burst_are_rejected() {
        assert_eq!(rejected(&[(10, -900), (12, -800), (59, -700), (60, -600)]), [true, true, true, false]);
        assert_eq!(rejected(&[(10, -900), (60_000, -800)]), [true, false], "a sender with a long period");
    }

    #[test]
    fn after_a_silence_only_a_late_message_is_rejected() {
        assert_eq!(rejected(&[(10, 10), (5000, 3999), (5100, 5100)]), [false, true, false]);
        assert_eq!(rejected(&[(10, 10), (5000, 4000)]), [false, false], "as old as the limit is not too old");
        assert_eq!(rejected(&[(10, 10), (1000, 10)]), [false, false], "an active sender may repeat itself");
    }

    #[test]
    fn messages_are_ordered_by_the_sequence_of_their_writer_until_it_was_silent() {
        let mut filter = StaleMessageFilter::new(wall(0), LIMIT);
        let mut check =
            |writer, sequence, ms| filter.check(sample(writer, sequence), wall(0), false, now(ms));
        assert_eq!(check(1, 7, 0), Ok(()));
        assert_eq!(check(1, 6, 10), Err(Untimely::Overtaken));
        assert_eq!(check(1, 7, 20), Err(Untimely::Overtaken), "the same message again");
        assert_eq!(check(2, 1, 30), Ok(()), "another writer has other numbers");
        assert_eq!(check(1, 8, 40), Ok(()));
        assert_eq!(check(1, 1, 1041), Err(Untimely::Stale), "it may have restarted, but its stamp is old");
        assert_eq!(check(1, 2, 1141), Ok(()));
    }

    #[test]
    fn an_active_writer_does_not_vouch_for_the_kept_message_of_another() {
        let mut filter = StaleMessageFilter::new(wall(0), LIMIT);
        let mut check = |writer, stamp| filter.check(sample(writer, 1), wall(stamp), false, now(20));
        assert_eq!((check(1, 10), check(2, -600_000)), (Ok(()), Err(Untimely::Stale)));
    }

    #[test]
    fn the_writer_that_was_silent_longest_is_forgotten_first() {
        let mut filter = StaleMessageFilter::new(wall(0), LIMIT);
        let many = u8::try_from(MAX_WRITERS).unwrap();
        for writer in 0..=many {
            assert_eq!(filter.check(sample(writer, 9), wall(0), false, now(u64::from(writer))), Ok(()));
        }
        assert_eq!(filter.writers.len(), MAX_WRITERS);
        let mut check = |writer| filter.check(sample(writer, 8), wall(0), false, now(50));
        assert_eq!(check(1), Err(Untimely::Overtaken));
        assert_eq!(check(0), Ok(()), "it is not known any more");
    }

    proptest! {
        /// Whatever the stamps are, and whatever other writers send meanwhile.
        #[test]
        fn no_stamp_rejects_the_second_message_of_a_writer_or_a_later_one(
            messages in prop::collection::vec((50_u64..900, any::<i64>(), any::<i64>(), any::<i64>()), 2..40),
        ) {
            let mut filter = StaleMessageFilter::new(wall(0), LIMIT);
            let mut mono = MonoTime::ZERO;
            for (sequence, (pause_ms, stamp, clock, other)) in (0..).zip(messages) {
                mono = mono.after(Duration::from_millis(pause_ms));
                // The clock of this host steps as well.
                let now = Now { mono, wall: WallStamp::from_nanos(clock) };
                let _ = filter.check(sample(2, sequence), WallStamp::from_nanos(other), false, now);
                let result = filter.check(sample(1, sequence), WallStamp::from_nanos(stamp), false, now);
                prop_assert!(result.is_ok() || sequence == 0, "message {sequence}: {result:?}");
                let urgent = filter.check(sample(3, sequence), WallStamp::from_nanos(stamp), true, now);
                prop_assert_eq!(urgent, Ok(()));
            }
        }
    }
}
