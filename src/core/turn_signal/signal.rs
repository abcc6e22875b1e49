//! Commands and sides (docs/spec/turn-signal-decider.md, "Commands").

use std::fmt;

/// `TurnIndicatorsCommand.command`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[repr(u8)]
pub enum Signal {
    /// 0: nothing is known or wanted.
    #[default]
    NoCommand = 0,
    /// 1: off.
    Disable = 1,
    /// 2: left.
    Left = 2,
    /// 3: right.
    Right = 3,
}

/// `HazardLightsCommand.command`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[repr(u8)]
pub enum Hazard {
    /// 0: nothing is known or wanted.
    #[default]
    NoCommand = 0,
    /// 1: off.
    Disable = 1,
    /// 2: on.
    Enable = 2,
}

/// A side of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// Left.
    Left,
    /// Right.
    Right,
}

impl Signal {
    /// The side that blinks, if one does.
    pub const fn side(self) -> Option<Side> {
        match self {
            Self::Left => Some(Side::Left),
            Self::Right => Some(Side::Right),
            Self::NoCommand | Self::Disable => None,
        }
    }
}

impl Side {
    /// The other one.
    pub const fn opposite(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }
}

impl From<Side> for Signal {
    fn from(side: Side) -> Self {
        match side {
            Side::Left => Self::Left,
            Side::Right => Self::Right,
        }
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoCommand => "NO_COMMAND",
            Self::Disable => "DISABLE",
            Self::Left => "LEFT",
            Self::Right => "RIGHT",
        })
    }
}

impl fmt::Display for Hazard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoCommand => "NO_COMMAND",
            Self::Disable => "DISABLE",
            Self::Enable => "ENABLE",
        })
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Signal::from(*self).fmt(f)
    }
}

/// What the hazard lights do when the planner and the system both have a say: on when either wants
/// them on (docs/spec/turn-signal-decider.md, "Hazard lights").
pub fn joined_hazard(planner: Hazard, system: Hazard) -> Hazard {
    if planner == Hazard::Enable || system == Hazard::Enable { Hazard::Enable } else { Hazard::Disable }
}
