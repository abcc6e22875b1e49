//! The route: ordered segments of lanelets, and who comes next within them
//! (docs/spec/turn-signal-decider.md, "Neighbours within the route").

use std::collections::BTreeSet;

use thiserror::Error;

use crate::core::map::geometry::Pose;
use crate::core::map::lane_network::{Lane, LaneId, LaneNetwork};

/// Side by side lanelets of a route.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Segment {
    /// The one that the route prefers.
    pub preferred: LaneId,
    /// All of them, the preferred one included; areas left out.
    pub lanes: Vec<LaneId>,
}

/// A route of the mission planner.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    id: u128,
    start: Pose,
    segments: Vec<Segment>,
    lanes: BTreeSet<LaneId>,
}

/// A reason for which a route is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum RouteError {
    /// A route without lanelets.
    #[error("the route has no lanelet")]
    Empty,
    /// A lanelet that is listed twice; upstream refuses it as well.
    #[error("the route lists lanelet {lane} twice")]
    Repeated {
        /// Id of the lanelet.
        lane: LaneId,
    },
    /// A route of another map.
    #[error("lanelet {lane} of the route is not on the map")]
    Unknown {
        /// Id of the lanelet.
        lane: LaneId,
    },
    /// A start that is not a pose.
    #[error("the start of the route is not a number")]
    StartNotFinite,
}

impl Route {
    /// A route with the id (`uuid`) and start pose of its message.
    pub fn new(id: u128, start: Pose, segments: Vec<Segment>) -> Result<Self, RouteError> {
        let mut lanes = BTreeSet::new();
        for lane in segments.iter().flat_map(|segment| &segment.lanes) {
            if !lanes.insert(*lane) {
                return Err(RouteError::Repeated { lane: *lane });
            }
        }
        if lanes.is_empty() {
            return Err(RouteError::Empty);
        }
        Ok(Self { id, start, segments, lanes })
    }

    /// Returns the route if it can be driven on this road.
    ///
    /// # Errors
    /// A lanelet that is not there, or a start that is not a pose.
    pub fn checked(self, road: &LaneNetwork) -> Result<Self, RouteError> {
        if !self.start.is_finite() {
            return Err(RouteError::StartNotFinite);
        }
        let unknown = self.lanes().find(|lane| road.lane(*lane).is_none());
        match unknown {
            Some(lane) => Err(RouteError::Unknown { lane }),
            None => Ok(self),
        }
    }

    /// Its id; another one means another route.
    pub fn id(&self) -> u128 {
        self.id
    }

    /// Pose at its start.
    pub fn start(&self) -> Pose {
        self.start
    }

    /// Its segments, in order.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// All lanelets, ascending.
    pub fn lanes(&self) -> impl Iterator<Item = LaneId> + '_ {
        self.lanes.iter().copied()
    }

    /// Returns whether a lanelet is on the route.
    pub fn contains(&self, lane: LaneId) -> bool {
        self.lanes.contains(&lane)
    }

    /// Returns whether a lanelet is in the last segment.
    pub fn ends_with(&self, lane: LaneId) -> bool {
        self.segments.last().is_some_and(|segment| segment.lanes.contains(&lane))
    }

    /// Length of the preferred lanelets between two lanelets of the route, without their own, metres; `None` when one of them
    /// is not on it.
    pub fn between_m(&self, road: &LaneNetwork, one: LaneId, other: LaneId) -> Option<f64> {
        let segment = |lane: LaneId| self.segments.iter().position(|segment| segment.lanes.contains(&lane));
        let (one, other) = (segment(one)?, segment(other)?);
        let between = self.segments.iter().take(one.max(other)).skip(one.min(other) + 1);
        Some(between.filter_map(|segment| road.lane(segment.preferred)).map(Lane::length_m).sum())
    }

    /// The lanelet after this one; none after the last segment.
    pub fn next(&self, road: &LaneNetwork, lane: LaneId) -> Option<LaneId> {
        let first = self.segments.first().map(|segment| segment.preferred);
        let goes_on = |next: &&LaneId| self.contains(**next) && Some(**next) != first;
        road.followers(lane).iter().find(goes_on).filter(|_| !self.ends_with(lane)).copied()
    }

    /// The lanelets before this one; none before the first segment.
    pub fn previous<'a>(&'a self, road: &'a LaneNetwork, lane: LaneId) -> impl Iterator<Item = LaneId> + 'a {
        let starts = self.segments.first().is_some_and(|segment| segment.lanes.contains(&lane));
        let before = if starts { &[] } else { road.predecessors(lane) };
        before.iter().copied().filter(|before| self.contains(*before))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::map::lane_network::Lane;

    fn route(lanes: &[LaneId]) -> Result<Route, RouteError> {
        let segments = lanes.iter().map(|lane| Segment { preferred: *lane, lanes: vec![*lane] });
        Route::new(7, Pose::default(), segments.collect())
    }

    #[test]
    fn a_loop_ends_where_the_route_ends() {
        let lane = |id, follower| Lane { id, followers: vec![follower], ..Lane::default() };
        let road = LaneNetwork::new([lane(1, 2), lane(2, 3), lane(3, 1)], Vec::new());
        let circle = route(&[1, 2, 3]).unwrap();
        assert_eq!([1, 2, 3].map(|lane| circle.next(&road, lane)), [Some(2), Some(3), None]);
        let before = |lane| circle.previous(&road, lane).collect::<Vec<_>>();
        assert_eq!([before(1), before(2)], [vec![], vec![1]]);
        let short = route(&[1, 2]).unwrap();
        assert_eq!(short.next(&road, 2), None, "the follower is not on the route");
    }

    #[test]
    fn bad_routes_are_refused() {
        assert_eq!(route(&[]), Err(RouteError::Empty));
        let twice = route(&[4, 5, 4]);
        assert_eq!(twice, Err(RouteError::Repeated { lane: 4 }));
    }
}
