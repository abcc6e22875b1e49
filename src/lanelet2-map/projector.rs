//! The projection of a map's coordinates: Autoware's `map_projector_info.yaml`
//! (docs/spec/turn-signal-decider.md, "Map facts").

use super::osm::Osm;
use super::projection::{UTM_SCALE, east_north_up, transverse_mercator, utm_meridian_deg};

pub mod info;

pub use super::projection::{Geo, MgrsSquare};

/// A projection from latitude and longitude to metres.
///
/// ```
/// use lanelet2_map::projector::{Geo, Projector};
///
/// let projector = Projector::parse("projector_type: MGRS\nmgrs_grid: 54SUE\n").unwrap();
/// let tokyo = Geo { latitude_deg: 35.68, longitude_deg: 139.77, altitude_m: 40.0 };
/// let [x_m, y_m, z_m] = projector.project(tokyo).unwrap();
/// assert!((88e3..90e3).contains(&x_m) && (49e3..51e3).contains(&y_m) && z_m == 40.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projector {
    /// No projection: the tags `local_x` and `local_y` are the coordinates.
    Local,
    /// UTM, from the corner of a 100 km square; if all nodes have `local_x` and `local_y`, these are used.
    Mgrs(MgrsSquare),
    /// UTM in the zone of an origin, relative to that origin. The map's heights are kept.
    LocalCartesianUtm(Geo),
    /// East, north and up of an origin, on its tangential plane.
    LocalCartesian(Geo),
    /// Transverse Mercator around the meridian of an origin, relative to that origin. The map's heights are
    /// kept.
    TransverseMercator {
        /// Position at which x and y are 0.
        origin: Geo,
        /// Scale on the meridian of the origin.
        scale: f64,
    },
}

impl Projector {
    /// Creates the military grid's square that contains the first node with a position; `None` if no node has
    /// one.
    pub fn mgrs_around(osm: &Osm) -> Option<Self> {
        let [latitude_deg, longitude_deg] = osm.nodes.all().iter().find_map(|node| node.geo_deg)?;
        MgrsSquare::around(Geo { latitude_deg, longitude_deg, altitude_m: 0.0 }).map(Self::Mgrs)
    }

    /// Returns x, y and z of a node in the map frame, metres. `None` out of range of the projection, and
    /// always for [`Self::Local`].
    pub fn project(&self, position: Geo) -> Option<[f64; 3]> {
        let with_height = |[x, y]: [f64; 2]| [x, y, position.altitude_m];
        match *self {
            Self::Local => None,
            Self::Mgrs(square) => square.project(position).map(with_height),
            Self::LocalCartesianUtm(origin) => {
                mercator_from(position, origin, utm_meridian_deg(origin), UTM_SCALE).map(with_height)
            }
            Self::TransverseMercator { origin, scale } => {
                mercator_from(position, origin, origin.longitude_deg, scale).map(with_height)
            }
            Self::LocalCartesian(origin) => east_north_up(position, origin),
        }
    }
}

fn mercator_from(position: Geo, origin: Geo, meridian_deg: f64, scale: f64) -> Option<[f64; 2]> {
    let [x, y] = transverse_mercator(position, meridian_deg, scale)?;
    let [origin_x, origin_y] = transverse_mercator(origin, meridian_deg, scale)?;
    Some([x - origin_x, y - origin_y])
}
