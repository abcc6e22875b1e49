//! Findings to levelled, named statuses (`diagnostic_msgs`; docs/spec/vehicle-interface.md, "Diagnostics").

use std::collections::VecDeque;
use std::fmt;
use std::time::Duration;

use super::time::MonoTime;

/// `DiagnosticStatus.level`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Level {
    /// 0: as it should be.
    Ok = 0,
    /// 1: works, but look at it.
    Warn = 1,
    /// 2: does not work.
    Error = 2,
    /// 3: was not refreshed. Aggregators set it; this gateway always knows and never does.
    Stale = 3,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ok => "OK",
            Self::Warn => "WARN",
            Self::Error => "ERROR",
            Self::Stale => "STALE",
        })
    }
}

/// One `DiagnosticStatus`, without the hardware id that all share.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Status {
    /// `<node>: <task>`.
    pub name: String,
    /// How bad it is.
    pub level: Level,
    /// One short line for a person; changes only when the situation does.
    pub message: String,
    /// What an operator needs beside it, in a fixed order.
    pub values: Vec<(&'static str, String)>,
}

/// Several statuses that go out together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostics {
    /// The statuses, in a fixed order.
    pub statuses: Vec<Status>,
    /// True for a refresh of all tasks; false when these are the ones that changed just now.
    pub refresh: bool,
}

/// Frames per second over the last few refreshes.
#[derive(Debug, Clone, Default)]
pub struct RateMeter {
    samples: VecDeque<(MonoTime, u64)>,
}

impl RateMeter {
    /// Long enough for a 1 Hz message to show about 1 Hz.
    const WINDOW: Duration = Duration::from_secs(5);
    /// Bounds memory when refreshes come often.
    const MAX_SAMPLES: usize = 64;

    /// Takes the count as of now.
    pub fn sample(&mut self, count: u64, now: MonoTime) {
        self.samples.push_back((now, count));
        let old = |samples: &VecDeque<(MonoTime, u64)>| {
            samples.len() > Self::MAX_SAMPLES
                || samples.get(1).is_some_and(|(at, _)| now.since(*at) >= Self::WINDOW)
        };
        while old(&self.samples) {
            self.samples.pop_front();
        }
    }

    /// Events per second, up to now; zero while nothing was sampled before.
    #[allow(clippy::cast_precision_loss)] // counts within a window are far below 2^52
    pub fn rate_hz(&self, count: u64, now: MonoTime) -> f64 {
        self.samples.front().map_or(0.0, |(since, before)| {
            let seconds = now.since(*since).as_secs_f64();
            if seconds > 0.0 { count.saturating_sub(*before) as f64 / seconds } else { 0.0 }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_measured_over_the_window() {
        let mut meter = RateMeter::default();
        for half_second in 0..=20_u64 {
            meter.sample(half_second * 50, MonoTime::from_millis(half_second * 500));
        }
        let now = MonoTime::from_millis(10_000);
        assert!((meter.rate_hz(1_000, now) - 100.0).abs() < 1e-9);
        // Silence empties the window.
        for half_second in 21..=40_u64 {
            meter.sample(1_000, MonoTime::from_millis(half_second * 500));
        }
        assert!(meter.rate_hz(1_000, MonoTime::from_millis(20_000)).abs() < 1e-9);
    }
}
