//! The rows of checks and findings, and what a check results in.

use serde::Serialize;

use super::facts::Facts;
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
    pub(super) judge: fn(&Facts) -> Vec<Outcome>,
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
    pub(super) fn sound(text: impl Into<String>) -> Self {
        Self::Sound { text: text.into() }
    }

    pub(super) fn not_checked(reason: impl Into<String>) -> Self {
        Self::NotChecked { reason: reason.into() }
    }

    /// Inserts a value for its name into the texts of a problem.
    #[allow(clippy::needless_pass_by_value)] // texts and numbers alike
    pub(super) fn with(mut self, name: &str, value: impl ToString) -> Self {
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
    pub(super) fn found(&self) -> Outcome {
        let [text, why, remedy] = [self.text, self.why, self.remedy].map(str::to_owned);
        Outcome::Found(Finding { finding: self.name, level: self.level, text, why, remedy, see: self.see })
    }
}
