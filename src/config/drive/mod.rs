//! Drive scenarios for the turn signal decider: a map, a route, how the vehicle drives it, what the
//! planner does meanwhile, what goes wrong, and what must come out. TOML or YAML with the same keys;
//! `docs/turn-signal-scenarios.md` explains each.
//!
//! Positions are metres along the way: the middle of the preferred lanelets, from the start of the
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

pub use disturbance::{Disturbance, DisturbanceKind};
pub use expectation::{Expectation, Interval, Wanted};
pub use manoeuvre::{AvoidanceLine, Plan, PlanKind};
pub use reader::Moment;
pub use route::RoutePlan;
pub use setting::{SpeedProfile, Stop};

use crate::config::files::Files;
use crate::config::map::read_lane_network;
use crate::config::reading::fields::Fields;
use crate::config::reading::location::Text;
use crate::config::reading::problem::{Problem, Refused};
use crate::config::reading::toml_text::from_toml;
use crate::config::reading::value::Value;
use crate::config::reading::yaml_text::from_yaml;
use crate::core::map::geometry::Point;
use crate::core::map::lane_network::LaneNetwork;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::parameters::{Parameters, Vehicle};
use reader::{MAX_S, Reader, SEE, metres};

/// Without a limit a drive ends after this.
const MAX_DRIVE_S: f64 = 600.0;

/// A drive scenario as read.
#[derive(Debug, Clone)]
pub struct DriveFile {
    /// Its name.
    pub name: Option<String>,
    /// Its description.
    pub description: Option<String>,
    /// The behaviours it is for, improved first.
    pub modes: Vec<DeciderCompat>,
    /// The decider's parameters, those of the country and those set one by one.
    pub parameters: Parameters,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Cycles a second.
    pub planning_hz: f64,
    /// Place of the vehicle at the start, metres along the way.
    pub start_m: f64,
    /// Where the drive ends, metres; `None` = at the end of the way.
    pub until_m: Option<f64>,
    /// The latest time of its end.
    pub until: Duration,
    /// The map it is on.
    pub map: PathBuf,
    /// The lanelets of the map.
    pub road: Arc<LaneNetwork>,
    /// The route.
    pub route: RoutePlan,
    /// Speed of the vehicle.
    pub speed: SpeedProfile,
    /// Stops of the vehicle, ascending.
    pub stops: Vec<Stop>,
    /// The line it drives instead of the way of the route; empty = that way.
    pub points: Vec<Point>,
    /// Manoeuvres of the planner, in the order of the file.
    pub manoeuvres: Vec<Plan>,
    /// Disturbances, in the order of the file.
    pub disturbances: Vec<Disturbance>,
    /// Expectations, in the order of the file.
    pub expectations: Vec<Expectation>,
}

/// Reads a drive scenario and the map it names.
///
/// # Errors
/// All reasons, each with its place; of what is not even TOML or YAML, the first.
pub fn read(files: &dyn Files, path: &Path) -> Result<DriveFile, Refused> {
    let one = |problem| Refused(vec![problem]);
    let bytes = files
        .read(path)
        .map_err(|error| one(Problem::unreadable(path, &error, "give the path of a drive scenario")))?;
    let text = Text::new(path, bytes).map_err(one)?;
    let root = match path.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => from_toml(&text, SEE),
        Some("yaml" | "yml") => from_yaml(&text),
        Some(_) | None => {
            let reason = "unknown file extension of a drive scenario";
            Err(Problem::whole_file(path, reason, "name it .toml or .yaml"))
        }
    };
    let mut reader = Reader::new(Arc::clone(&text.file));
    let file = interpret(files, &root.map_err(one)?, path, &mut reader);
    match file.filter(|_| reader.problems.is_empty()) {
        Some(file) => Ok(file),
        None => Err(Refused(reader.into_problems())),
    }
}

/// `None` only with a problem in the reader.
fn interpret(files: &dyn Files, root: &Value, path: &Path, reader: &mut Reader) -> Option<DriveFile> {
    let mut top = Fields::of(reader, root)?;
    let name = top.text(reader, "name").map(|given| given.text);
    let description = top.text(reader, "description").map(|given| given.text);
    let map = top.required(reader, "map");
    let modes = reader::modes(reader, &mut top);
    let parameters = setting::parameters(files, reader, &mut top);
    let vehicle = setting::vehicle(reader, &mut top);
    let planning_hz = reader::number(reader, &mut top, "planning_hz", 0.1..=1000.0, "Hz").unwrap_or(10.0);
    let start_m = metres(reader, &mut top, "start_m").unwrap_or(0.0);
    let until_m = metres(reader, &mut top, "until_m");
    let until_s = reader::number(reader, &mut top, "until_s", 0.0..=MAX_S, "s");
    let route = route::route(reader, &mut top);
    let drive = setting::drive(reader, &mut top);
    let manoeuvres = manoeuvre::plans(reader, &mut top);
    let disturbances = disturbance::disturbances(reader, &mut top);
    let expectations = expectation::expectations(reader, &mut top);
    top.done(reader);
    if until_m.is_some_and(|until_m| until_m <= start_m) {
        reader.refuse(&root.location, "until_m is not beyond start_m", "the drive goes forward: give more");
    }
    let map_path = path.parent().unwrap_or(Path::new("")).join(&map.as_ref()?.text);
    let road = match read_lane_network(files, &map_path) {
        Ok(road) => road,
        Err(reason) => {
            let reason = format!("{}: {reason}", map_path.display());
            let remedy = "give the path of a lanelet2 map, relative to this file";
            reader.refuse(&map?.location, reason, remedy);
            return None;
        }
    };
    reader.check_lanes(&road);
    let (speed, stops, points) = drive?;
    let until = Duration::from_secs_f64(until_s.unwrap_or(MAX_DRIVE_S).clamp(0.0, MAX_S));
    Some(DriveFile {
        name,
        description,
        modes,
        parameters,
        vehicle,
        planning_hz,
        start_m,
        until_m,
        until,
        map: map_path,
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
