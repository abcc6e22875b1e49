//! Stale messages: what a sender keeps for late readers (transient local), or a network delivers long
//! after it was sent. They were meant for another time, so the first one is not used.

use std::time::Duration;

use crate::core::time::{MonoTime, Now, WallStamp};

/// Kept messages are delivered in one go; the next message of a sender that is alive comes later.
const BURST: Duration = Duration::from_millis(50);

/// Tells new messages of a sender from old ones.
#[derive(Debug, Clone)]
pub(super) struct StaleMessageFilter {
    started: WallStamp,
    /// When the first message of the present burst of stale ones was received.
    suspected_at: Option<MonoTime>,
}

impl StaleMessageFilter {
    /// A filter for a topic that is subscribed to since `started`.
    pub(super) fn before(started: WallStamp) -> Self {
        Self { started, suspected_at: None }
    }

    /// True if a message is not to be used: its sender was not active before (`is_active`), and its stamp is
    /// older than `limit` or from before the start. A sender that goes on is accepted whatever its clock shows,
    /// from its second message on; one without stamps (zero) from the first.
    pub(super) fn rejects_as_stale(
        &mut self,
        is_active: bool,
        stamp: WallStamp,
        limit: Duration,
        now: Now,
    ) -> bool {
        let age_ns = now.wall.as_nanos().saturating_sub(stamp.as_nanos());
        let is_old = u64::try_from(age_ns).is_ok_and(|age_ns| Duration::from_nanos(age_ns) > limit);
        let is_earlier = stamp.as_nanos() < self.started.as_nanos();
        let is_kept = stamp != WallStamp::default() && (is_old || is_earlier);
        let waited = self.suspected_at.map(|at| now.mono.since(at));
        if is_active || !is_kept || waited.is_some_and(|waited| waited >= BURST) {
            self.suspected_at = None;
            return false;
        }
        if waited.is_none() {
            self.suspected_at = Some(now.mono);
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_secs(1);

    /// The gateway started at 100 s; times in ms since then.
    fn rejected(messages: &[(u64, i64)]) -> Vec<bool> {
        let wall = |ms: i64| WallStamp::from_nanos((100_000 + ms) * 1_000_000);
        let mut stale = StaleMessageFilter::before(wall(0));
        let mut last_used = None::<MonoTime>;
        let take = |(ms, stamp): &(u64, i64)| {
            let now = Now { mono: MonoTime::from_millis(*ms), wall: wall(i64::try_from(*ms).unwrap()) };
            let is_active = last_used.is_some_and(|at| now.mono.since(at) <= LIMIT);
            let rejected = stale.rejects_as_stale(is_active, wall(*stamp), LIMIT, now);
            last_used = if rejected { last_used } else { Some(now.mono) };
            rejected
        };
        messages.iter().map(take).collect()
    }

    #[test]
    fn a_message_from_before_the_start_is_rejected_and_a_sender_that_goes_on_is_accepted() {
        assert_eq!(rejected(&[(10, -1), (110, 100)]), [true, false]);
        assert_eq!(rejected(&[(10, 5)]), [false], "sent since the start");
        assert_eq!(rejected(&[(10, 90_000)]), [false], "a clock ahead is no past");
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
}
