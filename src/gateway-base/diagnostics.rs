//! Diagnostic statuses with levels and values (`diagnostic_msgs`; docs/spec/vehicle-interface.md,
//! "Diagnostics").

mod level;
mod message;

use std::collections::VecDeque;
use std::time::Duration;

use crate::time::MonoTime;
pub use level::Level;
use message::joined;
pub use message::{MessagePart, MessageRow, Section, messages};

/// One `DiagnosticStatus` without the hardware id, which all statuses share.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Status {
    /// Subject of the status, e.g. `turn_indicators` or an interface.
    pub task: String,
    /// Severity of the status.
    pub level: Level,
    /// Short text, which changes only when the condition changes.
    pub message: String,
    /// Details as keys and values, in a fixed order.
    pub values: Vec<(&'static str, String)>,
    /// Vehicle signals that the status is about, `MESSAGE.SIGNAL` of the DBC.
    pub signals: Vec<String>,
    /// Remedy; empty if no action is needed.
    pub remedy: String,
    /// Rows of the status's messages and their reasons.
    pub rows: Vec<&'static MessageRow>,
    /// The kind of the status, with all its messages.
    pub section: &'static Section,
}

impl Status {
    /// Creates the status of a task, without signals. It has the level of the worst part of its message, and
    /// the remedies of all parts that are not OK.
    pub fn new(
        section: &'static Section,
        task: impl Into<String>,
        parts: &[MessagePart],
        values: Vec<(&'static str, String)>,
    ) -> Self {
        let bad = parts.iter().filter(|part| part.level() > Level::Ok);
        Self {
            task: task.into(),
            level: parts.iter().map(MessagePart::level).max().unwrap_or_default(),
            message: texts(parts),
            values,
            signals: Vec::new(),
            remedy: joined(bad.map(|part| part.remedy.as_str())),
            rows: parts.iter().flat_map(|part| part.rows.iter().copied()).collect(),
            section,
        }
    }

    /// Returns where its messages and keys are documented, see [`Section::document`]; `None` while the status
    /// is OK.
    pub fn document(&self) -> Option<String> {
        (!self.remedy.is_empty()).then(|| self.section.document())
    }

    /// Returns the keys and values as published. Unless the status is OK, the remedy and the document come
    /// last.
    pub fn published_values(&self) -> impl Iterator<Item = (&'static str, String)> {
        let remedy = (!self.remedy.is_empty()).then(|| ("remedy", self.remedy.clone()));
        let document = self.document().map(|document| ("document", document));
        self.values.iter().cloned().chain(remedy).chain(document)
    }
}

/// Joins the texts of all parts of a message.
pub fn texts(parts: &[MessagePart]) -> String {
    parts.iter().map(|part| part.text.as_str()).collect::<Vec<_>>().join("; ")
}

/// Statuses that are published together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostics {
    /// ROS node name, the prefix of each status name: `<node>: <task>`.
    pub node: String,
    /// Statuses in a fixed order.
    pub statuses: Vec<Status>,
    /// True for a refresh of all tasks; false if only changed statuses are included.
    pub refresh: bool,
}

/// Measures a rate over the latest refreshes.
#[derive(Debug, Clone, Default)]
pub struct RateMeter {
    samples: VecDeque<(MonoTime, u64)>,
}

impl RateMeter {
    /// Length of the window: long enough for a 1 Hz message to show about 1 Hz.
    pub const WINDOW: Duration = Duration::from_secs(5);
    /// Bounds memory when refreshes are frequent.
    const MAX_SAMPLES: usize = 64;

    /// Records the current count.
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

    /// Returns the rate in events per second up to now; 0 before the first sample.
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
