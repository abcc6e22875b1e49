//! `doctor`: judges a set-up by its facts. Each check and each finding is a table row, and the same facts
//! always give the same findings.

mod bus;
mod configuration;
pub mod facts;
mod host;
mod interface;
mod ros;
pub mod scan_text;
mod text;

use serde::Serialize;

use facts::Facts;
use gateway_base::diagnostics::Level;

/// A question about a set-up.
#[derive(Debug)]
pub struct CheckRow {
    /// Short name, also in JSON.
    pub name: &'static str,
    /// The question.
    pub asks: &'static str,
    /// Possible findings.
    pub findings: &'static [&'static FindingRow],
    judge: fn(&Facts) -> Vec<Outcome>,
}

/// A possible problem. In its texts `{name}` is replaced by a value.
#[derive(Debug)]
pub struct FindingRow {
    /// Short name, also in JSON.
    pub name: &'static str,
    /// WARN, or ERROR if the gateway cannot work.
    pub level: Level,
    /// Description of the problem.
    pub text: &'static str,
    /// Consequence of the problem.
    pub why: &'static str,
    /// Remedy.
    pub remedy: &'static str,
    /// Document and section with details.
    pub see: &'static str,
}

/// All checks in printing order: file, bus, ROS 2, computer.
pub const CHECKS: [&CheckRow; 13] = [
    &configuration::CONFIGURATION,
    &interface::INTERFACE,
    &interface::CONTROLLER,
    &interface::LISTEN_ONLY,
    &interface::TRANSMIT_QUEUE,
    &bus::BIT_RATE,
    &bus::ERROR_FRAMES,
    &bus::VEHICLE_MESSAGES,
    &ros::ROS_DOMAIN,
    &ros::TOPICS,
    &host::SERVICE,
    &host::PERMISSIONS,
    &host::CLOCK,
];

/// Outcome of a check for one item.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum Outcome {
    /// No problem was found.
    Sound {
        /// The observation.
        text: String,
    },
    /// A problem was found.
    Found(Finding),
    /// The check could not be performed.
    NotChecked {
        /// The reason.
        reason: String,
    },
}

/// A problem with its values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Name of the row.
    pub finding: &'static str,
    /// Level of the row.
    pub level: Level,
    /// Description of the problem.
    pub text: String,
    /// Consequence of the problem.
    pub why: String,
    /// Remedy.
    pub remedy: String,
    /// Document and section with details.
    pub see: &'static str,
}

impl Outcome {
    fn sound(text: impl Into<String>) -> Self {
        Self::Sound { text: text.into() }
    }

    fn not_checked(reason: impl Into<String>) -> Self {
        Self::NotChecked { reason: reason.into() }
    }

    /// Inserts a value for its name into the texts of a problem.
    fn with(mut self, name: &str, value: impl ToString) -> Self {
        if let Self::Found(Finding { text, why, remedy, .. }) = &mut self {
            for part in [text, why, remedy] {
                *part = part.replace(&format!("{{{name}}}"), &value.to_string());
            }
        }
        self
    }
}

impl FindingRow {
    /// Returns the problem, into which [`Outcome::with`] inserts values.
    fn found(&self) -> Outcome {
        let [text, why, remedy] = [self.text, self.why, self.remedy].map(str::to_owned);
        Outcome::Found(Finding { finding: self.name, level: self.level, text, why, remedy, see: self.see })
    }
}

/// Results of all checks.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Diagnosis {
    /// Worst level of all findings.
    pub level: Level,
    /// Number of errors.
    pub errors: usize,
    /// Number of warnings.
    pub warnings: usize,
    /// Number of items that could not be checked.
    pub not_checked: usize,
    /// All checks in their order.
    pub checks: Vec<CheckOutcomes>,
}

/// The outcomes of one check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CheckOutcomes {
    /// Name of the check.
    pub name: &'static str,
    /// Its question.
    pub asks: &'static str,
    /// Its outcome for each item.
    pub outcomes: Vec<Outcome>,
}

/// Judges a set-up.
pub fn examine(facts: &Facts) -> Diagnosis {
    let checks: Vec<_> = CHECKS
        .into_iter()
        .map(|row| CheckOutcomes { name: row.name, asks: row.asks, outcomes: (row.judge)(facts) })
        .collect();
    let outcomes = || checks.iter().flat_map(|check| &check.outcomes);
    let level = |outcome: &_| if let Outcome::Found(found) = outcome { Some(found.level) } else { None };
    let levels = || outcomes().filter_map(level);
    Diagnosis {
        level: levels().max().unwrap_or_default(),
        errors: levels().filter(|level| *level == Level::Error).count(),
        warnings: levels().filter(|level| *level == Level::Warn).count(),
        not_checked: outcomes().filter(|outcome| matches!(outcome, Outcome::NotChecked { .. })).count(),
        checks,
    }
}
