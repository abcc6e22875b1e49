//! `[diagnostics]`: how often diagnostics are refreshed, and of which hardware they are.

use std::time::Duration;

use crate::config::reading::fields::Fields;

const DEFAULT_PERIOD: Duration = Duration::from_millis(250);

/// Reads the section: the refresh period, and `DiagnosticStatus.hardware_id`.
pub(super) fn diagnostics(fields: Fields<'_>) -> (Duration, String) {
    // Aggregators call a status stale after 1 s.
    let period = fields.millis("period_ms", 20..=500).unwrap_or(DEFAULT_PERIOD);
    let hardware_id = fields.string("hardware_id").map_or("none".to_owned(), |id| id.text);
    if hardware_id.is_empty() {
        let reason = "ROS tools warn about an empty hardware_id";
        fields.refuse("hardware_id", reason, "use \"none\" or leave it out");
    }
    fields.done();
    (period, hardware_id)
}
