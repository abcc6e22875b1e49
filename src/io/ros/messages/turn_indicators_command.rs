//! `autoware_vehicle_msgs/msg/TurnIndicatorsCommand`.

use serde::{Deserialize, Serialize};

use super::stamp::Time;
use crate::core::light_command::TurnCommand;
use crate::core::time::WallStamp;

/// `autoware_vehicle_msgs/msg/TurnIndicatorsCommand`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TurnIndicatorsCommand {
    /// Time at which the command was given.
    pub stamp: Time,
    /// `NO_COMMAND` 0, `DISABLE` 1, `ENABLE_LEFT` 2, `ENABLE_RIGHT` 3.
    pub command: u8,
}

impl TurnIndicatorsCommand {
    /// The message that gives `command`.
    pub fn new(command: TurnCommand, stamp: WallStamp) -> Self {
        Self { stamp: stamp.into(), command: command as u8 }
    }
}
