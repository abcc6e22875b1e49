//! Text of keys, lists and scalars, whatever it was written in, each with its place.

mod toml_text;
mod yaml_text;

pub(super) use toml_text::from_toml;
pub(super) use yaml_text::from_yaml;

use super::place::Spot;

/// A value at its place.
#[derive(Debug, Clone)]
pub(super) struct Value {
    pub(super) spot: Spot,
    pub(super) kind: Kind,
}

/// What a value is.
#[derive(Debug, Clone)]
pub(super) enum Kind {
    /// Nothing: YAML only.
    Null,
    /// A number, a truth value or text, as written.
    Scalar {
        text: String,
        /// Quoted, so that digits are text.
        is_quoted: bool,
    },
    List(Vec<Value>),
    /// In the order of the document, no key twice.
    Map(Vec<Entry>),
}

/// A key with its value.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub(super) key: String,
    /// Of the key.
    pub(super) spot: Spot,
    pub(super) value: Value,
}

impl Value {
    /// What it is, in words.
    pub(super) fn described(&self) -> &'static str {
        match &self.kind {
            Kind::Null => "nothing",
            Kind::Scalar { is_quoted: true, .. } => "a text",
            Kind::Scalar { is_quoted: false, .. } => "a single value",
            Kind::List(_) => "a list",
            Kind::Map(_) => "a table",
        }
    }
}
