//! The sides of the vehicle, and the commands that turn them on (docs/spec/turn-signal-decider.md,
//! "Commands").

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::light_command::TurnCommand;
use gateway_base::names::named_by_variant;

/// A side of the vehicle.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema, Display,
)]
#[display("{}", TurnCommand::from(*self))]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The left side of the vehicle.
    Left,
    /// The right side of the vehicle.
    Right,
}

impl TurnCommand {
    /// Returns the side that blinks, if one does.
    pub const fn side(self) -> Option<Side> {
        match self {
            Self::Left => Some(Side::Left),
            Self::Right => Some(Side::Right),
            Self::NoCommand | Self::Disable => None,
        }
    }
}

named_by_variant!(Side);

impl Side {
    /// Returns the opposite side.
    pub fn opposite(self) -> Self {
        self.choose(Self::Right, Self::Left)
    }

    /// Returns the value for this side.
    pub fn choose<T>(self, left: T, right: T) -> T {
        match self {
            Self::Left => left,
            Self::Right => right,
        }
    }
}

impl From<Side> for TurnCommand {
    fn from(side: Side) -> Self {
        side.choose(Self::Left, Self::Right)
    }
}
