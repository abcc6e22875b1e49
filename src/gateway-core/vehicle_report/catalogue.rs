//! Status messages shared by all reports of the vehicle.

use gateway_base::diagnostics::messages;

messages! {
    /// Whether a report is published.
    REPORT {
        Ok publishing() "publishing";
        Error unknown(reason) "unknown: {reason}";
        Error invalid(reason) "invalid: {reason}";
        Error hardware_fault(reason) "hardware fault: {reason}";
        Warn asleep(reason) "asleep: {reason}";
        Warn fallback(source, reason) "fallback {source}: {reason}", "The report continues from the named source meanwhile.";
    }
}
