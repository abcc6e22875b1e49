//! The route of a drive scenario.

use super::reader::{NamedLanelets, pose};
use crate::config::reading::{Checker, Fields, SourceLocation, Value, items};
use lanelet2_map::geometry::Pose;
use turn_signal::route::Segment;

const EXAMPLE: &str = "give a list of lists of lanelet ids, the preferred one first: [[1], [2, 3]]";

/// A route as specified in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct RoutePlan {
    /// Parallel lanelets, the preferred one first.
    pub segments: Vec<Segment>,
    /// Id, if the route has its own.
    pub id: Option<u128>,
    /// Pose at the start; `None` = the start of its first preferred lanelet.
    pub start: Option<Pose>,
    /// Goal; `None` = the end of its last preferred lanelet.
    pub goal: Option<Pose>,
    /// Position in the file.
    pub location: SourceLocation,
}

pub(super) fn route(lanes: &NamedLanelets, top: &Fields<'_>) -> Option<RoutePlan> {
    top.require(&["route"], "");
    top.read_table("route", |fields| {
        let [start, goal] = ["start", "goal"].map(|key| fields.read_table(key, pose));
        Some(RoutePlan { start, goal, ..plan(lanes, fields)? })
    })
}

/// Reads the keys `segments` and `id` of any table.
pub(super) fn plan(lanes: &NamedLanelets, fields: &Fields<'_>) -> Option<RoutePlan> {
    let id = fields.whole("id");
    fields.require(&["segments"], "")?;
    let given = fields.list("segments", EXAMPLE);
    let segments: Vec<Segment> =
        given.iter().filter_map(|item| segment(lanes, fields.checker, item)).collect();
    if given.is_empty() {
        fields.refuse("segments", "a route without lanelets", EXAMPLE);
    }
    let mut listed = Vec::new();
    for lane in segments.iter().flat_map(|segment| &segment.lanes) {
        if listed.contains(lane) {
            let reason = format!("the route lists lanelet {lane} twice");
            fields.refuse("segments", reason, "Autoware refuses such a route: name each lanelet once");
        }
        listed.push(*lane);
    }
    let location = fields.checker.source_location(fields.at("segments"));
    Some(RoutePlan { segments, id, start: None, goal: None, location })
}

/// Reads parallel lanelets; a single one needs no list.
fn segment(lanes: &NamedLanelets, checker: &Checker, value: &Value) -> Option<Segment> {
    let lanes: Vec<_> = items(value).iter().filter_map(|item| lanes.lane(checker, item)).collect();
    let Some(preferred) = lanes.first().copied() else {
        if items(value).is_empty() {
            checker.refuse(&value.location, "a segment without lanelets", "name at least the preferred one");
        }
        return None;
    };
    Some(Segment { preferred, lanes })
}
