//! The lanelets of a map, with their followers and neighbours
//! (docs/spec/turn-signal-decider.md, "Map facts").

use std::cmp::Ordering;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::geometry::path::NearestLimits;
use crate::geometry::polyline::{length_m, nearest};
use crate::geometry::shape::contains;
use crate::geometry::{Point, Pose, wrapped};
use extent::Extent;

pub mod graph_order;

mod extent;
mod reader;
mod route_search;
mod tags;
mod topology;

/// Id of a lanelet.
pub type LaneId = i64;

/// One side of a lanelet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Roadside {
    /// A polygon of type `hatched_road_markings` shares a point with the bound.
    pub hatched: bool,
    /// There is a lane: a neighbour, routable or not, a shoulder, a sibling, or an opposite lane.
    pub lane: bool,
}

/// The direction of a turn, from the tag `turn_direction`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TurnDirection {
    /// No tag, or a value that does not name a direction.
    #[default]
    None,
    /// The lanelet leads straight on.
    Straight,
    /// The lanelet turns left.
    Left,
    /// The lanelet turns right.
    Right,
}

/// A lanelet of a map, with the properties that the decider needs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lanelet {
    /// Id of its relation.
    pub id: LaneId,
    /// Centreline in driving direction, computed from the bounds.
    pub centerline: Vec<Point>,
    /// Left bound in driving direction.
    pub left_bound: Vec<Point>,
    /// Right bound in driving direction.
    pub right_bound: Vec<Point>,
    /// The direction from the tag `turn_direction`.
    pub turn_direction: TurnDirection,
    /// The value of that tag if it names no direction, as written.
    pub unknown_direction: Option<String>,
    /// The tag `turn_signal_distance`, metres.
    pub turn_signal_distance_m: Option<f64>,
    /// The lanelets that follow this one, in the order of the routing graph.
    pub followers: Vec<LaneId>,
    /// The roadside at the left bound.
    pub left: Roadside,
    /// The roadside at the right bound.
    pub right: Roadside,
    /// The roundabouts to which it refers, by position in [`LaneNetwork::roundabouts`], in the order of the
    /// map.
    pub roundabouts: Vec<usize>,
    /// On an entry: exits listed in `exit_turn_signal_left`.
    pub exits_signalled_left: Vec<LaneId>,
    /// On an entry: exits listed in `exit_turn_signal_right`.
    pub exits_signalled_right: Vec<LaneId>,
    /// The tag `enable_exit_turn_signal` is `true`.
    pub enables_exit_signal: bool,
}

/// A roundabout regulatory element.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Roundabout {
    /// Lanelets that lead in.
    pub entries: Vec<LaneId>,
    /// Lanelets that lead out.
    pub exits: Vec<LaneId>,
    /// Lanelets of the ring.
    pub internals: Vec<LaneId>,
}

/// The lanelets and roundabouts of a map.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LaneNetwork {
    lanes: BTreeMap<LaneId, (Lanelet, Extent)>,
    predecessors: BTreeMap<LaneId, Vec<LaneId>>,
    roundabouts: Vec<Roundabout>,
}

#[derive(Debug)]
struct Near<'a> {
    lane: &'a Lanelet,
    is_level: bool,
    distance_m: f64,
    turned_rad: f64,
}

impl Near<'_> {
    /// Compares lanelets by distance, then by the difference of heading.
    fn by_distance(&self, other: &Self) -> Ordering {
        self.distance_m.total_cmp(&other.distance_m).then(self.turned_rad.total_cmp(&other.turned_rad))
    }
}

impl Roadside {
    /// Returns whether there is only a hatched marking and no lane (step 8 of the shift rule).
    pub const fn is_hatched_only(self) -> bool {
        self.hatched && !self.lane
    }
}

impl Roundabout {
    /// Returns whether a lanelet has any role in the roundabout.
    pub fn contains(&self, lane: LaneId) -> bool {
        self.entries.contains(&lane) || self.exits.contains(&lane) || self.internals.contains(&lane)
    }
}

impl LaneNetwork {
    /// Creates the network of these lanelets, in the order of the routing graph. Of two lanelets with the
    /// same id, the last one counts.
    pub fn new(lanes: impl IntoIterator<Item = Lanelet>, roundabouts: Vec<Roundabout>) -> Self {
        let mut predecessors: BTreeMap<LaneId, Vec<LaneId>> = BTreeMap::new();
        let mut measured = |lane: Lanelet| {
            for follower in &lane.followers {
                predecessors.entry(*follower).or_default().push(lane.id);
            }
            let extent = Extent::of(&lane.border());
            (lane.id, (lane, extent))
        };
        let lanes: BTreeMap<_, _> = lanes.into_iter().map(&mut measured).collect();
        Self { lanes, predecessors, roundabouts }
    }

    /// Returns the lanelet with this id.
    pub fn lane(&self, id: LaneId) -> Option<&Lanelet> {
        self.lanes.get(&id).map(|(lane, _)| lane)
    }

    /// Returns all lanelets, in ascending order of their ids.
    pub fn lanes(&self) -> impl Iterator<Item = &Lanelet> {
        self.lanes.values().map(|(lane, _)| lane)
    }

    /// Returns the lanelets that follow this one, in the order of the routing graph.
    pub fn followers(&self, id: LaneId) -> &[LaneId] {
        self.lane(id).map_or(&[], |lane| &lane.followers)
    }

    /// Returns the lanelets that lead into this one, in the order of the routing graph.
    pub fn predecessors(&self, id: LaneId) -> &[LaneId] {
        self.predecessors.get(&id).map_or(&[], Vec::as_slice)
    }

    /// Returns all roundabouts; [`Lanelet::roundabouts`] contains positions in this list.
    pub fn roundabouts(&self) -> &[Roundabout] {
        &self.roundabouts
    }

    /// Returns the roundabouts that a lanelet refers to, in the order of the map.
    pub fn roundabouts_of(&self, id: LaneId) -> impl Iterator<Item = &Roundabout> {
        let indices = self.lane(id).map_or(&[][..], |lane| &lane.roundabouts);
        indices.iter().filter_map(|index| self.roundabouts.get(*index))
    }

    /// Returns the lanelet of `lanes` nearest to a pose; of equally near lanelets, the one with the most
    /// similar heading.
    pub fn closest(&self, lanes: impl IntoIterator<Item = LaneId>, pose: Pose) -> Option<&Lanelet> {
        let bounded: Vec<_> = lanes
            .into_iter()
            .filter_map(|id| self.lanes.get(&id))
            .map(|(lane, extent)| (lane, extent.distances_m(pose.position)))
            .collect();
        // Lanelets that are surely farther away than another need no exact measurement.
        let reach_m = bounded.iter().map(|(_, (_, most_m))| *most_m).fold(f64::INFINITY, f64::min);
        let ranked = bounded.into_iter().filter(|(_, (least_m, _))| *least_m <= reach_m).map(|(lane, _)| {
            let rank = (lane.distance_m(pose.position), lane.misalignment_rad(pose));
            (lane, rank)
        });
        let nearest = ranked.min_by(|(_, (near, facing)), (_, (other_near, other_facing))| {
            near.total_cmp(other_near).then(facing.total_cmp(other_facing))
        });
        nearest.map(|(lane, _)| lane)
    }

    /// Like [`Self::closest`], among the lanelets within the limits; `None` if there are none.
    pub fn closest_within(
        &self,
        lanes: impl IntoIterator<Item = LaneId>,
        pose: Pose,
        limits: NearestLimits,
    ) -> Option<&Lanelet> {
        let near = lanes.into_iter().filter_map(|id| self.near(id, pose, limits));
        near.min_by(Near::by_distance).map(|near| near.lane)
    }

    /// Returns the lanelet of `lanes` that a vehicle is on. Among the near lanelets with a similar heading,
    /// it prefers one at the vehicle's height, then one that `is_continuous`, then the nearest. Without such
    /// a lanelet, the [closest](Self::closest).
    pub fn current(
        &self,
        lanes: impl IntoIterator<Item = LaneId>,
        pose: Pose,
        limits: NearestLimits,
        is_continuous: impl Fn(LaneId) -> bool,
    ) -> Option<&Lanelet> {
        let lanes: Vec<LaneId> = lanes.into_iter().collect();
        let ranked = lanes.iter().filter_map(|id| self.near(*id, pose, limits)).min_by(|one, other| {
            let by_place = |near: &Near<'_>| (!near.is_level, !is_continuous(near.lane.id));
            by_place(one).cmp(&by_place(other)).then(one.by_distance(other))
        });
        ranked.map(|near| near.lane).or_else(|| self.closest(lanes, pose))
    }

    /// Like [`Self::current`], for lanelets that are all continuous: returns a lanelet only if it would also
    /// be chosen among any other lanelets. `None` if none of them is near the vehicle, has a similar heading
    /// and lies at its height.
    pub fn surely_current(
        &self,
        lanes: impl IntoIterator<Item = LaneId>,
        pose: Pose,
        limits: NearestLimits,
    ) -> Option<&Lanelet> {
        let lanes: Vec<LaneId> = lanes.into_iter().collect();
        let level = |lanes: &mut dyn Iterator<Item = LaneId>| {
            let near = lanes.filter_map(|id| self.near(id, pose, limits));
            near.filter(|near| near.is_level).min_by(Near::by_distance).map(|near| near.lane)
        };
        // No lanelet is nearer than the one the pose is in.
        let around = lanes.iter().copied().filter(|id| self.contains(*id, pose.position));
        level(&mut around.into_iter()).or_else(|| level(&mut lanes.iter().copied()))
    }

    fn contains(&self, id: LaneId, point: Point) -> bool {
        self.lanes
            .get(&id)
            .is_some_and(|(lane, extent)| extent.distances_m(point).0 <= 0.0 && lane.contains(point))
    }

    /// Returns a lanelet within the limits of a pose; `None` beyond them.
    fn near(&self, id: LaneId, pose: Pose, limits: NearestLimits) -> Option<Near<'_>> {
        let (lane, extent) = self.lanes.get(&id)?;
        let (least_m, _) = extent.distances_m(pose.position);
        let distance_m = Some(least_m)
            .filter(|least_m| *least_m <= limits.distance_m)
            .map(|_| lane.distance_m(pose.position))
            .filter(|distance_m| *distance_m <= limits.distance_m)?;
        let middle = nearest(&lane.centerline, pose.position)?;
        let turned_rad = wrapped(middle.yaw_rad - pose.yaw_rad).abs();
        let is_level = pose.position.at_height(middle.z_m).is_level_with(pose.position);
        (turned_rad <= limits.yaw_rad).then_some(Near { lane, is_level, distance_m, turned_rad })
    }
}

impl Lanelet {
    /// Returns the length of the centreline in metres.
    pub fn length_m(&self) -> f64 {
        length_m(&self.centerline)
    }

    /// Returns whether a point lies between the bounds.
    pub fn contains(&self, point: Point) -> bool {
        contains(&self.ring(), point)
    }

    /// Returns the distance in metres from a point to the lanelet's area, or to its centreline if it has no
    /// bounds.
    pub fn distance_m(&self, point: Point) -> f64 {
        if self.contains(point) {
            return 0.0;
        }
        nearest(&self.border(), point).map_or(f64::INFINITY, |nearest| nearest.distance_m)
    }

    /// Returns the angle between a pose and the nearest piece of the centreline, radians, 0 to π.
    pub fn misalignment_rad(&self, pose: Pose) -> f64 {
        let facing = nearest(&self.centerline, pose.position).map_or(0.0, |nearest| nearest.yaw_rad);
        wrapped(facing - pose.yaw_rad).abs()
    }

    /// Returns the closed line around the lanelet's area, or its centreline if it has no area.
    fn border(&self) -> Vec<Point> {
        let mut ring = self.ring();
        ring.extend(ring.first().copied());
        if ring.len() > 3 { ring } else { self.centerline.clone() }
    }

    fn ring(&self) -> Vec<Point> {
        self.left_bound.iter().chain(self.right_bound.iter().rev()).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Lanelets of any shape, also without area, without points and far from being numbers.
        #[test]
        fn the_closest_is_the_first_of_the_least_distance(
            lines in prop::collection::vec(prop::collection::vec((coordinate(), coordinate()), 0..5), 0..8),
            (x_m, y_m) in (-9.0..9.0_f64, -9.0..9.0_f64),
        ) {
            let points = |line: &Vec<(f64, f64)>| line.iter().map(|(x, y)| Point::new(*x, *y)).collect();
            let lane = |(id, line): (LaneId, &Vec<(f64, f64)>)| Lanelet {
                id,
                centerline: points(line),
                left_bound: if id % 3 == 0 { Vec::new() } else { points(line) },
                ..Lanelet::default()
            };
            let road = LaneNetwork::new((0..).zip(&lines).map(lane), Vec::new());
            let pose = Pose::new(x_m, y_m, 0.0);
            let rank = |lane: &&Lanelet| (lane.distance_m(pose.position), lane.misalignment_rad(pose));
            let plain = road.lanes().min_by(|one, other| {
                let (one, other) = (rank(one), rank(other));
                one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1))
            });
            let closest = road.closest(0..9, pose);
            prop_assert_eq!(closest.map(|lane| lane.id), plain.map(|lane| lane.id));
        }
    }

    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![20 => -9.0..9.0_f64, 10 => (-3..4_i8).prop_map(f64::from), 1 => Just(f64::NAN)]
    }
}
