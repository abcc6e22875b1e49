//! Numbers, places and times of a drive scenario, with every refusal kept.

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use super::{FARTHEST, Moment, UsedLane};
use crate::config::problem::Problem;
use crate::config::values::fields::{Fields, Given, Refuse, given};
use crate::config::values::place::{Place, Spot, line};
use crate::config::values::{Kind, Value};
use crate::core::turn_signal::geometry::Pose;
use crate::core::turn_signal::road::{LaneId, Road};

/// Longer drives are mistakes, metres.
pub(super) const LONGEST_M: f64 = 1e6;
/// And seconds.
pub(super) const LONGEST_S: f64 = 86_400.0;
/// How many lanelets of the map are named in a refusal.
const SHOWN: usize = 12;

/// What was found so far.
pub(super) struct Reading {
    pub(super) file: Arc<Path>,
    pub(super) problems: Vec<Problem>,
    lanes: Vec<UsedLane>,
}

impl Refuse for Reading {
    const SEE: &'static str = super::SEE;

    fn refuse_at(&mut self, spot: &Spot, reason: String, remedy: &str) {
        self.problems.push(spot.place(&self.file).problem(line(&reason), line(remedy)));
    }
}

impl Reading {
    pub(super) fn new(file: Arc<Path>) -> Self {
        Self { file, problems: Vec::new(), lanes: Vec::new() }
    }

    pub(super) fn refuse(&mut self, spot: &Spot, reason: impl Into<String>, remedy: &str) {
        self.refuse_at(spot, reason.into(), remedy);
    }

    pub(super) fn place(&self, spot: &Spot) -> Place {
        spot.place(&self.file)
    }

    /// In the order of the file.
    pub(super) fn into_problems(mut self) -> Vec<Problem> {
        self.problems.sort_by_key(|problem| problem.position);
        self.problems.dedup();
        self.problems
    }

    /// A number within a range.
    pub(super) fn in_range(&mut self, given: &Given, range: &RangeInclusive<f64>, unit: &str) -> Option<f64> {
        let number: Option<f64> = given.text.trim().parse().ok();
        let found = number.filter(|number| range.contains(number));
        if found.is_none() {
            let reason = match number {
                Some(_) => format!("{} {unit} is out of range", given.text.trim()),
                None => format!("{:?} is no number", given.text),
            };
            let remedy = format!("give {} to {} {unit}", range.start(), range.end());
            self.refuse(&given.spot, reason, &remedy);
        }
        found
    }

    /// The id of a lanelet, to be looked for in the map.
    pub(super) fn lane(&mut self, value: &Value) -> Option<LaneId> {
        let given = given(self, value)?;
        match given.text.parse() {
            Ok(id) => {
                self.lanes.push(UsedLane { id, place: self.place(&given.spot) });
                Some(id)
            }
            Err(_) => {
                self.refuse(&given.spot, format!("{:?} is no lanelet id", given.text), "give a whole number");
                None
            }
        }
    }

    /// Refuses every lanelet that the map does not have.
    pub(super) fn check_lanes(&mut self, road: &Road) {
        let mut known: Vec<_> = road.lanes().take(SHOWN + 1).map(|lane| lane.id.to_string()).collect();
        if known.len() > SHOWN {
            known.truncate(SHOWN);
            known.push("…".to_owned());
        }
        let remedy = match known.as_slice() {
            [] => "it has none".to_owned(),
            known => format!("it has {}", known.join(", ")),
        };
        for used in std::mem::take(&mut self.lanes) {
            if road.lane(used.id).is_none() {
                let reason = format!("the map has no lanelet {}", used.id);
                self.problems.push(used.place.problem(reason, remedy.clone()));
            }
        }
    }
}

/// A number within a range, if the key is there.
pub(super) fn number(
    reading: &mut Reading,
    fields: &mut Fields<'_>,
    key: &'static str,
    range: RangeInclusive<f64>,
    unit: &str,
) -> Option<f64> {
    let given = fields.number(reading, key)?;
    reading.in_range(&given, &range, unit)
}

/// A place or an offset, if the key is there.
pub(super) fn metres(reading: &mut Reading, fields: &mut Fields<'_>, key: &'static str) -> Option<f64> {
    number(reading, fields, key, FARTHEST, "m")
}

/// A place or an offset that must be there.
pub(super) fn required_metres(
    reading: &mut Reading,
    fields: &mut Fields<'_>,
    key: &'static str,
) -> Option<f64> {
    required(reading, fields, key, FARTHEST, "m")
}

/// A number that must be there.
pub(super) fn required(
    reading: &mut Reading,
    fields: &mut Fields<'_>,
    key: &'static str,
    range: RangeInclusive<f64>,
    unit: &str,
) -> Option<f64> {
    fields.must_have(reading, key)?;
    number(reading, fields, key, range, unit)
}

/// A place or a time, by which of two keys is there.
pub(super) fn moment(
    reading: &mut Reading,
    fields: &mut Fields<'_>,
    [at_m, at_s]: [&'static str; 2],
) -> Option<Moment> {
    let spot = fields.spot_of(at_s);
    let place = metres(reading, fields, at_m);
    let time = number(reading, fields, at_s, 0.0..=LONGEST_S, "s");
    if let (Some(_), Some(spot)) = (place, spot) {
        reading.refuse(&spot, format!("both {at_m} and {at_s}"), "keep one of them");
    }
    place.map(Moment::AtM).or(time.map(Moment::AtS))
}

/// A place or a time that must be there.
pub(super) fn required_moment(
    reading: &mut Reading,
    fields: &mut Fields<'_>,
    keys: [&'static str; 2],
) -> Option<Moment> {
    if keys.iter().all(|key| !fields.has(key)) {
        reading.refuse(fields.spot(), format!("neither {} nor {}", keys[0], keys[1]), "say where or when");
    }
    moment(reading, fields, keys)
}

/// One of some words.
pub(super) fn word<T: Copy>(
    reading: &mut Reading,
    fields: &mut Fields<'_>,
    key: &'static str,
    words: &[(&str, T)],
) -> Option<T> {
    let given = fields.text(reading, key)?;
    let found = words.iter().find(|(word, _)| *word == given.text).map(|(_, meaning)| *meaning);
    if found.is_none() {
        let known: Vec<_> = words.iter().map(|(word, _)| *word).collect();
        let reason = format!("{:?} is not known here", given.text);
        reading.refuse(&given.spot, reason, &format!("give one of {}", known.join(", ")));
    }
    found
}

/// `{ x_m = 1, y_m = 2, yaw_deg = 90 }`
pub(super) fn pose(reading: &mut Reading, value: &Value) -> Option<Pose> {
    let mut fields = Fields::of(reading, value)?;
    let x_m = required(reading, &mut fields, "x_m", -1e8..=1e8, "m");
    let y_m = required(reading, &mut fields, "y_m", -1e8..=1e8, "m");
    let yaw_deg = required(reading, &mut fields, "yaw_deg", -360.0..=360.0, "degrees");
    fields.done(reading);
    Some(Pose::new(x_m?, y_m?, yaw_deg?.to_radians()))
}

/// The values of a list.
pub(super) fn list<'v>(reading: &mut Reading, value: &'v Value, wanted: &str) -> &'v [Value] {
    match &value.kind {
        Kind::List(items) => items,
        Kind::Null | Kind::Scalar { .. } | Kind::Map(_) => {
            reading.refuse(&value.spot, format!("{} stands here", value.described()), wanted);
            &[]
        }
    }
}
