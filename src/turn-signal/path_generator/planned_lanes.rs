//! The path of upstream's path generator, as lanelets (docs/spec/turn-signal-decider.md, "Path generator").

use std::collections::BTreeSet;

use crate::distance_path::{arc_m, walk, within};
use crate::route::Route;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::path::NearestLimits;
use lanelet2_map::lane_network::{LaneId, LaneNetwork};

/// How far the path reaches back from the vehicle, metres.
const BACKWARD_M: f64 = 5.0;
/// How far the path reaches ahead, metres.
const FORWARD_M: f64 = 300.0;
/// How far along the route from its previous place the vehicle is searched for, metres.
const SEARCH_M: f64 = 100.0;

/// The place of the vehicle in one cycle, which the next cycle starts from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaceOnRoute {
    /// Where the rear axle is.
    pub pose: Pose,
    /// The lanelet it is assigned to.
    pub lane: LaneId,
}

/// A walk along a graph, backwards or forwards.
struct Walk<'a> {
    road: &'a LaneNetwork,
    route: &'a Route,
    /// Beyond the ends of the route, the walk goes on along the map.
    leaves_route: bool,
}

impl PlaceOnRoute {
    /// Returns the place of a vehicle at `ego`, after the place `before`; the nearest place on the route
    /// without one. `None` if no lanelet is left.
    pub fn new(
        (road, route): (&LaneNetwork, &Route),
        before: Option<Self>,
        ego: Pose,
        limits: NearestLimits,
    ) -> Option<Self> {
        let first = || Some(Self { pose: ego, lane: road.closest(route.lanes(), ego)?.id });
        let before = before.or_else(first)?;
        let walk = Walk { road, route, leaves_route: false };
        let around = walk.around(before, [SEARCH_M; 2]);
        let near = road.closest_within(around.iter().copied(), ego, limits);
        let lane = near.or_else(|| road.closest(around.iter().copied(), ego))?;
        Some(Self { pose: ego, lane: lane.id })
    }

    /// Returns the lanelets of the path that upstream plans here, in order.
    pub fn planned(self, (road, route): (&LaneNetwork, &Route), front_m: f64) -> Vec<LaneId> {
        let walk = Walk { road, route, leaves_route: true };
        let mut lanes = walk.around(self, [BACKWARD_M + front_m, FORWARD_M + front_m]);
        let mut ego_m = road.lane(self.lane).map_or(0.0, |lane| arc_m(&lane.centerline, self.pose));
        let (mut to_m, mut start_m, mut is_seen) = (ego_m + FORWARD_M, 0.0, false);
        for (at, id) in lanes.iter().enumerate() {
            let Some(lane) = road.lane(*id) else { continue };
            if *id == self.lane {
                (ego_m, to_m, is_seen) = (ego_m + start_m, to_m + start_m, true);
            }
            if let Some(goal) = route.goal().filter(|_| route.last_preferred() == Some(*id)) {
                to_m = to_m.min(start_m + arc_m(&lane.centerline, goal));
            }
            start_m += lane.length_m();
            if is_seen && start_m >= to_m + front_m {
                lanes.truncate(at + 1);
                break;
            }
            if is_seen && at + 1 == lanes.len() {
                to_m = to_m.min(start_m - front_m);
            }
        }
        within(road, &lanes, ego_m - BACKWARD_M, to_m).into_iter().map(|(id, _)| id).collect()
    }
}

impl Walk<'_> {
    /// Returns the lanelets from `backward_m` behind to `forward_m` ahead of a place. A lanelet that is met
    /// again ends the walk; the one of the place itself is met twice where the way back leads around to it.
    fn around(&self, place: PlaceOnRoute, [backward_m, forward_m]: [f64; 2]) -> Vec<LaneId> {
        let Some(lane) = self.road.lane(place.lane) else { return Vec::new() };
        let along_m = arc_m(&lane.centerline, place.pose);
        let rest_m = lane.length_m() - along_m;
        let step = |id: LaneId, next: &[LaneId]| {
            let on_map = next.first().copied().filter(|_| self.leaves_route);
            self.route.first_in_graph(next).filter(|_| self.route.contains(id)).or(on_map)
        };
        let previous = |id: LaneId, _: &BTreeSet<LaneId>| step(id, self.road.predecessors(id));
        let next = |id: LaneId, _: &BTreeSet<LaneId>| step(id, self.road.followers(id));
        let mut visited = BTreeSet::new();
        let mut lanes = walk(self.road, lane.id, backward_m - along_m, &mut visited, previous);
        lanes.reverse();
        lanes.push(lane.id);
        visited.insert(lane.id);
        lanes.extend(walk(self.road, lane.id, forward_m - rest_m, &mut visited, next));
        lanes
    }
}
