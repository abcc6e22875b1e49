//! Behaviour, parameters, vehicle and speed of a drive scenario.

use std::path::Path;

use super::reading::{LONGEST_S, Reading, list, metres, number, required, required_metres};
use super::{SpeedProfile, Stop};
use crate::config::country::{NoCountry, country};
use crate::config::files::Files;
use crate::config::values::fields::{Fields, given};
use crate::config::values::{Kind, Value};
use crate::core::turn_signal::geometry::Point;
use crate::core::turn_signal::parameters::{Parameters, Vehicle};
use crate::core::turn_signal::scene::Mode;

/// Faster is no drive, m/s.
const FASTEST_MPS: f64 = 100.0;

/// The key `compat`.
pub(super) fn modes(reading: &mut Reading, top: &mut Fields<'_>) -> Vec<Mode> {
    super::expectation::modes(reading, top, "compat")
}

/// The keys `country` and `parameters`.
pub(super) fn parameters(files: &dyn Files, reading: &mut Reading, top: &mut Fields<'_>) -> Parameters {
    let mut parameters = Parameters::DEPLOYED;
    if let Some(code) = top.text(reading, "country") {
        let folder = reading.file.parent().unwrap_or(Path::new(""));
        match country(files, folder, &code.text) {
            Ok(country) => parameters = Parameters::for_country(&country),
            Err(NoCountry::Nowhere { reason, remedy }) => reading.refuse(&code.spot, reason, &remedy),
            Err(NoCountry::Refused(problems)) => reading.problems.extend(problems),
        }
    }
    for (name, value) in entries(reading, top, "parameters") {
        let Some(text) = given(reading, value) else { continue };
        if let Err(error) = parameters.set(name, &text.text) {
            reading.refuse(&value.spot, error.to_string(), "see docs/turn-signal-scenarios.md");
        }
    }
    parameters
}

/// Keys and values of a table, if it is there.
fn entries<'v>(reading: &mut Reading, top: &mut Fields<'v>, key: &'static str) -> Vec<(&'v str, &'v Value)> {
    let Some(value) = top.take(key) else { return Vec::new() };
    match &value.kind {
        Kind::Map(entries) => entries.iter().map(|entry| (entry.key.as_str(), &entry.value)).collect(),
        Kind::Null | Kind::Scalar { .. } | Kind::List(_) => {
            reading.refuse(&value.spot, format!("{} stands here", value.described()), "give a table");
            Vec::new()
        }
    }
}

/// The table `vehicle`; what it does not say is that of Autoware's sample vehicle.
pub(super) fn vehicle(reading: &mut Reading, top: &mut Fields<'_>) -> Vehicle {
    let sample = Vehicle::SAMPLE;
    let Some(value) = top.take("vehicle") else { return sample };
    let Some(mut fields) = Fields::of(reading, value) else { return sample };
    let mut size = |key, otherwise| number(reading, &mut fields, key, 0.0..=50.0, "m").unwrap_or(otherwise);
    let vehicle = Vehicle {
        wheel_base_m: size("wheel_base_m", sample.wheel_base_m),
        front_overhang_m: size("front_overhang_m", sample.front_overhang_m),
        rear_overhang_m: size("rear_overhang_m", sample.rear_overhang_m),
        left_m: size("left_m", sample.left_m),
        right_m: size("right_m", sample.right_m),
    };
    fields.done(reading);
    vehicle
}

/// The table `drive`.
pub(super) fn drive(
    reading: &mut Reading,
    top: &mut Fields<'_>,
) -> Option<(SpeedProfile, Vec<Stop>, Vec<Point>)> {
    top.must_have(reading, "drive")?;
    let mut fields = Fields::of(reading, top.take("drive")?)?;
    fields.must_have(reading, "speed");
    let speed = fields.take("speed").and_then(|value| speed(reading, value));
    let mut stops: Vec<Stop> =
        fields.list(reading, "stops").iter().filter_map(|value| stop(reading, value)).collect();
    stops.sort_by(|one, other| one.at_m.total_cmp(&other.at_m));
    let points = fields.take("points").map(|value| points(reading, value)).unwrap_or_default();
    fields.done(reading);
    Some((speed?, stops, points))
}

fn speed(reading: &mut Reading, value: &Value) -> Option<SpeedProfile> {
    let steps = list(reading, value, "give a list of steps: [{ at_m = 0, mps = 10 }]");
    let (mut by_place, mut by_time) = (Vec::new(), Vec::new());
    for step in steps {
        let mut fields = Fields::of(reading, step)?;
        let is_by_time = fields.has("at_s");
        if is_by_time {
            let at_s = number(reading, &mut fields, "at_s", 0.0..=LONGEST_S, "s");
            let mps = required(reading, &mut fields, "mps", -FASTEST_MPS..=FASTEST_MPS, "m/s");
            by_time.extend(at_s.zip(mps));
        } else {
            let at_m = required_metres(reading, &mut fields, "at_m");
            let mps = required(reading, &mut fields, "mps", 0.0..=FASTEST_MPS, "m/s");
            by_place.extend(at_m.zip(mps));
        }
        fields.done(reading);
    }
    let ascends = |steps: &[(f64, f64)]| {
        steps.iter().zip(steps.iter().skip(1)).all(|((before, _), (after, _))| before < after)
    };
    if !(ascends(&by_place) && ascends(&by_time)) {
        reading.refuse(&value.spot, "the steps do not ascend", "order them, each place or time once");
    }
    match (by_place.is_empty(), by_time.is_empty()) {
        (false, true) => Some(SpeedProfile::ByPlace(by_place)),
        (true, false) => Some(SpeedProfile::ByTime(by_time)),
        (true, true) => {
            reading.refuse(&value.spot, "no speed at all", "give a step: [{ at_m = 0, mps = 10 }]");
            None
        }
        (false, false) => {
            reading.refuse(&value.spot, "steps by place and by time", "keep at_m or at_s");
            None
        }
    }
}

fn stop(reading: &mut Reading, value: &Value) -> Option<Stop> {
    let mut fields = Fields::of(reading, value)?;
    let at_m = required_metres(reading, &mut fields, "at_m");
    let for_s = required(reading, &mut fields, "for_s", 0.0..=LONGEST_S, "s");
    fields.done(reading);
    Some(Stop { at_m: at_m?, for_s: for_s? })
}

fn points(reading: &mut Reading, value: &Value) -> Vec<Point> {
    let wanted = "give a list of two points or more: [[0.0, 1.5], [50.0, 1.5]]";
    let mut points: Vec<Point> = Vec::new();
    let items = list(reading, value, wanted);
    for item in items {
        let pair = list(reading, item, "give x and y in metres: [0.0, 1.5]");
        let coordinates: Vec<f64> = pair
            .iter()
            .filter_map(|item| {
                let given = given(reading, item)?;
                reading.in_range(&given, &(-1e8..=1e8), "m")
            })
            .collect();
        match coordinates.as_slice() {
            [x_m, y_m] => points.push(Point::new(*x_m, *y_m)),
            _ if pair.len() == 2 => {}
            _ => reading.refuse(&item.spot, "a point has two coordinates", "give x and y: [0.0, 1.5]"),
        }
    }
    let moves = points.iter().zip(points.iter().skip(1)).all(|(one, other)| one.distance_m(*other) > 1e-3);
    if items.len() < 2 || !moves {
        reading.refuse(&value.spot, "the points are no line", wanted);
    }
    points
}

/// `lanes`: ids of lanelets.
pub(super) fn lanes(reading: &mut Reading, fields: &mut Fields<'_>) -> Option<Vec<i64>> {
    let value = fields.take("lanes")?;
    let items = list(reading, value, "give a list of lanelet ids");
    Some(items.iter().filter_map(|item| reading.lane(item)).collect())
}

/// An offset to the side that a vehicle can have, metres.
pub(super) fn offset(reading: &mut Reading, fields: &mut Fields<'_>) -> Option<f64> {
    required(reading, fields, "offset_m", -50.0..=50.0, "m")
}

/// Where something begins and ends; forwards.
pub(super) fn from_to(reading: &mut Reading, fields: &mut Fields<'_>) -> Option<(f64, f64)> {
    let from_m = required_metres(reading, fields, "from_m");
    let to_m = required_metres(reading, fields, "to_m");
    let (from_m, to_m) = (from_m?, to_m?);
    if to_m <= from_m {
        let reason = format!("it ends at {to_m} m and begins at {from_m} m");
        reading.refuse(fields.spot(), reason, "to_m must be more than from_m");
        return None;
    }
    Some((from_m, to_m))
}

/// A place within something, if given.
pub(super) fn place_within(
    reading: &mut Reading,
    fields: &mut Fields<'_>,
    key: &'static str,
    (from_m, to_m): (f64, f64),
) -> Option<f64> {
    let spot = fields.spot_of(key);
    let at_m = metres(reading, fields, key)?;
    if let Some(spot) = spot.filter(|_| !(from_m..=to_m).contains(&at_m)) {
        reading.refuse(&spot, format!("{at_m} m lies outside"), &format!("give {from_m} to {to_m} m"));
    }
    Some(at_m)
}
