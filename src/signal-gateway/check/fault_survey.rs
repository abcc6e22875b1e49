//! Measures how often, how long and since when a fault was present in a recording.

use std::time::Duration;

use crate::report::text::times;
use can_signal::validation::unusable::FaultKind;
use gateway_base::time::MonoTime;

/// Longest time until the first value that is normal: some cars send the state of their indicators every ten
/// seconds.
const MAX_COLD_START: Duration = Duration::from_secs(10);

/// Times at which a fault was present.
#[derive(Debug, Clone, Copy)]
pub(super) struct FaultSurvey {
    pub(super) count: u64,
    pub(super) total: Duration,
    pub(super) first: MonoTime,
    /// True while the fault has only begun before the first value was published.
    is_before_first_value: bool,
}

impl FaultSurvey {
    /// Creates the survey of a fault that was first present at this time.
    pub(super) fn begin(first: MonoTime) -> Self {
        Self { count: 0, total: Duration::ZERO, first, is_before_first_value: true }
    }

    /// Counts a beginning of the fault; `was_published` is true once a value was published.
    pub(super) fn begins_again(&mut self, was_published: bool) {
        self.count += 1;
        self.is_before_first_value &= !was_published;
    }

    /// Returns true if the report only had to wait for its first value. `was_published` is true if a value
    /// was published at any time.
    pub(super) fn is_cold_start(&self, kind: Option<FaultKind>, was_published: bool) -> bool {
        kind == Some(FaultKind::Unknown)
            && was_published
            && self.is_before_first_value
            && self.total <= MAX_COLD_START
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
