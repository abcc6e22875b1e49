//! Which commands a control mode lets through (docs/spec/vehicle-interface.md, "Control modes").

/// `ControlModeReport.mode`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum ControlMode {
    /// 0
    NoCommand = 0,
    /// 1
    Autonomous = 1,
    /// 2
    AutonomousSteerOnly = 2,
    /// 3
    AutonomousVelocityOnly = 3,
    /// 4
    Manual = 4,
    /// 5
    Disengaged = 5,
    /// 6
    NotReady = 6,
}

/// What is known of the control mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// This.
    Known(ControlMode),
    /// A value that is not defined.
    Undefined(i128),
    /// Nothing that can be believed: nothing came, or not for longer than its limit.
    Unknown,
}

/// Which functions may be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Grants {
    /// Turn indicators: the steering group.
    pub turn: bool,
    /// Hazard lights: the group of all else.
    pub hazard: bool,
}

impl ControlMode {
    /// All modes, by value.
    pub const ALL: [Self; 7] = [
        Self::NoCommand,
        Self::Autonomous,
        Self::AutonomousSteerOnly,
        Self::AutonomousVelocityOnly,
        Self::Manual,
        Self::Disengaged,
        Self::NotReady,
    ];

    /// The mode with that value.
    pub fn from_raw(raw: u8) -> Option<Self> {
        Self::ALL.get(usize::from(raw)).copied()
    }

    /// The constant's name in the `.msg` file.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoCommand => "NO_COMMAND",
            Self::Autonomous => "AUTONOMOUS",
            Self::AutonomousSteerOnly => "AUTONOMOUS_STEER_ONLY",
            Self::AutonomousVelocityOnly => "AUTONOMOUS_VELOCITY_ONLY",
            Self::Manual => "MANUAL",
            Self::Disengaged => "DISENGAGED",
            Self::NotReady => "NOT_READY",
        }
    }

    /// What it lets through. Modes the interface leaves undecided let nothing through.
    pub fn grants(self) -> Grants {
        match self {
            Self::Autonomous | Self::AutonomousSteerOnly => Grants { turn: true, hazard: true },
            Self::AutonomousVelocityOnly => Grants { turn: false, hazard: true },
            Self::NoCommand | Self::Manual | Self::Disengaged | Self::NotReady => Grants::default(),
        }
    }
}

impl Mode {
    /// What it lets through: nothing while it is not known.
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
        for (raw, (mode, (turn, hazard))) in (0..).zip(ControlMode::ALL.into_iter().zip(table)) {
            assert_eq!((mode as u8, ControlMode::from_raw(raw)), (raw, Some(mode)));
            assert_eq!(mode.grants(), Grants { turn, hazard }, "{}", mode.name());
        }
        assert_eq!(ControlMode::from_raw(7), None);
        assert_eq!(Mode::Undefined(1).grants(), Grants::default());
    }
}
