//! Detects that the wall clock was set back, which a participant cannot handle.
//!
//! RustDDS orders the samples of a best-effort reader by the wall clock, and returns only those not later
//! than now. So after a step back its readers return nothing until the clock has reached the time before the
//! step again; a new participant's readers do.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// A smaller step delays readers no longer than a busy computer does.
const MIN_STEP: Duration = Duration::from_millis(100);
/// Minimum time between two reactions when the clock is set back repeatedly. Until the reaction no echo
/// arrives, so this is well below the second of silence that the gateway tolerates.
const MIN_INTERVAL: Duration = Duration::from_millis(400);

/// Compares the wall clock with a clock that is never set.
#[derive(Debug)]
pub(super) struct SetBack {
    begun: Instant,
    /// Maximum lead of the wall clock over the other.
    most_ahead: Duration,
    /// There was a step back without a reaction so far.
    is_unfollowed: bool,
    /// Time of the last due reaction, since the start.
    last_due: Option<Duration>,
}

impl SetBack {
    pub(super) fn watch() -> Self {
        let begun = Instant::now();
        let mut watched = Self { begun, most_ahead: Duration::ZERO, is_unfollowed: false, last_due: None };
        watched.is_to_follow();
        watched
    }

    /// Returns true when a reaction to a step back is due, and again at intervals until
    /// [`Self::note_followed`].
    pub(super) fn is_to_follow(&mut self) -> bool {
        let before = self.begun.elapsed();
        let wall = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        // A pause while the clocks are read makes the comparison useless.
        if self.begun.elapsed().saturating_sub(before) < MIN_STEP / 10 {
            self.is_unfollowed |= self.is_step_back(before, wall);
        }
        self.is_due(before)
    }

    /// Records that a participant was created since the step.
    pub(super) fn note_followed(&mut self) {
        self.is_unfollowed = false;
    }

    fn is_due(&mut self, passed: Duration) -> bool {
        let has_waited = self.last_due.is_none_or(|last| passed.saturating_sub(last) >= MIN_INTERVAL);
        let is_due = self.is_unfollowed && has_waited;
        if is_due {
            self.last_due = Some(passed);
        }
        is_due
    }

    fn is_step_back(&mut self, passed: Duration, wall: Duration) -> bool {
        // Within some hours of 1970 no step is detected.
        let ahead = wall.saturating_sub(passed);
        let is_step = ahead + MIN_STEP <= self.most_ahead;
        self.most_ahead = if is_step { ahead } else { self.most_ahead.max(ahead) };
        is_step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_step_back_is_seen_once_and_nothing_else_is_one() {
        let mut watched = SetBack { most_ahead: Duration::from_secs(1000), ..SetBack::watch() };
        let mut is_step = |passed_s: f64, wall_s: f64| {
            watched.is_step_back(Duration::from_secs_f64(passed_s), Duration::from_secs_f64(wall_s))
        };
        // It runs, is 50 ms late, is set ahead by 60 s and back by 3600 s, and runs; then it is set back and
        // ahead by 60 s.
        let times = [(1.0, 1001.0), (2.0, 1001.95), (3.0, 1063.0), (4.0, 1064.0)];
        assert!(times.into_iter().all(|(passed_s, wall_s)| !is_step(passed_s, wall_s)));
        assert!(is_step(5.0, 465.0));
        assert!(!is_step(6.0, 466.0) && is_step(7.0, 407.0) && !is_step(8.0, 468.0) && is_step(9.0, 468.8));
    }
    #[test]
    fn the_first_step_is_followed_at_once_and_the_next_ones_at_intervals() {
        let mut watched = SetBack { is_unfollowed: true, ..SetBack::watch() };
        let mut is_due = |now_ms| watched.is_due(Duration::from_millis(now_ms));
        assert!(is_due(1), "whatever else a participant was made for");
        assert!(!is_due(2) && !is_due(400) && is_due(401), "it was not followed");
        watched.note_followed();
        assert!(!watched.is_due(Duration::from_secs(9)));
        watched.is_unfollowed = true;
        assert!(watched.is_due(Duration::from_secs(9)));
    }
}
