//! Unique names of acts, events and actions, by which conditions find them.

use std::collections::{BTreeMap, BTreeSet};

use crate::config::reading::joined;

pub(super) struct Names {
    own: BTreeMap<String, usize>,
    assigned: BTreeSet<String>,
}

impl Names {
    /// Creates an assigner; `own` are the names in the file of all elements to be named.
    pub(super) fn new<'n>(own: impl Iterator<Item = &'n str>) -> Self {
        let mut counts = BTreeMap::new();
        own.for_each(|name| *counts.entry(name.to_owned()).or_insert(0) += 1);
        Self { own: counts, assigned: BTreeSet::new() }
    }

    /// Assigns an element its own name if no other element has it, otherwise its path.
    pub(super) fn assign(&mut self, own: &str, path: String) -> String {
        let is_unique = !own.is_empty() && self.own.get(own) == Some(&1);
        let mut name = if is_unique { own.to_owned() } else { path };
        while !self.assigned.insert(name.clone()) {
            name.push('\'');
        }
        name
    }
}

/// Returns the path of an event: `<act>/Event[2]`.
pub(super) fn event_path(act: &str, index: usize) -> String {
    format!("{act}/Event[{}]", index + 1)
}

/// Returns the path of an action: `<event>/Action[2]`.
pub(super) fn action_path(event: &str, index: usize) -> String {
    format!("{event}/Action[{}]", index + 1)
}

/// Returns at most 20 names as a remedy: `there are a, b`.
pub(super) fn listed<'n>(names: impl Iterator<Item = &'n str>) -> String {
    format!("there are {}", joined(names.map(str::to_owned), 20))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_assigned_once() {
        let mut names = Names::new(["go", "", "", "twice", "twice", "b/Event[1]"].into_iter());
        assert_eq!(names.assign("go", "x".into()), "go");
        assert_eq!(names.assign("", event_path("b", 0)), "b/Event[1]");
        assert_eq!(names.assign("twice", event_path("b", 1)), "b/Event[2]");
        assert_eq!(names.assign("twice", event_path("b", 2)), "b/Event[3]");
        assert_eq!(names.assign("b/Event[1]", "y".into()), "b/Event[1]'");
        assert_eq!(action_path("go", 1), "go/Action[2]");
    }
}
