//! The state that a source tells, or why it tells none.

use crate::core::can::bus::Received;
use crate::core::validation::observation::MissingReason;
use crate::core::validation::table::SignalIndex;

/// What an enumerated turn signal can say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TurnCode {
    /// No indicator on.
    Off,
    /// Left indicators on.
    Left,
    /// Right indicators on.
    Right,
    /// Both sides on: hazard.
    Both,
}

/// What a hazard signal can say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct HazardCode {
    /// Whether the hazard lights are on.
    pub active: bool,
    /// Why, as a position in the binding's list of reasons.
    pub reason: Option<u8>,
}

/// A state and when it was received, or why there is none.
pub type Judged<T> = Result<(T, Received), UnavailableReason>;

/// Why a state is not published.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnavailableReason {
    /// The profile binds no signal that could tell.
    Unbound,
    /// Unknown: no believable value of this signal.
    Absent(SignalIndex, MissingReason),
    /// Unknown: the vehicle says "not available", with this raw value.
    NotAvailable(SignalIndex, i128),
    /// Invalid: the profile gives this raw value no meaning.
    Undefined(SignalIndex, i128),
    /// Invalid: left and right are on at once, which the profile calls undefined.
    BothOn([(SignalIndex, i128); 2]),
    /// The value itself says "fault".
    Fault(SignalIndex, i128),
    /// Unknown: lamps that are dark may be between two flashes.
    WatchingLamps([SignalIndex; 2]),
    /// Unknown: what this stalk or button was used for before it came into sight.
    Settling(SignalIndex),
}
