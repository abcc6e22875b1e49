//! The clock of a simulator, which other nodes follow with `use_sim_time`
//! (docs/spec/traffic-lights.md, "Simulated clock").
//!
//! Its messages are events: between two of them no time passes. It can stand still, run at any speed, and begin anew
//! when a recording is repeated.

use std::time::Duration;

use crate::core::time::{MonoTime, Now, WallStamp, deadline_after};

/// The largest step back that is a message overtaken by another, and not a new beginning.
const MAX_OVERTAKEN_NANOS: i64 = 1_000_000_000;
/// The time of the gateway's own clock after which a clock without messages is reported.
const SILENCE: Duration = Duration::from_secs(5);

/// The effect of a message of the clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ClockStep {
    /// Time begins, or begins anew: what was before does not count.
    Begins,
    /// Time goes on, or stands still.
    GoesOn,
    /// The message was overtaken by a newer one, so it has no effect.
    Overtaken,
}

/// The clock of a simulator, as its messages give it.
#[derive(Debug, Clone, Default)]
pub(super) struct SimulatedClock {
    /// `None` before the first message.
    run: Option<Run>,
    /// The number of times that it began anew.
    pub(super) restarts: u64,
    /// The number of messages that were overtaken.
    pub(super) overtaken: u64,
}

#[derive(Debug, Clone, Copy)]
struct Run {
    /// Its first and its present time, nanoseconds.
    begin: i64,
    present: i64,
    /// The time at which its last message was received.
    received: MonoTime,
}

impl SimulatedClock {
    /// Takes a message of the clock that was received at `now`.
    pub(super) fn handle(&mut self, stamp: WallStamp, now: MonoTime) -> ClockStep {
        let present = stamp.as_nanos();
        let begin = match self.run {
            Some(run) if present >= run.present => run.begin,
            Some(mut run) if run.present.saturating_sub(present) <= MAX_OVERTAKEN_NANOS => {
                run.received = now;
                self.run = Some(run);
                self.overtaken += 1;
                return ClockStep::Overtaken;
            }
            before => {
                self.restarts += u64::from(before.is_some());
                self.run = Some(Run { begin: present, present, received: now });
                return ClockStep::Begins;
            }
        };
        self.run = Some(Run { begin, present, received: now });
        ClockStep::GoesOn
    }

    /// The present time; `None` before the first message. Its monotonic part counts from the beginning.
    pub(super) fn now(&self) -> Option<Now> {
        let Run { begin, present, .. } = self.run?;
        let mono = MonoTime::from_nanos(present.abs_diff(begin));
        Some(Now { mono, wall: WallStamp::from_nanos(present) })
    }

    /// Returns whether messages have stopped. A clock that stands still sends them.
    pub(super) fn is_silent(&self, now: MonoTime) -> bool {
        self.run.is_some_and(|run| now.since(run.received) > SILENCE)
    }

    /// The time at which it becomes silent if no message is received; `None` when it has, or never spoke.
    pub(super) fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        self.run.map(|run| deadline_after(run.received, SILENCE)).filter(|at| *at > now)
    }
}

#[cfg(test)]
mod tests {
    use super::ClockStep::{Begins, GoesOn, Overtaken};
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    #[test]
    fn time_counts_from_the_first_message_and_from_each_new_beginning() {
        let mut clock = SimulatedClock::default();
        assert_eq!(clock.now(), None);
        let mut steps = Vec::new();
        for (received_s, stamp) in [(0, 100), (1, 110), (2, 110), (3, 109), (4, 120), (5, 50), (6, 51)] {
            let step =
                clock.handle(WallStamp::from_nanos(stamp * SECOND), MonoTime::from_millis(received_s * 1000));
            let now = clock.now().unwrap();
            assert_eq!(now.wall.as_nanos() / SECOND, if step == Overtaken { 110 } else { stamp });
            steps.push((step, now.mono.as_nanos() / 1_000_000_000));
        }
        let expected = [
            (Begins, 0),
            (GoesOn, 10),
            (GoesOn, 10),
            (Overtaken, 10),
            (GoesOn, 20),
            (Begins, 0),
            (GoesOn, 1),
        ];
        assert_eq!(steps, expected);
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
