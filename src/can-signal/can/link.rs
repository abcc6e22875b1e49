//! Index of a bus, and state of its link.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gateway_base::names::display_by_name;

/// Index of a configured CAN bus in the settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BusIndex(pub u8);

/// State of the link below a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LinkState {
    /// The interface is up, so that frames can arrive.
    Up,
    /// The interface exists but is down (`ENETDOWN`).
    Down,
    /// There is no interface with that name (`ENODEV`), e.g. an unplugged adapter.
    Missing,
    /// The interface exists and is not a CAN interface.
    NotCan,
    /// The interface exists but cannot be opened, with the `errno`.
    Failed(i32),
    /// The recording has ended, so that no frame follows.
    Ended,
}

display_by_name!(LinkState);

impl LinkState {
    /// Returns the state as text.
    pub fn text(self) -> String {
        if self == Self::NotCan { "not a CAN interface".to_owned() } else { format!("link {self}") }
    }
}
