//! Text of keys, lists and scalars, whatever it was written in, each with its place.

use super::location::Location;

/// A value at its place.
#[derive(Debug, Clone)]
pub(in crate::config) struct Value {
    pub(in crate::config) location: Location,
    pub(in crate::config) kind: Kind,
}

/// What a value is.
#[derive(Debug, Clone)]
pub(in crate::config) enum Kind {
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
pub(in crate::config) struct Entry {
    pub(in crate::config) key: String,
    /// Of the key.
    pub(in crate::config) location: Location,
    pub(in crate::config) value: Value,
}

impl Value {
    /// What it is, in words.
    pub(in crate::config) fn described(&self) -> &'static str {
        match &self.kind {
            Kind::Null => "nothing",
            Kind::Scalar { is_quoted: true, .. } => "a text",
            Kind::Scalar { is_quoted: false, .. } => "a single value",
            Kind::List(_) => "a list",
            Kind::Map(_) => "a table",
        }
    }
}
