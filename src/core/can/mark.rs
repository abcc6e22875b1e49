//! Marks of the driver's actions in a recording.

use std::fmt;

/// A change of the driver's action, noted at its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mark {
    /// From now on nothing is operated.
    Quiet,
    /// Indicate to the left.
    Left,
    /// Indicate to the right.
    Right,
    /// Switch the hazard lights on.
    Hazard,
    /// End the action: indicators and hazard lights off.
    Off,
}

impl Mark {
    /// All marks.
    pub const ALL: [Self; 5] = [Self::Quiet, Self::Left, Self::Right, Self::Hazard, Self::Off];

    /// The mark in a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quiet => "quiet",
            Self::Left => "left",
            Self::Right => "right",
            Self::Hazard => "hazard",
            Self::Off => "off",
        }
    }

    /// The mark of this name, in upper or lower case; `None` when there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mark| mark.name().eq_ignore_ascii_case(name))
    }
}

impl fmt::Display for Mark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
