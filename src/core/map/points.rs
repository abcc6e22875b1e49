//! Where the nodes of a map are, in metres.

use super::error::MapError;
use super::osm::Osm;

/// x, y, z in the map frame, metres, one for each node in the order of the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Points(Vec<[f64; 3]>);

impl Points {
    /// The local coordinates of the tags.
    ///
    /// # Errors
    /// [`MapError::NoLocal`] when a node has none: half a map in another frame is of no use.
    pub fn local(osm: &Osm) -> Result<Self, MapError> {
        let point = |node: &super::osm::Node| {
            let [x, y] = node.local_m.ok_or(MapError::NoLocal { node: node.id })?;
            Ok([x, y, node.ele_m])
        };
        osm.nodes.all().iter().map(point).collect::<Result<_, _>>().map(Self)
    }

    /// The node at this position of [`Osm::nodes`].
    pub fn get(&self, node: usize) -> Option<[f64; 3]> {
        self.0.get(node).copied()
    }
}
