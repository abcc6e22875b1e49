//! Steps of the wall clock, and their status. Published stamps depend on the wall clock, but no decision
//! does.

use std::time::Duration;

use super::catalogue::{self, WALL_CLOCK};
use gateway_base::diagnostics::Status;
use gateway_base::time::{MonoTime, Now};

/// Task of the status in diagnostics. A replay has no wall clock and therefore does not report this status.
pub const WALL_CLOCK_TASK: &str = "wall_clock";

/// Smallest change between two readings that counts as a step, ns; a slewed clock stays far below.
const MIN_STEP_NS: i64 = 10_000_000;
/// Time for which a step is shown as a warning.
const STEP_SHOWN: Duration = Duration::from_secs(10);

/// Detects steps of the wall clock relative to the monotonic clock.
#[derive(Debug, Clone, Copy)]
pub(super) struct WallClock {
    last_read: Now,
    steps: u64,
    /// The last step in ns, and when it was detected.
    last_step: Option<(i64, MonoTime)>,
}

impl WallClock {
    /// Creates a detector that has found no step until `now`.
    pub(super) fn new(now: Now) -> Self {
        Self { last_read: now, steps: 0, last_step: None }
    }

    /// Compares both clocks with their last readings; returns true if the wall clock has stepped since.
    pub(super) fn read(&mut self, now: Now) -> bool {
        let Now { mono, wall } = std::mem::replace(&mut self.last_read, now);
        let elapsed = i64::try_from(now.mono.since(mono).as_nanos()).unwrap_or(i64::MAX);
        let step_ns = now.wall.as_nanos().saturating_sub(wall.as_nanos()).saturating_sub(elapsed);
        if step_ns.saturating_abs() < MIN_STEP_NS {
            return false;
        }
        self.steps += 1;
        self.last_step = Some((step_ns, now.mono));
        true
    }

    /// Returns the status `wall_clock`.
    #[allow(clippy::cast_precision_loss)] // a step, rounded to milliseconds
    pub(super) fn status(&self, now: MonoTime) -> Status {
        let text = |step_ns: i64| format!("{:+.3}", step_ns as f64 / 1e9);
        let recent = self.last_step.filter(|(_, at)| now.since(*at) <= STEP_SHOWN);
        let message = recent.map_or_else(catalogue::steady, |(step_ns, _)| catalogue::stepped(text(step_ns)));
        let last_step = self.last_step.map_or("-".to_owned(), |(step_ns, _)| text(step_ns));
        let values = vec![("steps", self.steps.to_string()), ("last_step_s", last_step)];
        Status::new(&WALL_CLOCK, WALL_CLOCK_TASK, &[message], values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gateway_base::diagnostics::Level;
    use gateway_base::time::WallStamp;

    fn now(ms: u64, ahead_ms: i64) -> Now {
        let wall = (1_700_000_000_000 + i64::try_from(ms).unwrap() + ahead_ms) * 1_000_000;
        Now { mono: MonoTime::from_millis(ms), wall: WallStamp::from_nanos(wall) }
    }

    #[test]
    fn a_step_is_counted_and_a_warning_for_ten_seconds() {
        let mut clock = WallClock::new(now(0, 0));
        assert!(!clock.read(now(250, 0)));
        assert_eq!(clock.status(MonoTime::from_millis(250)).message, "steady");
        assert!(clock.read(now(500, -2000)));
        assert!(!clock.read(now(750, -2000)));
        let status = clock.status(MonoTime::from_millis(10_500));
        assert_eq!((status.level, &*status.message), (Level::Warn, "the wall clock has stepped by -2.000 s"));
        assert_eq!(status.values, [("steps", "1".to_owned()), ("last_step_s", "-2.000".to_owned())]);
        assert_eq!(clock.status(MonoTime::from_millis(10_501)).level, Level::Ok);
    }

    #[test]
    fn a_clock_that_is_slewed_has_not_stepped() {
        let mut clock = WallClock::new(now(0, 0));
        assert!((1..1000).all(|n| !clock.read(now(u64::try_from(n).unwrap() * 250, n * 9))));
    }
}
