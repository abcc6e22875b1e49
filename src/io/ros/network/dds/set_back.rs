//! Whether the wall clock was set back, which a participant does not stand.
//!
//! RustDDS orders what a best-effort reader receives by the wall clock, and hands out what is not later than now. So after a step
//! back its readers give nothing until the time before the step has come again; the readers of a new participant do.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// A smaller step makes readers wait no longer than a busy computer does.
const MIN_STEP: Duration = Duration::from_millis(100);

/// The wall clock beside a clock that is never set.
#[derive(Debug)]
pub(super) struct SetBack {
    begun: Instant,
    /// By how much the wall clock was most ahead of the other.
    most_ahead: Duration,
}

impl SetBack {
    /// Starts to compare the clocks now.
    pub(super) fn watch() -> Self {
        let mut watched = Self { begun: Instant::now(), most_ahead: Duration::ZERO };
        watched.is_new();
        watched
    }

    /// True once for each step back since the last call.
    pub(super) fn is_new(&mut self) -> bool {
        let before = self.begun.elapsed();
        let wall = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        // A pause while the clocks are read says nothing of them.
        self.begun.elapsed().saturating_sub(before) < MIN_STEP / 10 && self.is_step_back(before, wall)
    }

    fn is_step_back(&mut self, passed: Duration, wall: Duration) -> bool {
        // Before 1970 and some hours nothing is a step.
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
        let mut watched = SetBack { begun: Instant::now(), most_ahead: Duration::from_secs(1000) };
        let mut is_step = |passed_s: f64, wall_s: f64| {
            watched.is_step_back(Duration::from_secs_f64(passed_s), Duration::from_secs_f64(wall_s))
        };
        // It runs, is 50 ms late, is set ahead by 60 s and back by 3600 s, and runs; then it is set back and ahead by 60 s.
        let times = [(1.0, 1001.0), (2.0, 1001.95), (3.0, 1063.0), (4.0, 1064.0)];
        assert!(times.into_iter().all(|(passed_s, wall_s)| !is_step(passed_s, wall_s)));
        assert!(is_step(5.0, 465.0));
        assert!(!is_step(6.0, 466.0) && is_step(7.0, 407.0) && !is_step(8.0, 468.0) && is_step(9.0, 468.8));
    }
}
