//! When a network side counts as dead, and when to start the next one.

use std::time::{Duration, Instant};

use crate::io::ros::link::Violation;

/// Time between two pings.
const PING_INTERVAL: Duration = Duration::from_millis(200);
/// Longest silence of a network side that works. On one busy processor an echo was seen to take more than a second, and
/// killing a healthy network side costs more than waiting for a deaf one. One that has ended is replaced at once.
const PATIENCE: Duration = Duration::from_secs(5);
/// Longest time until a network side has joined the network.
const START_PATIENCE: Duration = Duration::from_secs(10);
/// The most that counts of the time between two looks. When the whole computer is busy, or was suspended, this side does
/// not look often either, and the silence is not the other's.
const MAX_STEP: Duration = Duration::from_millis(200);

/// Waits for answers of one network side.
#[derive(Debug)]
pub(super) struct Liveness {
    last_look: Instant,
    /// Time that was seen to pass since the last answer.
    silence: Duration,
    patience: Duration,
    last_ping: Option<(u64, Instant)>,
    last_pong: u64,
}

impl Liveness {
    /// A network side that was started now.
    pub(super) fn new(now: Instant) -> Self {
        Self {
            last_look: now,
            silence: Duration::ZERO,
            patience: START_PATIENCE,
            last_ping: None,
            last_pong: 0,
        }
    }

    /// Notes that it has joined the network: from now on it is to answer.
    pub(super) fn joined(&mut self) {
        (self.silence, self.patience) = (Duration::ZERO, PATIENCE);
    }

    /// False once it has been silent for too long.
    pub(super) fn look(&mut self, now: Instant) -> bool {
        self.silence += now.saturating_duration_since(self.last_look).min(MAX_STEP);
        self.last_look = now;
        self.silence <= self.patience
    }

    /// The number of a ping, when one is due.
    pub(super) fn next_ping(&mut self, now: Instant) -> Option<u64> {
        let number = match self.last_ping {
            Some((_, at)) if now.saturating_duration_since(at) < PING_INTERVAL => return None,
            Some((number, _)) => number + 1,
            None => 1,
        };
        self.last_ping = Some((number, now));
        Some(number)
    }

    /// Notes an answer, which may be to any ping since the last one.
    pub(super) fn pong(&mut self, number: u64) -> Result<(), Violation> {
        let sent = self.last_ping.map_or(0, |(number, _)| number);
        if number <= self.last_pong || number > sent {
            return Err(Violation::OutOfTurn);
        }
        (self.last_pong, self.silence) = (number, Duration::ZERO);
        Ok(())
    }
}

/// The delay before the first of a row of restarts.
const MIN_DELAY: Duration = Duration::from_millis(100);
/// The longest delay: reports are back within two seconds after an attack, however long it was.
const MAX_DELAY: Duration = Duration::from_millis(1600);
/// A network side of this age was healthy.
const HEALTHY: Duration = Duration::from_secs(60);

/// Delays between the end of a network side and the start of the next, which double from one to the next.
#[derive(Debug)]
pub(super) struct RestartDelay(Duration);

impl Default for RestartDelay {
    fn default() -> Self {
        Self(MIN_DELAY)
    }
}

impl RestartDelay {
    /// The delay after the end of a network side of this age; none that never joined the network has an age.
    pub(super) fn next(&mut self, age: Option<Duration>) -> Duration {
        if age.is_some_and(|age| age >= HEALTHY) {
            self.0 = MIN_DELAY;
        }
        let delay = self.0;
        self.0 = (delay * 2).min(MAX_DELAY);
        delay
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn silence_counts_from_the_last_answer() {
        let start = Instant::now();
        let mut liveness = Liveness::new(start);
        liveness.joined();
        let mut alive_until = 0;
        for at in (0..10_000).step_by(50) {
            let now = start + ms(at);
            if let Some(ping) = liveness.next_ping(now).filter(|_| at < 3_000) {
                liveness.pong(ping).unwrap();
            }
            if !liveness.look(now) {
                break;
            }
            alive_until = at;
        }
        assert_eq!(alive_until, 2_800 + 4_950);
    }

    #[test]
    fn one_that_starts_has_more_time() {
        let start = Instant::now();
        let mut liveness = Liveness::new(start);
        assert!((1..=100).all(|tick| liveness.look(start + ms(tick * 100))));
        assert!(!liveness.look(start + ms(10_100)));
    }

    #[test]
    fn time_in_which_nobody_polled_is_not_its_silence() {
        let start = Instant::now();
        let mut liveness = Liveness::new(start);
        liveness.joined();
        for pause in 1..=25 {
            assert!(liveness.look(start + ms(pause * 60_000)), "look {pause}");
        }
        assert!(!liveness.look(start + ms(26 * 60_000)));
    }

    #[test]
    fn answers_to_pings_that_were_not_sent_or_answered_before_are_violations() {
        let now = Instant::now();
        let mut liveness = Liveness::new(now);
        assert_eq!(liveness.pong(1), Err(Violation::OutOfTurn));
        assert_eq!(liveness.next_ping(now), Some(1));
        assert_eq!(liveness.next_ping(now), None);
        assert_eq!(liveness.next_ping(now + PING_INTERVAL), Some(2));
        assert_eq!(liveness.next_ping(now + PING_INTERVAL * 2), Some(3));
        assert_eq!(liveness.pong(2), Ok(()));
        for number in [0, 1, 2, 4, u64::MAX] {
            assert_eq!(liveness.pong(number), Err(Violation::OutOfTurn), "{number}");
        }
        assert_eq!(liveness.pong(3), Ok(()));
    }

    #[test]
    fn delays_grow_until_one_was_healthy() {
        let mut delay = RestartDelay::default();
        let mut after = |age: Option<u64>| delay.next(age.map(Duration::from_secs)).as_millis();
        let first: Vec<_> = (0..7).map(|_| after(Some(1))).collect();
        assert_eq!(first, [100, 200, 400, 800, 1600, 1600, 1600]);
        assert_eq!(after(None), 1600);
        assert_eq!([after(Some(60)), after(Some(59))], [100, 200]);
    }
}
