//! Current state of a report, for people and programs that monitor the gateway.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::failure::{FailureCounts, LastFailure};
use can_signal::validation::unusable::FaultKind;
use gateway_base::diagnostics::Level;

/// The present state of a report with values of `T`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ReportSnapshot<T> {
    /// Value that is published; `None` while the report is withheld.
    pub published: Option<T>,
    /// Why it is withheld; `None` while it is published.
    pub withheld: Option<String>,
    /// Kind of failure; `None` without one. A report can be published in spite of a hardware fault.
    pub failure: Option<FaultKind>,
    /// True while it is withheld because its first values since the start are awaited; not a failure.
    pub is_starting: bool,
    /// Level of its diagnostic status.
    pub level: Level,
    /// Message of its diagnostic status.
    pub message: String,
    /// Name of the source that decides; `None` where there is only one.
    pub source: Option<String>,
    /// Why the hazard lights are on, as the vehicle gives it; `None` where it does not.
    pub reason: Option<String>,
    /// Stamp of the published message, nanoseconds since 1970; `None` while the report is withheld.
    pub stamp_ns: Option<i64>,
    /// Signals on which it depends, by name.
    pub signals: Vec<String>,
    /// Number of failures since start.
    pub failures: FailureCounts,
    /// The last failure; `None` before the first.
    pub last_failure: Option<LastFailure>,
}

impl<T> ReportSnapshot<T> {
    /// Returns the same report with its value converted by `value`.
    pub fn map<U>(&self, value: impl FnOnce(&T) -> U) -> ReportSnapshot<U> {
        ReportSnapshot {
            published: self.published.as_ref().map(value),
            withheld: self.withheld.clone(),
            failure: self.failure,
            is_starting: self.is_starting,
            level: self.level,
            message: self.message.clone(),
            source: self.source.clone(),
            reason: self.reason.clone(),
            stamp_ns: self.stamp_ns,
            signals: self.signals.clone(),
            failures: self.failures,
            last_failure: self.last_failure.clone(),
        }
    }
}
