//! Stale messages: what a sender keeps for late readers (transient local), or a network delivers long
//! after it was sent. They were said for another time, so the first one is not carried out.

use std::time::Duration;

use crate::core::time::{MonoTime, Now, WallStamp};

/// What is kept is handed over in one go; the next message of a sender that lives comes later.
const BURST: Duration = Duration::from_millis(50);

/// Tells what a sender says now from what it said before.
#[derive(Debug, Clone)]
pub(super) struct StaleMessageFilter {
    started: WallStamp,
    /// When a message came that seemed to be that are stale.
    suspected_at: Option<MonoTime>,
}

impl StaleMessageFilter {
    /// Nobody was listened to before `started`.
    pub(super) fn before(started: WallStamp) -> Self {
        Self { started, suspected_at: None }
    }

    /// Whether a message is not to be used: nothing was heard before, or not for longer than `limit`, and its
    /// stamp is as old as that. A sender that goes on is believed whatever its clock says, from its second
    /// message on; one that gives no stamps (zero) from the first.
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
    fn held_back(messages: &[(u64, i64)]) -> Vec<bool> {
        let wall = |ms: i64| WallStamp::from_nanos((100_000 + ms) * 1_000_000);
        let mut stale = StaleMessageFilter::before(wall(0));
        let mut heard = None::<MonoTime>;
        let take = |(ms, stamp): &(u64, i64)| {
            let now = Now { mono: MonoTime::from_millis(*ms), wall: wall(i64::try_from(*ms).unwrap()) };
            let is_active = heard.is_some_and(|at| now.mono.since(at) <= LIMIT);
            let held_back = stale.rejects_as_stale(is_active, wall(*stamp), LIMIT, now);
            heard = if held_back { heard } else { Some(now.mono) };
            held_back
        };
        messages.iter().map(take).collect()
    }

    #[test]
    fn what_was_said_before_the_start_is_held_back_and_a_sender_that_goes_on_is_believed() {
        assert_eq!(held_back(&[(10, -1), (110, 100)]), [true, false]);
        assert_eq!(held_back(&[(10, 5)]), [false], "said since the start");
        assert_eq!(held_back(&[(10, 90_000)]), [false], "a clock ahead is no past");
        let other_clock: Vec<_> = (0..5).map(|n| (10 + n * 100, -90_000)).collect();
        assert_eq!(held_back(&other_clock), [true, false, false, false, false]);
        let without_stamps = -100_000;
        assert_eq!(held_back(&[(10, without_stamps), (60_000, without_stamps)]), [false, false]);
    }

    #[test]
    fn several_that_are_handed_over_at_once_are_all_held_back() {
        assert_eq!(held_back(&[(10, -900), (12, -800), (59, -700), (60, -600)]), [true, true, true, false]);
        assert_eq!(held_back(&[(10, -900), (60_000, -800)]), [true, false], "a sender that speaks seldom");
    }

    #[test]
    fn after_a_silence_only_a_late_message_is_held_back() {
        assert_eq!(held_back(&[(10, 10), (5000, 3999), (5100, 5100)]), [false, true, false]);
        assert_eq!(
            held_back(&[(10, 10), (5000, 4000)]),
            [false, false],
            "as old as the limit is not too old"
        );
        assert_eq!(
            held_back(&[(10, 10), (1000, 10)]),
            [false, false],
            "a sender that speaks may repeat itself"
        );
    }
}
