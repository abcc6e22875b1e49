//! The path on which all distances are measured: the middle of the route's lanelets behind and ahead of the
//! vehicle (docs/spec/turn-signal-decider.md, "Distance path").

use std::collections::BTreeSet;

use super::compat::DeciderQuirks;
use super::parameters::DeciderParameters;
use super::route::Route;
use lanelet2_map::geometry::path::{Path, PathError};
use lanelet2_map::geometry::polyline::{headed, nearest};
use lanelet2_map::geometry::sampling::{knots_between, resampled};
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet};

/// More lanelets than any path of this length has; bounds the work on degenerate maps.
const MAX_LANES: usize = 10_000;

/// The path and its lanelets.
#[derive(Debug, Clone, PartialEq)]
pub struct DistancePath {
    /// The path on which distances are measured.
    pub path: Path,
    /// Lanelets of the path, in order, each once.
    pub lanes: Vec<LaneId>,
    /// Arc lengths of each lanelet's start and end on the path, metres, to within the smoothing of corners.
    pub spans_m: Vec<[f64; 2]>,
    /// Arc length of the vehicle on the path, by its lanelet, metres.
    pub ego_m: f64,
}

/// Lanelets one after another, with places on their joined centrelines.
struct Sequence {
    lanes: Vec<LaneId>,
    centerline: Vec<Point>,
    /// Where the vehicle is, metres.
    ego_m: f64,
    /// Where the path ends, metres; may lie beyond the last lanelet.
    to_m: f64,
}

impl DistancePath {
    /// Creates the path for a vehicle at `ego` on the lanelet `current` of the route.
    pub fn new(
        (road, route, quirks): (&LaneNetwork, &Route, DeciderQuirks),
        parameters: &DeciderParameters,
        ego: Pose,
        current: LaneId,
        backward_m: f64,
    ) -> Result<Self, PathError> {
        let lane = road.lane(current).ok_or(PathError::TooShort)?;
        let lengths_m = [backward_m, parameters.path_forward_length_m];
        let sequence = if quirks.ignores_order_of_segments {
            Sequence::on_map((road, route, quirks), lengths_m, ego, lane)
        } else {
            Sequence::in_order((road, route, quirks), lengths_m, ego, lane)
        };
        let from_m = (sequence.ego_m - backward_m).max(0.0);
        let knots = knots_between(&sequence.centerline, from_m, sequence.to_m);
        let points = resampled(&knots, parameters.path_interval_m);
        let reaching_in = within(road, &sequence.lanes, from_m, sequence.to_m);
        let (lanes, spans_m) =
            reaching_in.into_iter().map(|(id, span_m)| (id, span_m.map(|at_m| at_m - from_m))).unzip();
        Ok(Self { path: Path::new(headed(&points))?, lanes, spans_m, ego_m: sequence.ego_m - from_m })
    }
}

impl Sequence {
    /// Follows the order of the route's segments.
    fn in_order(
        (road, route, quirks): (&LaneNetwork, &Route, DeciderQuirks),
        [backward_m, forward_m]: [f64; 2],
        ego: Pose,
        current: &Lanelet,
    ) -> Self {
        let along_m = arc_m(&current.centerline, ego);
        let rest_m = current.length_m() - along_m;
        let previous = |id: LaneId, _: &BTreeSet<LaneId>| route.previous(road, id, quirks).first().copied();
        let next = |id: LaneId, _: &BTreeSet<LaneId>| route.next(road, id, quirks);
        let own = || BTreeSet::from([current.id]);
        let mut lanes = walk(road, current.id, backward_m - along_m, &mut own(), previous);
        let behind_m: f64 = lanes.iter().filter_map(|id| road.lane(*id)).map(Lanelet::length_m).sum();
        lanes.reverse();
        lanes.push(current.id);
        lanes.extend(walk(road, current.id, forward_m - rest_m, &mut own(), next));
        let ego_m = behind_m + along_m;
        Self { centerline: joined(road, &lanes), lanes, ego_m, to_m: ego_m + forward_m }
    }

    /// Goes by the map, and projects vehicle and goal on all lanelets at once (W22, W24).
    fn on_map(
        (road, route, quirks): (&LaneNetwork, &Route, DeciderQuirks),
        [backward_m, forward_m]: [f64; 2],
        ego: Pose,
        current: &Lanelet,
    ) -> Self {
        let is_new = |id: &LaneId, visited: &BTreeSet<LaneId>| !visited.contains(id) && !route.ends_with(*id);
        let previous = |id: LaneId, visited: &BTreeSet<LaneId>| {
            route.previous(road, id, quirks).into_iter().find(|before| is_new(before, visited))
        };
        let next = |id: LaneId, _: &BTreeSet<LaneId>| route.next(road, id, quirks);
        let own = || BTreeSet::from([current.id]);
        let after = walk(road, current.id, forward_m, &mut own(), next);
        let is_reached = arc_m(&current.centerline, ego) < backward_m;
        let reach_m = if is_reached { backward_m } else { 0.0 };
        let mut lanes = walk(road, current.id, reach_m, &mut own(), previous);
        // A ring of two lanelets leaves out the vehicle's own.
        if lanes.is_empty() || lanes.first() != after.first() {
            lanes.reverse();
            lanes.push(current.id);
        } else {
            lanes.clear();
        }
        lanes.extend(after);

        let centerline = joined(road, &lanes);
        let ego_m = arc_m(&centerline, ego);
        let mut to_m = ego_m + forward_m;
        if let (Some(last), Some(goal)) = (lanes.last(), route.goal())
            && quirks.ends_path_at_goal
            && route.ends_with(*last)
        {
            to_m = to_m.min(arc_m(&centerline, goal));
        }
        Self { lanes, centerline, ego_m, to_m }
    }
}

fn joined(road: &LaneNetwork, lanes: &[LaneId]) -> Vec<Point> {
    let lanes = lanes.iter().filter_map(|id| road.lane(*id));
    lanes.flat_map(|lane| lane.centerline.iter().copied()).collect()
}

/// Returns the arc length of the place on a line that is nearest to a pose, metres.
pub(super) fn arc_m(line: &[Point], pose: Pose) -> f64 {
    nearest(line, pose.position).map_or(0.0, |nearest| nearest.arc_m)
}

/// Returns the lanelets after `from`, until they cover `length_m`; none that is `visited`, which `step` sees.
pub(super) fn walk(
    road: &LaneNetwork,
    from: LaneId,
    length_m: f64,
    visited: &mut BTreeSet<LaneId>,
    step: impl Fn(LaneId, &BTreeSet<LaneId>) -> Option<LaneId>,
) -> Vec<LaneId> {
    let mut walked = Vec::new();
    let (mut here, mut covered_m) = (from, 0.0);
    while covered_m < length_m && walked.len() < MAX_LANES {
        let Some(next) = step(here, visited).filter(|next| visited.insert(*next)) else { break };
        covered_m += road.lane(next).map_or(0.0, Lanelet::length_m);
        walked.push(next);
        here = next;
    }
    walked
}

/// Returns the lanelets of the sequence that overlap an interval of it, with their start and end on the
/// sequence; if its end lies before its start, the lanelets around either.
pub(super) fn within(
    road: &LaneNetwork,
    sequence: &[LaneId],
    from_m: f64,
    to_m: f64,
) -> Vec<(LaneId, [f64; 2])> {
    let mut start_m = 0.0;
    let spans = sequence.iter().map(|id| {
        let span_m = [start_m, start_m + road.lane(*id).map_or(0.0, Lanelet::length_m)];
        [_, start_m] = span_m;
        (*id, span_m)
    });
    let reaches = |(_, [start_m, end_m]): &(LaneId, [f64; 2])| {
        let is_around = |at_m: f64| *start_m < at_m && at_m < *end_m;
        *start_m < to_m && *end_m > from_m || to_m < from_m && (is_around(from_m) || is_around(to_m))
    };
    spans.filter(reaches).collect()
}
