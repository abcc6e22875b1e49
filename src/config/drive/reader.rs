//! Numbers, places and times of a drive scenario, with every refusal kept.

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use crate::config::reading::fields::{Fields, LocatedText, Refuse, given};
use crate::config::reading::location::{Location, SourceLocation, line};
use crate::config::reading::problem::Problem;
use crate::config::reading::value::{Kind, Value};
use crate::core::map::geometry::Pose;
use crate::core::map::lane_network::{LaneId, LaneNetwork};
use crate::core::turn_signal::compat::DeciderCompat;

/// The page that explains the keys.
pub(super) const SEE: &str = "docs/turn-signal-scenarios.md";
/// Longer drives are mistakes, metres.
const MAX_M: f64 = 1e6;
/// And seconds.
pub(super) const MAX_S: f64 = 86_400.0;
/// Farther than this is not a drive.
const MAX_DISTANCE_M: RangeInclusive<f64> = -MAX_M..=MAX_M;
/// Most lanelets of the map that a refusal names.
const SHOWN: usize = 12;

/// A place on the way or a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moment {
    /// Metres along the way.
    AtM(f64),
    /// Seconds from the start.
    AtS(f64),
}

/// A lanelet id where it stands.
#[derive(Debug, Clone)]
struct UsedLane {
    id: LaneId,
    location: SourceLocation,
}

const MODES: [(&str, &[DeciderCompat]); 5] = [
    (DeciderCompat::Improved.name(), &[DeciderCompat::Improved]),
    (DeciderCompat::Upstream.name(), &[DeciderCompat::Upstream]),
    (DeciderCompat::PathGenerator.name(), &[DeciderCompat::PathGenerator]),
    ("both", BOTH),
    ("all", &DeciderCompat::ALL),
];
/// The behaviours of the behavior path planner, which the rules of all records are for.
const BOTH: &[DeciderCompat] = &[DeciderCompat::Improved, DeciderCompat::Upstream];

/// The reader of a drive scenario with the problems found so far.
pub(super) struct Reader {
    pub(super) file: Arc<Path>,
    pub(super) problems: Vec<Problem>,
    lanes: Vec<UsedLane>,
}

impl Refuse for Reader {
    const SEE: &'static str = SEE;

    fn refuse_at(&mut self, location: &Location, reason: String, remedy: &str) {
        self.problems.push(location.in_file(&self.file).problem(line(&reason), line(remedy)));
    }
}

impl Reader {
    pub(super) fn new(file: Arc<Path>) -> Self {
        Self { file, problems: Vec::new(), lanes: Vec::new() }
    }

    pub(super) fn refuse(&mut self, location: &Location, reason: impl Into<String>, remedy: &str) {
        self.refuse_at(location, reason.into(), remedy);
    }

    pub(super) fn source_location(&self, location: &Location) -> SourceLocation {
        location.in_file(&self.file)
    }

    /// All problems, in the order of the file.
    pub(super) fn into_problems(mut self) -> Vec<Problem> {
        self.problems.sort_by_key(|problem| problem.position);
        self.problems.dedup();
        self.problems
    }

    /// A number within a range.
    pub(super) fn in_range(
        &mut self,
        given: &LocatedText,
        range: &RangeInclusive<f64>,
        unit: &str,
    ) -> Option<f64> {
        let number: Option<f64> = given.text.trim().parse().ok();
        let found = number.filter(|number| range.contains(number));
        if found.is_none() {
            let reason = match number {
                Some(_) => format!("{} {unit} is out of range", given.text.trim()),
                None => format!("{:?} is not a number", given.text),
            };
            let remedy = format!("give {} to {} {unit}", range.start(), range.end());
            self.refuse(&given.location, reason, &remedy);
        }
        found
    }

    /// The id of a lanelet, to be looked for in the map.
    pub(super) fn lane(&mut self, value: &Value) -> Option<LaneId> {
        let given = given(self, value)?;
        match given.text.parse() {
            Ok(id) => {
                self.lanes.push(UsedLane { id, location: self.source_location(&given.location) });
                Some(id)
            }
            Err(_) => {
                self.refuse(
                    &given.location,
                    format!("{:?} is not a lanelet id", given.text),
                    "give a whole number",
                );
                None
            }
        }
    }

    /// Refuses every lanelet that the map does not have.
    pub(super) fn check_lanes(&mut self, road: &LaneNetwork) {
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
                self.problems.push(used.location.problem(reason, remedy.clone()));
            }
        }
    }
}

/// A number within a range, if the key is there.
pub(super) fn number(
    reader: &mut Reader,
    fields: &mut Fields<'_>,
    key: &'static str,
    range: RangeInclusive<f64>,
    unit: &str,
) -> Option<f64> {
    let given = fields.number(reader, key)?;
    reader.in_range(&given, &range, unit)
}

/// A place or an offset, if the key is there.
pub(super) fn metres(reader: &mut Reader, fields: &mut Fields<'_>, key: &'static str) -> Option<f64> {
    number(reader, fields, key, MAX_DISTANCE_M, "m")
}

/// A place or an offset that must be there.
pub(super) fn required_metres(
    reader: &mut Reader,
    fields: &mut Fields<'_>,
    key: &'static str,
) -> Option<f64> {
    required(reader, fields, key, MAX_DISTANCE_M, "m")
}

/// A number that must be there.
pub(super) fn required(
    reader: &mut Reader,
    fields: &mut Fields<'_>,
    key: &'static str,
    range: RangeInclusive<f64>,
    unit: &str,
) -> Option<f64> {
    fields.must_have(reader, key)?;
    number(reader, fields, key, range, unit)
}

/// A place or a time, by which of two keys is there.
pub(super) fn moment(
    reader: &mut Reader,
    fields: &mut Fields<'_>,
    [at_m, at_s]: [&'static str; 2],
) -> Option<Moment> {
    let location = fields.location_of(at_s);
    let place = metres(reader, fields, at_m);
    let time = number(reader, fields, at_s, 0.0..=MAX_S, "s");
    if let (Some(_), Some(location)) = (place, location) {
        reader.refuse(&location, format!("both {at_m} and {at_s}"), "keep one of them");
    }
    place.map(Moment::AtM).or(time.map(Moment::AtS))
}

/// A place or a time that must be there.
pub(super) fn required_moment(
    reader: &mut Reader,
    fields: &mut Fields<'_>,
    keys: [&'static str; 2],
) -> Option<Moment> {
    if keys.iter().all(|key| !fields.has(key)) {
        reader.refuse(fields.location(), format!("neither {} nor {}", keys[0], keys[1]), "say where or when");
    }
    moment(reader, fields, keys)
}

/// One of some words.
pub(super) fn keyword<T: Copy>(
    reader: &mut Reader,
    fields: &mut Fields<'_>,
    key: &'static str,
    words: &[(&str, T)],
) -> Option<T> {
    let given = fields.text(reader, key)?;
    let found = words.iter().find(|(word, _)| *word == given.text).map(|(_, meaning)| *meaning);
    if found.is_none() {
        let known: Vec<_> = words.iter().map(|(word, _)| *word).collect();
        let reason = format!("{:?} is not known here", given.text);
        reader.refuse(&given.location, reason, &format!("give one of {}", known.join(", ")));
    }
    found
}

/// `{ x_m = 1, y_m = 2, yaw_deg = 90 }`
pub(super) fn pose(reader: &mut Reader, value: &Value) -> Option<Pose> {
    let mut fields = Fields::of(reader, value)?;
    let x_m = required(reader, &mut fields, "x_m", -1e8..=1e8, "m");
    let y_m = required(reader, &mut fields, "y_m", -1e8..=1e8, "m");
    let yaw_deg = required(reader, &mut fields, "yaw_deg", -360.0..=360.0, "degrees");
    fields.done(reader);
    Some(Pose::new(x_m?, y_m?, yaw_deg?.to_radians()))
}

/// The values of a list.
pub(super) fn list<'v>(reader: &mut Reader, value: &'v Value, wanted: &str) -> &'v [Value] {
    match &value.kind {
        Kind::List(items) => items,
        Kind::Null | Kind::Scalar { .. } | Kind::Map(_) => {
            reader.refuse(&value.location, format!("{} stands here", value.described()), wanted);
            &[]
        }
    }
}

/// `lanes`: ids of lanelets.
pub(super) fn lanes(reader: &mut Reader, fields: &mut Fields<'_>) -> Option<Vec<i64>> {
    let value = fields.take("lanes")?;
    let items = list(reader, value, "give a list of lanelet ids");
    Some(items.iter().filter_map(|item| reader.lane(item)).collect())
}

/// An offset to the side that a vehicle can have, metres.
pub(super) fn offset(reader: &mut Reader, fields: &mut Fields<'_>) -> Option<f64> {
    required(reader, fields, "offset_m", -50.0..=50.0, "m")
}

/// Start and end of a stretch, in driving direction.
pub(super) fn from_to(reader: &mut Reader, fields: &mut Fields<'_>) -> Option<(f64, f64)> {
    let from_m = required_metres(reader, fields, "from_m");
    let to_m = required_metres(reader, fields, "to_m");
    let (from_m, to_m) = (from_m?, to_m?);
    if to_m <= from_m {
        let reason = format!("it ends at {to_m} m and begins at {from_m} m");
        reader.refuse(fields.location(), reason, "to_m must be more than from_m");
        return None;
    }
    Some((from_m, to_m))
}

/// A place within something, if given.
pub(super) fn place_within(
    reader: &mut Reader,
    fields: &mut Fields<'_>,
    key: &'static str,
    (from_m, to_m): (f64, f64),
) -> Option<f64> {
    let location = fields.location_of(key);
    let at_m = metres(reader, fields, key)?;
    if let Some(location) = location.filter(|_| !(from_m..=to_m).contains(&at_m)) {
        reader.refuse(&location, format!("{at_m} m lies outside"), &format!("give {from_m} to {to_m} m"));
    }
    Some(at_m)
}

/// The behaviours that the key `compat` names; improved and upstream without it.
pub(super) fn modes(reader: &mut Reader, fields: &mut Fields<'_>) -> Vec<DeciderCompat> {
    keyword(reader, fields, "compat", &MODES).unwrap_or(BOTH).to_vec()
}
