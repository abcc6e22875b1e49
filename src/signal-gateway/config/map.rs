//! The lanelet2 maps named in sections and drives, with their projector files.

use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

use quick_xml::reader::Reader;

use super::built_in::{BuiltIn, display};
use super::file_kind::FileKind;
use super::files::Files;
use super::named_file;
use super::reading::{Checker, Location, Position, Problem, cannot_read};
use lanelet2_map::error::MapError;
use lanelet2_map::lane_network::LaneNetwork;
use lanelet2_map::light_map::{LampSource, LightMap};
use lanelet2_map::osm::{self, Osm, OsmLayer};
use lanelet2_map::points::Points;
use lanelet2_map::projector::Projector;

/// Name of the map file in a folder that is given as a map.
const MAP_NAME: &str = "lanelet2_map.osm";

/// Size of the pieces in which a map is read, bytes.
const PIECE: usize = 64 << 10;

/// The lights of a map.
#[derive(Debug)]
pub struct MapLights {
    /// The lights; without the positions of their lamps if these cannot be computed.
    pub lights: LightMap,
    /// Reason why lamps have no positions; `None` if they have.
    pub unplaced: Option<MapError>,
}

/// Returns the path of a map given by name, or by a path relative to the working directory, and the remedy if
/// it does not exist.
pub fn find_map(files: &dyn Files, given: &Path, otherwise: &str) -> (PathBuf, String) {
    let path = named_file::find_here(BuiltIn::Map, files, given);
    let remedy = named_file::remedy(BuiltIn::Map, files, &path, otherwise);
    (path, remedy)
}

/// Reads the lights of a map from a file, or from `lanelet2_map.osm` in a folder.
///
/// # Errors
/// Returns the problem of the file, its projector or the map, with its position if known.
pub fn read_lights(files: &dyn Files, path: &Path, lamps: LampSource) -> Result<MapLights, Problem> {
    let map = MapFile::read(files, path)?;
    // Points are only for viewers: a map without them still has its lights.
    let (points, unplaced) = match Points::new(&map.osm, &map.projector()) {
        Ok(points) => (Some(points), None),
        Err(error) => (None, Some(error)),
    };
    let lights = LightMap::read(&map.osm, points.as_ref(), lamps);
    let lights = lights.map_err(|error| map.problem(files, error.to_string(), &error))?;
    Ok(MapLights { lights, unplaced })
}

/// Reads the lanelets of a map from a file, or from `lanelet2_map.osm` in a folder.
///
/// # Errors
/// Returns the problem of the file, its projector or the map, with its position if known; a map without a
/// lanelet for vehicles.
pub fn read_lane_network(files: &dyn Files, path: &Path) -> Result<LaneNetwork, Problem> {
    let mut map = MapFile::read(files, path)?;
    let road = Points::new(&map.osm, &map.projector()).and_then(|points| {
        // The points replace the nodes, which are most of a map, from here on.
        map.osm.nodes = OsmLayer::default();
        LaneNetwork::read(&map.osm, &points)
    });
    let road = road.map_err(|error| {
        // Without the file, the map does not require local coordinates: they were the last resort.
        let reason = match (&error, map.given) {
            (MapError::NoLocal(node), None) => {
                format!(
                    "node {node} has no `local_x` and `local_y`, and there is no map_projector_info.yaml beside the map"
                )
            }
            _ => error.to_string(),
        };
        map.problem(files, reason, &error)
    })?;
    let is_empty = road.lanes().next().is_none();
    let problem = || Problem::whole_file(path, "it has no lanelet for vehicles", "give another map");
    if is_empty { Err(problem()) } else { Ok(road) }
}

/// Reads a map that is named at `at`. Records its problem at its position in the map, otherwise at `at`;
/// `otherwise` is the remedy unless a built-in map was probably meant.
pub(super) fn read_named<T>(
    files: &dyn Files,
    checker: &Checker,
    at: &Location,
    path: &Path,
    otherwise: &str,
    read: impl FnOnce(&dyn Files, &Path) -> Result<T, Problem>,
) -> Option<T> {
    let refuse = |problem: Problem| {
        if problem.position.is_some() {
            checker.adopt(vec![problem]);
        } else {
            let remedy = named_file::remedy(BuiltIn::Map, files, path, otherwise);
            checker.refuse(at, format!("{}: {}", display(&problem.file), problem.reason), &remedy);
        }
    };
    read(files, path).map_err(refuse).ok()
}

/// Returns the problem of a map, at a value in a line or where the line begins.
fn placed(
    files: &dyn Files,
    path: &Path,
    reason: String,
    line: Option<usize>,
    value: Option<&str>,
) -> Problem {
    let text = |line: usize| {
        let text = BufReader::new(files.open(path).ok()?).split(b'\n').nth(line - 1)?.ok()?;
        Some(String::from_utf8_lossy(&text).into_owned())
    };
    let position =
        line.map(|line| Position { line, column: text(line).map_or(1, |text| column(&text, value)) });
    Problem { position, ..Problem::whole_file(path, reason, "") }
}

/// Returns the column of a value in a line, otherwise of the line's first character; counted in characters
/// from 1.
fn column(line: &str, value: Option<&str>) -> usize {
    let quoted =
        |value: &str| ['"', '\''].into_iter().find_map(|quote| line.find(&format!("{quote}{value}{quote}")));
    let start = value.and_then(quoted).unwrap_or(line.len() - line.trim_start().len());
    line[..start].chars().count() + 1
}

/// A map before interpretation.
struct MapFile {
    path: PathBuf,
    osm: Osm,
    /// Projector of its projector file; `None` without that file.
    given: Option<Projector>,
}

impl MapFile {
    fn read(files: &dyn Files, path: &Path) -> Result<Self, Problem> {
        let whole = |reason: String| Problem::whole_file(path, reason, "");
        let (path, outcome) = match files.open(path) {
            Err(error) if error.kind() == io::ErrorKind::IsADirectory => {
                let path = path.join(MAP_NAME);
                let outcome = files.open(&path);
                if outcome.as_ref().is_err_and(|error| error.kind() == io::ErrorKind::NotFound) {
                    return Err(whole(format!("this is a folder without a {MAP_NAME}")));
                }
                (path, outcome)
            }
            outcome => (path.to_owned(), outcome),
        };
        let file = outcome.map_err(|error| whole(cannot_read(&error)))?;
        let mut reader = Reader::from_reader(BufReader::with_capacity(PIECE, file));
        let osm = osm::read_events(|text| reader.read_event_into(text)).map_err(|error| {
            let content = files.read(&path).unwrap_or_default();
            FileKind::Map.mismatch(&content).map_or_else(
                || placed(files, &path, error.to_string(), Some(error.line), error.value()),
                |refusal| whole(refusal.reason),
            )
        })?;
        let beside = path.with_file_name("map_projector_info.yaml");
        let parse = |bytes: Vec<u8>| Projector::parse(&String::from_utf8_lossy(&bytes));
        let given = files.read(&beside).ok().map(parse).transpose();
        let given = given.map_err(|error| whole(format!("{}: {error}", beside.display())))?;
        Ok(Self { path, osm, given })
    }

    fn problem(&self, files: &dyn Files, reason: String, error: &MapError) -> Problem {
        placed(files, &self.path, reason, self.osm.line(error.element()), None)
    }

    /// Returns the given projector, otherwise the military grid like upstream, otherwise local coordinates.
    fn projector(&self) -> Projector {
        self.given.or_else(|| Projector::mgrs_around(&self.osm)).unwrap_or(Projector::Local)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    const CROSSROADS: &str = include_str!("../../../tests/maps/crossroads.osm");

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

    /// A map that is available only in pieces, and the result of reading beyond its last byte.
    struct Stream(String, Beyond);

    #[derive(Clone, Copy)]
    struct Beyond(fn() -> io::Result<usize>);

    impl Files for Stream {
        fn read(&self, _: &Path) -> io::Result<Vec<u8>> {
            Err(io::ErrorKind::OutOfMemory.into())
        }

        fn open(&self, path: &Path) -> io::Result<Box<dyn Read>> {
            let text = io::Cursor::new(self.0.clone());
            match path.extension() {
                Some(osm) if osm == "osm" => Ok(Box::new(text.chain(self.1))),
                _ => Err(io::ErrorKind::NotFound.into()),
            }
        }
    }

    impl Read for Beyond {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            (self.0)()
        }
    }

    #[test]
    fn a_map_is_read_in_pieces_to_its_first_mistake() {
        let refused = |text, beyond| {
            read_lane_network(&Stream(text, Beyond(beyond)), Path::new("map.osm")).unwrap_err()
        };
        let torn = refused(CROSSROADS.to_owned(), || Err(io::Error::other("the disk is gone")));
        let lines = CROSSROADS.split('\n').count();
        assert_eq!(torn.to_string(), format!("map.osm:{lines}:1: cannot read it: the disk is gone"));
        let wrong = format!("<osm>\n  <node/>{}", "\n".repeat(2 * PIECE));
        let wrong = refused(wrong, || panic!("more was read than the pieces with the mistake"));
        assert_eq!(wrong.to_string(), "map.osm:2:3: a node has no `id`");
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
        assert!(error.reason.ends_with("which the projector type Local needs"), "{error}");
        assert!(error.position.is_some(), "{error}");
    }

    #[test]
    fn a_map_without_any_coordinates_is_refused_with_what_it_lacks() {
        let map = CROSSROADS.replace("k=\"local_x\"", "k=\"x\"").replace(" lat=", " was=");
        let error = read_lane_network(&Town { map, projector: None }, Path::new("town")).unwrap_err();
        assert!(error.reason.ends_with("there is no map_projector_info.yaml beside the map"), "{error}");
    }

    #[test]
    fn a_problem_of_a_map_has_its_place() {
        let refused = |old: &str, new: &str| {
            let map = CROSSROADS.replacen(old, new, 1);
            read_lane_network(&Town { map, projector: None }, Path::new("town")).unwrap_err()
        };
        let value = refused("lat=\"", "lat=\"x");
        assert_eq!(value.file, Path::new("town/lanelet2_map.osm"));
        let line = CROSSROADS.lines().position(|line| line.contains("lat=\"")).unwrap();
        let at = CROSSROADS.lines().nth(line).unwrap().find("lat=").unwrap();
        assert_eq!(value.position, Some(Position { line: line + 1, column: at + 5 }), "{value}");
        let cut = read_lane_network(
            &Town { map: CROSSROADS[..CROSSROADS.len() / 2].to_owned(), projector: None },
            Path::new("town"),
        );
        let cut = cut.unwrap_err();
        assert!(cut.reason.ends_with("it is cut short"), "{cut}");
        let lines = CROSSROADS[..CROSSROADS.len() / 2].split('\n').count();
        assert_eq!(cut.position.map(|position| position.line), Some(lines));
        let role = refused("role=\"left\"", "role=\"middle\"");
        let Position { line, column } = role.position.unwrap();
        let text = CROSSROADS.lines().nth(line - 1).unwrap();
        assert!(text[column - 1..].starts_with("<relation"), "{role}: {text}");
    }
}
