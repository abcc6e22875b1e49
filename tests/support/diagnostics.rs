//! Possible diagnostics: every status with its messages, as the catalogue lists them, and its
//! keys, as `tests/diagnostics.toml` does; and the check of a status against both.

use std::sync::LazyLock;

use can_signal::can::catalogue::LINK;
use gateway_base::diagnostics::{Level, MessageRow, Section, Status};
use gateway_core::gateway::catalogue::REASONS;
use serde::Deserialize;
use signal_gateway::process_status::catalogue::sections;

use super::rows::rows;

/// Every kind of status, in the order of the catalogue.
pub(crate) static TASKS: LazyLock<Vec<Task>> = LazyLock::new(|| {
    let keys: Result<Catalogue, _> = toml::from_str(include_str!("../diagnostics.toml"));
    let Catalogue { status } = keys.unwrap_or_else(|refused| panic!("{refused}"));
    let names: Vec<_> = status.iter().map(|status| status.names.clone()).collect();
    let expected: Vec<_> = sections().map(|section| section.names.to_vec()).collect();
    assert_eq!(names, expected, "tests/diagnostics.toml has the statuses of the catalogue, in its order");
    let task = |(section, StatusKeys { about, keys, .. })| Task {
        section,
        about,
        keys: keys.into_iter().map(key).collect(),
    };
    sections().zip(status).map(task).collect()
});

/// The file, whose comments say what the columns are.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Catalogue {
    status: Vec<StatusKeys>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StatusKeys {
    names: Vec<String>,
    about: String,
    #[serde(deserialize_with = "rows")]
    keys: Vec<[String; 4]>,
}

fn key([name, unit, meaning, present]: [String; 4]) -> Key {
    Key { name, unit, meaning, present }
}

/// One kind of status.
pub(crate) struct Task {
    /// Its names and messages.
    pub(crate) section: &'static Section,
    /// Subject of the status, and when it exists.
    pub(crate) about: String,
    pub(crate) keys: Vec<Key>,
}

/// One key of a status.
pub(crate) struct Key {
    pub(crate) name: String,
    /// The unit, or `-`.
    pub(crate) unit: String,
    pub(crate) meaning: String,
    /// Condition under which it exists, or `always`.
    pub(crate) present: String,
}

/// All reasons in messages.
pub(crate) fn reasons() -> impl Iterator<Item = &'static MessageRow> {
    LINK.iter().copied().chain(REASONS.iter().copied().flatten().copied())
}

impl Task {
    /// The kind of a status.
    pub(crate) fn of(status: &Status) -> &'static Self {
        TASKS.iter().find(|task| std::ptr::eq(task.section, status.section)).unwrap()
    }

    /// The keys of a status that is listed, by position; or what is not listed.
    pub(crate) fn listed(&self, status: &Status) -> Result<Vec<usize>, String> {
        let is = |row: &'static MessageRow| move |listed: &'static MessageRow| std::ptr::eq(row, listed);
        for row in &status.rows {
            if !self.section.rows().any(is(row)) && !reasons().any(is(row)) {
                return Err(format!("the message `{}` is not listed", row.template));
            }
        }
        let names = self.section.names;
        if !names.contains(&status.task.as_str()) && names != ["{interface}"] {
            return Err(format!("the name is not one of {names:?}"));
        }
        if (status.level > Level::Ok) == status.remedy.is_empty() {
            return Err(format!("the remedy of {} is `{}`", status.level, status.remedy));
        }
        self.listed_keys(status)
    }

    /// All keys are listed, in the order of the list, and none is missing that is always there.
    fn listed_keys(&self, status: &Status) -> Result<Vec<usize>, String> {
        let mut listed = Vec::new();
        for (name, _) in &status.values {
            let at = self.keys.iter().position(|key| key.name == *name);
            let at = at.ok_or_else(|| format!("the key `{name}` is not listed"))?;
            if listed.last().is_some_and(|last| *last > at) {
                return Err(format!("the key `{name}` is listed at another position"));
            }
            listed.push(at);
        }
        let missing =
            (0..self.keys.len()).find(|at| self.keys[*at].present == "always" && !listed.contains(at));
        match missing {
            Some(at) => Err(format!("the key `{}` is missing", self.keys[at].name)),
            None => Ok(listed),
        }
    }
}

/// Fails when a status has a message or a key that `docs/diagnostics.md` does not list.
pub(crate) fn assert_listed(status: &Status) {
    if let Err(wrong) = Task::of(status).listed(status) {
        panic!("{wrong} of `{}`: {status:?}", status.task);
    }
}
