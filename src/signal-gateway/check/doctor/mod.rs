//! `doctor`: judges a set-up by its facts. Each check and each finding is a row; the same facts give the same
//! findings.

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
    /// What can be found.
    pub findings: &'static [&'static FindingRow],
    judge: fn(&Facts) -> Vec<Outcome>,
}

/// Something that can be wrong. In its texts `{name}` stands for a value.
#[derive(Debug)]
pub struct FindingRow {
    /// Short name, also in JSON.
    pub name: &'static str,
    /// WARN, or ERROR where the gateway cannot do its work.
    pub level: Level,
    /// What was found.
    pub text: &'static str,
    /// Why it matters.
    pub why: &'static str,
    /// What mends it.
    pub remedy: &'static str,
    /// The document that says more, and its section.
    pub see: &'static str,
}

/// All checks, in the order in which they are printed: from the file to the bus, then to ROS 2, then to the
/// computer.
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

/// Outcome of a check for one thing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum Outcome {
    /// Nothing is wrong; what was seen.
    Sound {
        /// What was seen.
        text: String,
    },
    /// Something is wrong.
    Found(Finding),
    /// It could not be checked.
    NotChecked {
        /// The reason.
        reason: String,
    },
}

/// Something that is wrong, with its values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Name of the row.
    pub finding: &'static str,
    /// Level of the row.
    pub level: Level,
    /// What was found.
    pub text: String,
    /// Why it matters.
    pub why: String,
    /// What mends it.
    pub remedy: String,
    /// The document that says more, and its section.
    pub see: &'static str,
}

impl Outcome {
    fn sound(text: impl Into<String>) -> Self {
        Self::Sound { text: text.into() }
    }

    fn not_checked(reason: impl Into<String>) -> Self {
        Self::NotChecked { reason: reason.into() }
    }
}

impl FindingRow {
    /// Returns the finding with these values in the place of their names.
    fn with(&self, values: &[(&str, &str)]) -> Outcome {
        let filled = |text: &str| {
            values
                .iter()
                .fold(text.to_owned(), |text, (name, value)| text.replace(&format!("{{{name}}}"), value))
        };
        Outcome::Found(Finding {
            finding: self.name,
            level: self.level,
            text: filled(self.text),
            why: filled(self.why),
            remedy: filled(self.remedy),
            see: self.see,
        })
    }
}

/// What all checks came to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Diagnosis {
    /// The worst level of a finding.
    pub level: Level,
    /// Findings that are errors.
    pub errors: usize,
    /// Findings that are warnings.
    pub warnings: usize,
    /// Things that could not be checked.
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
    /// What it came to, for each thing.
    pub outcomes: Vec<Outcome>,
}

/// Judges a set-up.
pub fn examine(facts: &Facts) -> Diagnosis {
    let checks: Vec<_> = CHECKS
        .into_iter()
        .map(|row| CheckOutcomes { name: row.name, asks: row.asks, outcomes: (row.judge)(facts) })
        .collect();
    let outcomes = || checks.iter().flat_map(|check| &check.outcomes);
    let levels = || {
        outcomes()
            .filter_map(|outcome| if let Outcome::Found(found) = outcome { Some(found.level) } else { None })
    };
    Diagnosis {
        level: levels().max().unwrap_or_default(),
        errors: levels().filter(|level| *level == Level::Error).count(),
        warnings: levels().filter(|level| *level == Level::Warn).count(),
        not_checked: outcomes().filter(|outcome| matches!(outcome, Outcome::NotChecked { .. })).count(),
        checks,
    }
}
