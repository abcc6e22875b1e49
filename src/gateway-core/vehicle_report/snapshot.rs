//! Current state of a report, for people and programs that monitor the gateway.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::failure::{FailureCounts, LastFailure};
use can_signal::validation::unusable::FaultKind;
use gateway_base::diagnostics::Level;

/// Whether a report is published, or why not. The words of all but `published` begin the message of its
/// status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReportState {
    /// It is published without a failure.
    Published,
    /// Its first values since the start are awaited.
    Starting,
    /// There is no valid value.
    #[default]
    Unknown,
    /// The value has no meaning in the profile.
    Invalid,
    /// The vehicle reports a fault; the report may be published in spite of it.
    HardwareFault,
    /// The bus sleeps, as the profile allows.
    Asleep,
    /// The bus is awake again, and lamps or stalk are observed.
    WakingUp,
    /// The gearbox is between two gears.
    Shifting,
    /// The vehicle does not show it.
    NotVisible,
    /// The configuration lacks what it needs.
    NotConfigured,
}

impl From<FaultKind> for ReportState {
    fn from(kind: FaultKind) -> Self {
        match kind {
            FaultKind::Unknown => Self::Unknown,
            FaultKind::Invalid => Self::Invalid,
            FaultKind::HardwareFault => Self::HardwareFault,
        }
    }
}

/// The present state of a report with values of `T`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ReportSnapshot<T> {
    /// Value that is published; `None` while the report is withheld.
    pub published: Option<T>,
    /// Why it is withheld; `None` while it is published.
    pub withheld: Option<String>,
    /// Whether it is published, or why not.
    #[serde(default)]
    pub state: ReportState,
    /// Kind of failure; `None` without one. A report can be published in spite of a hardware fault.
    pub failure: Option<FaultKind>,
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
            state: self.state,
            failure: self.failure,
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
