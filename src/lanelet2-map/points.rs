//! The coordinates of the nodes of a map, metres.

use super::error::{MAX_DISTANCE_M, MapError};
use super::osm::{Node, Osm};
use super::projector::{Geo, Projector};

/// x, y, z in the map frame, metres, one for each node in the order of the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Points(Vec<[f64; 3]>);

impl Points {
    /// Uses local coordinates or projects, depending on the projector. The two are never mixed, since they
    /// need not agree.
    ///
    /// # Errors
    /// Returns the first node without usable coordinates.
    pub fn new(osm: &Osm, projector: &Projector) -> Result<Self, MapError> {
        let nodes = osm.nodes.all();
        let local = match projector {
            Projector::Local => true,
            Projector::Mgrs(_) => nodes.iter().all(|node| node.local_m.is_some()),
            Projector::LocalCartesianUtm(_)
            | Projector::LocalCartesian(_)
            | Projector::TransverseMercator { .. } => false,
        };
        let point = |node: &Node| {
            let point = if local {
                let [x, y] = node.local_m.ok_or(MapError::NoLocal(node.id))?;
                [x, y, node.ele_m]
            } else {
                let [latitude_deg, longitude_deg] = node.geo_deg.ok_or(MapError::NotProjected(node.id))?;
                let position = Geo { latitude_deg, longitude_deg, altitude_m: node.ele_m };
                projector.project(position).ok_or(MapError::NotProjected(node.id))?
            };
            if point.iter().any(|axis| axis.abs() >= MAX_DISTANCE_M) {
                return Err(MapError::TooFar(node.id));
            }
            Ok(point)
        };
        nodes.iter().map(point).collect::<Result<_, _>>().map(Self)
    }

    /// Returns the node at this position of [`Osm::nodes`].
    pub fn get(&self, node: usize) -> Option<[f64; 3]> {
        self.0.get(node).copied()
    }
}
