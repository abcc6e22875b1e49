//! The clock of a simulator, which other nodes follow with `use_sim_time`
//! (docs/spec/traffic-lights.md, "Simulated clock").
//!
//! Its messages are events: no time passes between two of them. It can stand still, run at any speed, and
//! restart when a recording is repeated.

use std::time::Duration;

use gateway_base::time::{MonoTime, Now, WallStamp, deadline_after};

/// Maximum step back that counts as an overtaken message rather than a restart, nanoseconds.
const MAX_OVERTAKEN_NANOS: i64 = 1_000_000_000;
/// Time without messages, on the gateway's own clock, after which the clock is reported as silent.
const SILENCE: Duration = Duration::from_secs(5);

/// The clock of a simulator, from its messages.
#[derive(Debug, Clone, Default)]
pub(super) struct SimulatedClock {
    /// `None` before the first message.
    latest: Option<ClockState>,
    pub(super) restarts: u64,
    /// Number of messages that were ignored because a newer message had overtaken them.
    pub(super) overtaken: u64,
}

#[derive(Debug, Clone, Copy)]
struct ClockState {
    /// Stamp of the first message since the last restart, nanoseconds.
    begin: i64,
    present: i64,
    /// The time at which the last message was received.
    received: MonoTime,
}

impl SimulatedClock {
    /// Processes a message of the clock received at `now`. Returns true if time begins, or restarts: then all
    /// earlier state is void.
    pub(super) fn handle(&mut self, stamp: WallStamp, now: MonoTime) -> bool {
        let stamp = stamp.as_nanos();
        match &mut self.latest {
            Some(latest) if latest.present.saturating_sub(stamp) <= MAX_OVERTAKEN_NANOS => {
                latest.received = now;
                self.overtaken += u64::from(stamp < latest.present);
                latest.present = latest.present.max(stamp);
                false
            }
            before => {
                self.restarts += u64::from(before.is_some());
                self.latest = Some(ClockState { begin: stamp, present: stamp, received: now });
                true
            }
        }
    }

    /// Returns the present time; `None` before the first message. Its monotonic part is the time since the
    /// beginning.
    pub(super) fn now(&self) -> Option<Now> {
        let ClockState { begin, present, .. } = self.latest?;
        let mono = MonoTime::from_nanos(present.abs_diff(begin));
        Some(Now { mono, wall: WallStamp::from_nanos(present) })
    }

    /// Returns whether messages have stopped. A clock that stands still continues to send them.
    pub(super) fn is_silent(&self, now: MonoTime) -> bool {
        self.latest.is_some_and(|latest| now.since(latest.received) > SILENCE)
    }

    /// Returns the time at which it becomes silent unless a message is received; `None` if it is silent
    /// already, or before the first message.
    pub(super) fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        self.latest.map(|latest| deadline_after(latest.received, SILENCE)).filter(|at| *at > now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    #[test]
    fn time_counts_from_the_first_message_and_from_each_new_beginning() {
        let mut clock = SimulatedClock::default();
        assert_eq!(clock.now(), None);
        // Stamp, whether time begins, time since the beginning and present stamp, seconds.
        for (received_s, (stamp, begins, since, present)) in (0..).zip([
            (100, true, 0, 100),
            (110, false, 10, 110),
            (110, false, 10, 110),
            (109, false, 10, 110),
            (120, false, 20, 120),
            (50, true, 0, 50),
            (51, false, 1, 51),
        ]) {
            let received = MonoTime::from_millis(received_s * 1_000);
            assert_eq!(clock.handle(WallStamp::from_nanos(stamp * SECOND), received), begins, "{received_s}");
            let now = clock.now().unwrap();
            assert_eq!((now.mono.as_nanos(), now.wall.as_nanos()), (since * 1_000_000_000, present * SECOND));
        }
        assert_eq!((clock.restarts, clock.overtaken), (1, 1));
    }

    #[test]
    fn a_clock_that_stands_still_is_not_silent() {
        let mut clock = SimulatedClock::default();
        assert!(!clock.is_silent(MonoTime::from_millis(60_000)));
        for ms in [0, 4_000, 8_000] {
            clock.handle(WallStamp::from_nanos(SECOND), MonoTime::from_millis(ms));
        }
        assert!(!clock.is_silent(MonoTime::from_millis(13_000)));
        let at = clock.next_deadline(MonoTime::from_millis(13_000)).unwrap();
        assert!(clock.is_silent(at));
        assert_eq!(clock.next_deadline(at), None);
    }

    #[test]
    fn no_stamp_brings_it_down() {
        let mut clock = SimulatedClock::default();
        for stamp in [i64::MAX, i64::MIN, 0, i64::MAX, -1, i64::MIN] {
            clock.handle(WallStamp::from_nanos(stamp), MonoTime::ZERO);
            assert!(clock.now().is_some());
        }
    }
}
