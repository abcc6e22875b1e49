//! Keys, lists and scalars of any notation, each with its location.

use super::location::Location;

#[derive(Debug, Clone)]
pub(crate) struct Value {
    pub(crate) location: Location,
    pub(crate) kind: Kind,
}

#[derive(Debug, Clone)]
pub(crate) enum Kind {
    /// A key without a value, in YAML only.
    Null,
    /// A number, a truth value or a text, as written.
    Scalar {
        text: String,
        /// True if quoted, so that digits are text.
        is_quoted: bool,
    },
    List(Vec<Value>),
    /// Entries in document order, without duplicate keys.
    Map(Vec<Entry>),
}

#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) key: String,
    /// Location of the key; the value has its own.
    pub(crate) location: Location,
    pub(crate) value: Value,
}

impl Value {
    /// Describes the value for a refusal: `expected a list, found …`.
    pub(crate) fn described(&self) -> String {
        match &self.kind {
            Kind::Null => "nothing".to_owned(),
            Kind::Scalar { text, is_quoted: true } => format!("the text {text:?}"),
            Kind::Scalar { text, is_quoted: false } if text.is_empty() => "no number".to_owned(),
            Kind::Scalar { text, is_quoted: false } => text.clone(),
            Kind::List(_) => "a list".to_owned(),
            Kind::Map(_) => "a table".to_owned(),
        }
    }

    /// Returns a single value as written, and whether it is quoted. `None` for nothing, a list or a table.
    pub(crate) fn scalar(&self) -> Option<(&str, bool)> {
        if let Kind::Scalar { text, is_quoted } = &self.kind { Some((text, *is_quoted)) } else { None }
    }
}

/// Returns the values of a list; a single value counts as a list of one.
pub(crate) fn items(value: &Value) -> &[Value] {
    match &value.kind {
        Kind::List(items) => items,
        Kind::Null => &[],
        Kind::Scalar { .. } | Kind::Map(_) => std::slice::from_ref(value),
    }
}
