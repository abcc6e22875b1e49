//! The lanelet2 maps that sections and drives name, with the projector file beside each.

use std::path::{Path, PathBuf};

use super::files::Files;
use crate::core::map::error::MapError;
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
    let projector = projector(files, path)?;
    LaneNetwork::read(&read(files, path)?, &projector).map_err(|error| match error {
        // Without the file, local coordinates are assumed; the map does not ask for them.
        MapError::NoLocal { node } if files.read(&projector_file(path)).is_err() => format!(
            "node {node} has no `local_x` and `local_y`, and there is no map_projector_info.yaml beside the map"
        ),
        error => error.to_string(),
    })
}

fn read(files: &dyn Files, path: &Path) -> Result<Vec<u8>, String> {
    files.read(path).map_err(|error| format!("cannot read it: {error}"))
}

/// The projector of a map, from the file beside it that Autoware reads; local coordinates without one.
fn projector(files: &dyn Files, map: &Path) -> Result<Projector, String> {
    let path = projector_file(map);
    let Ok(bytes) = files.read(&path) else { return Ok(Projector::Local) };
    let text = String::from_utf8_lossy(&bytes);
    Projector::parse(&text).map_err(|error| format!("{}: {error}", path.display()))
}

fn projector_file(map: &Path) -> PathBuf {
    map.with_file_name("map_projector_info.yaml")
}
