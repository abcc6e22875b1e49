//! Commands granted by each control mode (docs/spec/vehicle-interface.md, "Control modes").

use crate::control_mode::ControlMode;
use can_signal::validation::unusable::Unusable;
use turn_signal::light_command::EnumOrUnknown;

/// Control mode of the vehicle, or why it is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ModeState {
    /// The vehicle is in a defined mode.
    Known(ControlMode),
    /// The message has a number that is not a mode.
    Undefined(u8),
    /// A signal of the control mode has no usable value.
    Unusable(Unusable),
    /// Nothing has been received within the timeout.
    #[default]
    Unknown,
}

/// Functions that may be requested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Grants {
    /// Turn indicators, which belong to the steering group.
    pub turn: bool,
    /// Hazard lights, which belong to the remaining group.
    pub hazard: bool,
}

impl ControlMode {
    /// Returns the functions that the mode grants; modes that the interface leaves open grant none.
    pub fn grants(self) -> Grants {
        match self {
            Self::Autonomous | Self::AutonomousSteerOnly => Grants { turn: true, hazard: true },
            Self::AutonomousVelocityOnly => Grants { turn: false, hazard: true },
            Self::NoCommand | Self::Manual | Self::Disengaged | Self::NotReady => Grants::default(),
        }
    }
}

impl From<EnumOrUnknown<ControlMode>> for ModeState {
    fn from(mode: EnumOrUnknown<ControlMode>) -> Self {
        match mode {
            EnumOrUnknown::Known(mode) => Self::Known(mode),
            EnumOrUnknown::Unknown(number) => Self::Undefined(number),
        }
    }
}

impl ModeState {
    /// Returns the undefined number of the message or signal; `None` for a defined or unknown mode.
    pub fn undefined(self) -> Option<i128> {
        match self {
            Self::Undefined(number) => Some(number.into()),
            Self::Unusable(Unusable::Undefined(_, raw)) => Some(raw),
            Self::Known(_) | Self::Unusable(_) | Self::Unknown => None,
        }
    }

    /// Returns the functions that the mode grants: none while the mode is unknown.
    pub fn grants(self) -> Grants {
        match self {
            Self::Known(mode) => mode.grants(),
            Self::Undefined(_) | Self::Unusable(_) | Self::Unknown => Grants::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use turn_signal::light_command::Numbered as _;

    #[test]
    fn each_mode_has_its_value_and_its_grants() {
        let table = [(false, false), (true, true), (true, true), (false, true)];
        let table = table.into_iter().chain([(false, false); 3]);
        for (raw, (mode, (turn, hazard))) in (0_u8..).zip(ControlMode::ALL.iter().zip(table)) {
            assert_eq!(
                (*mode as u8, ModeState::from(EnumOrUnknown::from(raw))),
                (raw, ModeState::Known(*mode))
            );
            assert_eq!(mode.grants(), Grants { turn, hazard }, "{}", mode.name());
        }
        assert_eq!(ModeState::from(EnumOrUnknown::from(7)), ModeState::Undefined(7));
        assert_eq!(ModeState::Undefined(1).grants(), Grants::default());
    }
}
