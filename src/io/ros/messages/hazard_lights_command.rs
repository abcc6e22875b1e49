//! `autoware_vehicle_msgs/msg/HazardLightsCommand`.

use serde::{Deserialize, Serialize};

use super::stamp::Time;
use crate::core::time::WallStamp;
use crate::core::turn_signal::signal::Hazard;

/// `autoware_vehicle_msgs/msg/HazardLightsCommand`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct HazardLightsCommand {
    /// When it was given.
    pub stamp: Time,
    /// `NO_COMMAND` 0, `DISABLE` 1, `ENABLE` 2.
    pub command: u8,
}

impl HazardLightsCommand {
    /// The message that gives `command`.
    pub fn new(command: Hazard, stamp: WallStamp) -> Self {
        Self { stamp: stamp.into(), command: command as u8 }
    }

    /// What it asks for; `None` when its number means nothing.
    pub fn hazard(self) -> Option<Hazard> {
        [Hazard::NoCommand, Hazard::Disable, Hazard::Enable]
            .into_iter()
            .find(|hazard| *hazard as u8 == self.command)
    }
}
