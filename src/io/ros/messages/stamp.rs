//! Stamps and headers, with which most messages begin.

use serde::{Deserialize, Serialize};

use crate::core::time::WallStamp;

/// `builtin_interfaces/msg/Time`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Time {
    /// Seconds since 1970-01-01 UTC.
    pub sec: i32,
    /// Nanoseconds of the second, 0 to 999 999 999.
    pub nanosec: u32,
}

impl From<WallStamp> for Time {
    fn from(stamp: WallStamp) -> Self {
        Self { sec: stamp.sec(), nanosec: stamp.nanosec() }
    }
}

impl From<Time> for WallStamp {
    /// Nanoseconds of a second or more carry over.
    fn from(time: Time) -> Self {
        // 32 bits of seconds in nanoseconds fit 64 bits, with any number of nanoseconds.
        Self::from_nanos(i64::from(time.sec) * 1_000_000_000 + i64::from(time.nanosec))
    }
}

/// `builtin_interfaces/msg/Duration`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Duration {
    /// Whole seconds; negative before zero.
    pub sec: i32,
    /// Nanoseconds of the second, 0 to 999 999 999.
    pub nanosec: u32,
}

/// `std_msgs/msg/Header`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Header {
    /// Time of the data.
    pub stamp: Time,
    /// Frame of reference; empty in diagnostics.
    pub frame_id: String,
}
