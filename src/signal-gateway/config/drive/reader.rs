//! Positions, times and lanelets of a drive scenario.

use std::cell::RefCell;
use std::ops::RangeInclusive;

use crate::config::reading::{Checker, Fields, Keywords, SourceLocation, Value, joined};
use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::{LaneId, LaneNetwork};
use turn_signal::compat::DeciderCompat;

/// The document that explains the keys.
pub(super) const SEE: &str = "docs/turn-signal-scenarios.md";
/// Maximum length of a drive, seconds.
pub(super) const MAX_S: f64 = 86_400.0;
const DISTANCES_M: RangeInclusive<f64> = -1e6..=1e6;
/// Number of lanelets of the map that are named in a refusal.
const SHOWN: usize = 12;

/// A position or a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriveMoment {
    /// Metres along the route path.
    AtM(f64),
    /// Seconds from the start.
    AtS(f64),
}

const COMPATS: Keywords<&[DeciderCompat]> = &[
    (DeciderCompat::Improved.name(), &[DeciderCompat::Improved]),
    (DeciderCompat::Upstream.name(), &[DeciderCompat::Upstream]),
    (DeciderCompat::PathGenerator.name(), &[DeciderCompat::PathGenerator]),
    ("both", BOTH),
    ("all", &DeciderCompat::ALL),
];
/// The two modes that follow the behavior path planner.
const BOTH: &[DeciderCompat] = &[DeciderCompat::Improved, DeciderCompat::Upstream];

#[derive(Default)]
pub(super) struct NamedLanelets(RefCell<Vec<(LaneId, SourceLocation)>>);

impl NamedLanelets {
    /// Reads the id of a lanelet, to be looked up in the map.
    pub(super) fn lane(&self, checker: &Checker, value: &Value) -> Option<LaneId> {
        let id = checker.whole(value)?;
        self.0.borrow_mut().push((id, checker.source_location(&value.location)));
        Some(id)
    }

    pub(super) fn lanes(&self, fields: &Fields<'_>) -> Option<Vec<LaneId>> {
        let items = fields.checker.list(fields.value("lanes")?, "give a list of lanelet ids");
        Some(items.iter().filter_map(|item| self.lane(fields.checker, item)).collect())
    }

    pub(super) fn check(self, checker: &Checker, road: &LaneNetwork) {
        let known = joined(road.lanes().map(|lane| lane.id.to_string()), SHOWN);
        let remedy = format!("it has {known}");
        let used = self.0.into_inner().into_iter();
        let unknown = used.filter(|(id, _)| road.lane(*id).is_none());
        let problem = |(id, location): (LaneId, SourceLocation)| {
            location.problem(format!("the map has no lanelet {id}"), remedy.clone())
        };
        checker.adopt(unknown.map(problem).collect());
    }
}

/// Reads a position in metres along the route path.
pub(super) fn metres(fields: &Fields<'_>, key: &'static str) -> Option<f64> {
    fields.number(key, DISTANCES_M, "m")
}

pub(super) fn required_metres(fields: &Fields<'_>, key: &'static str) -> Option<f64> {
    fields.required_number(key, DISTANCES_M, "m")
}

pub(super) fn required_seconds(fields: &Fields<'_>, key: &'static str) -> Option<f64> {
    fields.required_number(key, 0.0..=MAX_S, "s")
}

/// Reads a position or a time; giving both is refused.
pub(super) fn moment(fields: &Fields<'_>, [at_m, at_s]: [&'static str; 2]) -> Option<DriveMoment> {
    let position = metres(fields, at_m);
    let time = fields.number(at_s, 0.0..=MAX_S, "s");
    if position.is_some() && time.is_some() {
        fields.refuse(at_s, format!("both {at_m} and {at_s}"), "keep one of them");
    }
    position.map(DriveMoment::AtM).or(time.map(DriveMoment::AtS))
}

pub(super) fn required_moment(fields: &Fields<'_>, keys: [&'static str; 2]) -> Option<DriveMoment> {
    if keys.iter().all(|key| !fields.has(key)) {
        let reason = format!("neither {} nor {}", keys[0], keys[1]);
        fields.checker.refuse(fields.location(), reason, "give a position or a time");
    }
    moment(fields, keys)
}

/// Reads a pose such as `{ x_m = 1, y_m = 2, yaw_deg = 90 }`.
pub(super) fn pose(fields: &Fields<'_>) -> Option<Pose> {
    fields.require(&["x_m", "y_m", "yaw_deg"], "");
    let [x_m, y_m] = ["x_m", "y_m"].map(|key| fields.number(key, -1e8..=1e8, "m"));
    let yaw_deg = fields.number("yaw_deg", -360.0_f64..=360.0, "degrees");
    Some(Pose::new(x_m?, y_m?, yaw_deg?.to_radians()))
}

pub(super) fn from_to(fields: &Fields<'_>) -> Option<(f64, f64)> {
    let (from_m, to_m) = (required_metres(fields, "from_m"), required_metres(fields, "to_m"));
    let (from_m, to_m) = (from_m?, to_m?);
    if to_m <= from_m {
        let reason = format!("it ends at {to_m} m and begins at {from_m} m");
        return fields.checker.refused(fields.location(), reason, "to_m must be more than from_m");
    }
    Some((from_m, to_m))
}

/// Reads the key `compat`; without it the drive is for improved and upstream.
pub(super) fn compats(fields: &Fields<'_>) -> Vec<DeciderCompat> {
    fields.keyword("compat", COMPATS).unwrap_or(BOTH).to_vec()
}
