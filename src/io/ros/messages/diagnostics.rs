//! `diagnostic_msgs/msg/DiagnosticArray`.

use serde::{Deserialize, Serialize};

use super::stamp::Header;
use crate::core::diagnostics::{Diagnostics, Status};
use crate::core::time::WallStamp;

/// `diagnostic_msgs/msg/KeyValue`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// Name of the value.
    pub key: String,
    /// The value as text.
    pub value: String,
}

/// `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// OK 0, WARN 1, ERROR 2, STALE 3; a `byte` in the `.msg` file.
    pub level: u8,
    /// `<node>: <task>`.
    pub name: String,
    /// One line for a person.
    pub message: String,
    /// The hardware that the status is about.
    pub hardware_id: String,
    /// Values that an operator needs beside the message.
    pub values: Vec<KeyValue>,
}

impl DiagnosticStatus {
    /// The message with `status` about `hardware_id`.
    pub fn new(status: &Status, hardware_id: &str) -> Self {
        let values = status.values.iter();
        Self {
            level: status.level as u8,
            name: status.name.clone(),
            message: status.message.clone(),
            hardware_id: hardware_id.to_owned(),
            values: values
                .map(|(key, value)| KeyValue { key: (*key).to_owned(), value: value.clone() })
                .collect(),
        }
    }
}

/// `diagnostic_msgs/msg/DiagnosticArray`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// Time of the statuses.
    pub header: Header,
    /// One status for each task.
    pub status: Vec<DiagnosticStatus>,
}

impl DiagnosticArray {
    /// The message with `diagnostics` about `hardware_id`.
    pub fn new(diagnostics: &Diagnostics, stamp: WallStamp, hardware_id: &str) -> Self {
        Self {
            header: Header { stamp: stamp.into(), frame_id: String::new() },
            status: diagnostics
                .statuses
                .iter()
                .map(|status| DiagnosticStatus::new(status, hardware_id))
                .collect(),
        }
    }
}
