//! Speed and stops of a drive scenario.

use std::ops::RangeInclusive;

use super::reader::{MAX_S, required_metres, required_seconds};
use crate::config::reading::{Fields, Value};
use lanelet2_map::geometry::Point;

/// Maximum speed of a vehicle in a scenario, m/s.
pub const MAX_SPEED_MPS: f64 = 100.0;

/// The speed of the vehicle, in ascending steps. Each speed applies from its step on; the first also applies
/// before its step.
#[derive(Debug, Clone, PartialEq)]
pub enum SpeedProfile {
    /// Steps by position (metres along the route path, m/s); never negative.
    ByPosition(Vec<(f64, f64)>),
    /// Steps by time (seconds from the start, m/s); negative is backwards.
    ByTime(Vec<(f64, f64)>),
}

/// A stop of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// Position, metres along the route path.
    pub at_m: f64,
    /// Time that the vehicle stands, seconds.
    pub for_s: f64,
}

/// Reads the table `drive`: speed, stops, and the points of a line other than the route's lanelets.
pub(super) fn drive(top: &Fields<'_>) -> Option<(SpeedProfile, Vec<Stop>, Vec<Point>)> {
    top.require(&["drive"], "");
    top.read_table("drive", |fields| {
        fields.require(&["speed"], "");
        let speed = speed(fields);
        let mut stops = fields.read_tables("stops", stop);
        stops.sort_by(|one, other| one.at_m.total_cmp(&other.at_m));
        let points = if fields.has("points") { points(fields) } else { Vec::new() };
        Some((speed?, stops, points))
    })
}

/// Keys that state a speed in another unit, with the factor to m/s.
const OTHER_UNITS: &[(&str, &str, f64)] = &[
    ("kmh", "km/h", 1.0 / 3.6),
    ("kph", "km/h", 1.0 / 3.6),
    ("km_h", "km/h", 1.0 / 3.6),
    ("mph", "mph", 0.44704),
];

fn speed(fields: &Fields<'_>) -> Option<SpeedProfile> {
    let (mut by_position, mut by_time) = (Vec::new(), Vec::new());
    let before = fields.checker.count();
    for step in fields.tables("speed") {
        if step.has("at_s") {
            let at_s = step.number("at_s", 0.0..=MAX_S, "s");
            let mps = mps(&step, -MAX_SPEED_MPS..=MAX_SPEED_MPS);
            by_time.extend(at_s.zip(mps));
        } else {
            let at_m = required_metres(&step, "at_m");
            let mps = mps(&step, 0.0..=MAX_SPEED_MPS);
            by_position.extend(at_m.zip(mps));
        }
        step.done();
    }
    // The steps are incomplete, so that nothing else can be said of them.
    if fields.checker.count() > before {
        return None;
    }
    let ascends = |steps: &[(f64, f64)]| {
        steps.iter().zip(steps.iter().skip(1)).all(|((before, _), (after, _))| before < after)
    };
    if !(ascends(&by_position) && ascends(&by_time)) {
        fields.refuse("speed", "the steps do not ascend", "order them, each position or time once");
    }
    match (by_position.is_empty(), by_time.is_empty()) {
        (false, true) => Some(SpeedProfile::ByPosition(by_position)),
        (true, false) => Some(SpeedProfile::ByTime(by_time)),
        (true, true) => fields.refused("speed", "no speed at all", "give a step: [{ at_m = 0, mps = 10 }]"),
        (false, false) => fields.refused("speed", "steps by position and by time", "keep at_m or at_s"),
    }
}

/// Reads the speed of a step.
fn mps(step: &Fields<'_>, range: RangeInclusive<f64>) -> Option<f64> {
    let Some((key, unit, to_mps)) = OTHER_UNITS.iter().find(|(key, ..)| step.has(key)) else {
        return step.required_number("mps", range, "m/s");
    };
    let given = step.value(key).and_then(Value::scalar).and_then(|(given, _)| given.parse::<f64>().ok());
    let in_mps = given.map_or("…".to_owned(), |given| format!("{:.2}", given * to_mps));
    let remedy = format!("write mps = {in_mps}");
    step.refused(key, format!("speeds are in m/s, not in {unit}"), &remedy)
}

fn stop(fields: &Fields<'_>) -> Option<Stop> {
    let (at_m, for_s) = (required_metres(fields, "at_m"), required_seconds(fields, "for_s"));
    Some(Stop { at_m: at_m?, for_s: for_s? })
}

fn points(fields: &Fields<'_>) -> Vec<Point> {
    const EXAMPLE: &str = "give a list of two points or more: [[0.0, 1.5], [50.0, 1.5]]";
    let checker = fields.checker;
    let given = fields.list("points", EXAMPLE);
    let point = |item: &Value| {
        let pair = checker.list(item, "give x and y in metres: [0.0, 1.5]");
        if pair.len() != 2 {
            checker.refuse(&item.location, "a point has two coordinates", "give x and y: [0.0, 1.5]");
        }
        let mut coordinates = pair.iter().map(|item| checker.number(item, &(-1e8..=1e8), "m"));
        Some(Point::new(coordinates.next()??, coordinates.next()??))
    };
    let points: Vec<Point> = given.iter().filter_map(point).collect();
    let moves = points.iter().zip(points.iter().skip(1)).all(|(one, other)| one.distance_m(*other) > 1e-3);
    if given.len() < 2 || !moves {
        fields.refuse("points", "the points are not a line", EXAMPLE);
    }
    points
}
