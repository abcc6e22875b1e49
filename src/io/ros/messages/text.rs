//! `std_msgs/msg/String`.

use serde::{Deserialize, Serialize};

/// `std_msgs/msg/String`, under a name of its own.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Text {
    /// The text, UTF-8.
    pub data: String,
}
