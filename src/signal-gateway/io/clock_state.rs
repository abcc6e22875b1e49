//! Detects whether the wall clock is synchronised, and whether it was set during a measurement.

use std::time::{Duration, Instant, SystemTime};

use serde::{Deserialize, Serialize};

/// State of the wall clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct ClockState {
    /// True while the clock is synchronised (`adjtimex`); `None` if the kernel does not report this.
    pub is_synchronised: Option<bool>,
    /// Amount by which the clock was set forward while it was watched, ms; negative = backward.
    pub jump_ms: i64,
}

/// Compares the wall clock with the monotonic clock.
#[derive(Debug, Clone, Copy)]
pub struct ClockWatch {
    mono: Instant,
    wall: SystemTime,
}

impl ClockWatch {
    /// Starts the comparison.
    pub fn start() -> Self {
        Self { mono: Instant::now(), wall: SystemTime::now() }
    }

    /// Returns the state of the clock since the start.
    pub fn state(self) -> ClockState {
        let passed = millis(self.mono.elapsed());
        let shown = SystemTime::now()
            .duration_since(self.wall)
            .map_or_else(|error| -millis(error.duration()), millis);
        ClockState { is_synchronised: is_synchronised(), jump_ms: shown - passed }
    }
}

fn millis(duration: Duration) -> i64 {
    i64::try_from(duration.as_millis()).unwrap_or(i64::MAX)
}

/// Queries the kernel; reading needs no privilege.
#[allow(unsafe_code)]
fn is_synchronised() -> Option<bool> {
    // SAFETY: timex consists of integers, for each of which zero is valid; zero in `modes` means that nothing
    // is set.
    let mut state: libc::timex = unsafe { std::mem::zeroed() };
    // SAFETY: the kernel reads and writes one timex, which `state` is.
    let result = unsafe { libc::adjtimex(&raw mut state) };
    (result >= 0).then_some(state.status & libc::STA_UNSYNC == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clock_that_nobody_sets_has_not_jumped_and_one_that_was_set_has() {
        let watch = ClockWatch::start();
        assert!(watch.state().jump_ms.abs() < 5_000);
        let set_back = ClockWatch { wall: watch.wall + Duration::from_secs(3_600), ..watch };
        assert!(set_back.state().jump_ms < -3_000_000, "{:?}", set_back.state());
    }
}
