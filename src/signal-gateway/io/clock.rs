//! Reads the clocks. No other part of the live daemon does.

use std::time::{Duration, Instant, SystemTime};

use gateway_base::time::{MonoTime, Now, WallStamp};

/// Maximum time between the readings of both clocks for one instant.
const MAX_SPREAD: Duration = Duration::from_micros(200);
/// Maximum number of attempts; the last reading is used regardless of its spread.
const MAX_READINGS: usize = 4;

/// Reads monotonic and wall time for this process.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    origin: Instant,
}

impl Clock {
    /// Starts a clock whose monotonic time begins now.
    pub fn start() -> Self {
        Self { origin: Instant::now() }
    }

    /// Returns the current time. The clocks are read again if the process was interrupted between them, which
    /// would look like a step of the wall clock.
    pub fn now(&self) -> Now {
        let mut mono = self.origin.elapsed();
        let mut wall = SystemTime::now();
        for _ in 1..MAX_READINGS {
            let end = self.origin.elapsed();
            if end.saturating_sub(mono) <= MAX_SPREAD {
                break;
            }
            (mono, wall) = (end, SystemTime::now());
        }
        let mono = u64::try_from(mono.as_nanos()).unwrap_or(u64::MAX);
        let wall = wall.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let wall = i64::try_from(wall.as_nanos()).unwrap_or(i64::MAX);
        Now { mono: MonoTime::from_nanos(mono), wall: WallStamp::from_nanos(wall) }
    }

    /// Converts a monotonic time to an instant to sleep until.
    pub fn instant(&self, at: MonoTime) -> Instant {
        self.origin + at.since(MonoTime::ZERO)
    }
}
