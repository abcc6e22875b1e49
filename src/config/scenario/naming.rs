//! Names of acts, events and actions by which conditions find them: each is given once.

use std::collections::{BTreeMap, BTreeSet};

/// Gives out names.
pub(super) struct Names {
    own: BTreeMap<String, usize>,
    given: BTreeSet<String>,
}

impl Names {
    /// `own` are the names that stand in the file, of everything that is to be named.
    pub(super) fn new<'n>(own: impl Iterator<Item = &'n str>) -> Self {
        let mut counts = BTreeMap::new();
        own.for_each(|name| *counts.entry(name.to_owned()).or_insert(0) += 1);
        Self { own: counts, given: BTreeSet::new() }
    }

    /// The own name if no other has it, else the path to it.
    pub(super) fn give(&mut self, own: &str, path: String) -> String {
        let is_telling = !own.is_empty() && self.own.get(own) == Some(&1);
        let mut name = if is_telling { own.to_owned() } else { path };
        while !self.given.insert(name.clone()) {
            name.push('\'');
        }
        name
    }
}

/// `<act>/Event[2]`
pub(super) fn event_path(act: &str, index: usize) -> String {
    format!("{act}/Event[{}]", index + 1)
}

/// `<event>/Action[2]`
pub(super) fn action_path(event: &str, index: usize) -> String {
    format!("{event}/Action[{}]", index + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_given_once() {
        let mut names = Names::new(["go", "", "", "twice", "twice", "b/Event[1]"].into_iter());
        assert_eq!(names.give("go", "x".into()), "go");
        assert_eq!(names.give("", event_path("b", 0)), "b/Event[1]");
        assert_eq!(names.give("twice", event_path("b", 1)), "b/Event[2]");
        assert_eq!(names.give("twice", event_path("b", 2)), "b/Event[3]");
        assert_eq!(names.give("b/Event[1]", "y".into()), "b/Event[1]'");
        assert_eq!(action_path("go", 1), "go/Action[2]");
    }
}
