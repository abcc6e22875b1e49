//! `[diagnostics]`: the refresh period of diagnostics, and their hardware id.

use std::time::Duration;

use crate::config::reading::{Fields, key_rows, millis, text};

/// The text of `hardware_id` that names nothing.
pub(super) const NO_HARDWARE_ID: &str = "none";

key_rows! {
    // Aggregators call a status stale after 1 s.
    PERIOD_MS: Duration = millis("period_ms", 20, 500).or(250).doc("refresh of all statuses, {range}; changes go out at once");
    HARDWARE_ID: String = text("hardware_id").or_text(NO_HARDWARE_ID).restart().doc("hardware_id of every status, e.g. \"vehicle_pc_1\"");
}

/// Reads the section: the refresh period, and `DiagnosticStatus.hardware_id`.
pub(super) fn diagnostics(fields: &Fields<'_>) -> (Duration, String) {
    let (period, hardware_id) = (fields.read(&PERIOD_MS), fields.read(&HARDWARE_ID));
    if hardware_id.is_empty() {
        let reason = "ROS tools warn about an empty hardware_id";
        fields.refuse(HARDWARE_ID.name, reason, "use \"none\" or leave it out");
    }
    (period, hardware_id)
}
