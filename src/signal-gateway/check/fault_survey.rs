//! Measures how often, how long and since when a fault was present in a recording.

use std::time::Duration;

use crate::report::text::times;
use gateway_base::time::MonoTime;

/// Times at which a fault was present.
#[derive(Debug, Clone, Copy)]
pub(super) struct FaultSurvey {
    pub(super) count: u64,
    pub(super) total: Duration,
    pub(super) first: MonoTime,
}

impl FaultSurvey {
    /// Creates the survey of a fault that was first present at this time.
    pub(super) fn begin(first: MonoTime) -> Self {
        Self { count: 0, total: Duration::ZERO, first }
    }

    /// Returns e.g. `twice, 1.250 s in all, first at 0.030 s`.
    pub(super) fn text(&self) -> String {
        let (total, first) = (seconds_text(MonoTime::ZERO.after(self.total)), seconds_text(self.first));
        format!("{}, {total} in all, first at {first}", times(self.count))
    }
}

/// Returns a time to the millisecond, e.g. `1.250 s`.
pub(super) fn seconds_text(at: MonoTime) -> String {
    let millis = at.as_nanos() / 1_000_000;
    format!("{}.{:03} s", millis / 1000, millis % 1000)
}
