//! Status messages shared by all reports of the vehicle.

use gateway_base::diagnostics::{Status, messages};

messages! {
    /// Whether a report is published.
    REPORT {
        Ok publishing() "publishing";
        Error unknown(reason) "unknown: {reason}";
        Error invalid(reason) "invalid: {reason}";
        Error hardware_fault(reason) "hardware fault: {reason}";
        Warn starting(reason) "starting: {reason}";
        Warn asleep(reason) "asleep: {reason}";
        Warn fallback(source, reason) "fallback {source}: {reason}", "The report continues from the named source meanwhile.";
    }
}

/// Returns true for the status of a report that is withheld because its first values since the start are
/// awaited.
pub fn is_starting(status: &Status) -> bool {
    status.rows.first() == Some(&&starting::ROW)
}
