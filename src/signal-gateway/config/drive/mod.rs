//! Drive scenarios for the turn-signal decider: a map, a route, the speed of the vehicle, manoeuvres of the
//! planner, disturbances, and expectations. `docs/turn-signal-scenarios.md` explains each key.
//!
//! Positions are metres along the route path: the middle of the preferred lanelets, from the start of the
//! first one, of the rear axle. Times are seconds from the start. Offsets are to the left.

mod disturbance;
mod expectation;
mod manoeuvre;
mod reader;
mod route;
mod setting;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

pub use disturbance::{Disturbance, DisturbanceKind, GapKind};
pub use expectation::{Expectation, ExpectedDecision, ExpectedInterval, IntervalUnit};
pub use manoeuvre::{ManoeuvrePlan, PlanKind, PlannedShift};
pub use reader::DriveMoment;
pub use route::RoutePlan;
pub use setting::{MAX_SPEED_MPS, SpeedProfile, Stop};

use crate::config::built_in::BuiltIn;
use crate::config::decider;
use crate::config::dimensions;
use crate::config::file_kind::FileKind;
use crate::config::files::Files;
use crate::config::map::{read_lane_network, read_named};
use crate::config::named_file;
use crate::config::reading::{Checker, Fields, Problem, Refused, Text, from_toml};
use lanelet2_map::geometry::Point;
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet};
use reader::{MAX_S, NamedLanelets, SEE, metres};
use turn_signal::compat::DeciderCompat;
use turn_signal::decider::DeciderSettings;

/// The default end of a drive, seconds.
const MAX_DRIVE_S: f64 = 600.0;

/// The content of a drive scenario.
#[derive(Debug, Clone)]
pub struct DriveFile {
    /// Title of the scenario.
    pub name: Option<String>,
    /// Description of the scenario.
    pub description: Option<String>,
    /// Values of `compat` for which the scenario is intended, improved first.
    pub compats: Vec<DeciderCompat>,
    /// Settings of the decider, except `compat`, which is one of `compats`.
    pub decider: DeciderSettings,
    /// Cycles of the decider per second.
    pub planning_hz: f64,
    /// Position of the vehicle at the start, metres.
    pub start_m: f64,
    /// Position at which the drive ends, metres; `None` = half a metre before the end of the route path.
    pub until_m: Option<f64>,
    /// Latest end of the drive.
    pub until: Duration,
    /// Path of the map.
    pub map: PathBuf,
    /// Lanelets of the map.
    pub road: Arc<LaneNetwork>,
    /// Route at the start.
    pub route: RoutePlan,
    /// Speed of the vehicle.
    pub speed: SpeedProfile,
    /// Stops, in ascending order.
    pub stops: Vec<Stop>,
    /// Line that the vehicle drives instead of the route's lanelets; empty = the lanelets.
    pub points: Vec<Point>,
    /// Manoeuvres of the planner, in the order of the file.
    pub manoeuvres: Vec<ManoeuvrePlan>,
    /// Disturbances, in the order of the file.
    pub disturbances: Vec<Disturbance>,
    /// Expectations, in the order of the file.
    pub expectations: Vec<Expectation>,
}

/// Reads a drive scenario, by path or built-in name, and its map.
///
/// # Errors
/// Every problem with its location; only the first one of a file that is not TOML.
pub fn read(files: &dyn Files, path: &Path) -> Result<DriveFile, Refused> {
    let path = &named_file::find_here(BuiltIn::Drive, files, path);
    let missing = BuiltIn::Drive.did_you_mean(path, "give the path of a drive scenario");
    let text = FileKind::Drive.read(files, path, &missing)?.not_blank()?;
    interpreted(files, &text, None)
}

/// Reads a drive from a text; `road` has the lanelets of its map if the map was read before.
fn interpreted(files: &dyn Files, text: &Text, road: Option<LaneNetwork>) -> Result<DriveFile, Refused> {
    let root = from_toml(text, SEE)?;
    let checker = Checker::new(&text.file, SEE);
    let file = Fields::of(&checker, &root).and_then(|top| interpret(files, top, road));
    checker.finish(file).map_err(Refused)
}

/// Maximum length of the way between two lanelets, metres.
const MAX_WAY_M: f64 = 1_000_000.0;

/// Creates a drive at one speed (m/s) over the shortest way from one lanelet of a map to another, with the
/// defaults of a scenario for everything else.
///
/// # Errors
/// Fails if the map cannot be read or lacks one of the lanelets, if no way leads from one to the other or
/// only a very long one, or if the speed is not allowed in a scenario.
pub fn way(
    files: &dyn Files,
    map: &Path,
    [from, to]: [LaneId; 2],
    speed_mps: f64,
) -> Result<DriveFile, Refused> {
    let road = read_lane_network(files, map)?;
    let missing = [from, to].into_iter().find(|lane| road.lane(*lane).is_none());
    let refused = |reason: String, remedy| Refused::from(Problem::whole_file(map, &reason, remedy));
    if let Some(lane) = missing {
        return Err(refused(format!("it has no lanelet {lane}"), "give the ids of lanelets for vehicles"));
    }
    let lanes = road.shortest_way(from, to).ok_or_else(|| {
        let reason = format!("no way leads from lanelet {from} to lanelet {to} without a change of lane");
        refused(reason, "give two lanelets of one road, or write a scenario with a route")
    })?;
    let length_m: f64 = lanes.iter().filter_map(|lane| road.lane(*lane)).map(Lanelet::length_m).sum();
    if length_m > MAX_WAY_M {
        let reason = format!(
            "the way from lanelet {from} to lanelet {to} is {:.0} km long; at most {:.0} km are driven",
            length_m / 1000.0,
            MAX_WAY_M / 1000.0
        );
        return Err(refused(reason, "give two lanelets that are nearer to each other"));
    }
    over(files, map, road, lanes, speed_mps)
}

/// Creates a drive at one speed (m/s) over an arbitrary lanelet of a map, with the defaults of a scenario for
/// everything else.
///
/// # Errors
/// Fails if the map cannot be read or has no lanelet, or if the speed is not allowed in a scenario.
pub fn anywhere(files: &dyn Files, map: &Path, speed_mps: f64) -> Result<DriveFile, Refused> {
    let road = read_lane_network(files, map)?;
    let lanes = road.lanes().next().map(|lane| lane.id).into_iter().collect();
    over(files, map, road, lanes, speed_mps)
}

fn over(
    files: &dyn Files,
    map: &Path,
    road: LaneNetwork,
    lanes: Vec<LaneId>,
    speed_mps: f64,
) -> Result<DriveFile, Refused> {
    let segments: Vec<[LaneId; 1]> = lanes.into_iter().map(|lane| [lane]).collect();
    let name = map.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let text = format!(
        "map = {}\n[route]\nsegments = {segments:?}\n[drive]\nspeed = [{{ at_m = 0, mps = {speed_mps:?} }}]\n",
        toml::Value::String(name)
    );
    let text = Text::of(&map.with_file_name("the way between two lanelets"), text);
    interpreted(files, &text, Some(road))
}

/// Reads the file; returns `None` only if a problem was recorded.
fn interpret(files: &dyn Files, top: Fields<'_>, road: Option<LaneNetwork>) -> Option<DriveFile> {
    let checker = top.checker;
    let lanes = NamedLanelets::default();
    top.require(&["map"], "");
    let [name, description] = ["name", "description"].map(|key| top.string(key).map(|given| given.text));
    let map = named_file::path_at(BuiltIn::Map, files, &top, "map");
    let compats = reader::compats(&top);
    let vehicle = top.section("vehicle").read_all(dimensions::vehicle);
    let decider = decider::decider(files, &top, DeciderCompat::Improved, vehicle);
    let planning_hz = top.number("planning_hz", 0.1..=1000.0, "Hz").unwrap_or(10.0);
    let start_m = metres(&top, "start_m").unwrap_or(0.0);
    let until_m = metres(&top, "until_m");
    let until_s = top.number("until_s", 0.0..=MAX_S, "s");
    let route = route::route(&lanes, &top);
    let drive = setting::drive(&top);
    let manoeuvres = top.read_tables("manoeuvre", |fields| manoeuvre::plan(&lanes, fields));
    let disturbances = top.read_tables("disturbance", |fields| disturbance::disturbance(&lanes, fields));
    let expectations = top.read_tables("expect", expectation::expectation);
    if until_m.is_some_and(|until_m| until_m <= start_m) {
        top.refuse("until_m", "until_m is not beyond start_m", "the drive goes forward: give more");
    }
    let map_at = top.at("map");
    top.done();
    let map = map?;
    let remedy = "give the path of a lanelet2 map, relative to this file";
    let read = |files: &dyn Files, path: &Path| road.map_or_else(|| read_lane_network(files, path), Ok);
    let road = read_named(files, checker, map_at, &map, remedy, read)?;
    lanes.check(checker, &road);
    let (speed, stops, points) = drive?;
    Some(DriveFile {
        name,
        description,
        compats,
        decider,
        planning_hz,
        start_m,
        until_m,
        until: Duration::from_secs_f64(until_s.unwrap_or(MAX_DRIVE_S)),
        map,
        road: Arc::new(road),
        route: route?,
        speed,
        stops,
        points,
        manoeuvres,
        disturbances,
        expectations,
    })
}
