//! The keys of one table, taken one by one; what is left is refused.

use super::location::Location;
use super::value::{Entry, Kind, Value};

/// A text with its place.
#[derive(Debug, Clone)]
pub(in crate::config) struct LocatedText {
    pub(in crate::config) text: String,
    pub(in crate::config) location: Location,
}

/// What collects refusals.
pub(in crate::config) trait Refuse {
    /// Where the keys are explained.
    const SEE: &'static str;

    /// Refuses what stands at a place.
    fn refuse_at(&mut self, location: &Location, reason: String, remedy: &str);
}

/// The keys of a table.
pub(in crate::config) struct Fields<'v> {
    value: &'v Value,
    entries: &'v [Entry],
    known: Vec<&'static str>,
}

impl<'v> Fields<'v> {
    /// Those of a table; anything else is refused.
    pub(in crate::config) fn of<R: Refuse>(reading: &mut R, value: &'v Value) -> Option<Self> {
        match &value.kind {
            Kind::Map(entries) => Some(Self { value, entries, known: Vec::new() }),
            Kind::Null | Kind::Scalar { .. } | Kind::List(_) => {
                let reason = format!("expected a table, found {}", value.described());
                reading.refuse_at(&value.location, reason, &see::<R>());
                None
            }
        }
    }

    /// The value of a key; nothing (YAML's null) is as if it were not there.
    pub(in crate::config) fn take(&mut self, key: &'static str) -> Option<&'v Value> {
        self.known.push(key);
        let entry = self.entries.iter().find(|entry| entry.key == key)?;
        (!matches!(entry.value.kind, Kind::Null)).then_some(&entry.value)
    }

    /// Whether the key is there.
    pub(in crate::config) fn has(&self, key: &str) -> bool {
        self.entries.iter().any(|entry| entry.key == key)
    }

    /// A single value as text.
    pub(in crate::config) fn text(
        &mut self,
        reading: &mut impl Refuse,
        key: &'static str,
    ) -> Option<LocatedText> {
        self.take(key).and_then(|value| given(reading, value))
    }

    /// A single value that is not quoted.
    pub(in crate::config) fn number(
        &mut self,
        reading: &mut impl Refuse,
        key: &'static str,
    ) -> Option<LocatedText> {
        let value = self.take(key)?;
        if let Kind::Scalar { text, is_quoted: true } = &value.kind {
            reading.refuse_at(
                &value.location,
                format!("{text:?} is a text"),
                "give a number, without quotes",
            );
            return None;
        }
        given(reading, value)
    }

    /// `true` or `false`; false when it is not there.
    pub(in crate::config) fn truth(&mut self, reading: &mut impl Refuse, key: &'static str) -> bool {
        self.truth_or(reading, key, false)
    }

    /// `true` or `false`; `otherwise` when it is not there.
    pub(in crate::config) fn truth_or(
        &mut self,
        reading: &mut impl Refuse,
        key: &'static str,
        otherwise: bool,
    ) -> bool {
        let Some(value) = self.take(key) else { return otherwise };
        match &value.kind {
            Kind::Scalar { text, is_quoted: false } if text == "true" => true,
            Kind::Scalar { text, is_quoted: false } if text == "false" => false,
            Kind::Null | Kind::Scalar { .. } | Kind::List(_) | Kind::Map(_) => {
                let reason = format!("{} stands here", value.described());
                reading.refuse_at(&value.location, reason, "give true or false");
                otherwise
            }
        }
    }

    /// Refuses when the key is not there.
    pub(in crate::config) fn must_have<R: Refuse>(&self, reading: &mut R, key: &'static str) -> Option<()> {
        // Nothing (YAML's null) is as if it were not there.
        let is_filled = |entry: &&Entry| entry.key == key && !matches!(entry.value.kind, Kind::Null);
        let found = self.entries.iter().find(is_filled).map(|_| ());
        if found.is_none() {
            reading.refuse_at(&self.value.location, format!("the key {key} is missing"), &see::<R>());
        }
        found
    }

    /// Where the table stands.
    pub(in crate::config) fn location(&self) -> &'v Location {
        &self.value.location
    }

    /// Where a key stands.
    pub(in crate::config) fn location_of(&self, key: &str) -> Option<Location> {
        self.entries.iter().find(|entry| entry.key == key).map(|entry| entry.location.clone())
    }

    /// A text that must be there.
    pub(in crate::config) fn required(
        &mut self,
        reading: &mut impl Refuse,
        key: &'static str,
    ) -> Option<LocatedText> {
        self.must_have(reading, key)?;
        let value = self.take(key)?;
        given(reading, value)
    }

    /// A list of tables, `[[key]]`.
    pub(in crate::config) fn list(&mut self, reading: &mut impl Refuse, key: &'static str) -> &'v [Value] {
        let Some(value) = self.take(key) else { return &[] };
        if let Kind::List(items) = &value.kind {
            return items;
        }
        let reason = format!("expected a list, found {}", value.described());
        reading.refuse_at(&value.location, reason, &format!("write [[{key}]], or in YAML a list"));
        &[]
    }

    /// Refuses every key that nobody took.
    pub(in crate::config) fn done(self, reading: &mut impl Refuse) {
        for entry in self.entries.iter().filter(|entry| !self.known.contains(&entry.key.as_str())) {
            let remedy = format!("known here are {}", self.known.join(", "));
            reading.refuse_at(&entry.location, format!("unknown key {:?}", entry.key), &remedy);
        }
    }
}

/// A single value as text.
pub(in crate::config) fn given<R: Refuse>(reading: &mut R, value: &Value) -> Option<LocatedText> {
    match &value.kind {
        Kind::Scalar { text, .. } => {
            Some(LocatedText { text: text.clone(), location: value.location.clone() })
        }
        Kind::Null | Kind::List(_) | Kind::Map(_) => {
            let reason = format!("expected a single value, found {}", value.described());
            reading.refuse_at(&value.location, reason, &see::<R>());
            None
        }
    }
}

/// The values of a list; a single one is a list of one.
pub(in crate::config) fn items(value: &Value) -> &[Value] {
    match &value.kind {
        Kind::List(items) => items,
        Kind::Null => &[],
        Kind::Scalar { .. } | Kind::Map(_) => std::slice::from_ref(value),
    }
}

fn see<R: Refuse>() -> String {
    format!("see {}", R::SEE)
}
