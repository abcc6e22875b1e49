//! The lanelet2 maps that sections and drives name, with the projector file beside each.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

use super::built_in::BuiltIn;
use super::file_kind::FileKind;
use super::files::Files;
use super::named_file;
use super::reading::problem::cannot_read;
use crate::core::map::error::MapError;
use crate::core::map::lane_network::LaneNetwork;
use crate::core::map::light_map::{LampSource, LightMap};
use crate::core::map::osm::{self, Osm};
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

/// The path of a map that is given by name, or by a path relative to the working directory; with the advice for one that does
/// not exist.
pub fn find_map(files: &dyn Files, given: &Path, otherwise: &str) -> (PathBuf, String) {
    let path = named_file::find_here(BuiltIn::Map, files, given);
    let remedy = named_file::remedy(BuiltIn::Map, files, &path, otherwise);
    (path, remedy)
}

/// Reads the lights of a map from a file, or from `lanelet2_map.osm` in a folder.
///
/// # Errors
/// The reason as text: the file, its projector, or the map.
pub fn read_lights(files: &dyn Files, path: &Path, lamps: LampSource) -> Result<MapLights, String> {
    let map = MapFile::read(files, path)?;
    // Points are for viewers only: a map without them has its lights all the same.
    let (points, unplaced) = match Points::new(&map.osm, &map.projector()) {
        Ok(points) => (Some(points), None),
        Err(error) => (None, Some(error)),
    };
    let lights = LightMap::read(&map.osm, points.as_ref(), lamps).map_err(|error| error.to_string())?;
    Ok(MapLights { lights, unplaced })
}

/// Reads the lanelets of a map from a file, or from `lanelet2_map.osm` in a folder.
///
/// # Errors
/// The reason as text: the file, its projector, or the map.
pub fn read_lane_network(files: &dyn Files, path: &Path) -> Result<LaneNetwork, String> {
    let map = MapFile::read(files, path)?;
    LaneNetwork::read(&map.osm, &map.projector()).map_err(|error| {
        // Without the file, the map does not require local coordinates: they were the last resort.
        if let (MapError::NoLocal { node }, None) = (&error, map.given) {
            return format!(
                "node {node} has no `local_x` and `local_y`, and there is no map_projector_info.yaml beside the map"
            );
        }
        error.to_string()
    })
}

/// A map that is not interpreted yet.
struct MapFile {
    osm: Osm,
    /// The projector of the file beside it; `None` without that file.
    given: Option<Projector>,
}

impl MapFile {
    fn read(files: &dyn Files, path: &Path) -> Result<Self, String> {
        let (path, outcome) = match files.read(path) {
            Err(error) if error.kind() == io::ErrorKind::IsADirectory => {
                let path = path.join(MAP_NAME);
                let outcome = files.read(&path);
                if outcome.as_ref().is_err_and(|error| error.kind() == io::ErrorKind::NotFound) {
                    return Err(format!("this is a folder without a {MAP_NAME}"));
                }
                (Cow::from(path), outcome)
            }
            outcome => (path.into(), outcome),
        };
        let bytes = outcome.map_err(|error| cannot_read(&error))?;
        if let Some((reason, _)) = FileKind::Map.mismatch(&bytes) {
            return Err(reason);
        }
        let osm = osm::read(&bytes).map_err(|error| error.to_string())?;
        Ok(Self { osm, given: projector(files, &path)? })
    }

    /// The projector that is given; else, as upstream, the military grid; else local coordinates.
    fn projector(&self) -> Projector {
        self.given.or_else(|| Projector::mgrs_around(&self.osm)).unwrap_or(Projector::Local)
    }
}

/// The projector of a map, from the file beside it that Autoware reads; `None` without one.
fn projector(files: &dyn Files, map: &Path) -> Result<Option<Projector>, String> {
    let path = map.with_file_name("map_projector_info.yaml");
    let Ok(bytes) = files.read(&path) else { return Ok(None) };
    let text = String::from_utf8_lossy(&bytes);
    Projector::parse(&text).map(Some).map_err(|error| format!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CROSSROADS: &str = include_str!("../../tests/maps/crossroads.osm");

    /// A folder with a map, and a projector file if there is one.
    struct Town {
        map: String,
        projector: Option<&'static str>,
    }

    impl Files for Town {
        fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
            match path.to_str() {
                Some("town") => Err(io::ErrorKind::IsADirectory.into()),
                Some("town/lanelet2_map.osm") => Ok(self.map.clone().into()),
                Some("town/map_projector_info.yaml") => {
                    self.projector.map(Into::into).ok_or_else(|| io::ErrorKind::NotFound.into())
                }
                _ => Err(io::ErrorKind::NotFound.into()),
            }
        }
    }

    #[test]
    fn lanelets_and_lights_are_read_from_a_folder_alike() {
        let town = Town { map: CROSSROADS.to_owned(), projector: None };
        let road = read_lane_network(&town, Path::new("town")).unwrap();
        assert_eq!(road.lanes().count(), 14);
        assert_eq!(Ok(road), read_lane_network(&town, Path::new("town/lanelet2_map.osm")));
        assert!(read_lights(&town, Path::new("town"), LampSource::Drawn).is_ok());
    }

    #[test]
    fn without_a_projector_file_a_map_is_in_the_military_grid() {
        let map = CROSSROADS.replace("k=\"local_x\"", "k=\"x\"");
        let start = |road: &LaneNetwork| road.lanes().next().unwrap().centerline[0];
        let path = Path::new("town");
        let assumed = Town { map: map.clone(), projector: None };
        let [drawn, assumed] = [&Town { map: CROSSROADS.to_owned(), projector: None }, &assumed]
            .map(|town| read_lane_network(town, path).unwrap());
        assert!(
            start(&assumed).distance_m(start(&drawn)) < 1e-4,
            "{:?} {:?}",
            start(&assumed),
            start(&drawn)
        );
        let local = Town { map, projector: Some("projector_type: Local\n") };
        let error = read_lane_network(&local, path).unwrap_err();
        assert!(error.ends_with("which the projector type Local needs"), "{error}");
    }

    #[test]
    fn a_map_without_any_coordinates_is_refused_with_what_it_lacks() {
        let map = CROSSROADS.replace("k=\"local_x\"", "k=\"x\"").replace(" lat=", " was=");
        let error = read_lane_network(&Town { map, projector: None }, Path::new("town")).unwrap_err();
        assert!(error.ends_with("there is no map_projector_info.yaml beside the map"), "{error}");
    }
}
