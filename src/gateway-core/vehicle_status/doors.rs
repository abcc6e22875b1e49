//! Doors; each door can be unknown separately.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::state::{Judged, StatusContext, StatusReason};
use can_signal::can::ReceiveTime;
use can_signal::validation::table::Role;
use can_signal::validation::unusable::Unusable;
use gateway_base::names::named_by_variant;

/// Maximum number of doors of a vehicle.
pub const MAX_DOORS: usize = 16;

/// State of a door, as in `DoorStatus.status`.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
#[repr(u8)]
pub enum DoorState {
    /// `UNKNOWN`, 0: no signal says it.
    #[default]
    Unknown = 0,
    /// `NOT_AVAILABLE`, 1: the vehicle says that it does not know.
    NotAvailable = 1,
    /// `OPENED`, 2.
    Opened = 2,
    /// `CLOSED`, 3.
    Closed = 3,
    /// `OPENING`, 4.
    Opening = 4,
    /// `CLOSING`, 5.
    Closing = 5,
}

named_by_variant!(DoorState);

impl DoorState {
    /// All states.
    pub const ALL: [Self; 6] =
        [Self::Unknown, Self::NotAvailable, Self::Opened, Self::Closed, Self::Opening, Self::Closing];
}

/// A door of the vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Door {
    /// Name for display, e.g. `front left`; used as description in the layout of the doors.
    pub name: String,
    /// True if passengers board through this door.
    pub is_entrance: bool,
    /// True if passengers alight through this door.
    pub is_exit: bool,
    /// Meanings of the raw values.
    pub role: Role<DoorState>,
}

impl Door {
    /// Returns the name, and whether passengers board and alight through this door.
    pub fn layout_text(&self) -> String {
        let uses = [(self.is_entrance, "entrance"), (self.is_exit, "exit")];
        let uses = uses.into_iter().filter_map(|(is_used, text)| is_used.then_some(text));
        std::iter::once(self.name.as_str()).chain(uses).collect::<Vec<_>>().join(" ")
    }
}

/// States of all doors in the order of the profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DoorStates {
    states: [DoorState; MAX_DOORS],
    count: usize,
}

impl DoorStates {
    /// Returns true if a door is not closed, false if all are; `None` if neither is certain.
    pub fn has_open(&self) -> Option<bool> {
        let is_open =
            |state: &DoorState| matches!(state, DoorState::Opened | DoorState::Opening | DoorState::Closing);
        if self.as_slice().iter().any(is_open) {
            return Some(true);
        }
        self.as_slice().iter().all(|state| *state == DoorState::Closed).then_some(false)
    }

    /// Returns the states, one for each door.
    pub fn as_slice(&self) -> &[DoorState] {
        &self.states[..self.count]
    }
}

/// Returns the doors with their states as text.
pub fn doors_text<'a>(doors: impl Iterator<Item = (&'a str, DoorState)>) -> String {
    doors.map(|(name, state)| format!("{name} {}", state.name())).collect::<Vec<_>>().join(", ")
}

impl FromIterator<DoorState> for DoorStates {
    /// Doors beyond [`MAX_DOORS`] are omitted.
    fn from_iter<I: IntoIterator<Item = DoorState>>(states: I) -> Self {
        let mut all = Self::default();
        for (place, state) in all.states.iter_mut().zip(states) {
            *place = state;
            all.count += 1;
        }
        all
    }
}

/// Evaluates all doors. The report is unavailable while no door is known; otherwise it contains a door
/// without a value as `UNKNOWN`. Also returns the first reason why a door is not known.
pub fn judge(doors: &[Door], context: StatusContext<'_>) -> (Judged<DoorStates>, Option<StatusReason>) {
    let mut newest: Option<ReceiveTime> = None;
    let mut unknown = None;
    let state_of = |door: &Door| match context.defined(&door.role) {
        Ok((state, received)) => {
            newest = Some(newest.map_or(received, |newest| newest.newest(received)));
            state
        }
        Err(reason) => {
            unknown = unknown.or(Some(reason));
            let is_told = matches!(reason, StatusReason::Signal(Unusable::NotAvailable(..)));
            if is_told { DoorState::NotAvailable } else { DoorState::Unknown }
        }
    };
    let states: DoorStates = doors.iter().map(state_of).collect();
    // A profile names at least one door.
    let state = newest.map(|newest| (states, newest)).ok_or(unknown.unwrap_or(StatusReason::NoSource));
    (state, unknown.filter(|_| state.is_ok()))
}
