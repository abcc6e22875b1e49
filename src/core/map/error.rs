//! Why a map is not used.

use super::osm::{Element, OsmError, Tags};

/// What is wrong with a map.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MapError {
    /// The file is not read.
    #[error(transparent)]
    Osm(#[from] OsmError),
    /// A tag has a value that cannot be used.
    #[error("{element}: tag `{key}` is `{value}`, {expected} expected")]
    BadTag {
        /// The element with the tag.
        element: Element,
        /// The tag.
        key: &'static str,
        /// As written.
        value: String,
        /// What would do.
        expected: &'static str,
    },
    /// Coordinates in metres were asked for, and a node has none.
    #[error("node {node} has no `local_x` and `local_y`, and the map is said to have local coordinates")]
    NoLocal {
        /// The first such node of the file.
        node: i64,
    },
}

/// A number in a tag; none if it is empty or missing.
pub(super) fn number_tag(tags: &Tags, key: &'static str, element: Element) -> Result<Option<f64>, MapError> {
    let parse = |text: &str| text.parse().ok().filter(|number: &f64| number.is_finite());
    parsed_tag(tags, key, element, "a number", parse)
}

/// An id in a tag; none if it is empty or missing.
pub(super) fn id_tag(tags: &Tags, key: &'static str, element: Element) -> Result<Option<i64>, MapError> {
    parsed_tag(tags, key, element, "a whole number of 64 bits", |text| text.parse().ok())
}

fn parsed_tag<T>(
    tags: &Tags,
    key: &'static str,
    element: Element,
    expected: &'static str,
    parse: impl Fn(&str) -> Option<T>,
) -> Result<Option<T>, MapError> {
    let Some(text) = tags.get(key).map(str::trim).filter(|text| !text.is_empty()) else { return Ok(None) };
    let bad = || MapError::BadTag { element, key, value: text.chars().take(80).collect(), expected };
    parse(text).map(Some).ok_or_else(bad)
}
