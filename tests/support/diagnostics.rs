//! Possible diagnostics: every status with its messages and keys, as `tests/diagnostics.toml` and so `docs/diagnostics.md`
//! list them, and the check of a status against that list.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;
use signal_gateway::core::diagnostics::{Level, Status};

use super::rows::rows;

/// Every kind of status.
pub(crate) static TASKS: LazyLock<Vec<Task>> = LazyLock::new(|| {
    let catalogue: Result<Catalogue, _> = toml::from_str(include_str!("../diagnostics.toml"));
    let Catalogue { reasons, status } = catalogue.unwrap_or_else(|refused| panic!("{refused}"));
    let task = |status: StatusRows| Task {
        names: status.names,
        about: status.about,
        messages: status.messages.into_iter().flat_map(|row| messages(row, &reasons)).collect(),
        keys: status.keys.into_iter().map(key).collect(),
    };
    status.into_iter().map(task).collect()
});

/// The file, whose comments say what the columns are.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Catalogue {
    reasons: BTreeMap<String, Reasons>,
    status: Vec<StatusRows>,
}

#[derive(Deserialize)]
struct Reasons(#[serde(deserialize_with = "rows")] Vec<[String; 2]>);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StatusRows {
    names: Vec<String>,
    about: String,
    #[serde(deserialize_with = "rows")]
    messages: Vec<[String; 3]>,
    #[serde(deserialize_with = "rows")]
    keys: Vec<[String; 4]>,
}

/// The message of a row, or one for each reason of the list that it names.
fn messages([level, pattern, action]: [String; 3], reasons: &BTreeMap<String, Reasons>) -> Vec<Message> {
    let mut levels = [Level::Ok, Level::Warn, Level::Error].into_iter();
    let found = levels.find(|known| known.to_string() == level);
    let level = found.unwrap_or_else(|| panic!("{level} is not a level"));
    for (name, Reasons(reasons)) in reasons {
        let place = format!("{{{name}}}");
        if pattern.contains(&place) {
            let message = |[reason, action]: &[String; 2]| Message {
                level,
                pattern: pattern.replace(&place, reason),
                action: action.clone(),
            };
            return reasons.iter().map(message).collect();
        }
    }
    vec![Message { level, pattern, action }]
}

fn key([name, unit, meaning, present]: [String; 4]) -> Key {
    Key { name, unit, meaning, present }
}

/// One kind of status.
pub(crate) struct Task {
    /// The names after `<node>: `; `{interface}` stands for any name.
    pub(crate) names: Vec<String>,
    /// Subject of the status, and when it exists.
    pub(crate) about: String,
    pub(crate) messages: Vec<Message>,
    pub(crate) keys: Vec<Key>,
}

/// One message, or one part of a message of several that are joined by `; `.
pub(crate) struct Message {
    pub(crate) level: Level,
    /// `{name}` stands for any text, `[…]` for text that may be absent.
    pub(crate) pattern: String,
    /// Action of an operator.
    pub(crate) action: String,
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

impl Task {
    /// The task of a status's name without the node's.
    pub(crate) fn of(name: &str) -> &'static Self {
        let listed = TASKS.iter().find(|task| task.names.iter().any(|listed| listed == name));
        listed.or_else(|| TASKS.iter().find(|task| task.names == ["{interface}"])).unwrap()
    }

    /// The messages that a status consists of, by position, and the keys it has; or what is not listed.
    pub(crate) fn parts(&self, status: &Status) -> Result<(Vec<usize>, Vec<usize>), String> {
        Ok((self.message_parts(status.level, &status.message)?, self.listed_keys(status)?))
    }

    /// A message as a whole, or each part of it; the worst part has the status's level.
    fn message_parts(&self, level: Level, message: &str) -> Result<Vec<usize>, String> {
        let fitting = |text: &str| -> Vec<usize> {
            let fits = |at: &usize| self.messages[*at].fits(text) && self.messages[*at].level <= level;
            (0..self.messages.len()).filter(fits).collect()
        };
        let level_of = |at: &usize| self.messages[*at].level;
        if let Some(whole) = fitting(message).into_iter().find(|at| level_of(at) == level) {
            return Ok(vec![whole]);
        }
        let mut parts = Vec::new();
        for part in message.split("; ") {
            let worst = fitting(part).into_iter().max_by_key(level_of);
            parts.push(worst.ok_or_else(|| format!("the message `{part}` is not listed for {level}"))?);
        }
        let worst = parts.iter().map(level_of).max();
        if worst == Some(level) { Ok(parts) } else { Err(format!("`{message}` is not listed for {level}")) }
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

impl Message {
    fn fits(&self, text: &str) -> bool {
        match self.pattern.split_once('[') {
            None => fits(&self.pattern, text),
            Some((before, rest)) => {
                let (optional, after) = rest.split_once(']').unwrap();
                [format!("{before}{after}"), format!("{before}{optional}{after}")]
                    .iter()
                    .any(|pattern| fits(pattern, text))
            }
        }
    }
}

/// True if a text is the pattern with something for each `{name}`.
fn fits(pattern: &str, text: &str) -> bool {
    let Some((before, rest)) = pattern.split_once('{') else { return pattern == text };
    let (_, after) = rest.split_once('}').unwrap();
    let Some(text) = text.strip_prefix(before) else { return false };
    let ends = text.char_indices().map(|(at, char)| at + char.len_utf8());
    ends.into_iter().any(|end| fits(after, &text[end..]))
}

/// Fails when a status has a message or a key that `docs/diagnostics.md` does not list.
pub(crate) fn assert_listed(status: &Status) {
    let task = &status.task;
    if let Err(wrong) = Task::of(task).parts(status) {
        panic!("{wrong} of `{task}` in tests/diagnostics.toml: {status:?}");
    }
}
