//! The route: ordered segments of lanelets, and the neighbours of a lanelet within them
//! (docs/spec/turn-signal-decider.md, "Neighbours within the route").

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::error::Error;

use derive_more::Display;

use super::catalogue;
use super::compat::DeciderQuirks;
use gateway_base::diagnostics::MessagePart;
use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::graph_order::table_order;
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet};

/// Lanelets of a route that lie side by side.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// The lanelet that the route prefers.
    pub preferred: LaneId,
    /// All lanelets, including the preferred one; areas are left out.
    pub lanes: Vec<LaneId>,
}

/// A route of the mission planner.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    id: u128,
    start: Pose,
    goal: Option<Pose>,
    segments: Vec<Segment>,
    /// The lanelets, each with the index of its segment.
    lanes: BTreeMap<LaneId, usize>,
    /// The lanelets, each with its place in a routing graph of the route alone.
    graph_places: BTreeMap<LaneId, usize>,
}

/// A reason why a route is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
#[display("{}", self.message())]
pub enum RouteError {
    /// The route has no lanelets.
    Empty,
    /// This lanelet is listed twice; upstream also refuses such a route.
    Repeated(LaneId),
    /// This lanelet is not on the map: the route belongs to another map.
    Unknown(LaneId),
    /// The start pose is not finite.
    StartNotFinite,
}

impl RouteError {
    /// Returns its message in diagnostics.
    pub fn message(&self) -> MessagePart {
        match self {
            Self::Empty => catalogue::empty_route(),
            Self::Repeated(lane) => catalogue::repeated_lanelet(lane),
            Self::Unknown(lane) => catalogue::unknown_lanelet(lane),
            Self::StartNotFinite => catalogue::start_not_finite(),
        }
    }
}

impl Error for RouteError {}

impl Route {
    /// Creates a route with the id (`uuid`) and start pose of its message.
    pub fn new(id: u128, start: Pose, segments: Vec<Segment>) -> Result<Self, RouteError> {
        let mut lanes = BTreeMap::new();
        let mut listed = Vec::new();
        for (index, segment) in segments.iter().enumerate() {
            for lane in &segment.lanes {
                match lanes.entry(*lane) {
                    Entry::Vacant(vacant) => vacant.insert(index),
                    Entry::Occupied(_) => return Err(RouteError::Repeated(*lane)),
                };
                listed.push(*lane);
            }
        }
        if lanes.is_empty() {
            return Err(RouteError::Empty);
        }
        let graph_places = table_order(&listed).into_iter().zip(0..).collect();
        Ok(Self { id, start, goal: None, segments, lanes, graph_places })
    }

    /// Returns the same route with the goal of its message; a goal that is not finite is left out.
    #[must_use]
    pub fn with_goal(self, goal: Pose) -> Self {
        Self { goal: Some(goal).filter(|goal| goal.is_finite()), ..self }
    }

    /// Returns the route if it can be driven on this road.
    ///
    /// # Errors
    /// Fails if a lanelet is not on the map, or the start is not a pose.
    pub fn checked(self, road: &LaneNetwork) -> Result<Self, RouteError> {
        if !self.start.is_finite() {
            return Err(RouteError::StartNotFinite);
        }
        let unknown = self.lanes().find(|lane| road.lane(*lane).is_none());
        match unknown {
            Some(lane) => Err(RouteError::Unknown(lane)),
            None => Ok(self),
        }
    }

    /// Returns the id; another id means another route.
    pub fn id(&self) -> u128 {
        self.id
    }

    /// Returns the pose at its start.
    pub fn start(&self) -> Pose {
        self.start
    }

    /// Returns the pose at its end; `None` if it is not known.
    pub fn goal(&self) -> Option<Pose> {
        self.goal
    }

    /// Returns the segments, in order.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Returns all lanelets, in ascending order of their ids.
    pub fn lanes(&self) -> impl Iterator<Item = LaneId> + '_ {
        self.lanes.keys().copied()
    }

    /// Returns whether a lanelet is on the route.
    pub fn contains(&self, lane: LaneId) -> bool {
        self.lanes.contains_key(&lane)
    }

    /// Returns whether a lanelet is in the last segment.
    pub fn ends_with(&self, lane: LaneId) -> bool {
        self.segments.last().is_some_and(|segment| segment.lanes.contains(&lane))
    }

    /// Returns the lanelet that the first segment prefers.
    pub fn first_preferred(&self) -> Option<LaneId> {
        self.segments.first().map(|segment| segment.preferred)
    }

    /// Returns the lanelet that the last segment prefers.
    pub fn last_preferred(&self) -> Option<LaneId> {
        self.segments.last().map(|segment| segment.preferred)
    }

    /// Returns the lanelet of the route that comes first in a routing graph of the route alone
    /// (docs/spec/turn-signal-decider.md, "Order of the routing graph"); `None` if none is on the route.
    pub fn first_in_graph(&self, lanes: &[LaneId]) -> Option<LaneId> {
        let placed = lanes.iter().filter_map(|lane| Some((self.graph_places.get(lane)?, *lane)));
        placed.min().map(|(_, lane)| lane)
    }

    /// Returns whether upstream's path generator finds a lanelet of the route behind this one
    /// (docs/spec/turn-signal-decider.md, "Path generator").
    pub fn goes_on_after(&self, road: &LaneNetwork, lane: LaneId) -> bool {
        let followers = road.followers(lane);
        Some(lane) != self.last_preferred()
            && followers.first().copied() != self.first_preferred()
            && followers.iter().any(|next| self.contains(*next))
    }

    /// Returns the lanelets of the segments that are separated from the segment of `lane` by less than
    /// `within_m` metres of preferred lanelets, in ascending order; empty if `lane` is not on the route.
    pub fn around(&self, road: &LaneNetwork, lane: LaneId, within_m: f64) -> Vec<LaneId> {
        let Some(here) = self.lanes.get(&lane).copied() else { return Vec::new() };
        let reached = |segments: &mut dyn Iterator<Item = &Segment>| {
            let mut between_m = 0.0;
            let near = segments.take_while(|segment| {
                let is_near = between_m < within_m;
                between_m += road.lane(segment.preferred).map_or(0.0, Lanelet::length_m);
                is_near
            });
            near.flat_map(|segment| segment.lanes.iter().copied()).collect::<Vec<_>>()
        };
        let mut lanes = reached(&mut self.segments.iter().take(here).rev());
        lanes.extend(self.segments.get(here).into_iter().flat_map(|segment| &segment.lanes));
        lanes.extend(reached(&mut self.segments.iter().skip(here + 1)));
        lanes.sort_unstable();
        lanes
    }

    /// Returns the lanelet after this one: among the lanelets that follow it on the map, the one in the
    /// nearest segment from its own on; `None` after the last segment.
    pub fn next(&self, road: &LaneNetwork, lane: LaneId, quirks: DeciderQuirks) -> Option<LaneId> {
        if quirks.ignores_order_of_segments {
            return self.next_on_map(road, lane);
        }
        let here = self.lanes.get(&lane)?;
        let followers = road.followers(lane).iter().copied().filter(|next| *next != lane);
        let later = followers.filter_map(|next| Some((*self.lanes.get(&next)?, next)));
        later.filter(|(segment, _)| segment >= here).min_by_key(|(segment, _)| *segment).map(|(_, next)| next)
    }

    /// Returns the lanelets before this one: the lanelets that lead to it on the map, from its own segment
    /// backwards; none before the first segment.
    pub fn previous(&self, road: &LaneNetwork, lane: LaneId, quirks: DeciderQuirks) -> Vec<LaneId> {
        let Some(here) = self.lanes.get(&lane) else { return Vec::new() };
        let before = road.predecessors(lane).iter().copied();
        let mut before: Vec<(usize, LaneId)> =
            before.filter_map(|before| Some((*self.lanes.get(&before)?, before))).collect();
        if quirks.ignores_order_of_segments {
            before.retain(|_| *here > 0);
        } else {
            before.retain(|(segment, before)| segment <= here && *before != lane);
            // The sort is stable.
            before.sort_by_key(|(segment, _)| std::cmp::Reverse(*segment));
        }
        before.into_iter().map(|(_, before)| before).collect()
    }

    /// Returns the first lanelet of the route that follows on the map, except the lanelet at its start (W22).
    fn next_on_map(&self, road: &LaneNetwork, lane: LaneId) -> Option<LaneId> {
        let first = self.first_preferred();
        let follows = |next: &&LaneId| self.contains(**next) && Some(**next) != first;
        road.followers(lane).iter().find(follows).filter(|_| !self.ends_with(lane)).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compat::DeciderCompat;
    use lanelet2_map::geometry::Point;
    use lanelet2_map::lane_network::Lanelet;

    fn route(lanes: &[LaneId]) -> Result<Route, RouteError> {
        let segments = lanes.iter().map(|lane| Segment { preferred: *lane, lanes: vec![*lane] });
        Route::new(7, Pose::default(), segments.collect())
    }

    #[test]
    fn a_loop_ends_where_the_route_ends() {
        let lane = |id, follower| Lanelet { id, followers: vec![follower], ..Lanelet::default() };
        let road = LaneNetwork::new([lane(1, 2), lane(2, 3), lane(3, 1)], Vec::new());
        let circle = route(&[1, 2, 3]).unwrap();
        let short = route(&[1, 2]).unwrap();
        for quirks in DeciderCompat::ALL.map(DeciderQuirks::of) {
            assert_eq!([1, 2, 3].map(|lane| circle.next(&road, lane, quirks)), [Some(2), Some(3), None]);
            let before = |lane| circle.previous(&road, lane, quirks);
            assert_eq!([before(1), before(2)], [vec![], vec![1]]);
            assert_eq!(short.next(&road, 2, quirks), None, "the follower is not on the route");
        }
    }

    /// Onto a block at 5, once around it, and off before the way in, whatever the ids of the way in and of
    /// the last side.
    #[test]
    fn a_route_that_rejoins_itself_goes_by_its_segments() {
        for (way_in, last_side) in [(1, 8), (8, 1)] {
            let lane = |id, followers: &[LaneId]| Lanelet {
                id,
                followers: followers.to_vec(),
                ..Lanelet::default()
            };
            let lanes = [
                lane(way_in, &[5]),
                lane(5, &[6]),
                lane(6, &[7, 9]),
                lane(7, &[last_side]),
                lane(last_side, &[5]),
            ];
            let road = LaneNetwork::new(lanes, Vec::new());
            let block = route(&[way_in, 5, 6, 7, last_side]).unwrap();
            let improved = DeciderQuirks::of(DeciderCompat::Improved);
            assert_eq!(block.previous(&road, 5, improved), [way_in], "not the side that closes the block");
            assert_eq!(block.next(&road, last_side, improved), None, "its goal is before the joint");
            assert_eq!(block.next(&road, 6, improved), Some(7));
            let upstream = DeciderQuirks::of(DeciderCompat::Upstream);
            assert_eq!(block.previous(&road, 5, upstream), [way_in, last_side], "as on the map");
        }
    }

    #[test]
    fn what_is_around_a_lanelet_is_what_little_lies_between() {
        let lane = |id: LaneId, length_m| Lanelet {
            id,
            centerline: vec![Point::new(0.0, 0.0), Point::new(length_m, 0.0)],
            ..Lanelet::default()
        };
        let lengths_m = [5.0, 30.0, 4.0, 15.0, 2.0, 2.0, 40.0, 1.0];
        let road =
            LaneNetwork::new((1..).zip(lengths_m).map(|(id, length_m)| lane(id, length_m)), Vec::new());
        let order = [3, 1, 8, 2, 6, 4, 5, 7];
        let route = route(&order).unwrap();
        let between_m = |one: LaneId, other: LaneId| -> f64 {
            let at = |lane| order.iter().position(|id| *id == lane).unwrap();
            let (one, other) = (at(one).min(at(other)), at(one).max(at(other)));
            let between = order[..other].iter().skip(one + 1);
            between.map(|lane| road.lane(*lane).unwrap().length_m()).sum()
        };
        for within_m in [0.0, 3.0, 20.0, 21.0, 100.0] {
            for lane in 1..=8 {
                let is_around = |other: &LaneId| between_m(lane, *other) < within_m || lane == *other;
                let expected: Vec<LaneId> = (1..=8).filter(is_around).collect();
                assert_eq!(route.around(&road, lane, within_m), expected, "{lane} within {within_m} m");
            }
        }
        assert!(route.around(&road, 9, 20.0).is_empty());
    }

    #[test]
    fn bad_routes_are_refused() {
        assert_eq!(route(&[]), Err(RouteError::Empty));
        let twice = route(&[4, 5, 4]);
        assert_eq!(twice, Err(RouteError::Repeated(4)));
    }
}
