//! `[diagnostics]`: how often diagnostics are refreshed, and of which hardware they are.

use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use crate::config::reading::checker::Checker;

const DEFAULT_PERIOD: Duration = Duration::from_millis(250);

/// `[diagnostics]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiagnosticsFile {
    /// Refresh period, ms.
    pub period_ms: Option<Spanned<u64>>,
    /// `DiagnosticStatus.hardware_id`.
    pub hardware_id: Option<Spanned<String>>,
}

/// How often a status is refreshed.
pub(super) fn period(checker: &mut Checker<'_>, file: &DiagnosticsFile) -> Duration {
    let remedy = "give 20 to 500 ms: aggregators call a status stale after 1 s";
    let given = file.period_ms.as_ref();
    let period = checker.in_range(given, &(20..=500), "invalid refresh period {} ms", remedy);
    period.map_or(DEFAULT_PERIOD, Duration::from_millis)
}

/// `DiagnosticStatus.hardware_id`
pub(super) fn hardware_id(checker: &mut Checker<'_>, file: &DiagnosticsFile) -> String {
    let Some(id) = &file.hardware_id else { return "none".to_owned() };
    if id.get_ref().is_empty() {
        let reason = "an empty hardware_id draws a warning from ROS tools";
        checker.refuse(id, reason, "use \"none\" or leave it out");
    }
    id.get_ref().clone()
}
