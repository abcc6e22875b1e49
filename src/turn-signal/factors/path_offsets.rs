//! The planned path relative to the middle of its lanelets: its lateral offset, and where it crosses a bound.

use std::ops::RangeInclusive;

use super::factor::{FactorContext, Ramp};
use super::reference_line::ReferenceLine;
use crate::planner_input::PlannedPathPoint;
use crate::shift::{ShiftLine, ShiftedPath};
use lanelet2_map::geometry::path::{NearestLimits, nearest_visit};
use lanelet2_map::geometry::polyline::nearest_index;
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet};

/// Offsets that differ by less than this are equal, metres; planned paths are smoothed.
const SAME_OFFSET_M: f64 = 0.05;
/// Maximum number of short lanelets between two points of a path.
pub(super) const MAX_LANES_BETWEEN: u32 = 4;

/// A planned path, measured against the lanelets it follows.
#[derive(Debug, Clone)]
pub(super) struct PathOffsets {
    pub(super) poses: Vec<Pose>,
    /// Limits within which a point of the path is also found by heading and height; `None` if by position
    /// alone.
    limits: Option<NearestLimits>,
    /// The consecutive lanelets of the path from its first on: the vehicle's lane, even while the path leaves
    /// it.
    pub(super) lanes: Vec<LaneId>,
    middle: ReferenceLine,
    /// Offset of each point of the path to the left of the middle of the lane, metres.
    offsets_m: Vec<f64>,
}

/// A ramp of a path, with the indices of its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RampSpan {
    pub(super) start: usize,
    pub(super) end: usize,
    pub(super) ramp: Ramp,
}

impl PathOffsets {
    /// Measures the planned path; `None` if it is unusable.
    pub(super) fn new(context: &FactorContext<'_>) -> Option<Self> {
        let path = context.path.filter(|path| path.len() > 1)?;
        let poses: Vec<Pose> = path.iter().map(|point| point.pose).collect();
        // A path that is not a line is unusable.
        ShiftedPath::new(poses.clone(), Vec::new()).ok()?;
        let lanes = lanes(context, path);
        let middle = lanes.iter().filter_map(|id| context.road.lane(*id)).flat_map(|lane| &lane.centerline);
        let middle = ReferenceLine::new(middle.copied());
        let limits = context.looks_at_height.then_some(context.parameters.nearest);
        let offsets_m = middle.offsets_m(&poses, limits);
        Some(Self { poses, limits, lanes, middle, offsets_m })
    }

    /// Returns the path with each offset averaged over as many points before as after it, within a distance.
    pub(super) fn smoothed(mut self, within_m: f64) -> Self {
        let mean_m = |(index, here): (usize, &Pose)| {
            let is_near = |pose: &&Pose| pose.position.distance_m(here.position) <= within_m;
            let (before, after) = self.poses.split_at(index);
            let reach = before.iter().rev().take_while(is_near).count();
            let reach = reach.min(after.iter().skip(1).take_while(is_near).count());
            let near = self.offsets_m.iter().skip(index - reach).take(2 * reach + 1);
            let (sum_m, count) =
                near.fold((0.0, 0.0), |(sum_m, count), offset_m| (sum_m + offset_m, count + 1.0));
            sum_m / count
        };
        self.offsets_m = self.poses.iter().enumerate().map(mean_m).collect();
        self
    }

    /// Returns the offset of a pose to the left of the middle, metres; 0 where there is no lane.
    pub(super) fn offset_m(&self, pose: Pose) -> f64 {
        self.middle.offset_m(pose, self.limits)
    }

    /// Returns the offset of the path's point nearest to a pose, metres.
    pub(super) fn path_offset_m(&self, pose: Pose) -> f64 {
        self.offsets_m.get(self.nearest_index(pose)).copied().unwrap_or_default()
    }

    /// Returns the index of the path's point nearest to a pose.
    pub(super) fn nearest_index(&self, pose: Pose) -> usize {
        match self.limits {
            Some(limits) => nearest_visit(&self.poses, pose, limits, None),
            None => nearest_index(&self.poses, pose.position),
        }
    }

    pub(super) fn line(&self, start: Pose, end: Pose) -> ShiftLine {
        ShiftLine { start_index: self.nearest_index(start), end_index: self.nearest_index(end), start, end }
    }

    /// Returns the offset of a pose to the left of the path, metres.
    pub(super) fn beside_m(&self, pose: Pose) -> f64 {
        let line = ReferenceLine::new(self.poses.iter().map(|pose| pose.position));
        line.offset_m(pose, self.limits)
    }

    /// Returns the path with the offsets that result from these ramps, in order, linear within each ramp.
    pub(super) fn ramped(&self, ramps: &[Ramp]) -> Option<ShiftedPath> {
        let spans: Vec<RampSpan> = ramps
            .iter()
            .map(|ramp| RampSpan {
                start: self.nearest_index(ramp.start),
                end: self.nearest_index(ramp.end),
                ramp: *ramp,
            })
            .collect();
        let first_m = ramps.first().map_or(0.0, |ramp| ramp.before_m);
        let shift_m = |at: usize| {
            let begun = spans.iter().rfind(|span| span.start <= at);
            begun.map_or(first_m, |RampSpan { start, end, ramp }| {
                let share = if at >= *end { 1.0 } else { share(at - start, end - start) };
                ramp.before_m + (ramp.after_m - ramp.before_m) * share
            })
        };
        let shifts_m = (0..self.poses.len()).map(shift_m).collect();
        ShiftedPath::new(self.poses.clone(), shifts_m).ok()
    }

    /// Returns the ramps of the path itself between two poses: changes of the offset by `threshold_m` or more
    /// in one direction. A smooth path hardly moves at the ends of a ramp, so these ramps begin a little
    /// later and end a little earlier than planned.
    pub(super) fn own_ramps(&self, from: Pose, to: Pose, threshold_m: f64) -> Vec<Ramp> {
        let within = self.nearest_index(from)..=self.nearest_index(to);
        let spans = self.ramps_within(within, threshold_m, SAME_OFFSET_M).into_iter();
        spans.map(|span| span.ramp).collect()
    }

    /// Returns the ramps between two points of the path. An offset that moves back by no more than `ripple_m`
    /// does not end a ramp.
    pub(super) fn ramps_within(
        &self,
        points: RangeInclusive<usize>,
        threshold_m: f64,
        ripple_m: f64,
    ) -> Vec<RampSpan> {
        let first = *points.start();
        let within = self.offsets_m.get(points).unwrap_or_default();
        let span = |ends: RangeInclusive<usize>| {
            let (start, end) = (first + ends.start(), first + ends.end());
            let ramp = Ramp {
                start: *self.poses.get(start)?,
                end: *self.poses.get(end)?,
                before_m: *within.get(*ends.start())?,
                after_m: *within.get(*ends.end())?,
            };
            Some(RampSpan { start, end, ramp })
        };
        swings(within, threshold_m, ripple_m).into_iter().filter_map(span).collect()
    }

    /// Returns whether the path follows a ramp for more than half of its offset.
    pub(super) fn follows(&self, ramp: &Ramp) -> bool {
        let moved_m = self.path_offset_m(ramp.end) - ramp.before_m;
        let whole_m = ramp.after_m - ramp.before_m;
        moved_m / whole_m > 0.5
    }
}

/// Returns the first point of the path, between two indices, that has left its lane sideways.
pub(super) fn crossing(
    road: &LaneNetwork,
    path: &[PlannedPathPoint],
    points: RangeInclusive<usize>,
) -> Option<Pose> {
    let mut within: Option<&Lanelet> = None;
    for point in path.get(points).unwrap_or_default() {
        let position = point.pose.position;
        within = match within {
            None => point.lanes.iter().filter_map(|id| road.lane(*id)).find(|lane| lane.contains(position)),
            Some(lane) => Some(match onward(road, lane, position, MAX_LANES_BETWEEN) {
                Some(lane) => lane,
                None => return Some(point.pose),
            }),
        };
    }
    None
}

/// Returns the lanelet that contains a point: `lane`, or one of at most `most` lanelets that follow it.
fn onward<'a>(road: &'a LaneNetwork, lane: &'a Lanelet, point: Point, most: u32) -> Option<&'a Lanelet> {
    if lane.contains(point) {
        return Some(lane);
    }
    let next = road.followers(lane.id).iter().filter_map(|id| road.lane(*id)).filter(|_| most > 0);
    next.into_iter().find_map(|next| onward(road, next, point, most - 1))
}

/// Returns the consecutive lanelets of the path. If the first point names no lanelet, the lanelet of the
/// route nearest to the vehicle is used.
fn lanes(context: &FactorContext<'_>, path: &[PlannedPathPoint]) -> Vec<LaneId> {
    let known = |id: &LaneId| context.road.lane(*id).is_some();
    let named = path.first().map_or(&[][..], |point| &point.lanes);
    let holds = |id: &&LaneId| {
        let start = path.first().map(|point| point.pose.position);
        context.road.lane(**id).zip(start).is_some_and(|(lane, start)| lane.contains(start))
    };
    let first = named.iter().find(holds).or_else(|| named.iter().find(|id| known(id))).copied();
    let nearest = || context.road.closest(context.route.lanes(), context.odometry.pose).map(|lane| lane.id);
    let mut chain: Vec<LaneId> = first.or_else(nearest).into_iter().collect();
    for id in path.iter().flat_map(|point| &point.lanes) {
        let follows = chain.last().is_some_and(|last| context.road.followers(*last).contains(id));
        if follows && known(id) && !chain.contains(id) {
            chain.push(*id);
        }
    }
    chain
}

/// Returns the first and last index of every change in one direction of at least `threshold_m`, through
/// ripples of at most `ripple_m`.
fn swings(offsets_m: &[f64], threshold_m: f64, ripple_m: f64) -> Vec<RangeInclusive<usize>> {
    let mut found = Vec::new();
    let Some(first) = offsets_m.first() else { return Vec::new() };
    let (mut pivot, mut extreme) = ((0, *first), (0, *first));
    for (index, offset_m) in offsets_m.iter().copied().enumerate() {
        let swing_m = extreme.1 - pivot.1;
        let turned = (offset_m - extreme.1) * swing_m < 0.0;
        if turned && (offset_m - extreme.1).abs() > ripple_m {
            found.push((pivot, extreme));
            (pivot, extreme) = (extreme, (index, offset_m));
        } else if !turned && (offset_m - extreme.1).abs() > 0.0 {
            extreme = (index, offset_m);
        }
    }
    found.push((pivot, extreme));
    found.retain(|((_, from_m), (_, to_m))| (to_m - from_m).abs() >= threshold_m);
    let near = |one: f64, other: f64| (one - other).abs() <= ripple_m;
    let trimmed = |((from, from_m), (to, to_m)): ((usize, f64), (usize, f64))| {
        let mut run = offsets_m.iter().enumerate().skip(from).take(to + 1 - from);
        let begins = run.clone().take_while(|(_, offset_m)| near(**offset_m, from_m)).last();
        let ends = run.find(|(_, offset_m)| near(**offset_m, to_m));
        begins.map_or(from, |(index, _)| index)..=ends.map_or(to, |(index, _)| index)
    };
    found.into_iter().map(trimmed).collect()
}

#[allow(clippy::cast_precision_loss)] // points of a path
fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_smoothed_over_a_distance() {
        let poses: Vec<Pose> = [0.0, 1.0, 2.0, 6.0].map(|x_m| Pose::new(x_m, 0.0, 0.0)).to_vec();
        let (lanes, middle) = (Vec::new(), ReferenceLine::new([]));
        let offsets = PathOffsets { poses, limits: None, lanes, middle, offsets_m: vec![0.0, 0.3, 0.9, 5.0] };
        for (within_m, expected) in
            [(0.5, [0.0, 0.3, 0.9, 5.0]), (1.5, [0.0, 0.4, 0.9, 5.0]), (5.0, [0.0, 0.4, 6.2 / 3.0, 5.0])]
        {
            let smoothed = offsets.clone().smoothed(within_m).offsets_m;
            let is_near = |(one, other): (&f64, &f64)| (one - other).abs() < 1e-9;
            assert!(smoothed.iter().zip(&expected).all(is_near), "{within_m} m: {smoothed:?}");
        }
    }

    #[test]
    fn a_profile_is_cut_into_its_swings() {
        let out_and_back = [0.0, 0.0, 0.02, 0.5, 1.0, 1.48, 1.5, 1.5, 1.49, 1.0, 0.4, 0.03, 0.0, 0.0];
        assert_eq!(swings(&out_and_back, 0.3, SAME_OFFSET_M), [2..=5, 8..=11]);
        assert_eq!(swings(&[0.0, 0.29, 0.29], 0.3, SAME_OFFSET_M), [], "too little");
        assert_eq!(swings(&[0.0, -0.2, -0.17, -0.4], 0.3, SAME_OFFSET_M), [0..=3], "a ripple does not count");
        assert_eq!(swings(&[], 0.3, SAME_OFFSET_M), []);
    }
}
