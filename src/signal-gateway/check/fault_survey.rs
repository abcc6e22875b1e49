//! Measures how often, how long and since when a fault was present in a recording.

use std::time::Duration;

use gateway_base::time::MonoTime;

/// Times at which a fault was present.
#[derive(Debug, Clone, Copy)]
pub(super) struct FaultSurvey {
    pub(super) count: u64,
    pub(super) total: Duration,
    pub(super) first: MonoTime,
}

/// Returns a time to the millisecond, e.g. `1.250 s`.
pub(super) fn seconds_text(at: MonoTime) -> String {
    let millis = at.as_nanos() / 1_000_000;
    format!("{}.{:03} s", millis / 1000, millis % 1000)
}
