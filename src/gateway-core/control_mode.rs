//! Control mode of the vehicle, with the numbers of Autoware's `ControlModeReport`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gateway_base::names::named_by_variant;
use turn_signal::light_command::Numbered;

/// Control mode of the vehicle, as in `ControlModeReport.mode`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
#[repr(u8)]
pub enum ControlMode {
    /// `NO_COMMAND`, 0: the vehicle follows no commands.
    NoCommand = 0,
    /// `AUTONOMOUS`, 1: Autoware drives.
    Autonomous = 1,
    /// `AUTONOMOUS_STEER_ONLY`, 2: Autoware steers.
    AutonomousSteerOnly = 2,
    /// `AUTONOMOUS_VELOCITY_ONLY`, 3: Autoware accelerates and brakes.
    AutonomousVelocityOnly = 3,
    /// `MANUAL`, 4: the driver drives.
    Manual = 4,
    /// `DISENGAGED`, 5: the driver has taken over.
    Disengaged = 5,
    /// `NOT_READY`, 6: the vehicle cannot be commanded yet.
    NotReady = 6,
}

named_by_variant!(ControlMode);

impl Numbered for ControlMode {
    const ALL: &'static [Self] = &[
        Self::NoCommand,
        Self::Autonomous,
        Self::AutonomousSteerOnly,
        Self::AutonomousVelocityOnly,
        Self::Manual,
        Self::Disengaged,
        Self::NotReady,
    ];
}
