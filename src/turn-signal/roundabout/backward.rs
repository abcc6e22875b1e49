//! The length of the distance path behind a vehicle inside a roundabout, chosen so that the path still holds
//! the pose at which the entry came within range (docs/spec/turn-signal-decider.md, "Backward search").

use std::collections::BTreeSet;

use super::RoundaboutMemory;
use crate::compat::DeciderQuirks;
use crate::parameters::DeciderParameters;
use crate::route::Route;
use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet};

/// Returns the length of the distance path behind the vehicle, metres, when it is on the lanelet `current`.
///
/// In upstream's search, a remembered pose inside the entry itself, or met before the entry, adds nothing.
pub fn backward_length_m(
    (road, route): (&LaneNetwork, &Route),
    parameters: &DeciderParameters,
    memory: &RoundaboutMemory,
    current: LaneId,
    quirks: DeciderQuirks,
) -> f64 {
    let default_m = parameters.path_backward_length_m;
    let inside = road
        .roundabouts_of(current)
        .any(|element| element.internals.contains(&current) || element.exits.contains(&current));
    if !inside {
        return default_m;
    }
    let mut search = Search { road, route, memory, quirks, noted: BTreeSet::new(), longest_m: default_m };
    search.run(current, parameters.roundabout_backward_depth);
    search.longest_m
}

struct Search<'a> {
    road: &'a LaneNetwork,
    route: &'a Route,
    memory: &'a RoundaboutMemory,
    quirks: DeciderQuirks,
    /// Lanelets that contain a remembered pose.
    noted: BTreeSet<LaneId>,
    longest_m: f64,
}

impl Search<'_> {
    /// Searches depth first, over lanelets not visited before.
    fn run(&mut self, current: LaneId, most_depth: Option<u32>) {
        if !self.quirks.searches_back_by_entries {
            let poses: Vec<Pose> = self.memory.entries.values().copied().collect();
            self.noted = poses.into_iter().filter_map(|pose| self.route_lane_at(pose)).collect();
        }
        let mut visited = BTreeSet::from([current]);
        let mut pending = vec![(current, 0.0, 0_u32)];
        while let Some((lane, before_m, depth)) = pending.pop() {
            let reached_m = before_m + self.length_m(lane);
            if most_depth.is_some_and(|most| depth >= most) {
                continue;
            }
            for previous in self.route.previous(self.road, lane, self.quirks) {
                if !visited.insert(previous) {
                    continue;
                }
                let pose = self.memory.entries.get(&previous).copied().filter(|_| self.is_entry(previous));
                self.noted.extend(pose.and_then(|pose| self.route_lane_at(pose)));
                let counts = !self.quirks.searches_back_by_entries || !self.is_entry(previous);
                if counts && self.noted.contains(&previous) {
                    self.longest_m = self.longest_m.max(reached_m + self.length_m(previous));
                }
                pending.push((previous, reached_m, depth + 1));
            }
        }
    }

    fn route_lane_at(&self, pose: Pose) -> Option<LaneId> {
        self.road.closest(self.route.lanes(), pose).map(|lane| lane.id)
    }

    fn is_entry(&self, lane: LaneId) -> bool {
        self.road.roundabouts_of(lane).any(|element| element.entries.contains(&lane))
    }

    fn length_m(&self, lane: LaneId) -> f64 {
        self.road.lane(lane).map_or(0.0, Lanelet::length_m)
    }
}
