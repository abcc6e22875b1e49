//! `autoware_vehicle_msgs/msg/HazardLightsCommand`.

use serde::{Deserialize, Serialize};

use super::stamp::Time;
use crate::core::light_command::HazardCommand;
use crate::core::time::WallStamp;

/// `autoware_vehicle_msgs/msg/HazardLightsCommand`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct HazardLightsCommand {
    /// Time at which the command was given.
    pub stamp: Time,
    /// `NO_COMMAND` 0, `DISABLE` 1, `ENABLE` 2.
    pub command: u8,
}

impl HazardLightsCommand {
    /// The message that gives `command`.
    pub fn new(command: HazardCommand, stamp: WallStamp) -> Self {
        Self { stamp: stamp.into(), command: command as u8 }
    }
}
