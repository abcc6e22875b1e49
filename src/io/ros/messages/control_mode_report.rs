//! `autoware_vehicle_msgs/msg/ControlModeReport`.

use serde::{Deserialize, Serialize};

use super::stamp::Time;

/// `autoware_vehicle_msgs/msg/ControlModeReport`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ControlModeReport {
    /// Time of the vehicle's report.
    pub stamp: Time,
    /// `NO_COMMAND` 0, `AUTONOMOUS` 1, `AUTONOMOUS_STEER_ONLY` 2, `AUTONOMOUS_VELOCITY_ONLY` 3,
    /// `MANUAL` 4, `DISENGAGED` 5, `NOT_READY` 6.
    pub mode: u8,
}
