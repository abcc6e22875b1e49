//! `doctor`: judges a set-up by its facts. Each check and each finding is a table row, and the same facts
//! always give the same findings.

mod bus;
mod configuration;
pub mod facts;
mod host;
mod interface;
mod ros;
mod row;
pub mod scan_text;
mod text;

use serde::Serialize;

use facts::Facts;
use gateway_base::diagnostics::Level;
pub use row::{CheckRow, Finding, FindingRow, Outcome};

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
