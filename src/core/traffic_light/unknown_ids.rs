//! Ids of a scenario that the map does not know, found before it runs (Q14).

use std::fmt;

use super::scenario::{Action, Scenario, Test, Trigger};
use crate::core::map::light_map::LightMap;

/// An id that is neither a head nor a group.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {id} is neither a signal head nor a group of the map")]
pub struct UnknownTarget {
    /// The id.
    pub id: i64,
    /// Where it stands.
    pub place: Place,
}

/// A place in a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// A state of a phase.
    Phase {
        /// Name of the controller.
        controller: String,
        /// Name of the phase.
        phase: String,
    },
    /// An action before the start.
    Init,
    /// An action of an event.
    Event(String),
    /// A condition, by its name.
    Condition(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Phase { controller, phase } => write!(f, "controller \"{controller}\", phase \"{phase}\""),
            Self::Init => f.write_str("init actions"),
            Self::Event(name) => write!(f, "event \"{name}\""),
            Self::Condition(name) => write!(f, "condition \"{name}\""),
        }
    }
}

/// All of them, in the order of the document.
pub fn check_ids(scenario: &Scenario, map: &LightMap) -> Vec<UnknownTarget> {
    let mut unknown = Vec::new();
    let mut check = |id: i64, place: Place| {
        if map.group(id).is_none() && map.head(id).is_none() {
            unknown.push(UnknownTarget { id, place });
        }
    };
    for controller in &scenario.controllers {
        for phase in &controller.phases {
            for entry in &phase.entries {
                let place = Place::Phase { controller: controller.name.clone(), phase: phase.name.clone() };
                check(entry.target.id, place);
            }
        }
    }
    for action in &scenario.init {
        for id in action.ids() {
            check(*id, Place::Init);
        }
    }
    let check_trigger = |trigger: &Option<Trigger>, check: &mut dyn FnMut(i64, Place)| {
        for condition in trigger.iter().flat_map(|trigger| trigger.groups.iter().flatten()) {
            if let Test::State { target, .. } = &condition.test {
                check(target.id, Place::Condition(condition.name.clone()));
            }
        }
    };
    for act in &scenario.acts {
        check_trigger(&act.start, &mut check);
        check_trigger(&act.stop, &mut check);
        for event in &act.events {
            check_trigger(&event.start, &mut check);
            for id in event.actions.iter().flat_map(Action::ids) {
                check(*id, Place::Event(event.name.clone()));
            }
        }
    }
    check_trigger(&scenario.stop, &mut check);
    unknown
}
