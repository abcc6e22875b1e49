//! Failures of a report since start: number by kind, and the latest failure.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use can_signal::validation::unusable::FaultKind;
use gateway_base::time::{MonoTime, millis};

/// Number of failures of a report since start, by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct FailureCounts {
    /// There was no valid value.
    pub unknown: u64,
    /// The value had no meaning in the profile.
    pub invalid: u64,
    /// The vehicle reported a fault.
    pub hardware_fault: u64,
}

/// The last failure of a report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LastFailure {
    /// The kind of failure.
    pub kind: FaultKind,
    /// The reason in words.
    pub text: String,
    /// Time since it began, ms.
    pub age_ms: u64,
}

/// Failures of a report since start.
#[derive(Debug, Clone, Default)]
pub(super) struct FailureHistory {
    pub(super) counts: FailureCounts,
    last: Option<Failure>,
}

#[derive(Debug, Clone)]
struct Failure {
    kind: FaultKind,
    text: String,
    /// Time at which the failure began.
    at: MonoTime,
}

impl FailureHistory {
    /// Records a change of the report's failure from kind `before` to `kind`.
    pub(super) fn changed(
        &mut self,
        before: Option<FaultKind>,
        kind: Option<FaultKind>,
        text: impl FnOnce() -> String,
        at: MonoTime,
    ) {
        let Some(kind) = kind else { return };
        if Some(kind) != before {
            let count = match kind {
                FaultKind::Unknown => &mut self.counts.unknown,
                FaultKind::Invalid => &mut self.counts.invalid,
                FaultKind::HardwareFault => &mut self.counts.hardware_fault,
            };
            *count = count.saturating_add(1);
        }
        self.last = Some(Failure { kind, text: text(), at });
    }

    /// Returns the last failure; `None` before the first.
    pub(super) fn last(&self, now: MonoTime) -> Option<LastFailure> {
        let Failure { kind, text, at } = self.last.clone()?;
        Some(LastFailure { kind, text, age_ms: millis(now.since(at)) })
    }

    /// Returns the values for a diagnostic status; `is_bad` is true while the last failure persists.
    pub(super) fn status_values(&self, is_bad: bool, now: MonoTime) -> [(&'static str, String); 4] {
        let last = match &self.last {
            Some(failure) if is_bad => failure.text.clone(),
            Some(Failure { text, at, .. }) => format!("{text} ({} s ago)", now.since(*at).as_secs()),
            None => "none".to_owned(),
        };
        [
            ("unknown_count", self.counts.unknown.to_string()),
            ("invalid_count", self.counts.invalid.to_string()),
            ("hardware_fault_count", self.counts.hardware_fault.to_string()),
            ("last_error", last),
        ]
    }
}
