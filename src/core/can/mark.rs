//! Marks of the driver's actions in a recording.

use derive_more::Display;

/// A change of the driver's action, noted at its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Display)]
#[display("{}", self.name())]
pub enum DriverMark {
    /// The driver operates nothing from now on.
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

impl DriverMark {
    /// All marks in the order of their declaration.
    pub const ALL: [Self; 5] = [Self::Quiet, Self::Left, Self::Right, Self::Hazard, Self::Off];

    /// Returns the name of the mark in a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quiet => "quiet",
            Self::Left => "left",
            Self::Right => "right",
            Self::Hazard => "hazard",
            Self::Off => "off",
        }
    }

    /// Returns the mark with this name, in upper or lower case; `None` when there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mark| mark.name().eq_ignore_ascii_case(name))
    }
}
