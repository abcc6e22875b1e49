//! The part of a vehicle profile about traffic-light states received over CAN, compiled.
//!
//! Built once at start by `config`, which has checked it against the DBC.

use std::time::Duration;

use crate::core::traffic_light::bulb::BulbSet;
use crate::core::validation::meaning::Meaning;
use crate::core::validation::table::{MessageIndex, Role, SignalIndex, SignalTable};

/// Everything the profile binds for the v2i channel; by default nothing.
#[derive(Debug, Clone, Default)]
pub struct V2iBinding {
    /// The messages and signals it takes.
    pub table: SignalTable,
    /// In the order of the profile; no id is fed by two of them.
    pub sources: Vec<V2iSource>,
}

impl V2iBinding {
    /// Whether the profile binds nothing.
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// The message that carries a signal.
    pub(super) fn message_of(&self, signal: SignalIndex) -> MessageIndex {
        self.table.signals[signal.0].message
    }
}

/// One `[[v2i]]` section.
#[derive(Debug, Clone)]
pub struct V2iSource {
    /// The states.
    pub states: V2iStates,
    /// `true` = the states can be used. All of them must be true: one that is not known makes the states
    /// unknown, since the unit that sends them may have failed
    /// (docs/spec/traffic-lights.md, "V2X unit on CAN").
    pub status: Vec<Role<bool>>,
}

/// How states are sent.
#[derive(Debug, Clone)]
pub enum V2iStates {
    /// A signal of its own for one group or head.
    Single(Group),
    /// One message that carries one group after another.
    Cycling(Cycle),
}

/// A group or head with a received state.
#[derive(Debug, Clone)]
pub struct Group {
    /// Relation id of a group, or way id of a head.
    pub id: i64,
    /// Its state; the signal is the same one for all groups of a cycle.
    pub state: Role<BulbSet>,
    /// How sure the unit is; 1 without.
    pub confidence: Option<Confidence>,
}

/// How sure a unit is: raw value / `full`.
#[derive(Debug, Clone)]
pub struct Confidence {
    /// 0 to `full` are defined; "not available" counts as 1.
    pub role: Role<()>,
    /// The raw value that means 1; at least 1.
    pub full: u32,
}

impl Confidence {
    /// What a raw value means, 0 to 1; `None` when it is not a defined one.
    pub(super) fn of(&self, raw: i128) -> Option<f64> {
        match self.role.values.meaning(raw) {
            Meaning::Defined(()) => u32::try_from(raw).ok().map(|raw| f64::from(raw) / f64::from(self.full)),
            Meaning::NotAvailable => Some(1.0),
            Meaning::Fault | Meaning::Undefined => None,
        }
    }
}

/// A message that carries one group after another. Its signals are in each of its frames.
#[derive(Debug, Clone)]
pub struct Cycle {
    /// Number of the intersection.
    pub intersection: SignalIndex,
    /// Number of the signal group there.
    pub group: SignalIndex,
    /// The mapped groups, ascending by their keys; all have the same signals.
    pub groups: Vec<(GroupKey, Group)>,
    /// How long a state holds that is not received again while the message goes on for other groups.
    pub timeout: Duration,
}

/// Intersection and signal group, raw values.
pub type GroupKey = (i128, i128);
