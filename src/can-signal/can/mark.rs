//! Marks of the driver's actions in a recording.

use serde::{Deserialize, Serialize};

use gateway_base::names::{display_by_name, variant};

/// A change of the driver's action, recorded when it happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DriverMark {
    /// The driver operates nothing from this time on.
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
    /// Returns the mark with this name, in upper or lower case; `None` for an unknown name.
    pub fn from_name(name: &str) -> Option<Self> {
        variant(&name.to_ascii_lowercase())
    }
}

display_by_name!(DriverMark);
