//! The path of a drive: positions along the centrelines of the lanelets of a route, as points of the map.

use std::collections::BTreeMap;
use std::iter::successors;
use std::sync::Arc;

use thiserror::Error;

use lanelet2_map::geometry::polyline::{arc_lengths_m, at_arc, nearest};
use lanelet2_map::geometry::{Point, Pose, cross};
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet};
use turn_signal::route::Segment;
use turn_signal::side::Side;

/// Length of a lane change without a position of its own, metres, if there is room.
const LANE_CHANGE_M: f64 = 50.0;
/// Half the length of the path section whose direction gives the heading at its middle, metres.
const HEADING_M: f64 = 0.25;

/// The line along which positions are measured.
#[derive(Debug, Clone)]
pub struct RoutePath {
    road: Arc<LaneNetwork>,
    line: Line,
    length_m: f64,
}

#[derive(Debug, Clone)]
enum Line {
    Lanes(RouteTracks),
    /// A line from the file, with the lanelets that it may lie on.
    Points(Vec<Point>, Vec<LaneId>),
}

/// Parallel lanes of a route, with changes between them.
#[derive(Debug, Clone)]
struct RouteTracks {
    /// Start of each segment, and the end of the last one, metres.
    starts_m: Vec<f64>,
    /// Driven lanes, at least one.
    tracks: Vec<LaneTrack>,
    changes: Vec<RouteLaneChange>,
    lengths_m: BTreeMap<LaneId, f64>,
}

/// Consecutive lanelets, one for each segment from the first on.
#[derive(Debug, Clone)]
struct LaneTrack {
    first: usize,
    lanes: Vec<LaneId>,
}

/// A lane change that moves the vehicle, metres along the route path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RouteLaneChange {
    /// Side of the target lane.
    pub side: Side,
    /// Start of the change.
    pub from_m: f64,
    /// End of the change.
    pub to_m: f64,
}

/// Reason why lanelets do not form a path.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum RoutePathError {
    /// A lanelet cannot be reached from the one before.
    #[error(
        "lanelet {to} follows no lanelet of the segment before, nor is there one beside it to come from; the \
         path ends in lanelet {from}"
    )]
    Gap {
        /// The last lanelet of the path.
        from: LaneId,
        /// The lanelet that cannot be reached.
        to: LaneId,
    },
    /// A lane change lies outside the part with both lanes.
    #[error("both lanes of the lane change lie side by side from {from_m:.1} to {to_m:.1} m only")]
    ChangeOutside {
        /// Start of the part with both lanes, metres.
        from_m: f64,
        /// End of the part with both lanes, metres.
        to_m: f64,
    },
    /// The centreline of this lanelet has no length.
    #[error("lanelet {0} has no length")]
    NoLength(LaneId),
}

impl RoutePath {
    /// Creates the path through the preferred lanelets. If a lanelet does not follow the previous one, the
    /// vehicle changes lanes: at the first of `changes` to the right side that lies where both lanes exist,
    /// otherwise over fifty metres in the middle of that part.
    pub fn of_route(
        road: Arc<LaneNetwork>,
        segments: &[Segment],
        changes: &[RouteLaneChange],
    ) -> Result<Self, RoutePathError> {
        let mut starts_m = vec![0.0];
        let mut end_m = 0.0;
        for segment in segments {
            let length_m = road.lane(segment.preferred).map_or(0.0, Lanelet::length_m);
            if length_m.is_nan() || length_m <= 0.0 {
                return Err(RoutePathError::NoLength(segment.preferred));
            }
            end_m += length_m;
            starts_m.push(end_m);
        }
        let ids = segments.iter().flat_map(|segment| &segment.lanes);
        let lengths_m = ids.filter_map(|id| Some((*id, road.lane(*id)?.length_m()))).collect();
        let mut lanes =
            RouteTracks { starts_m, tracks: tracks(&road, segments)?, changes: Vec::new(), lengths_m };
        lanes.locate_changes(&road, changes)?;
        Ok(Self { road, line: Line::Lanes(lanes), length_m: end_m })
    }

    /// Creates the path from a drawn line of at least two points, with the lanelets that it may lie on.
    pub fn of_points(road: Arc<LaneNetwork>, points: Vec<Point>, lanes: Vec<LaneId>) -> Self {
        let length_m = arc_lengths_m(&points).last().copied().unwrap_or_default();
        Self { road, line: Line::Points(points, lanes), length_m }
    }

    /// Returns the position of the path's end, metres.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Returns the pose at a position, `offset_m` to the left of the path, which may change along it. Beyond
    /// its ends the path continues straight.
    pub fn pose(&self, at_m: f64, offset_m: impl Fn(f64) -> f64) -> Pose {
        let along = Pose { position: self.middle(at_m), yaw_rad: self.heading_rad(at_m) };
        let rise = (offset_m(at_m + HEADING_M) - offset_m(at_m - HEADING_M)) / (2.0 * HEADING_M);
        Pose { position: along.point_at(0.0, offset_m(at_m)), yaw_rad: along.yaw_rad + rise.atan() }
    }

    /// Returns the lanelet at a position; from the middle of a lane change on, it is the target lanelet.
    pub fn lane_at(&self, at_m: f64) -> Option<LaneId> {
        match &self.line {
            Line::Lanes(lanes) => {
                let done = |change: &&RouteLaneChange| at_m >= f64::midpoint(change.from_m, change.to_m);
                let track = lanes.tracks.get(lanes.changes.iter().take_while(done).count())?;
                track.lane(lanes.segment(at_m))
            }
            Line::Points(_, lanes) => {
                let pose = self.pose(at_m, |_| 0.0);
                self.road.closest(lanes.iter().copied(), pose).map(|lane| lane.id)
            }
        }
    }

    /// Returns the lanelets between two positions, in order.
    pub fn lanes_between(&self, from_m: f64, to_m: f64) -> Vec<LaneId> {
        let mut found: Vec<LaneId> = Vec::new();
        let to_m = to_m.min(self.length_m);
        for at_m in metres_from(from_m.max(0.0)).take_while(|at_m| *at_m <= to_m) {
            found.extend(self.lane_at(at_m).filter(|lane| !found.contains(lane)));
        }
        found
    }

    /// Returns the position nearest to a point, and the distance between them, metres.
    pub fn nearest(&self, query: Point) -> (f64, f64) {
        let positions = metres_from(0.0).take_while(|at_m| *at_m < self.length_m).chain([self.length_m]);
        let line: Vec<Point> = positions.map(|at_m| self.middle(at_m)).collect();
        let projection = nearest(&line, query);
        // Each segment of the line is a metre of the path, except the last.
        let arcs_m = arc_lengths_m(&line);
        projection.map_or((0.0, f64::INFINITY), |projection| {
            let piece = arcs_m.partition_point(|arc_m| *arc_m <= projection.arc_m).saturating_sub(1);
            let index = u32::try_from(piece).unwrap_or(u32::MAX);
            let start_m = arcs_m.get(piece).copied().unwrap_or_default();
            ((f64::from(index) + projection.arc_m - start_m).min(self.length_m), projection.distance_m)
        })
    }

    /// Returns the heading of the path itself, without offsets.
    fn heading_rad(&self, at_m: f64) -> f64 {
        self.middle(at_m - HEADING_M).heading_to_rad(self.middle(at_m + HEADING_M))
    }

    /// Returns the point of the path itself, without offsets.
    fn middle(&self, at_m: f64) -> Point {
        let length_m = self.length_m;
        let within_m = at_m.clamp(0.0, length_m);
        let on = |at_m: f64| match &self.line {
            Line::Lanes(lanes) => lanes.point_at(&self.road, at_m),
            Line::Points(points, _) => at_arc(points, at_m).unwrap_or_default(),
        };
        if (at_m - within_m).abs() > 0.0 {
            let inner_m = if at_m < 0.0 { HEADING_M.min(length_m) } else { (length_m - HEADING_M).max(0.0) };
            let (edge, inner) = (on(within_m), on(inner_m));
            let span_m = edge.distance_m(inner);
            let beyond = if span_m > 0.0 { (at_m - within_m).abs() / span_m } else { 0.0 };
            return inner.toward(edge, 1.0 + beyond);
        }
        on(at_m)
    }
}

impl LaneTrack {
    fn end(&self) -> usize {
        self.first + self.lanes.len()
    }

    fn lane(&self, segment: usize) -> Option<LaneId> {
        self.lanes.get(segment.checked_sub(self.first)?).copied()
    }
}

impl RouteTracks {
    fn segment(&self, at_m: f64) -> usize {
        let begun = self.starts_m.partition_point(|start_m| *start_m <= at_m);
        begun.clamp(1, self.starts_m.len().max(2) - 1) - 1
    }

    fn on_track(&self, road: &LaneNetwork, track: &LaneTrack, at_m: f64) -> Option<Point> {
        let segment = self.segment(at_m);
        let lane = road.lane(track.lane(segment)?)?;
        let (start_m, end_m) = (self.starts_m.get(segment)?, self.starts_m.get(segment + 1)?);
        let share = (at_m - start_m) / (end_m - start_m);
        at_arc(&lane.centerline, share * self.lengths_m.get(&lane.id)?)
    }

    fn point_at(&self, road: &LaneNetwork, at_m: f64) -> Point {
        let mut point = self.tracks.first().and_then(|track| self.on_track(road, track, at_m));
        for (change, track) in self.changes.iter().zip(self.tracks.iter().skip(1)) {
            let share = smooth((at_m - change.from_m) / (change.to_m - change.from_m));
            if share <= 0.0 {
                break;
            }
            let target = self.on_track(road, track, at_m);
            point = match (point, target) {
                (Some(point), Some(target)) => Some(point.toward(target, share)),
                (point, target) => target.or(point),
            };
        }
        point.unwrap_or_default()
    }

    fn locate_changes(
        &mut self,
        road: &LaneNetwork,
        requested: &[RouteLaneChange],
    ) -> Result<(), RoutePathError> {
        let mut left: Vec<RouteLaneChange> = requested.to_vec();
        let mut changed_m = 0.0_f64;
        for (one, next) in self.tracks.iter().zip(self.tracks.iter().skip(1)) {
            let start = |segment: usize| self.starts_m.get(segment).copied().unwrap_or_default();
            let from_m = start(one.first.max(next.first)).max(changed_m);
            let to_m = start(one.end().min(next.end()));
            let middle_m = f64::midpoint(from_m, to_m);
            let side = match (self.on_track(road, one, middle_m), self.on_track(road, next, middle_m)) {
                (Some(here), Some(there)) => side_of(here, self.on_track(road, one, middle_m + 0.5), there),
                _ => Side::Left,
            };
            let fits = |change: &RouteLaneChange| {
                change.side == side && change.from_m >= from_m - 1e-6 && change.to_m <= to_m + 1e-6
            };
            let change = match left.iter().position(fits) {
                Some(index) => left.remove(index),
                None if left.iter().any(|change| change.side == side) => {
                    return Err(RoutePathError::ChangeOutside { from_m, to_m });
                }
                None => {
                    let half_m = (LANE_CHANGE_M / 2.0).min((to_m - from_m) / 2.0);
                    RouteLaneChange { side, from_m: middle_m - half_m, to_m: middle_m + half_m }
                }
            };
            changed_m = change.to_m;
            self.changes.push(change);
        }
        Ok(())
    }
}

pub(super) fn metres_from(from_m: f64) -> impl Iterator<Item = f64> {
    successors(Some(from_m), |at_m| Some(at_m + 1.0))
}

/// Returns a ramp from 0 to 1 without kinks; constant outside.
pub(super) fn smooth(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

fn side_of(here: Point, ahead: Option<Point>, there: Point) -> Side {
    let ahead = ahead.unwrap_or(here);
    if cross(here, ahead, there) < 0.0 { Side::Right } else { Side::Left }
}

fn tracks(road: &LaneNetwork, segments: &[Segment]) -> Result<Vec<LaneTrack>, RoutePathError> {
    let mut tracks: Vec<LaneTrack> = Vec::new();
    for (index, segment) in segments.iter().enumerate() {
        let Some(track) = tracks.last_mut() else {
            tracks.push(LaneTrack { first: index, lanes: vec![segment.preferred] });
            continue;
        };
        let before = index.checked_sub(1).and_then(|before| track.lane(before));
        if before.is_some_and(|before| road.followers(before).contains(&segment.preferred)) {
            track.lanes.truncate(index - track.first);
            track.lanes.push(segment.preferred);
            continue;
        }
        let mut beside = LaneTrack { first: index, lanes: vec![segment.preferred] };
        lead_back(road, segments, &mut beside);
        lead_on(road, segments, track);
        if beside.first >= track.end() {
            let from = track.lanes.last().copied().unwrap_or_default();
            return Err(RoutePathError::Gap { from, to: segment.preferred });
        }
        tracks.push(beside);
    }
    Ok(tracks)
}

/// Extends a track back along the lanelets of the route that lead into it.
fn lead_back(road: &LaneNetwork, segments: &[Segment], track: &mut LaneTrack) {
    while let (Some(before), Some(first)) = (track.first.checked_sub(1), track.lanes.first().copied()) {
        let leads = |lane: &&LaneId| road.followers(**lane).contains(&first);
        let lanes = segments.get(before).map(|segment| &segment.lanes);
        let Some(lane) = lanes.and_then(|lanes| lanes.iter().find(leads)) else { return };
        track.lanes.insert(0, *lane);
        track.first = before;
    }
}

/// Extends a track along the lanelets of the route that follow it.
fn lead_on(road: &LaneNetwork, segments: &[Segment], track: &mut LaneTrack) {
    while let (Some(segment), Some(last)) = (segments.get(track.end()), track.lanes.last().copied()) {
        let follows = |lane: &&LaneId| road.followers(last).contains(*lane);
        let Some(lane) = segment.lanes.iter().find(follows) else { return };
        track.lanes.push(*lane);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lanelets of 50 m by 3.5 m towards +x: 1, 2, 3 in the right lane and 11, 12, 13 to its left.
    fn two_lanes() -> Arc<LaneNetwork> {
        let lane = |id: LaneId| {
            let (left, index) = if id > 10 { (3.5, id - 11) } else { (0.0, id - 1) };
            let x_m = f64::from(i32::try_from(index).unwrap()) * 50.0;
            let followers = if index < 2 { vec![id + 1] } else { Vec::new() };
            let line = |y_m| vec![Point::new(x_m, y_m), Point::new(x_m + 50.0, y_m)];
            Lanelet { id, centerline: line(left), followers, ..Lanelet::default() }
        };
        Arc::new(LaneNetwork::new([1, 2, 3, 11, 12, 13].map(lane), Vec::new()))
    }

    fn segments(lanes: &[&[LaneId]]) -> Vec<Segment> {
        lanes.iter().map(|lanes| Segment { preferred: lanes[0], lanes: lanes.to_vec() }).collect()
    }

    fn point(route_path: &RoutePath, at_m: f64) -> (f64, f64) {
        let position = route_path.pose(at_m, |_| 0.0).position;
        (position.x_m, (position.y_m * 1e3).round() / 1e3)
    }

    #[test]
    fn positions_are_metres_along_the_middle_whatever_the_lane() {
        let route = segments(&[&[1, 11], &[12, 2], &[13]]);
        let route_path = RoutePath::of_route(two_lanes(), &route, &[]).unwrap();
        // Both lanes exist from 0 to 100 m, so the change takes 50 m in the middle.
        let points = [0.0, 25.0, 50.0, 75.0, 150.0].map(|at_m| point(&route_path, at_m));
        assert_eq!(points, [(0.0, 0.0), (25.0, 0.0), (50.0, 1.75), (75.0, 3.5), (150.0, 3.5)]);
        assert_eq!(
            [20.0, 49.0, 50.0, 140.0].map(|at_m| route_path.lane_at(at_m)),
            [Some(1), Some(1), Some(12), Some(13)]
        );
        assert_eq!(route_path.lanes_between(40.0, 110.0), [1, 12, 13]);
        assert_eq!((point(&route_path, -5.0), point(&route_path, 160.0)), ((-5.0, 0.0), (160.0, 3.5)));
        assert_eq!(route_path.nearest(Point::new(120.5, 4.5)), (120.5, 1.0));

        let placed = RouteLaneChange { side: Side::Left, from_m: 10.0, to_m: 20.0 };
        let away = RouteLaneChange { side: Side::Right, ..placed };
        let route_path = RoutePath::of_route(two_lanes(), &route, &[away, placed]).unwrap();
        for (at_m, left_m) in [(10.0, 0.0), (15.0, 1.75), (20.0, 3.5)] {
            assert!((point(&route_path, at_m).1 - left_m).abs() < 1e-9, "{at_m}");
        }
        let heading_deg = route_path.pose(15.0, |_| 0.0).yaw_rad.to_degrees();
        assert!((25.0..28.0).contains(&heading_deg), "1.5 * 3.5 / 10: {heading_deg}");
        let late = RouteLaneChange { to_m: 101.0, ..placed };
        let refused = RoutePath::of_route(two_lanes(), &route, &[late]).unwrap_err();
        assert_eq!(refused, RoutePathError::ChangeOutside { from_m: 0.0, to_m: 100.0 });
    }

    #[test]
    fn offsets_lie_to_the_left_and_turn_the_vehicle() {
        let route_path = RoutePath::of_route(two_lanes(), &segments(&[&[1], &[2]]), &[]).unwrap();
        let pose = route_path.pose(30.0, |at_m| (at_m - 20.0) * 0.1);
        assert!((pose.position.y_m - 1.0).abs() < 1e-9 && (pose.yaw_rad - 0.1_f64.atan()).abs() < 1e-9);
    }

    #[test]
    fn lanelets_that_lead_nowhere_are_refused() {
        let refused =
            |lanes: &[&[LaneId]]| RoutePath::of_route(two_lanes(), &segments(lanes), &[]).unwrap_err();
        assert_eq!(refused(&[&[1], &[3]]), RoutePathError::Gap { from: 1, to: 3 });
        assert_eq!(refused(&[&[1], &[12]]), RoutePathError::Gap { from: 1, to: 12 });
        assert_eq!(refused(&[&[9]]), RoutePathError::NoLength(9));
    }
}
