//! The route of a drive scenario.

use super::reader::{Reader, list, pose};
use crate::config::reading::fields::{Fields, items};
use crate::config::reading::location::SourceLocation;
use crate::config::reading::value::{Kind, Value};
use crate::core::map::geometry::Pose;
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
    /// Its place in the file.
    pub location: SourceLocation,
}

/// The table `route`.
pub(super) fn route(reader: &mut Reader, top: &mut Fields<'_>) -> Option<RoutePlan> {
    top.must_have(reader, "route")?;
    let value = top.take("route")?;
    let mut fields = Fields::of(reader, value)?;
    let start = fields.take("start").and_then(|value| pose(reader, value));
    let goal = fields.take("goal").and_then(|value| pose(reader, value));
    let route = plan(reader, &mut fields);
    fields.done(reader);
    Some(RoutePlan { start, goal, ..route? })
}

/// The keys `segments` and `id` of any table.
pub(super) fn plan(reader: &mut Reader, fields: &mut Fields<'_>) -> Option<RoutePlan> {
    fields.must_have(reader, "segments")?;
    let value = fields.take("segments")?;
    let wanted = "give a list of lists of lanelet ids, the preferred one first: [[1], [2, 3]]";
    let segments: Vec<Segment> =
        list(reader, value, wanted).iter().filter_map(|item| segment(reader, item)).collect();
    if matches!(&value.kind, Kind::List(items) if items.is_empty()) {
        reader.refuse(&value.location, "a route without lanelets", wanted);
    }
    let mut listed = Vec::new();
    for lane in segments.iter().flat_map(|segment| &segment.lanes) {
        if listed.contains(lane) {
            let reason = format!("the route lists lanelet {lane} twice");
            reader.refuse(&value.location, reason, "Autoware refuses such a route: name each lanelet once");
        }
        listed.push(*lane);
    }
    let id = fields.number(reader, "id").and_then(|given| {
        let id = given.text.parse().ok();
        if id.is_none() {
            reader.refuse(
                &given.location,
                format!("{:?} is not an id", given.text),
                "give a whole number from 0",
            );
        }
        id
    });
    Some(RoutePlan {
        segments,
        id,
        start: None,
        goal: None,
        location: reader.source_location(&value.location),
    })
}

/// Lanelets side by side; a single one needs no list.
fn segment(reader: &mut Reader, value: &Value) -> Option<Segment> {
    let lanes: Vec<_> = items(value).iter().filter_map(|item| reader.lane(item)).collect();
    let Some(preferred) = lanes.first().copied() else {
        if items(value).is_empty() {
            reader.refuse(&value.location, "a segment without lanelets", "name at least the preferred one");
        }
        return None;
    };
    Some(Segment { preferred, lanes })
}
