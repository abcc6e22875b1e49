//! Index of a bus and state of the link below it.

/// Index of a configured CAN bus in the settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BusIndex(pub u8);

/// State of the link below a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LinkState {
    /// Frames can arrive.
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

impl LinkState {
    /// Name in diagnostics and black-box files, without the `errno`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Up => "up",
            Self::Down => "down",
            Self::Missing => "missing",
            Self::NotCan => "not_can",
            Self::Failed(_) => "failed",
            Self::Ended => "ended",
        }
    }
}
