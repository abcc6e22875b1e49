//! The lanelet2 maps that sections and drives name, with the projector file beside each.

use std::path::Path;

use super::files::Files;
use crate::core::map::lane_network::LaneNetwork;
use crate::core::map::light_map::{LampSource, LightMap};
use crate::core::map::osm;
use crate::core::map::points::Points;
use crate::core::map::projector::Projector;

/// Reads the lights of a map from a file.
///
/// # Errors
/// The reason as text: the file, its projector, or the map.
pub fn read_lights(files: &dyn Files, path: &Path, lamps: LampSource) -> Result<LightMap, String> {
    let osm = osm::read(&read(files, path)?).map_err(|error| error.to_string())?;
    // Points are for viewers only: a map without them has its lights all the same.
    let points = Points::new(&osm, &projector(files, path)?).ok();
    LightMap::read(&osm, points.as_ref(), lamps).map_err(|error| error.to_string())
}

/// Reads the lanelets of a map from a file.
///
/// # Errors
/// The reason as text: the file, its projector, or the map.
pub(super) fn read_lane_network(files: &dyn Files, path: &Path) -> Result<LaneNetwork, String> {
    LaneNetwork::read(&read(files, path)?, &projector(files, path)?).map_err(|error| error.to_string())
}

fn read(files: &dyn Files, path: &Path) -> Result<Vec<u8>, String> {
    files.read(path).map_err(|error| format!("cannot read it: {error}"))
}

/// The projector of a map, from the file beside it that Autoware reads; local coordinates without one.
fn projector(files: &dyn Files, map: &Path) -> Result<Projector, String> {
    let path = map.with_file_name("map_projector_info.yaml");
    let Ok(bytes) = files.read(&path) else { return Ok(Projector::Local) };
    let text = String::from_utf8_lossy(&bytes);
    Projector::parse(&text).map_err(|error| format!("{}: {error}", path.display()))
}
