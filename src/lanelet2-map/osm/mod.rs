//! Reads OSM XML files into their primitives.

mod primitives;
mod reader;
#[cfg(test)]
mod tests;

pub use primitives::{
    ElementRef, Member, Node, Osm, OsmElement, OsmError, OsmFault, OsmKind, OsmLayer, Relation, Tags, Way,
};
pub use reader::{read, read_events};
