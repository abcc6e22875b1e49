//! The received signals, and how far their messages are trusted.

use schemars::JsonSchema;
use serde::Serialize;

use super::value::age_text;
use crate::process_status::snapshot::Snapshot;
use can_signal::validation::snapshot::{IntegritySnapshot, MessageSnapshot, SignalSnapshot};

/// A signal with its raw value.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct RawView {
    /// Name of the signal.
    pub name: String,
    /// The raw value in decimal, or `no value`.
    pub value: String,
    /// Its meaning; empty where there is none.
    pub meaning: String,
    /// Its age; empty while there is no value.
    pub age: String,
    /// Why it is not valid; `None` while it is.
    pub missing: Option<String>,
    /// The result of the integrity check of its message; `None` for a message without one.
    pub integrity: Option<String>,
}

pub(super) fn message_of<'a>(snapshot: &'a Snapshot, signal: &SignalSnapshot) -> Option<&'a MessageSnapshot> {
    snapshot.messages.iter().find(|message| {
        (&message.name, &message.bus, message.used_by) == (&signal.message, &signal.bus, signal.used_by)
    })
}

pub(super) fn integrity_text(integrity: &IntegritySnapshot) -> String {
    match (integrity.is_trusted, integrity.last_reject) {
        (None, _) => "not checked yet".to_owned(),
        (Some(true), _) => "trusted".to_owned(),
        (Some(false), reject) => reject.map_or_else(|| "rejected".to_owned(), |reject| reject.to_string()),
    }
}

impl RawView {
    pub(super) fn of(snapshot: &Snapshot, signal: &SignalSnapshot) -> Self {
        let integrity = message_of(snapshot, signal).and_then(|message| message.integrity.as_ref());
        Self {
            name: signal.name.clone(),
            value: signal.raw.map_or_else(|| "no value".to_owned(), |raw| raw.to_string()),
            meaning: signal.raw.map_or_else(String::new, |_| signal.meanings.join(", ")),
            age: signal.age_ms.map_or_else(String::new, age_text),
            missing: signal.missing.as_ref().map(|missing| missing.text.clone()),
            integrity: integrity.map(|integrity| match integrity.rejected {
                0 => integrity_text(integrity),
                rejected => format!("{} ({rejected} rejected)", integrity_text(integrity)),
            }),
        }
    }

    /// Returns the value, its meaning and its age in a line: `1 turn left, 12 ms`.
    pub fn text(&self) -> String {
        let value = [self.value.as_str(), &self.meaning].join(" ");
        let age = if self.age.is_empty() { String::new() } else { format!(", {}", self.age) };
        format!("{}{age}", value.trim_end())
    }
}
