//! Possible diagnostics: every status with its messages and keys, as `docs/diagnostics.md` lists them, and the
//! check of a status against that list.

mod catalogue;

use std::sync::LazyLock;

use signal_gateway::core::diagnostics::{Level, Status};

/// Every kind of status.
pub(crate) static TASKS: LazyLock<Vec<Task>> = LazyLock::new(catalogue::tasks);

/// One kind of status.
pub(crate) struct Task {
    /// The names after `<node>: `; `{interface}` stands for any name.
    pub(crate) names: &'static [&'static str],
    /// Subject of the status, and when it exists.
    pub(crate) about: &'static str,
    pub(crate) messages: Vec<Message>,
    pub(crate) keys: Vec<Key>,
}

/// One message, or one part of a message of several that are joined by `; `.
pub(crate) struct Message {
    pub(crate) level: Level,
    /// `{name}` stands for any text, `[…]` for text that may be absent.
    pub(crate) pattern: String,
    /// Action of an operator.
    pub(crate) action: &'static str,
}

/// One key of a status.
pub(crate) struct Key {
    pub(crate) name: &'static str,
    /// The unit, or `-`.
    pub(crate) unit: &'static str,
    pub(crate) meaning: &'static str,
    /// Condition under which it exists; empty = always.
    pub(crate) when: &'static str,
}

impl Task {
    /// The task of a status's name without the node's.
    pub(crate) fn of(name: &str) -> &'static Self {
        let listed = TASKS.iter().find(|task| task.names.contains(&name));
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
        let missing = (0..self.keys.len()).find(|at| self.keys[*at].when.is_empty() && !listed.contains(at));
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
    let name = status.name.split_once(": ").unwrap().1;
    if let Err(wrong) = Task::of(name).parts(status) {
        panic!("{wrong} of `{name}` in tests/support/diagnostics/catalogue.rs: {status:?}");
    }
}
