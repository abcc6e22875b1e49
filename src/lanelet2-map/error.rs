//! Errors of maps, each with the faulty element, and the tags in which they are found.

use super::osm::{OsmElement, OsmKind, Tags};

/// Maximum distance, metres; larger coordinates are nonsense, and their sums lose millimetres.
pub(super) const MAX_DISTANCE_M: f64 = 1e8;
/// Limit for the points of all lanelets of a small map together. Each takes some 30 bytes.
pub(super) const MIN_POINTS: usize = 4_000_000;
/// Limit for the points of lanelets per point of a way in the file: a way is the bound of about two lanelets,
/// each of which also has a centerline.
pub(super) const POINTS_FOR_NODE: usize = 6;

/// An error of a map, with the faulty element.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum MapError {
    #[error("{element}: tag `{key}` is `{value}`, {expected} expected")]
    BadTag { element: OsmElement, key: &'static str, value: String, expected: &'static str },
    /// A lanelet does not have exactly one way on one of its sides.
    #[error("relation {lanelet}: {count} members of the role `{role}`, a lanelet has one")]
    Sides { lanelet: i64, role: &'static str, count: usize },
    #[error("way {way}: a bound of lanelet {lanelet} needs two points at least")]
    ShortBound { way: i64, lanelet: i64 },
    /// This node, the first of its kind, lies far outside of any map.
    #[error("node {0}: it lies {MAX_DISTANCE_M:e} metres or more from the origin of the map")]
    TooFar(i64),
    #[error(
        "relation {lanelet}: with it, the lanelets have more than {most} points, the most for a map whose ways have {nodes}: lanelets \
         that are too long, or share their ways; check the coordinates"
    )]
    TooLarge { lanelet: i64, most: usize, nodes: usize },
    /// This node, the first of its kind, cannot be projected.
    #[error("node {0}: its `lat` and `lon` are missing, or the projection does not reach there")]
    NotProjected(i64),
    /// The projector uses local coordinates, and this node, the first of its kind, has none.
    #[error("node {0} has no `local_x` and `local_y`, which the projector type Local needs")]
    NoLocal(i64),
}

impl MapError {
    /// Returns the faulty element.
    pub fn element(&self) -> OsmElement {
        let (kind, id) = match *self {
            Self::BadTag { element, .. } => return element,
            Self::Sides { lanelet, .. } | Self::TooLarge { lanelet, .. } => (OsmKind::Relation, lanelet),
            Self::ShortBound { way, .. } => (OsmKind::Way, way),
            Self::TooFar(node) | Self::NotProjected(node) | Self::NoLocal(node) => (OsmKind::Node, node),
        };
        OsmElement { kind, id }
    }
}

/// Returns the ids in a tag, separated by commas, blanks and square brackets; `None` without the tag, or for
/// the value `none`.
pub(super) fn id_list_tag(
    tags: &Tags,
    key: &'static str,
    element: OsmElement,
) -> Result<Option<Vec<i64>>, MapError> {
    let between = |letter: char| letter == ',' || letter == '[' || letter == ']' || letter.is_whitespace();
    parsed_tag(tags, key, element, "a list of ids or `none`", |text| {
        if text == "none" {
            return Some(None);
        }
        let ids = text.split(between).filter(|id| !id.is_empty()).map(|id| id.parse().ok());
        ids.collect::<Option<_>>().map(Some)
    })
    .map(Option::flatten)
}

/// Returns a number in a tag; `None` if it is empty or missing.
pub(super) fn number_tag(
    tags: &Tags,
    key: &'static str,
    element: OsmElement,
) -> Result<Option<f64>, MapError> {
    let parse = |text: &str| text.parse().ok().filter(|number: &f64| number.is_finite());
    parsed_tag(tags, key, element, "a number", parse)
}

/// Returns an id in a tag; `None` if it is empty or missing.
pub(super) fn id_tag(tags: &Tags, key: &'static str, element: OsmElement) -> Result<Option<i64>, MapError> {
    parsed_tag(tags, key, element, "a whole number of 64 bits", |text| text.parse().ok())
}

fn parsed_tag<T>(
    tags: &Tags,
    key: &'static str,
    element: OsmElement,
    expected: &'static str,
    parse: impl Fn(&str) -> Option<T>,
) -> Result<Option<T>, MapError> {
    let Some(text) = tags.get(key).map(str::trim).filter(|text| !text.is_empty()) else { return Ok(None) };
    let bad = || MapError::BadTag { element, key, value: text.chars().take(80).collect(), expected };
    parse(text).map(Some).ok_or_else(bad)
}
