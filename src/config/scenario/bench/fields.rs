//! The keys of one table, taken one by one; what is left is refused.

use super::super::reading::{Given, Reading};
use super::super::value::{Entry, Kind, Value};

/// The keys of a table.
pub(super) struct Fields<'v> {
    value: &'v Value,
    entries: &'v [Entry],
    known: Vec<&'static str>,
}

impl<'v> Fields<'v> {
    /// Those of a table; anything else is refused.
    pub(super) fn of(reading: &mut Reading, value: &'v Value) -> Option<Self> {
        match &value.kind {
            Kind::Map(entries) => Some(Self { value, entries, known: Vec::new() }),
            Kind::Null | Kind::Scalar { .. } | Kind::List(_) => {
                let reason = format!("{} stands where a table is wanted", value.described());
                reading.refuse(&value.spot, reason, "see config/scenarios/bench.toml");
                None
            }
        }
    }

    /// The value of a key; nothing (YAML's null) is as if it were not there.
    pub(super) fn take(&mut self, key: &'static str) -> Option<&'v Value> {
        self.known.push(key);
        let entry = self.entries.iter().find(|entry| entry.key == key)?;
        (!matches!(entry.value.kind, Kind::Null)).then_some(&entry.value)
    }

    /// Whether the key is there.
    pub(super) fn has(&self, key: &str) -> bool {
        self.entries.iter().any(|entry| entry.key == key)
    }

    /// A single value as text.
    pub(super) fn text(&mut self, reading: &mut Reading, key: &'static str) -> Option<Given> {
        self.take(key).and_then(|value| given(reading, value))
    }

    /// A single value that is not quoted.
    pub(super) fn number(&mut self, reading: &mut Reading, key: &'static str) -> Option<Given> {
        let value = self.take(key)?;
        if let Kind::Scalar { text, is_quoted: true } = &value.kind {
            reading.refuse(&value.spot, format!("{text:?} is a text"), "give a number, without quotes");
            return None;
        }
        given(reading, value)
    }

    /// `true` or `false`; false when it is not there.
    pub(super) fn truth(&mut self, reading: &mut Reading, key: &'static str) -> bool {
        let Some(value) = self.take(key) else { return false };
        match &value.kind {
            Kind::Scalar { text, is_quoted: false } if text == "true" => true,
            Kind::Scalar { text, is_quoted: false } if text == "false" => false,
            Kind::Null | Kind::Scalar { .. } | Kind::List(_) | Kind::Map(_) => {
                reading.refuse(
                    &value.spot,
                    format!("{} stands here", value.described()),
                    "give true or false",
                );
                false
            }
        }
    }

    /// A text that must be there.
    pub(super) fn required(&mut self, reading: &mut Reading, key: &'static str) -> Option<Given> {
        let Some(value) = self.take(key) else {
            let reason = format!("the key {key} is missing");
            reading.refuse(&self.value.spot, reason, "see config/scenarios/bench.toml");
            return None;
        };
        given(reading, value)
    }

    /// A list of tables, `[[key]]`.
    pub(super) fn list(&mut self, reading: &mut Reading, key: &'static str) -> &'v [Value] {
        let Some(value) = self.take(key) else { return &[] };
        if let Kind::List(items) = &value.kind {
            return items;
        }
        let reason = format!("{} stands where a list is wanted", value.described());
        reading.refuse(&value.spot, reason, &format!("write [[{key}]], or in YAML a list"));
        &[]
    }

    /// Refuses every key that nobody took.
    pub(super) fn done(self, reading: &mut Reading) {
        for entry in self.entries.iter().filter(|entry| !self.known.contains(&entry.key.as_str())) {
            let remedy = format!("known here are {}", self.known.join(", "));
            reading.refuse(&entry.spot, format!("unknown key {:?}", entry.key), &remedy);
        }
    }
}

/// A single value as text.
pub(super) fn given(reading: &mut Reading, value: &Value) -> Option<Given> {
    match &value.kind {
        Kind::Scalar { text, .. } => Some(Given { text: text.clone(), spot: value.spot.clone() }),
        Kind::Null | Kind::List(_) | Kind::Map(_) => {
            let reason = format!("{} stands where a single value is wanted", value.described());
            reading.refuse(&value.spot, reason, "see config/scenarios/bench.toml");
            None
        }
    }
}

/// The values of a list; a single one is a list of one.
pub(super) fn items(value: &Value) -> &[Value] {
    match &value.kind {
        Kind::List(items) => items,
        Kind::Null => &[],
        Kind::Scalar { .. } | Kind::Map(_) => std::slice::from_ref(value),
    }
}
