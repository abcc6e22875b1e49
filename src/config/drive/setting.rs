//! Behaviour, parameters, vehicle and speed of a drive scenario.

use std::path::Path;

use super::reader::{MAX_S, Reader, list, number, required, required_metres};
use crate::config::country::{NoCountry, country};
use crate::config::files::Files;
use crate::config::reading::fields::{Fields, given};
use crate::config::reading::value::{Kind, Value};
use crate::core::map::geometry::Point;
use crate::core::turn_signal::parameters::{Parameters, Vehicle};

/// Faster is not a drive, m/s.
const MAX_SPEED_MPS: f64 = 100.0;

/// Speed of the vehicle, which holds from each step on. Ascending, and the first speed also
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
    /// Place, metres along the way.
    pub at_m: f64,
    /// Duration, seconds.
    pub for_s: f64,
}

/// The keys `country` and `parameters`.
pub(super) fn parameters(files: &dyn Files, reader: &mut Reader, top: &mut Fields<'_>) -> Parameters {
    let mut parameters = Parameters::DEPLOYED;
    if let Some(code) = top.text(reader, "country") {
        let folder = reader.file.parent().unwrap_or(Path::new(""));
        match country(files, folder, &code.text) {
            Ok(country) => parameters = Parameters::for_country(&country),
            Err(NoCountry::Nowhere { reason, remedy }) => reader.refuse(&code.location, reason, &remedy),
            Err(NoCountry::Refused(problems)) => reader.problems.extend(problems),
        }
    }
    for (name, value) in entries(reader, top, "parameters") {
        let Some(text) = given(reader, value) else { continue };
        if let Err(error) = parameters.set(name, &text.text) {
            reader.refuse(&value.location, error.to_string(), "see docs/turn-signal-scenarios.md");
        }
    }
    parameters
}

/// Keys and values of a table, if it is there.
fn entries<'v>(reader: &mut Reader, top: &mut Fields<'v>, key: &'static str) -> Vec<(&'v str, &'v Value)> {
    let Some(value) = top.take(key) else { return Vec::new() };
    match &value.kind {
        Kind::Map(entries) => entries.iter().map(|entry| (entry.key.as_str(), &entry.value)).collect(),
        Kind::Null | Kind::Scalar { .. } | Kind::List(_) => {
            reader.refuse(&value.location, format!("{} stands here", value.described()), "give a table");
            Vec::new()
        }
    }
}

/// The table `vehicle`; missing keys are those of Autoware's sample vehicle.
pub(super) fn vehicle(reader: &mut Reader, top: &mut Fields<'_>) -> Vehicle {
    let sample = Vehicle::SAMPLE;
    let Some(value) = top.take("vehicle") else { return sample };
    let Some(mut fields) = Fields::of(reader, value) else { return sample };
    let mut size = |key, otherwise| number(reader, &mut fields, key, 0.0..=50.0, "m").unwrap_or(otherwise);
    let vehicle = Vehicle {
        wheel_base_m: size("wheel_base_m", sample.wheel_base_m),
        front_overhang_m: size("front_overhang_m", sample.front_overhang_m),
        rear_overhang_m: size("rear_overhang_m", sample.rear_overhang_m),
        left_m: size("left_m", sample.left_m),
        right_m: size("right_m", sample.right_m),
    };
    fields.done(reader);
    vehicle
}

/// The table `drive`.
pub(super) fn drive(
    reader: &mut Reader,
    top: &mut Fields<'_>,
) -> Option<(SpeedProfile, Vec<Stop>, Vec<Point>)> {
    top.must_have(reader, "drive")?;
    let mut fields = Fields::of(reader, top.take("drive")?)?;
    fields.must_have(reader, "speed");
    let speed = fields.take("speed").and_then(|value| speed(reader, value));
    let mut stops: Vec<Stop> =
        fields.list(reader, "stops").iter().filter_map(|value| stop(reader, value)).collect();
    stops.sort_by(|one, other| one.at_m.total_cmp(&other.at_m));
    let points = fields.take("points").map(|value| points(reader, value)).unwrap_or_default();
    fields.done(reader);
    Some((speed?, stops, points))
}

fn speed(reader: &mut Reader, value: &Value) -> Option<SpeedProfile> {
    let steps = list(reader, value, "give a list of steps: [{ at_m = 0, mps = 10 }]");
    let (mut by_place, mut by_time) = (Vec::new(), Vec::new());
    for step in steps {
        let mut fields = Fields::of(reader, step)?;
        let is_by_time = fields.has("at_s");
        if is_by_time {
            let at_s = number(reader, &mut fields, "at_s", 0.0..=MAX_S, "s");
            let mps = required(reader, &mut fields, "mps", -MAX_SPEED_MPS..=MAX_SPEED_MPS, "m/s");
            by_time.extend(at_s.zip(mps));
        } else {
            let at_m = required_metres(reader, &mut fields, "at_m");
            let mps = required(reader, &mut fields, "mps", 0.0..=MAX_SPEED_MPS, "m/s");
            by_place.extend(at_m.zip(mps));
        }
        fields.done(reader);
    }
    let ascends = |steps: &[(f64, f64)]| {
        steps.iter().zip(steps.iter().skip(1)).all(|((before, _), (after, _))| before < after)
    };
    if !(ascends(&by_place) && ascends(&by_time)) {
        reader.refuse(&value.location, "the steps do not ascend", "order them, each place or time once");
    }
    match (by_place.is_empty(), by_time.is_empty()) {
        (false, true) => Some(SpeedProfile::ByPlace(by_place)),
        (true, false) => Some(SpeedProfile::ByTime(by_time)),
        (true, true) => {
            reader.refuse(&value.location, "no speed at all", "give a step: [{ at_m = 0, mps = 10 }]");
            None
        }
        (false, false) => {
            reader.refuse(&value.location, "steps by place and by time", "keep at_m or at_s");
            None
        }
    }
}

fn stop(reader: &mut Reader, value: &Value) -> Option<Stop> {
    let mut fields = Fields::of(reader, value)?;
    let at_m = required_metres(reader, &mut fields, "at_m");
    let for_s = required(reader, &mut fields, "for_s", 0.0..=MAX_S, "s");
    fields.done(reader);
    Some(Stop { at_m: at_m?, for_s: for_s? })
}

fn points(reader: &mut Reader, value: &Value) -> Vec<Point> {
    let wanted = "give a list of two points or more: [[0.0, 1.5], [50.0, 1.5]]";
    let mut points: Vec<Point> = Vec::new();
    let items = list(reader, value, wanted);
    for item in items {
        let pair = list(reader, item, "give x and y in metres: [0.0, 1.5]");
        let coordinates: Vec<f64> = pair
            .iter()
            .filter_map(|item| {
                let given = given(reader, item)?;
                reader.in_range(&given, &(-1e8..=1e8), "m")
            })
            .collect();
        match coordinates.as_slice() {
            [x_m, y_m] => points.push(Point::new(*x_m, *y_m)),
            _ if pair.len() == 2 => {}
            _ => reader.refuse(&item.location, "a point has two coordinates", "give x and y: [0.0, 1.5]"),
        }
    }
    let moves = points.iter().zip(points.iter().skip(1)).all(|(one, other)| one.distance_m(*other) > 1e-3);
    if items.len() < 2 || !moves {
        reader.refuse(&value.location, "the points are not a line", wanted);
    }
    points
}
