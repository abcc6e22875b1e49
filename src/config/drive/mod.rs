//! Drive scenarios for the turn signal decider: a map, a route, how the vehicle drives it, what the
//! planner does meanwhile, what goes wrong, and what must come out. TOML or YAML with the same keys;
//! `docs/turn-signal-scenarios.md` explains each.
//!
//! Positions are metres along the way: the middle of the preferred lanelets, from the start of the
//! first one, of the rear axle. Times are seconds from the start. Offsets are to the left.

mod expectation;
mod manoeuvre;
mod reading;
mod route;
mod setting;
mod trouble;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

pub use expectation::{Expectation, Stretch, Wanted};
pub use manoeuvre::{AvoidanceLine, Plan, PlanKind};
pub use route::RoutePlan;
pub use trouble::{Trouble, TroubleKind};

use crate::config::files::Files;
use crate::config::problem::{Problem, Refused};
use crate::config::traffic_lights::projector;
use crate::config::values::fields::Fields;
use crate::config::values::place::{Place, Text};
use crate::config::values::{Value, from_toml, from_yaml};
use crate::core::map::road_map::RoadMap;
use crate::core::turn_signal::geometry::Point;
use crate::core::turn_signal::parameters::{Parameters, Vehicle};
use crate::core::turn_signal::road::{LaneId, Road};
use crate::core::turn_signal::scene::Mode;
use reading::{LONGEST_M, LONGEST_S, Reading, metres};

/// Where the keys are explained.
const SEE: &str = "docs/turn-signal-scenarios.md";
/// Without a limit a drive ends after this.
const LONGEST_DRIVE_S: f64 = 600.0;

/// What a drive scenario says.
#[derive(Debug, Clone)]
pub struct DriveFile {
    /// What it is called.
    pub name: Option<String>,
    /// What it is about.
    pub description: Option<String>,
    /// Whose behaviours it is for, improved first.
    pub modes: Vec<Mode>,
    /// The decider's parameters, those of the country and those set one by one.
    pub parameters: Parameters,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Cycles a second.
    pub planning_hz: f64,
    /// Where the vehicle is at the start, metres.
    pub start_m: f64,
    /// Where the drive ends, metres; `None` = at the end of the way.
    pub until_m: Option<f64>,
    /// When it ends at the latest.
    pub until: Duration,
    /// The map it is on.
    pub map: PathBuf,
    /// The lanelets of the map.
    pub road: Arc<Road>,
    /// The route.
    pub route: RoutePlan,
    /// How fast the vehicle drives.
    pub speed: SpeedProfile,
    /// Where it stands for a while, ascending.
    pub stops: Vec<Stop>,
    /// The line it drives instead of the way of the route; empty = that way.
    pub points: Vec<Point>,
    /// What the planner does, in the order of the file.
    pub manoeuvres: Vec<Plan>,
    /// What goes wrong.
    pub troubles: Vec<Trouble>,
    /// What must come out.
    pub expectations: Vec<Expectation>,
}

/// A place on the way or a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moment {
    /// Metres along the way.
    AtM(f64),
    /// Seconds from the start.
    AtS(f64),
}

/// How fast the vehicle drives: the speed holds from each step on. Ascending, and the first speed also
/// holds before its step.
#[derive(Debug, Clone, PartialEq)]
pub enum SpeedProfile {
    /// (metres along the way, m/s); never negative.
    ByPlace(Vec<(f64, f64)>),
    /// (seconds from the start, m/s); negative is backwards.
    ByTime(Vec<(f64, f64)>),
}

/// A stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// Where, metres along the way.
    pub at_m: f64,
    /// How long, seconds.
    pub for_s: f64,
}

/// Reads a drive scenario and the map it names.
///
/// # Errors
/// All reasons, each with its place; of what is not even TOML or YAML, the first.
pub fn read(files: &dyn Files, path: &Path) -> Result<DriveFile, Refused> {
    let one = |problem| Refused(vec![problem]);
    let bytes = files.read(path).map_err(|error| {
        one(whole(path, format!("cannot read it: {error}"), "give the path of a drive scenario"))
    })?;
    let text = Text::new(path, bytes).map_err(one)?;
    let root = match path.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => from_toml(&text, SEE),
        Some("yaml" | "yml") => from_yaml(&text),
        Some(_) | None => {
            let reason = "the extension tells no form of drive scenario".to_owned();
            Err(whole(path, reason, "name it .toml or .yaml"))
        }
    };
    let mut reading = Reading::new(Arc::clone(&text.file));
    let file = interpret(files, &root.map_err(one)?, path, &mut reading);
    match file.filter(|_| reading.problems.is_empty()) {
        Some(file) => Ok(file),
        None => Err(Refused(reading.into_problems())),
    }
}

/// `None` only with a problem told.
fn interpret(files: &dyn Files, root: &Value, path: &Path, reading: &mut Reading) -> Option<DriveFile> {
    let mut top = Fields::of(reading, root)?;
    let name = top.text(reading, "name").map(|given| given.text);
    let description = top.text(reading, "description").map(|given| given.text);
    let map = top.required(reading, "map");
    let modes = setting::modes(reading, &mut top);
    let parameters = setting::parameters(files, reading, &mut top);
    let vehicle = setting::vehicle(reading, &mut top);
    let planning_hz = reading::number(reading, &mut top, "planning_hz", 0.1..=1000.0, "Hz").unwrap_or(10.0);
    let start_m = metres(reading, &mut top, "start_m").unwrap_or(0.0);
    let until_m = metres(reading, &mut top, "until_m");
    let until_s = reading::number(reading, &mut top, "until_s", 0.0..=LONGEST_S, "s");
    let route = route::route(reading, &mut top);
    let drive = setting::drive(reading, &mut top);
    let manoeuvres = manoeuvre::plans(reading, &mut top);
    let troubles = trouble::troubles(reading, &mut top);
    let expectations = expectation::expectations(reading, &mut top);
    top.done(reading);
    if until_m.is_some_and(|until_m| until_m <= start_m) {
        reading.refuse(&root.spot, "until_m is not beyond start_m", "the drive goes forward: give more");
    }
    let map_path = path.parent().unwrap_or(Path::new("")).join(&map.as_ref()?.text);
    let road = match read_road(files, &map_path) {
        Ok(road) => road,
        Err(reason) => {
            let remedy = "give the path of a lanelet2 map, relative to this file";
            reading.refuse(&map?.spot, reason, remedy);
            return None;
        }
    };
    reading.check_lanes(&road);
    let (speed, stops, points) = drive?;
    let until = Duration::from_secs_f64(until_s.unwrap_or(LONGEST_DRIVE_S).clamp(0.0, LONGEST_S));
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
        troubles,
        expectations,
    })
}

fn read_road(files: &dyn Files, path: &Path) -> Result<Road, String> {
    let of_map = |reason: String| format!("{}: {reason}", path.display());
    let bytes = files.read(path).map_err(|error| of_map(format!("cannot read it: {error}")))?;
    let map = RoadMap::read(&bytes, &projector(files, path)?).map_err(|error| of_map(error.to_string()))?;
    Ok(Road::of_map(&map))
}

fn whole(path: &Path, reason: String, remedy: &str) -> Problem {
    let (file, remedy) = (path.to_owned(), remedy.to_owned());
    Problem { file, position: None, key: String::new(), reason, remedy }
}

/// A lanelet id where it stands.
#[derive(Debug, Clone)]
struct UsedLane {
    id: LaneId,
    place: Place,
}

/// Farther than this is no drive.
const FARTHEST: std::ops::RangeInclusive<f64> = -LONGEST_M..=LONGEST_M;
