//! Diagnostic statuses with levels and values (`diagnostic_msgs`; docs/spec/vehicle-interface.md, "Diagnostics").

use std::collections::VecDeque;
use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::names::display_by_name;
use super::time::MonoTime;

/// Severity of a status, `DiagnosticStatus.level` of ROS.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "UPPERCASE")]
#[repr(u8)]
pub enum Level {
    /// Works without a problem (0).
    #[default]
    Ok = 0,
    /// Works with a problem (1).
    Warn = 1,
    /// Does not work at all (2).
    Error = 2,
    /// Not refreshed (3); set by aggregators, never by this gateway.
    Stale = 3,
}

display_by_name!(Level);

/// One `DiagnosticStatus` without the hardware id, which is common to all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Status {
    /// What the status is about, e.g. `turn_indicators` or an interface.
    pub task: String,
    /// Severity of the status.
    pub level: Level,
    /// Short text, which changes only with the condition.
    pub message: String,
    /// Keys and values with details in a fixed order.
    pub values: Vec<(&'static str, String)>,
    /// Signals of the vehicle that it is about, `MESSAGE.SIGNAL` of the DBC.
    pub signals: Vec<String>,
}

impl Status {
    /// Creates the status of a task, which is about no signal.
    pub fn new(
        task: impl Into<String>,
        level: Level,
        message: String,
        values: Vec<(&'static str, String)>,
    ) -> Self {
        Self { task: task.into(), level, message, values, signals: Vec::new() }
    }
}

/// Statuses that are published together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostics {
    /// ROS node name, which begins the name of each status: `<node>: <task>`.
    pub node: String,
    /// The statuses, in a fixed order.
    pub statuses: Vec<Status>,
    /// True for a refresh of all tasks; false for those that have changed.
    pub refresh: bool,
}

/// Measures a rate over the latest refreshes.
#[derive(Debug, Clone, Default)]
pub struct RateMeter {
    samples: VecDeque<(MonoTime, u64)>,
}

impl RateMeter {
    /// Long enough for a 1 Hz message to show about 1 Hz.
    pub const WINDOW: Duration = Duration::from_secs(5);
    /// Bounds memory when refreshes come often.
    const MAX_SAMPLES: usize = 64;

    /// Samples the current count.
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

    /// Rate in events per second up to now; 0 before the first sample.
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
    fn rate_is_measured_over_window() {
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
