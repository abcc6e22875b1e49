//! The commands that each control mode grants (docs/spec/vehicle-interface.md, "Control modes").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::core::light_command::{EnumOrUnknown, Numbered};
use crate::core::names::variant_name;

/// `ControlModeReport.mode`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
#[repr(u8)]
pub enum ControlMode {
    /// `NO_COMMAND`, 0: the vehicle follows no command.
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

/// The control mode, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// A defined mode.
    Known(ControlMode),
    /// A value that stands for no mode.
    Undefined(i128),
    /// Nothing has been received, or nothing for longer than the timeout.
    #[default]
    Unknown,
}

/// The functions that may be requested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Grants {
    /// Turn indicators: the steering group.
    pub turn: bool,
    /// Hazard lights: the group of all else.
    pub hazard: bool,
}

impl ControlMode {
    /// The constant's name in the `.msg` file.
    pub fn name(self) -> &'static str {
        variant_name(&self)
    }

    /// The functions it grants. Modes that the interface leaves undecided grant nothing.
    pub fn grants(self) -> Grants {
        match self {
            Self::Autonomous | Self::AutonomousSteerOnly => Grants { turn: true, hazard: true },
            Self::AutonomousVelocityOnly => Grants { turn: false, hazard: true },
            Self::NoCommand | Self::Manual | Self::Disengaged | Self::NotReady => Grants::default(),
        }
    }
}

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

impl From<EnumOrUnknown<ControlMode>> for Mode {
    fn from(mode: EnumOrUnknown<ControlMode>) -> Self {
        match mode {
            EnumOrUnknown::Known(mode) => Self::Known(mode),
            EnumOrUnknown::Unknown(number) => Self::Undefined(number.into()),
        }
    }
}

impl Mode {
    /// The functions it grants: none while it is not known.
    pub fn grants(self) -> Grants {
        match self {
            Self::Known(mode) => mode.grants(),
            Self::Undefined(_) | Self::Unknown => Grants::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mode_has_its_value_and_its_grants() {
        let table = [(false, false), (true, true), (true, true), (false, true)];
        let table = table.into_iter().chain([(false, false); 3]);
        for (raw, (mode, (turn, hazard))) in (0_u8..).zip(ControlMode::ALL.iter().zip(table)) {
            assert_eq!((*mode as u8, Mode::from(EnumOrUnknown::from(raw))), (raw, Mode::Known(*mode)));
            assert_eq!(mode.grants(), Grants { turn, hazard }, "{}", mode.name());
        }
        assert_eq!(Mode::from(EnumOrUnknown::from(7)), Mode::Undefined(7));
        assert_eq!(Mode::Undefined(1).grants(), Grants::default());
    }
}
