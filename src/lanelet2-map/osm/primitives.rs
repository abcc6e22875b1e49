//! The uninterpreted primitives of an OSM XML file.
//!
//! Only data that a lanelet2 map needs is kept. Elements that an editor marked as deleted are left out.

use std::fmt;

use derive_more::Display;

/// Nodes, ways and relations of a file, each kind in the order of the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Osm {
    /// The points, with their coordinates.
    pub nodes: OsmLayer<Node>,
    /// The lines through these points.
    pub ways: OsmLayer<Way>,
    /// Groups of other elements.
    pub relations: OsmLayer<Relation>,
}

/// A point. Its coordinates in metres depend on the map's projection.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Id, unique among the nodes; editors assign negative ids to new nodes.
    pub id: i64,
    /// Latitude and longitude, degrees, if the file has both.
    pub geo_deg: Option<[f64; 2]>,
    /// The tags `local_x` and `local_y` in the map frame, metres, if the file has both.
    pub local_m: Option<[f64; 2]>,
    /// The tag `ele`, metres; 0 without one.
    pub ele_m: f64,
    /// Only the tags `color` and `arrow`.
    pub tags: Tags,
}

/// A line through nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Way {
    /// Id, unique among the ways.
    pub id: i64,
    /// Positions in [`Osm::nodes`], in the order of the line.
    pub nodes: Vec<usize>,
    /// Keys and values, in the order of the file.
    pub tags: Tags,
}

/// A group of elements.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Relation {
    /// Id, unique among the relations.
    pub id: i64,
    /// Its members, in the order of the file.
    pub members: Vec<Member>,
    /// Keys and values, in the order of the file.
    pub tags: Tags,
}

/// A part of a relation. Members of lanelets and regulatory elements exist in the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// Its role in the relation; can be empty.
    pub role: Box<str>,
    /// Kind and id of the element.
    pub element: OsmElement,
}

/// The kinds of elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Display)]
pub enum OsmKind {
    /// A point, the XML element `<node>`.
    #[display("node")]
    Node,
    /// A line, the XML element `<way>`.
    #[display("way")]
    Way,
    /// A group, the XML element `<relation>`.
    #[display("relation")]
    Relation,
}

/// Kind and id of an element; ids are unique within their kind only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Display)]
#[display("{kind} {id}")]
pub struct OsmElement {
    /// Kind of the element.
    pub kind: OsmKind,
    /// Id within its kind.
    pub id: i64,
}

/// Keys and values of an element, alternating, each followed by a byte that is invalid in UTF-8: a compact
/// form, since a map has hundreds of thousands of short texts.
#[derive(Clone, PartialEq, Eq, Default)]
pub struct Tags(pub(super) Box<[u8]>);

/// Elements of one kind, in the order of the file, with lookup by id.
#[derive(Debug, Clone, PartialEq)]
pub struct OsmLayer<T> {
    pub(super) items: Vec<T>,
    /// Sorted by id once all elements are read.
    pub(super) places: Vec<ElementPlace>,
}

/// The position of an element. 32 bits suffice, since more elements would take hundreds of GB.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ElementPlace {
    pub(super) id: i64,
    pub(super) position: u32,
    /// Line of the file on which the element begins, from 1.
    pub(super) line: u32,
}

/// The reason a file was refused, with its line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{fault}")]
pub struct OsmError {
    /// Line of the error in the text, from 1.
    pub line: usize,
    /// The fault in that line.
    pub fault: OsmFault,
}

/// A reason why a file is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum OsmFault {
    #[error("not UTF-8")]
    NotUtf8,
    /// The text could not be read to its end; contains the system's message.
    #[error("cannot read it: {0}")]
    NotRead(String),
    /// The text is not XML; contains the parser's message.
    #[error("not XML: {0}")]
    NotXml(String),
    /// The text is XML, but not a map; contains the outermost element, if any.
    #[error("not an OSM file: <osm> expected at the top{}", .0.as_ref().map_or_else(String::new, |name| format!(", found <{name}>")))]
    NotOsm(Option<String>),
    #[error("the file ends before </osm>: it is cut short")]
    Truncated,
    #[error("{element} has no `{key}`")]
    MissingAttribute { element: ElementRef, key: &'static str },
    #[error("{element}: `{key}` is `{value}`, {expected} expected")]
    BadValue { element: ElementRef, key: &'static str, value: String, expected: &'static str },
    #[error("{element} appears twice, first on line {first_line}")]
    Duplicate { element: OsmElement, first_line: usize },
    /// An element refers to an element that is deleted or not in the file.
    #[error("{from} refers to {to}, which is not in the file")]
    Missing { from: OsmElement, to: OsmElement },
}

impl OsmError {
    /// Returns the unusable value, as written in the file.
    pub fn value(&self) -> Option<&str> {
        if let OsmFault::BadValue { value, .. } = &self.fault { Some(value) } else { None }
    }
}

/// The element that contains an attribute; its id may be unknown if that is faulty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub enum ElementRef {
    /// An element whose id is known.
    Known(OsmElement),
    /// An element whose id is not known.
    #[display("a {_0}")]
    Unknown(OsmKind),
}

impl Tags {
    /// A byte that is invalid in UTF-8.
    pub(super) const END: u8 = 0xFF;

    /// Returns the value of a key; the first if there are several.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.iter().find_map(|(known, value)| (known == key).then_some(value))
    }

    /// Returns whether the key has this value.
    pub fn is(&self, key: &str, value: &str) -> bool {
        self.get(key) == Some(value)
    }

    /// Returns keys and values, in the order of the file.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        let mut texts =
            self.0.split(|byte| *byte == Self::END).map(|text| str::from_utf8(text).unwrap_or_default());
        std::iter::from_fn(move || texts.next().zip(texts.next()))
    }
}

impl Osm {
    /// Returns the line of the file on which an element begins, from 1; `None` if the file does not have it.
    pub fn line(&self, element: OsmElement) -> Option<usize> {
        let place = match element.kind {
            OsmKind::Node => self.nodes.place(element.id),
            OsmKind::Way => self.ways.place(element.id),
            OsmKind::Relation => self.relations.place(element.id),
        };
        place.map(|place| place.line as usize)
    }
}

impl<T> OsmLayer<T> {
    /// Returns the element with this id.
    pub fn get(&self, id: i64) -> Option<&T> {
        self.items.get(self.position(id)?)
    }

    /// Returns the position in [`Self::all`] of the element with this id.
    pub fn position(&self, id: i64) -> Option<usize> {
        self.place(id).map(|place| place.position as usize)
    }

    /// Returns all elements, in the order of the file.
    pub fn all(&self) -> &[T] {
        &self.items
    }

    fn place(&self, id: i64) -> Option<&ElementPlace> {
        let found = self.places.binary_search_by_key(&id, |place| place.id).ok()?;
        self.places.get(found)
    }
}

impl<T> Default for OsmLayer<T> {
    fn default() -> Self {
        Self { items: Vec::new(), places: Vec::new() }
    }
}

impl Relation {
    /// Returns the ids of the members with this role and kind, in the order of the file.
    pub fn members(&self, role: &str, kind: OsmKind) -> impl Iterator<Item = i64> {
        self.members
            .iter()
            .filter(move |member| &*member.role == role && member.element.kind == kind)
            .map(|member| member.element.id)
    }

    /// Returns whether it is a regulatory element of this subtype.
    pub fn is_regulatory(&self, subtype: &str) -> bool {
        self.tags.is("type", "regulatory_element") && self.tags.is("subtype", subtype)
    }

    /// Returns whether it is a lanelet.
    pub fn is_lanelet(&self) -> bool {
        self.tags.is("type", "lanelet")
    }
}

impl fmt::Debug for Tags {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.iter()).finish()
    }
}
