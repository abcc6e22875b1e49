//! Chooses routes from all over a map, or only routes that meet themselves.

use std::collections::BTreeSet;
use std::iter::successors;

use lanelet2_map::geometry::Point;
use lanelet2_map::geometry::polyline::{arc_lengths_m, at_arc, without_repeats};
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet};

/// Limits of a route: length in metres, and number of lanelets.
const ROUTE_M: f64 = 500.0;
const MAX_LANES: usize = 60;
/// Limits of a route that is to meet itself.
const LOOP_M: f64 = 1500.0;
const MAX_LOOP_LANES: usize = 200;
/// Number of candidate routes per requested route that meets itself.
const TRIES: usize = 100;
/// A route meets itself if it comes this close to a part of itself that lies so far behind, metres.
const NEAR_M: f64 = 10.0;
const LEFT_BEHIND_M: f64 = 50.0;
const STEP_M: f64 = 4.0;

/// The routes of a survey.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RouteChoice {
    /// This many routes from all over the map.
    Any(usize),
    /// At most this many different routes that meet themselves: they come near an earlier part of themselves,
    /// or their last lanelet leads to one of their lanelets.
    Loops(usize),
}

impl RouteChoice {
    /// Returns the routes deterministically: consecutive lanelets, none twice.
    pub(super) fn routes(self, road: &LaneNetwork) -> Vec<Vec<LaneId>> {
        match self {
            Self::Any(count) => routes(road, ROUTE_M, MAX_LANES).take(count).collect(),
            Self::Loops(count) => {
                let mut known = BTreeSet::new();
                let is_new = |lanes: &Vec<_>| known.insert(lanes.clone()) && meets_itself(road, lanes);
                let tried = routes(road, LOOP_M, MAX_LOOP_LANES).take(count.saturating_mul(TRIES));
                tried.filter(is_new).take(count).collect()
            }
        }
    }
}

/// Returns endless routes; none on a map without lanelets.
fn routes(road: &LaneNetwork, max_route_m: f64, max_lanes: usize) -> impl Iterator<Item = Vec<LaneId>> + '_ {
    let starts: Vec<LaneId> = road.lanes().map(|lane| lane.id).collect();
    // Knuth's generator: the choice is arbitrary but reproducible.
    let mut state: u64 = 1;
    let mut next = move |count: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let count = u64::try_from(count).unwrap_or(u64::MAX).max(1);
        usize::try_from((state >> 33) % count).unwrap_or_default()
    };
    std::iter::repeat_with(move || {
        let mut lanes: Vec<LaneId> = starts.get(next(starts.len())).copied().into_iter().collect();
        let mut route_m = 0.0;
        while let Some(last) =
            lanes.last().copied().filter(|_| route_m < max_route_m && lanes.len() < max_lanes)
        {
            route_m += road.lane(last).map_or(0.0, Lanelet::length_m);
            let followers = road.followers(last);
            match followers.get(next(followers.len())) {
                Some(lane) if !lanes.contains(lane) => lanes.push(*lane),
                _ => break,
            }
        }
        lanes
    })
    .take_while({
        let is_empty = road.lanes().next().is_none();
        move |_| !is_empty
    })
}

fn meets_itself(road: &LaneNetwork, lanes: &[LaneId]) -> bool {
    let leads_back =
        lanes.last().is_some_and(|last| road.followers(*last).iter().any(|next| lanes.contains(next)));
    leads_back || comes_near_itself(road, lanes)
}

fn comes_near_itself(road: &LaneNetwork, lanes: &[LaneId]) -> bool {
    let centerlines = lanes.iter().filter_map(|id| road.lane(*id)).flat_map(|lane| &lane.centerline);
    let line = without_repeats(&centerlines.copied().collect::<Vec<Point>>());
    let length_m = arc_lengths_m(&line).last().copied().unwrap_or_default();
    let arcs_m = successors(Some(0.0), |at_m| Some(at_m + STEP_M)).take_while(|at_m| *at_m <= length_m);
    let places: Vec<(f64, Point)> = arcs_m.filter_map(|at_m| Some((at_m, at_arc(&line, at_m)?))).collect();
    places.iter().any(|(at_m, place)| {
        let mut earlier = places.iter().take_while(|(before_m, _)| at_m - before_m >= LEFT_BEHIND_M);
        earlier.any(|(_, before)| before.distance_m(*place) < NEAR_M)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lanelet's line and its followers.
    type Drawn<'a> = (&'a [(f64, f64)], &'a [LaneId]);

    /// Returns lanelets numbered from 1.
    fn network(lanes: &[Drawn<'_>]) -> LaneNetwork {
        let lane = |(id, (line, followers)): (LaneId, &Drawn<'_>)| Lanelet {
            id,
            centerline: line.iter().map(|(x_m, y_m)| Point::new(*x_m, *y_m)).collect(),
            followers: followers.to_vec(),
            ..Lanelet::default()
        };
        LaneNetwork::new((1..).zip(lanes).map(lane), Vec::new())
    }

    #[test]
    fn a_route_meets_itself_by_its_lanelets_or_in_the_plane() {
        let (out, back): (&[_], &[_]) = (&[(0.0, 0.0), (100.0, 0.0)], &[(100.0, 60.0), (100.0, -60.0)]);
        let around: &[_] = &[(100.0, 0.0), (160.0, 0.0), (160.0, 60.0), (100.0, 60.0)];
        let crossing = network(&[(out, &[2]), (around, &[3]), (back, &[])]);
        assert!(meets_itself(&crossing, &[1, 2, 3]));
        assert!(!meets_itself(&crossing, &[1, 2]) && !meets_itself(&crossing, &[]));
        let block = network(&[(out, &[2]), (around, &[1])]);
        assert!(meets_itself(&block, &[1, 2]));
        assert!(!meets_itself(&block, &[1]), "the lanelet after it is not on the route");
        assert_eq!(RouteChoice::Loops(9).routes(&block).len(), 2, "each once");
        assert_eq!(RouteChoice::Any(9).routes(&block).len(), 9);
        assert_eq!(RouteChoice::Any(9).routes(&network(&[])).len(), 0);
    }
}
