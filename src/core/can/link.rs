//! Which bus, and what is known of the link below it.

/// Which of the configured CAN buses; an index into the settings' list of buses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BusIndex(pub u8);

/// What is known of the link below a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LinkState {
    /// Frames can arrive.
    Up,
    /// The interface exists but is down (`ENETDOWN`).
    Down,
    /// There is no interface of that name (`ENODEV`), e.g. an unplugged adapter.
    Missing,
    /// The interface is there but cannot be opened; the code is the `errno`.
    Failed(i32),
    /// The recording has ended: nothing more will come.
    Ended,
}
