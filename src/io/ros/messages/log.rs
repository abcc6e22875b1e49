//! `rcl_interfaces/msg/Log`.

use serde::{Deserialize, Serialize};

use super::stamp::Time;

/// `rcl_interfaces/msg/Log`: a line of a node's log, on `/rosout`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Log {
    /// When it occurred.
    pub stamp: Time,
    /// DEBUG 10, INFO 20, WARN 30, ERROR 40, FATAL 50.
    pub level: u8,
    /// The logger, which is named after its node.
    pub name: String,
    /// The message.
    pub msg: String,
    /// The source file that it comes from; empty when that is not known.
    pub file: String,
    /// The function that it comes from, or its module; empty likewise.
    pub function: String,
    /// The line in the file; 0 likewise.
    pub line: u32,
}

impl Log {
    /// The level of a warning.
    pub const WARN: u8 = 30;
    /// The level of an error.
    pub const ERROR: u8 = 40;
}
