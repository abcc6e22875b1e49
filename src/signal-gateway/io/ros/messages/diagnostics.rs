//! `diagnostic_msgs/msg/DiagnosticArray` from the core's diagnostics.

use super::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use super::std_msgs::Header;
use gateway_base::diagnostics::{Diagnostics, Status};
use gateway_base::time::WallStamp;

impl DiagnosticStatus {
    /// Creates the message of `status`, which `node` reports about `hardware_id`.
    pub fn new(node: &str, status: &Status, hardware_id: &str) -> Self {
        let value = |(key, value): (&str, String)| KeyValue { key: key.to_owned(), value };
        Self {
            level: status.level as u8,
            name: format!("{node}: {}", status.task),
            message: status.message.clone(),
            hardware_id: hardware_id.to_owned(),
            values: status.published_values().map(value).collect(),
        }
    }
}

impl DiagnosticArray {
    /// Creates the message of `diagnostics`, which are about `hardware_id`.
    pub fn new(diagnostics: &Diagnostics, stamp: WallStamp, hardware_id: &str) -> Self {
        let Diagnostics { node, statuses, .. } = diagnostics;
        Self {
            header: Header::new(stamp, ""),
            status: statuses.iter().map(|status| DiagnosticStatus::new(node, status, hardware_id)).collect(),
        }
    }
}
