//! The lanelet2 maps that sections and drives name, with the projector file beside each.

use std::borrow::Cow;
use std::io;
use std::path::Path;

use super::files::Files;
use crate::core::map::error::MapError;
use crate::core::map::lane_network::LaneNetwork;
use crate::core::map::light_map::{LampSource, LightMap};
use crate::core::map::osm;
use crate::core::map::points::Points;
use crate::core::map::projector::Projector;

/// The name of the map in a folder that stands for it.
const MAP_NAME: &str = "lanelet2_map.osm";

/// The lights of a map.
#[derive(Debug)]
pub struct MapLights {
    /// The lights; without the positions of their lamps when these cannot be computed.
    pub lights: LightMap,
    /// The reason why lamps have no positions; `None` when they have.
    pub unplaced: Option<MapError>,
}

/// Reads the lights of a map from a file, or from `lanelet2_map.osm` in a folder.
///
/// # Errors
/// The reason as text: the file, its projector, or the map.
pub fn read_lights(files: &dyn Files, path: &Path, lamps: LampSource) -> Result<MapLights, String> {
    let (path, bytes) = match files.read(path) {
        Err(error) if error.kind() == io::ErrorKind::IsADirectory => {
            let path = path.join(MAP_NAME);
            let bytes = read(files, &path)?;
            (Cow::from(path), bytes)
        }
        outcome => (path.into(), outcome.map_err(|error| format!("cannot read it: {error}"))?),
    };
    let osm = osm::read(&bytes).map_err(|error| error.to_string())?;
    // Upstream takes a map without a projector file for one in the military grid.
    let projector =
        projector(files, &path)?.or_else(|| Projector::mgrs_around(&osm)).unwrap_or(Projector::Local);
    // Points are for viewers only: a map without them has its lights all the same.
    let (points, unplaced) = match Points::new(&osm, &projector) {
        Ok(points) => (Some(points), None),
        Err(error) => (None, Some(error)),
    };
    let lights = LightMap::read(&osm, points.as_ref(), lamps).map_err(|error| error.to_string())?;
    Ok(MapLights { lights, unplaced })
}

/// Reads the lanelets of a map from a file.
///
/// # Errors
/// The reason as text: the file, its projector, or the map.
pub(super) fn read_lane_network(files: &dyn Files, path: &Path) -> Result<LaneNetwork, String> {
    let given = projector(files, path)?;
    LaneNetwork::read(&read(files, path)?, &given.unwrap_or(Projector::Local)).map_err(|error| {
        // Without the file, local coordinates are assumed; the map does not ask for them.
        if let (MapError::NoLocal { node }, None) = (&error, given) {
            return format!(
                "node {node} has no `local_x` and `local_y`, and there is no map_projector_info.yaml beside the map"
            );
        }
        error.to_string()
    })
}

fn read(files: &dyn Files, path: &Path) -> Result<Vec<u8>, String> {
    files.read(path).map_err(|error| format!("cannot read it: {error}"))
}

/// The projector of a map, from the file beside it that Autoware reads; `None` without one.
fn projector(files: &dyn Files, map: &Path) -> Result<Option<Projector>, String> {
    let path = map.with_file_name("map_projector_info.yaml");
    let Ok(bytes) = files.read(&path) else { return Ok(None) };
    let text = String::from_utf8_lossy(&bytes);
    Projector::parse(&text).map(Some).map_err(|error| format!("{}: {error}", path.display()))
}
