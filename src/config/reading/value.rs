//! Keys, lists and scalars of any notation, each with its place.

use super::location::Location;

/// A value with its place.
#[derive(Debug, Clone)]
pub(in crate::config) struct Value {
    pub(in crate::config) location: Location,
    pub(in crate::config) kind: Kind,
}

/// The kind of a value, with its content.
#[derive(Debug, Clone)]
pub(in crate::config) enum Kind {
    /// No value, in YAML only.
    Null,
    /// A number, a truth value or a text, as written.
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
    /// The value in a refusal: `expected a list, found …`.
    pub(in crate::config) fn described(&self) -> String {
        match &self.kind {
            Kind::Null => "nothing".to_owned(),
            Kind::Scalar { text, is_quoted: true } => format!("the text {text:?}"),
            Kind::Scalar { text, is_quoted: false } => text.clone(),
            Kind::List(_) => "a list".to_owned(),
            Kind::Map(_) => "a table".to_owned(),
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
