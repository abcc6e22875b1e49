//! Rows of keys: all properties of a key in one place. A key is read and checked through its row, which
//! applies the default and records the value in effect. The shipped `gateway.toml`, the schema for editors,
//! the changes of a reload and the descriptions of the node's parameters are generated from the same rows.

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use super::checker::Keywords;
use super::fields::Fields;
use super::key::{KeyEffect, KeyRow, ValueShape};
use super::value::{Entry, Kind, Value};
use crate::config::built_in::full_path;
use crate::config::ros_names::is_topic;

/// A key of a file, whose values become a `T`.
pub(crate) struct ConfigKey<T: 'static> {
    pub(crate) name: &'static str,
    kind: KeyType<T>,
    default: KeyDefault,
    example: &'static str,
    doc: &'static str,
    effect: KeyEffect,
}

enum KeyType<T: 'static> {
    Whole(i64, i64, &'static str, fn(i64) -> Option<T>),
    Number(f64, f64, &'static str, fn(f64) -> Option<T>),
    Flag(fn(bool) -> T),
    Keyword(Keywords<T>, fn(&T) -> T),
    /// A shape, and its reader, which omits refused elements.
    Collection(fn() -> ValueShape, fn(&Fields<'_>, &'static str) -> T),
    /// A shape, its reader, and the value of a default text.
    Other(fn() -> ValueShape, fn(&Fields<'_>, &'static str) -> Option<T>, fn(&str) -> Option<T>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum KeyDefault {
    /// No default: the key stays absent, or the default depends on other keys or the environment.
    Absent,
    Flag(bool),
    /// A whole number in the unit of the key.
    Whole(i64),
    /// A number in the unit of the key.
    Number(f64),
    /// A time, for a key in milliseconds.
    Millis(Duration),
    /// A text or a keyword.
    Text(&'static str),
}

/// Declares the rows of a section and `keys`, which lists them in the order of the documented file.
macro_rules! key_rows {
    ($($name:ident: $type:ty = $row:expr;)*) => {
        $(pub(super) static $name: $crate::config::reading::row::ConfigKey<$type> = $row;)*

        /// Returns the rows in the order of the documented file.
        pub(crate) fn keys() -> Vec<&'static dyn $crate::config::reading::key::KeyRow> {
            vec![$(&$name),*]
        }
    };
}
pub(crate) use key_rows;

/// Returns a row for a whole number within a range; `unit` is empty for a plain number.
pub(crate) const fn whole<T: TryFrom<i64>>(
    name: &'static str,
    min: i64,
    max: i64,
    unit: &'static str,
) -> ConfigKey<T> {
    row(name, KeyType::Whole(min, max, unit, |number| number.try_into().ok()))
}

pub(crate) const fn any_whole(name: &'static str) -> ConfigKey<i64> {
    other(name, || ValueShape::Whole(i64::MIN, i64::MAX, ""), read_whole, |text| text.parse().ok())
}

/// Returns a row for a non-negative whole number of any size.
pub(crate) const fn any_count(name: &'static str) -> ConfigKey<u64> {
    other(name, || ValueShape::Whole(0, i64::MAX, ""), read_whole, |text| text.parse().ok())
}

pub(crate) const fn number(name: &'static str, min: f64, max: f64, unit: &'static str) -> ConfigKey<f64> {
    row(name, KeyType::Number(min, max, unit, Some))
}

/// Returns a row for a number within a range that becomes a value of another type.
pub(crate) const fn number_as<T>(
    name: &'static str,
    min: f64,
    max: f64,
    unit: &'static str,
    make: fn(f64) -> Option<T>,
) -> ConfigKey<T> {
    row(name, KeyType::Number(min, max, unit, make))
}

pub(crate) const fn millis(name: &'static str, min: i64, max: i64) -> ConfigKey<Duration> {
    row(name, KeyType::Whole(min, max, "ms", |ms| Some(Duration::from_millis(ms.try_into().ok()?))))
}

/// Returns a row for a time limit: 1 ms to an hour.
pub(crate) const fn limit(name: &'static str) -> ConfigKey<Duration> {
    millis(name, 1, 3_600_000)
}

pub(crate) const fn seconds(name: &'static str, min: i64, max: i64) -> ConfigKey<Duration> {
    row(name, KeyType::Whole(min, max, "s", |s| Some(Duration::from_secs(s.try_into().ok()?))))
}

pub(crate) const fn flag(name: &'static str, default: bool) -> ConfigKey<bool> {
    ConfigKey { default: KeyDefault::Flag(default), ..row(name, KeyType::Flag(|flag| flag)) }
}

pub(crate) const fn keyword<T: Copy>(name: &'static str, keywords: Keywords<T>) -> ConfigKey<T> {
    row(name, KeyType::Keyword(keywords, |value| *value))
}

pub(crate) const fn text(name: &'static str) -> ConfigKey<String> {
    other(name, || ValueShape::Text, |fields, name| Some(fields.string(name)?.text), owned)
}

pub(crate) const fn path(name: &'static str) -> ConfigKey<PathBuf> {
    other(name, || ValueShape::Path, read_path, |_| None)
}

pub(crate) const fn topic(name: &'static str, default: &'static str) -> ConfigKey<String> {
    other(name, || ValueShape::Text, read_topic, owned).or_text(default).restart()
}

/// Returns a row for a topic, or an empty text for none.
pub(crate) const fn optional_topic(name: &'static str, default: &'static str) -> ConfigKey<String> {
    other(name, || ValueShape::Text, read_optional_topic, owned).or_text(default).restart()
}

/// Returns a row whose values are read by their own function.
pub(crate) const fn other<T>(
    name: &'static str,
    shape: fn() -> ValueShape,
    read: fn(&Fields<'_>, &'static str) -> Option<T>,
    default: fn(&str) -> Option<T>,
) -> ConfigKey<T> {
    row(name, KeyType::Other(shape, read, default))
}

/// Returns a row for a list or a table, from which refused elements are omitted.
pub(crate) const fn collection<T>(
    name: &'static str,
    shape: fn() -> ValueShape,
    read: fn(&Fields<'_>, &'static str) -> T,
) -> ConfigKey<T> {
    row(name, KeyType::Collection(shape, read))
}

fn read_whole<T: FromStr>(fields: &Fields<'_>, name: &'static str) -> Option<T> {
    fields.whole(name)
}

fn read_path(fields: &Fields<'_>, name: &'static str) -> Option<PathBuf> {
    fields.path(name)
}

/// Reads a topic: `/a/b`, relative as `a/b`, or private as `~/a`.
pub(crate) fn read_topic(fields: &Fields<'_>, name: &'static str) -> Option<String> {
    let topic = fields.string(name)?.text;
    if !is_topic(&topic) {
        fields.refuse(name, format!("{topic:?} is not a topic"), "write it as /a/b, a/b or ~/a");
    }
    Some(topic)
}

fn read_optional_topic(fields: &Fields<'_>, name: &'static str) -> Option<String> {
    if fields.is(name, "") { fields.string(name).map(|text| text.text) } else { read_topic(fields, name) }
}

fn owned(text: &str) -> Option<String> {
    text.parse().ok()
}

const fn row<T>(name: &'static str, kind: KeyType<T>) -> ConfigKey<T> {
    ConfigKey { name, kind, default: KeyDefault::Absent, example: "", doc: "", effect: KeyEffect::Reload }
}

impl<T> ConfigKey<T> {
    pub(crate) const fn doc(self, doc: &'static str) -> Self {
        Self { doc, ..self }
    }

    pub(crate) const fn restart(self) -> Self {
        Self { effect: KeyEffect::Restart, ..self }
    }

    /// Shows a value in TOML for a key without a default.
    pub(crate) const fn example(self, example: &'static str) -> Self {
        Self { example, ..self }
    }

    pub(crate) const fn or(self, default: i64) -> Self {
        Self { default: KeyDefault::Whole(default), ..self }
    }

    pub(crate) const fn or_number(self, default: f64) -> Self {
        Self { default: KeyDefault::Number(default), ..self }
    }

    pub(crate) const fn or_text(self, default: &'static str) -> Self {
        Self { default: KeyDefault::Text(default), ..self }
    }

    /// Sets a time as the default of a key in milliseconds.
    pub(crate) const fn or_time(self, default: Duration) -> Self {
        Self { default: KeyDefault::Millis(default), ..self }
    }

    /// Reads the value of the key, which is known from now on; `None` if it is absent or refused.
    fn read(&self, fields: &Fields<'_>) -> Option<T> {
        let (value, checker) = (fields.value(self.name)?, fields.checker);
        match &self.kind {
            KeyType::Whole(min, max, unit, make) => make(checker.number(value, &(*min..=*max), unit)?),
            KeyType::Number(min, max, unit, make) => make(checker.number(value, &(*min..=*max), unit)?),
            KeyType::Flag(make) => Some(make(checker.flag(value)?)),
            KeyType::Keyword(keywords, copy) => {
                let words: Vec<_> = keywords.iter().map(|(word, value)| (*word, value)).collect();
                checker.keyword(&checker.text(value)?, &words).map(copy)
            }
            KeyType::Collection(_, read) => Some(read(fields, self.name)),
            KeyType::Other(_, read, _) => read(fields, self.name),
        }
    }

    /// Returns the value of a key that is absent; `None` without a default.
    fn default_value(&self) -> Option<T> {
        match (&self.kind, self.default) {
            (KeyType::Whole(.., make), KeyDefault::Whole(number)) => make(number),
            (KeyType::Whole(.., make), KeyDefault::Millis(time)) => make(time.as_millis().try_into().ok()?),
            (KeyType::Number(.., make), KeyDefault::Number(number)) => make(number),
            (KeyType::Flag(make), KeyDefault::Flag(flag)) => Some(make(flag)),
            (KeyType::Keyword(keywords, copy), KeyDefault::Text(text)) => {
                keywords.iter().find(|(word, _)| *word == text).map(|(_, value)| copy(value))
            }
            (KeyType::Other(.., make), KeyDefault::Text(text)) => make(text),
            (KeyType::Other(.., make), KeyDefault::Whole(number)) => make(&number.to_string()),
            _ => None,
        }
    }
}

impl<T: Sync> KeyRow for ConfigKey<T> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn shape(&self) -> ValueShape {
        match &self.kind {
            KeyType::Whole(min, max, unit, _) => ValueShape::Whole(*min, *max, unit),
            KeyType::Number(min, max, unit, _) => ValueShape::Number(*min, *max, unit),
            KeyType::Flag(_) => ValueShape::Flag,
            KeyType::Keyword(keywords, _) => {
                ValueShape::Keyword(keywords.iter().map(|(word, _)| *word).collect())
            }
            KeyType::Collection(shape, _) | KeyType::Other(shape, ..) => shape(),
        }
    }

    fn default_toml(&self) -> Option<String> {
        match self.default {
            KeyDefault::Absent => None,
            KeyDefault::Flag(flag) => Some(flag.to_string()),
            KeyDefault::Whole(number) => Some(number.to_string()),
            KeyDefault::Number(number) => Some(format!("{number:?}")),
            KeyDefault::Millis(time) => Some(time.as_millis().to_string()),
            KeyDefault::Text(text) => Some(format!("{text:?}")),
        }
    }

    fn example(&self) -> &'static str {
        self.example
    }

    fn doc(&self) -> &'static str {
        self.doc
    }

    fn effect(&self) -> KeyEffect {
        self.effect
    }
}

impl Fields<'_> {
    /// Reads a key through its row, which records the value in effect; an absent or refused key has its
    /// default.
    pub(crate) fn read<T: Default + Sync>(&self, key: &'static ConfigKey<T>) -> T {
        self.given(key).or_else(|| key.default_value()).unwrap_or_default()
    }

    /// Like [`Self::read`], but returns `None` if the key is absent or refused.
    pub(crate) fn given<T: Sync>(&self, key: &'static ConfigKey<T>) -> Option<T> {
        let value = key.read(self);
        let default = || match key.default_toml() {
            Some(toml) if toml == "\"\"" => toml,
            Some(toml) => plain_number(toml.trim_matches('"')),
            None => "none".to_owned(),
        };
        let path = |value: &Value| full_path(&self.checker.beside(&shown(value)));
        let text = match (self.value(key.name), key.shape()) {
            (None, _) => default(),
            (Some(value), _) if is_empty(value) && key.default_toml().is_none() => default(),
            (Some(value), ValueShape::Path) => {
                path(value).map_or_else(|| shown(value), |path| path.display().to_string())
            }
            (Some(value), _) => shown(value),
        };
        self.record(key, text);
        value
    }
}

/// A key with its value as written by a user.
#[derive(Debug)]
pub(crate) struct WrittenKey {
    /// Section and name, such as `[turn] off`, `[turn.source.1] name`.
    pub(crate) name: String,
    pub(crate) value: String,
}

/// Returns every key of a table.
pub(crate) fn flattened(fields: &Fields<'_>) -> Vec<WrittenKey> {
    let mut keys = Vec::new();
    flatten("", fields.all(), &mut keys);
    keys
}

fn flatten(section: &str, entries: &[Entry], keys: &mut Vec<WrittenKey>) {
    for Entry { key, value, .. } in entries {
        let below = if section.is_empty() { key.clone() } else { format!("{section}.{key}") };
        match &value.kind {
            Kind::Map(entries) => flatten(&below, entries, keys),
            Kind::List(items) if items.iter().any(|item| matches!(item.kind, Kind::Map(_))) => {
                for (number, item) in (1..).zip(items) {
                    if let Kind::Map(entries) = &item.kind {
                        flatten(&format!("{below}.{number}"), entries, keys);
                    }
                }
            }
            Kind::Null | Kind::Scalar { .. } | Kind::List(_) => {
                let name = if section.is_empty() { key.clone() } else { format!("[{section}] {key}") };
                keys.push(WrittenKey { name, value: shown(value) });
            }
        }
    }
}

fn is_empty(value: &Value) -> bool {
    match &value.kind {
        Kind::List(items) => items.is_empty(),
        Kind::Map(entries) => entries.is_empty(),
        Kind::Null | Kind::Scalar { .. } => false,
    }
}

/// Returns the value as written by a user, without the quotes of a text.
pub(crate) fn shown(value: &Value) -> String {
    match &value.kind {
        Kind::Null => "none".to_owned(),
        Kind::Scalar { text, is_quoted: true } if text.is_empty() => "\"\"".to_owned(),
        Kind::Scalar { text, is_quoted: true } => text.clone(),
        Kind::Scalar { text, is_quoted: false } => plain_number(text),
        Kind::List(items) => format!("[{}]", items.iter().map(shown).collect::<Vec<_>>().join(", ")),
        Kind::Map(entries) => {
            let pairs = entries.iter().map(|entry| format!("{} = {}", entry.key, shown(&entry.value)));
            format!("{{ {} }}", pairs.collect::<Vec<_>>().join(", "))
        }
    }
}

/// Returns the shortest text of a number, so that `10.0` and `10` are equal; any other text unchanged.
fn plain_number(text: &str) -> String {
    match text.parse::<f64>() {
        Ok(number) if text.contains(['.', 'e', 'E']) => number.to_string(),
        Ok(_) | Err(_) => text.to_owned(),
    }
}
