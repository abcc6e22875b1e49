//! The route of a drive scenario.

use super::reading::{Reading, list, pose};
use crate::config::values::fields::{Fields, items};
use crate::config::values::place::Place;
use crate::config::values::{Kind, Value};
use crate::core::turn_signal::geometry::Pose;
use crate::core::turn_signal::route::Segment;

/// A route as it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct RoutePlan {
    /// Side by side lanelets, the preferred one first.
    pub segments: Vec<Segment>,
    /// Its id, if it has one of its own.
    pub id: Option<u128>,
    /// Where it starts; `None` = where its first preferred lanelet does.
    pub start: Option<Pose>,
    /// Where it ends; `None` = where its last preferred lanelet does.
    pub goal: Option<Pose>,
    /// Where it stands.
    pub place: Place,
}

/// The table `route`.
pub(super) fn route(reading: &mut Reading, top: &mut Fields<'_>) -> Option<RoutePlan> {
    top.must_have(reading, "route")?;
    let value = top.take("route")?;
    let mut fields = Fields::of(reading, value)?;
    let start = fields.take("start").and_then(|value| pose(reading, value));
    let goal = fields.take("goal").and_then(|value| pose(reading, value));
    let route = plan(reading, &mut fields);
    fields.done(reading);
    Some(RoutePlan { start, goal, ..route? })
}

/// The keys `segments` and `id` of any table.
pub(super) fn plan(reading: &mut Reading, fields: &mut Fields<'_>) -> Option<RoutePlan> {
    fields.must_have(reading, "segments")?;
    let value = fields.take("segments")?;
    let wanted = "give a list of lists of lanelet ids, the preferred one first: [[1], [2, 3]]";
    let segments: Vec<Segment> =
        list(reading, value, wanted).iter().filter_map(|item| segment(reading, item)).collect();
    if matches!(&value.kind, Kind::List(items) if items.is_empty()) {
        reading.refuse(&value.spot, "a route without lanelets", wanted);
    }
    let mut seen = Vec::new();
    for lane in segments.iter().flat_map(|segment| &segment.lanes) {
        if seen.contains(lane) {
            let reason = format!("the route lists lanelet {lane} twice");
            reading.refuse(&value.spot, reason, "Autoware refuses such a route: name each lanelet once");
        }
        seen.push(*lane);
    }
    let id = fields.number(reading, "id").and_then(|given| {
        let id = given.text.parse().ok();
        if id.is_none() {
            reading.refuse(&given.spot, format!("{:?} is no id", given.text), "give a whole number from 0");
        }
        id
    });
    Some(RoutePlan { segments, id, start: None, goal: None, place: reading.place(&value.spot) })
}

/// Lanelets side by side; a single one needs no list.
fn segment(reading: &mut Reading, value: &Value) -> Option<Segment> {
    let lanes: Vec<_> = items(value).iter().filter_map(|item| reading.lane(item)).collect();
    let Some(preferred) = lanes.first().copied() else {
        if items(value).is_empty() {
            reading.refuse(&value.spot, "a segment without lanelets", "name at least the preferred one");
        }
        return None;
    };
    Some(Segment { preferred, lanes })
}
