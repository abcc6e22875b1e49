//! Compiled part of a vehicle profile for traffic-light states received over CAN.
//!
//! `config` builds it once at start-up and has checked it against the DBC.

use std::time::Duration;

use can_signal::validation::meaning::Meaning;
use can_signal::validation::table::{MessageIndex, Role, SignalIndex, SignalTable};
use traffic_lights::bulb::BulbSet;

/// Signals that the profile binds for the v2i channel; none by default.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct V2iBinding {
    /// Bound messages and signals.
    pub table: SignalTable,
    /// Sources in the order of the profile; ids are unique across sources.
    pub sources: Vec<V2iSource>,
}

impl V2iBinding {
    /// Returns whether the profile binds no signal.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Returns all bound groups and heads, in the order of the profile.
    pub fn groups(&self) -> impl Iterator<Item = &BoundGroup> {
        self.sources.iter().flat_map(|source| {
            let (single, cycling) = match &source.states {
                V2iStates::Single(group) => (Some(group), &[][..]),
                V2iStates::Cycling(cycle) => (None, &*cycle.groups),
            };
            single.into_iter().chain(cycling.iter().map(|(_, group)| group))
        })
    }

    pub(super) fn message_of(&self, signal: SignalIndex) -> MessageIndex {
        self.table.signals[signal.0].message
    }
}

/// Binding of one `[[v2i]]` section.
#[derive(Debug, Clone, PartialEq)]
pub struct V2iSource {
    /// Signals of the states.
    pub states: V2iStates,
    /// Status signals, true when the states can be used. All of them must be true: a signal without a value
    /// makes the states invalid, since the unit that sends them may have failed (docs/spec/traffic-lights.md,
    /// "V2X unit on CAN").
    pub status: Vec<Role<bool>>,
}

/// Encoding of the states.
#[derive(Debug, Clone, PartialEq)]
pub enum V2iStates {
    /// A separate signal for one group or head.
    Single(BoundGroup),
    /// One message that carries one group after another.
    Cycling(CyclingMessage),
}

/// A group or head with a received state.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundGroup {
    /// Relation id of a group, or way id of a head.
    pub id: i64,
    /// Signal of its state. All groups of a cycle use the same signal.
    pub state: Role<BulbSet>,
    /// Confidence reported by the unit; `None` = 1.
    pub confidence: Option<Confidence>,
}

/// Confidence reported by a unit: raw value / `full`.
#[derive(Debug, Clone, PartialEq)]
pub struct Confidence {
    /// The signal, with 0 to `full` defined; "not available" counts as 1.
    pub role: Role<()>,
    /// Raw value that corresponds to a confidence of 1; at least 1.
    pub full: u32,
}

impl Confidence {
    /// Returns the confidence for a raw value, 0 to 1; `None` if the value is not defined.
    pub(super) fn of(&self, raw: i128) -> Option<f64> {
        match self.role.values.meaning(raw) {
            Meaning::Defined(()) => u32::try_from(raw).ok().map(|raw| f64::from(raw) / f64::from(self.full)),
            Meaning::NotAvailable => Some(1.0),
            Meaning::Fault | Meaning::Undefined => None,
        }
    }
}

/// A message that carries one group after another. Each of its frames contains all its signals.
#[derive(Debug, Clone, PartialEq)]
pub struct CyclingMessage {
    /// Signal with the number of the intersection.
    pub intersection: SignalIndex,
    /// Signal with the number of the signal group at the intersection.
    pub group: SignalIndex,
    /// Mapped groups, ascending by key; all have the same signals.
    pub groups: Vec<(GroupKey, BoundGroup)>,
    /// Age at which a state that is not received again becomes invalid while the message continues for other
    /// groups.
    pub timeout: Duration,
}

/// Raw values of intersection and signal group.
pub type GroupKey = (i128, i128);
