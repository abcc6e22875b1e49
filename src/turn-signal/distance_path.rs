//! The path on which all distances are measured: the middle of the route's lanelets behind and ahead of the
//! vehicle (docs/spec/turn-signal-decider.md, "Distance path").

use std::collections::BTreeSet;
use std::iter::successors;

use super::compat::DeciderQuirks;
use super::parameters::DeciderParameters;
use super::route::Route;
use lanelet2_map::geometry::path::{Path, PathError};
use lanelet2_map::geometry::polyline::{arc_lengths_m, headed, nearest, without_repeats};
use lanelet2_map::geometry::spline::akima_points;
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

impl DistancePath {
    /// Creates the path for a vehicle at `ego` on the lanelet `current` of the route.
    pub fn new(
        (road, route, quirks): (&LaneNetwork, &Route, DeciderQuirks),
        parameters: &DeciderParameters,
        ego: Pose,
        current: LaneId,
        backward_m: f64,
    ) -> Result<Self, PathError> {
        let forward_m = parameters.path_forward_length_m;
        let lane = road.lane(current).ok_or(PathError::TooShort)?;
        let along_m = nearest(&lane.centerline, ego.position).map_or(0.0, |nearest| nearest.arc_m);
        let rest_m = lane.length_m() - along_m;
        let previous = |id: LaneId| route.previous(road, id, quirks).first().copied();
        let mut sequence = walk(road, current, backward_m - along_m, previous);
        let behind_m: f64 = sequence.iter().filter_map(|id| road.lane(*id)).map(Lanelet::length_m).sum();
        sequence.reverse();
        sequence.push(current);
        sequence.extend(walk(road, current, forward_m - rest_m, |id| route.next(road, id, quirks)));

        let ego_m = behind_m + along_m;
        let (from_m, to_m) = (ego_m - backward_m, ego_m + forward_m);
        let reaching_in = within(road, &sequence, from_m, to_m);
        let on_path_m = |at_m: f64| at_m - from_m.max(0.0);
        let (lanes, spans_m) =
            reaching_in.into_iter().map(|(id, span_m)| (id, span_m.map(on_path_m))).unzip();
        let centerline: Vec<Point> = sequence
            .iter()
            .filter_map(|id| road.lane(*id))
            .flat_map(|lane| lane.centerline.iter().copied())
            .collect();
        let points = resampled(&centerline, from_m, to_m, parameters.path_interval_m);
        Ok(Self { path: Path::new(headed(&points))?, lanes, spans_m, ego_m: ego_m - from_m.max(0.0) })
    }
}

/// Returns the lanelets after `from`, until they cover `length_m`.
fn walk(
    road: &LaneNetwork,
    from: LaneId,
    length_m: f64,
    step: impl Fn(LaneId) -> Option<LaneId>,
) -> Vec<LaneId> {
    let mut visited = BTreeSet::from([from]);
    let mut walked = Vec::new();
    let (mut here, mut covered_m) = (from, 0.0);
    while covered_m < length_m && walked.len() < MAX_LANES {
        let Some(next) = step(here).filter(|next| visited.insert(*next)) else { break };
        covered_m += road.lane(next).map_or(0.0, Lanelet::length_m);
        walked.push(next);
        here = next;
    }
    walked
}

/// Returns the lanelets of the sequence that overlap an interval of it, with their start and end on the
/// sequence.
fn within(road: &LaneNetwork, sequence: &[LaneId], from_m: f64, to_m: f64) -> Vec<(LaneId, [f64; 2])> {
    let mut start_m = 0.0;
    let spans = sequence.iter().map(|id| {
        let span_m = [start_m, start_m + road.lane(*id).map_or(0.0, Lanelet::length_m)];
        [_, start_m] = span_m;
        (*id, span_m)
    });
    spans.filter(|(_, [start_m, end_m])| *start_m < to_m && *end_m > from_m).collect()
}

/// Returns points of a line at equal steps between two arc lengths, including the point at the second.
fn resampled(line: &[Point], from_m: f64, to_m: f64, step_m: f64) -> Vec<Point> {
    let knots = without_repeats(line);
    let arcs = arc_lengths_m(&knots);
    let length_m = arcs.last().copied().unwrap_or_default();
    let (from_m, to_m) = (from_m.max(0.0), to_m.min(length_m));
    let samples = successors(Some(from_m), |at_m| Some(at_m + step_m));
    let queries: Vec<f64> = samples.take_while(|at_m| *at_m < to_m).chain([to_m]).collect();
    akima_points(&arcs, &knots, &queries).unwrap_or(knots)
}
