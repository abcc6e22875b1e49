//! The compiled part of a vehicle profile about traffic-light states received over CAN.
//!
//! `config` builds it once at start and has checked it against the DBC.

use std::time::Duration;

use can_signal::validation::meaning::Meaning;
use can_signal::validation::table::{MessageIndex, Role, SignalIndex, SignalTable};
use traffic_lights::bulb::BulbSet;

/// The signals that the profile binds for the v2i channel; none by default.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct V2iBinding {
    /// The bound messages and signals.
    pub table: SignalTable,
    /// The sources in the order of the profile; no two of them have the same id.
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

/// The binding of one `[[v2i]]` section.
#[derive(Debug, Clone, PartialEq)]
pub struct V2iSource {
    /// The signals of the states.
    pub states: V2iStates,
    /// Status signals, true when the states can be used. All of them must be true: one without a value makes
    /// the states invalid, since the unit that sends them may have failed (docs/spec/traffic-lights.md,
    /// "V2X unit on CAN").
    pub status: Vec<Role<bool>>,
}

/// The form in which states are sent.
#[derive(Debug, Clone, PartialEq)]
pub enum V2iStates {
    /// A signal of its own for one group or head.
    Single(BoundGroup),
    /// One message that carries one group after another.
    Cycling(CyclingMessage),
}

/// A group or head with a received state.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundGroup {
    /// Relation id of a group, or way id of a head.
    pub id: i64,
    /// Its state. All groups of a cycle have the same signal.
    pub state: Role<BulbSet>,
    /// The confidence of the unit; `None` means 1.
    pub confidence: Option<Confidence>,
}

/// The confidence of a unit: raw value / `full`.
#[derive(Debug, Clone, PartialEq)]
pub struct Confidence {
    /// The signal, with 0 to `full` defined; "not available" counts as 1.
    pub role: Role<()>,
    /// The raw value that means 1; at least 1.
    pub full: u32,
}

impl Confidence {
    /// Returns the confidence for a raw value, 0 to 1; `None` when the value is not defined.
    pub(super) fn of(&self, raw: i128) -> Option<f64> {
        match self.role.values.meaning(raw) {
            Meaning::Defined(()) => u32::try_from(raw).ok().map(|raw| f64::from(raw) / f64::from(self.full)),
            Meaning::NotAvailable => Some(1.0),
            Meaning::Fault | Meaning::Undefined => None,
        }
    }
}

/// A message that carries one group after another. Its signals are in each of its frames.
#[derive(Debug, Clone, PartialEq)]
pub struct CyclingMessage {
    /// The signal with the number of the intersection.
    pub intersection: SignalIndex,
    /// The signal with the number of the signal group there.
    pub group: SignalIndex,
    /// The mapped groups, ascending by their keys; all have the same signals.
    pub groups: Vec<(GroupKey, BoundGroup)>,
    /// Age at which a state that is not received again becomes invalid while the message continues for other
    /// groups.
    pub timeout: Duration,
}

/// The raw values of intersection and signal group.
pub type GroupKey = (i128, i128);
