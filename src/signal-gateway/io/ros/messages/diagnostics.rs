//! `diagnostic_msgs/msg/DiagnosticArray` from the core's diagnostics.

use gateway_base::diagnostics::{Diagnostics, Status};
use gateway_base::time::WallStamp;
use ros_messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use ros_messages::std_msgs::Header;

/// Creates the message of a status that `node` reports about `hardware_id`.
pub fn diagnostic_status(node: &str, status: &Status, hardware_id: &str) -> DiagnosticStatus {
    let value = |(key, value): (&str, String)| KeyValue { key: key.to_owned(), value };
    DiagnosticStatus {
        level: status.level as u8,
        name: format!("{node}: {}", status.task),
        message: status.message.clone(),
        hardware_id: hardware_id.to_owned(),
        values: status.published_values().map(value).collect(),
    }
}

/// Creates the message of diagnostics about `hardware_id`.
pub fn diagnostic_array(diagnostics: &Diagnostics, stamp: WallStamp, hardware_id: &str) -> DiagnosticArray {
    let Diagnostics { node, statuses, .. } = diagnostics;
    DiagnosticArray {
        header: Header::new(stamp, ""),
        status: statuses.iter().map(|status| diagnostic_status(node, status, hardware_id)).collect(),
    }
}
