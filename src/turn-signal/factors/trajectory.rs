//! Derives manoeuvres for a planner that sends a plain trajectory and no planning factors
//! (docs/turn-signal-decider.md, "Learned planners").
//!
//! The trajectory is appended to the driven path, so that a manoeuvre stays visible as a whole until it is
//! over. The points are placed on the lanelets of the route, and each change of the offset from the middle of
//! the vehicle's lane becomes a manoeuvre whose kind follows from its start and end.

use std::collections::VecDeque;
use std::ops::RangeInclusive;
use std::sync::Arc;

use super::avoidance;
use super::factor::{FactorContext, Ramp};
use super::path_offsets::{MAX_LANES_BETWEEN, PathOffsets, RampSpan, crossing};
use super::pulling;
use super::reference_line::ReferenceLine;
use crate::decision_context::STOP_SPEED_MPS;
use crate::inputs::Timed;
use crate::manoeuvre::Manoeuvre;
use crate::manoeuvre::lane_change::{LaneChange, LaneChangePhase};
use crate::manoeuvre::pull_over::PullOver;
use crate::planner_input::{Odometry, PlannedPathPoint, TrajectoryPoint};
use crate::side::Side;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::path::nearest_visit;
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet};

/// Minimum distance between points of the path, metres; a trajectory may be denser.
const STEP_M: f64 = 1.0;
/// Maximum number of points of the driven path: more than a lane change at city speed needs.
const MAX_DRIVEN: usize = 120;
/// A position farther than this from the previous one starts a new drive, metres.
const MAX_JUMP_M: f64 = 5.0;
/// Points nearer to each other than this are merged, metres: a standing vehicle produces many.
const SAME_POINT_M: f64 = 0.1;
/// A vehicle that begins to leave the roadside within this distance of where it stood pulls out from there,
/// metres; a smooth path hardly moves at the ends of a ramp.
const PULLS_OUT_WITHIN_M: f64 = 20.0;
/// A vehicle that stands within this distance of the end of its trajectory has arrived, metres.
const ARRIVED_M: f64 = 1.0;
/// Tolerated backward change of the offset within a manoeuvre, metres: positions are measured, and
/// trajectories are not smoothed.
const RIPPLE_M: f64 = 0.2;
/// Maximum number of points by which a ramp may have crossed a bound of its lane before its detected start:
/// ripple hides the true start.
const TRIMMED: usize = 5;
/// Offsets are averaged within this distance, metres: positions and trajectories are noisy.
const SMOOTHED_M: f64 = 4.0;
/// A ramp that ends at most this far before the end of a trajectory may continue beyond it, metres.
const BEYOND_M: f64 = 5.0;
/// Lanelets at most this far from the previous point are searched first, metres.
const AROUND_M: f64 = 20.0;

/// The part of the driven path that matters for manoeuvres.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DrivenPath {
    points: VecDeque<Odometry>,
}

impl DrivenPath {
    /// Adds a position of the vehicle.
    pub fn update(&mut self, odometry: Odometry) {
        let moved_m = |last: &Odometry| last.pose.position.distance_m(odometry.pose.position);
        if !odometry.pose.is_finite() || !odometry.speed_mps.is_finite() {
            return;
        }
        let is_other_way = odometry.speed_mps <= -STOP_SPEED_MPS;
        if is_other_way || self.points.back().is_some_and(|last| moved_m(last) > MAX_JUMP_M) {
            self.points.clear();
        }
        if self.points.back().is_none_or(|last| moved_m(last) >= STEP_M) {
            self.points.push_back(odometry);
        }
        if self.points.len() > MAX_DRIVEN {
            self.points.pop_front();
        }
    }
}

/// Returns the manoeuvres of a trajectory, in the order of the chain. The trajectory must be finite.
pub fn trajectory_manoeuvres(
    context: &FactorContext<'_>,
    driven: &DrivenPath,
    trajectory: &Timed<Arc<[TrajectoryPoint]>>,
) -> Vec<Timed<Manoeuvre>> {
    let (points, ego_index) = whole_path(context, driven, &trajectory.value);
    let mut manoeuvres = derived(context, &points, ego_index);
    manoeuvres.sort_by_key(Manoeuvre::kind);
    manoeuvres.into_iter().map(|value| Timed { at: trajectory.at, value }).collect()
}

/// Returns the driven path, the vehicle and the trajectory ahead of it as one path on lanelets, and the index
/// of the vehicle.
fn whole_path(
    context: &FactorContext<'_>,
    driven: &DrivenPath,
    trajectory: &[TrajectoryPoint],
) -> (Vec<PlannedPathPoint>, usize) {
    let ego = context.odometry.pose;
    let behind = driven.points.iter().map(|odometry| (odometry.pose, odometry.speed_mps));
    let mut way: Vec<(Pose, f64)> =
        behind.take_while(|(pose, _)| pose.position.distance_m(ego.position) > 0.0).collect();
    // A vehicle that begins to move stood here.
    let mut speed_mps = context.odometry.speed_mps;
    let is_here = |(pose, _): &mut (Pose, f64)| pose.position.distance_m(ego.position) < SAME_POINT_M;
    while let Some((_, was_mps)) = way.pop_if(is_here) {
        speed_mps = speed_mps.min(was_mps);
    }
    let ego_index = way.len();
    way.push((ego, speed_mps));
    let poses: Vec<Pose> = trajectory.iter().map(|point| point.pose).collect();
    let nearest = nearest_visit(&poses, ego, context.parameters.nearest, None);
    let (sin, cos) = ego.yaw_rad.sin_cos();
    let is_behind = |point: &&TrajectoryPoint| {
        let position = point.pose.position;
        (position.x_m - ego.position.x_m) * cos + (position.y_m - ego.position.y_m) * sin <= SAME_POINT_M
    };
    let ahead: Vec<_> = trajectory.iter().skip(nearest).skip_while(is_behind).collect();
    let far_m = |way: &[(Pose, f64)], point: &TrajectoryPoint| {
        way.last().map_or(0.0, |(last, _)| last.position.distance_m(point.pose.position))
    };
    for point in &ahead {
        if far_m(&way, point) >= STEP_M {
            way.push((point.pose, point.speed_mps));
        }
    }
    // The vehicle's state at the end matters: the last point replaces the points just before it.
    if let Some(last) = ahead.last() {
        let is_near = far_m(&way, last) < STEP_M;
        if is_near && way.len() > ego_index + 1 {
            way.pop();
        }
        if far_m(&way, last) >= SAME_POINT_M {
            way.push((last.pose, last.speed_mps));
        }
    }
    (on_lanes(context, way), ego_index)
}

/// Places the points of a path on the lanelets of the route. Each point lists its own lanelet first, then the
/// lanelets beside it.
fn on_lanes(context: &FactorContext<'_>, way: Vec<(Pose, f64)>) -> Vec<PlannedPathPoint> {
    let (road, route, limits) = (context.road, context.route, context.parameters.nearest);
    let mut before: Option<(LaneId, Vec<LaneId>)> = None;
    let point = |(pose, speed_mps): (Pose, f64)| {
        let around = before.as_ref().map_or(&[][..], |(_, around)| around);
        let surely = road.surely_current(around.iter().copied(), pose, limits);
        let is_around = |id: LaneId| around.binary_search(&id).is_ok();
        let lane =
            surely.or_else(|| road.current(route.lanes(), pose, limits, is_around)).map(|lane| lane.id);
        if let Some(lane) = lane.filter(|lane| before.as_ref().is_none_or(|(known, _)| known != lane)) {
            before = Some((lane, route.around(road, lane, AROUND_M)));
        }
        let mut lanes: Vec<LaneId> = lane.into_iter().collect();
        let beside =
            route.segments().iter().find(|segment| lane.is_some_and(|lane| segment.lanes.contains(&lane)));
        lanes.extend(beside.iter().flat_map(|segment| &segment.lanes).filter(|id| Some(**id) != lane));
        PlannedPathPoint { pose, speed_mps, lanes }
    };
    way.into_iter().map(point).collect()
}

/// Returns the manoeuvres on a path that are not over.
fn derived(context: &FactorContext<'_>, points: &[PlannedPathPoint], ego_index: usize) -> Vec<Manoeuvre> {
    let context = FactorContext { path: Some(points), ..*context };
    let Some(offsets) = PathOffsets::new(&context) else { return Vec::new() };
    let offsets = offsets.smoothed(SMOOTHED_M);
    let threshold_m = context.parameters.shift_length_threshold_m;
    let spans = offsets.ramps_within(0..=points.len() - 1, threshold_m, RIPPLE_M);
    // A vehicle that returns to its lane has not changed lanes.
    let is_back = |span: &RampSpan| {
        let lane = points.get(span.end).and_then(|point| point.lanes.first());
        lane.is_some_and(|lane| offsets.lanes.contains(lane))
    };
    let crosses = |span: &RampSpan| {
        leaves_sideways(context.road, points, span.start.saturating_sub(TRIMMED)..=span.end)
    };
    let last_back = spans.iter().rposition(|span| crosses(span) && is_back(span));
    let changes_lane =
        |index: usize, span: &RampSpan| last_back.is_none_or(|back| back < index) && crosses(span);
    // A completed lane change has made its lane the vehicle's own.
    let is_over = |span: &&RampSpan| {
        span.end < ego_index
            && crosses(span)
            && off_middle_m(&context, &points[span.end]).abs() < context.parameters.pull_out_minimum_shift_m
    };
    if let Some(RampSpan { end, .. }) = spans.iter().rfind(is_over)
        && let Some(rest) = points.get(*end..)
    {
        return derived(&context, rest, ego_index - end);
    }
    let mut manoeuvres = Vec::new();
    let mut avoiding: Vec<Ramp> = Vec::new();
    for (index, span) in spans.iter().enumerate() {
        let RampSpan { start, end, ramp } = span;
        if index == 0 && pulls_out(&context, points, ramp) {
            let lanes = offsets.lanes.clone();
            let pull_out = pulling::forwards(&context, Some(&offsets), &from_stand(points, ramp), lanes);
            manoeuvres.extend((*end >= ego_index).then_some(Manoeuvre::PullOut(pull_out)));
        } else if index + 1 == spans.len() && pulls_over(&context, points, ramp) {
            let pull_over = pulling::decided(&context, &offsets, &to_stand(points, ramp));
            let is_over = has_arrived(&context, points);
            manoeuvres.extend((!is_over).then_some(Manoeuvre::PullOver(PullOver::Decided(pull_over))));
        } else if changes_lane(index, span) {
            manoeuvres.push(Manoeuvre::LaneChange(lane_change(&context, &offsets, points, span)));
        } else if *start < ego_index || is_complete(points, *end) {
            avoiding.push(*ramp);
        }
    }
    let is_ahead = spans.iter().any(|span| span.end >= ego_index && avoiding.contains(&span.ramp));
    if is_ahead {
        manoeuvres.extend(avoidance::along(&context, &offsets, &avoiding, true).map(Manoeuvre::Avoidance));
    }
    manoeuvres
}

/// Returns whether a path leaves its lanelet, between two indices, for a lanelet that does not follow it.
fn leaves_sideways(road: &LaneNetwork, points: &[PlannedPathPoint], between: RangeInclusive<usize>) -> bool {
    let lanes = points.get(between).unwrap_or_default().iter().filter_map(|point| point.lanes.first());
    let lanes: Vec<LaneId> = lanes.copied().collect();
    lanes.windows(2).any(|pair| !leads_to(road, pair[0], pair[1], MAX_LANES_BETWEEN))
}

/// Returns whether `to` equals `from`, or follows it within `most` lanelets.
fn leads_to(road: &LaneNetwork, from: LaneId, to: LaneId, most: u32) -> bool {
    from == to || most > 0 && road.followers(from).iter().any(|next| leads_to(road, *next, to, most - 1))
}

/// Returns whether a path leads from standstill off the middle towards the middle.
fn pulls_out(context: &FactorContext<'_>, points: &[PlannedPathPoint], ramp: &Ramp) -> bool {
    let stood = points.first().is_some_and(|point| point.speed_mps.abs() < STOP_SPEED_MPS);
    let is_off = ramp.before_m.abs() >= context.parameters.pull_out_minimum_shift_m;
    stood && is_off && ramp.after_m.abs() < ramp.before_m.abs()
}

/// Returns whether a path ends at standstill, off the middle of the last lanelets of the route.
fn pulls_over(context: &FactorContext<'_>, points: &[PlannedPathPoint], ramp: &Ramp) -> bool {
    let Some(last) = points.last() else { return false };
    let off_m = off_middle_m(context, last);
    let stands = last.speed_mps.abs() < STOP_SPEED_MPS;
    let is_at_end = last.lanes.first().is_some_and(|lane| context.route.ends_with(*lane));
    let moves_out = (ramp.after_m - ramp.before_m) * off_m > 0.0;
    stands && is_at_end && moves_out && off_m.abs() >= context.parameters.pull_out_minimum_shift_m
}

/// Returns a ramp that starts where the vehicle stood, unless it first drives along the roadside.
fn from_stand(points: &[PlannedPathPoint], ramp: &Ramp) -> Ramp {
    let stand = points.first().map(|point| point.pose);
    let near = stand.filter(|pose| pose.position.distance_m(ramp.start.position) <= PULLS_OUT_WITHIN_M);
    Ramp { start: near.unwrap_or(ramp.start), ..*ramp }
}

/// Returns a ramp that ends where the path comes to a standstill.
fn to_stand(points: &[PlannedPathPoint], ramp: &Ramp) -> Ramp {
    Ramp { end: points.last().map_or(ramp.end, |point| point.pose), ..*ramp }
}

/// Returns whether the vehicle stands at the end of its path.
fn has_arrived(context: &FactorContext<'_>, points: &[PlannedPathPoint]) -> bool {
    let Odometry { pose, speed_mps } = context.odometry;
    let is_at_end =
        points.last().is_none_or(|last| last.pose.position.distance_m(pose.position) <= ARRIVED_M);
    speed_mps.abs() < STOP_SPEED_MPS && is_at_end
}

/// Returns the offset of a point to the left of the middle of its lanelet, metres; 0 without a lanelet.
fn off_middle_m(context: &FactorContext<'_>, point: &PlannedPathPoint) -> f64 {
    let lane = point.lanes.first().and_then(|id| context.road.lane(*id));
    let limits = context.looks_at_height.then_some(context.parameters.nearest);
    let middle = |lane: &Lanelet| ReferenceLine::new(lane.centerline.iter().copied());
    lane.map_or(0.0, |lane| middle(lane).offset_m(point.pose, limits))
}

/// Returns whether a path continues, or stands, where a ramp of it ends; otherwise the ramp leads beyond the
/// horizon and its kind is not known yet.
fn is_complete(points: &[PlannedPathPoint], end: usize) -> bool {
    let (Some(at), Some(last)) = (points.get(end), points.last()) else { return false };
    last.speed_mps.abs() < STOP_SPEED_MPS || at.pose.position.distance_m(last.pose.position) > BEYOND_M
}

fn lane_change(
    context: &FactorContext<'_>,
    offsets: &PathOffsets,
    points: &[PlannedPathPoint],
    span: &RampSpan,
) -> LaneChange {
    let ramp = span.ramp;
    LaneChange {
        side: if ramp.after_m > ramp.before_m { Side::Left } else { Side::Right },
        phase: LaneChangePhase::Running,
        start: Some(ramp.start),
        crossing: crossing(context.road, points, span.start..=span.end),
        end: Some(ramp.end),
        previous_path: offsets.poses.clone(),
        minimum_length_m: ramp.start.position.distance_m(ramp.end.position),
    }
}

#[cfg(test)]
mod tests;
