//! The rule for a vehicle that stands next to a turn with the signal of a manoeuvre on (3.1.2). Upstream
//! meant to switch it off; what is left of it is that plain lanelets stand in the queue of turns.

use crate::core::turn_signal::geometry::polyline::nearest;
use crate::core::turn_signal::road::{Lane, LaneId, TurnDirection};
use crate::core::turn_signal::scene::Scene;
use crate::core::turn_signal::signal::Side;

/// The vehicle stands near or inside a turn to this side.
pub(super) fn stands_at_turn(scene: &Scene<'_>, lanes: &[LaneId], side: Side) -> bool {
    let direction = match side {
        Side::Left => TurnDirection::Left,
        Side::Right => TurnDirection::Right,
    };
    scene.stands() && (is_near(scene, lanes, direction) || is_inside(scene, lanes, direction))
}

fn is_near(scene: &Scene<'_>, lanes: &[LaneId], direction: TurnDirection) -> bool {
    let Some(current) = scene.road.closest(lanes.iter().copied(), scene.ego()) else { return false };
    let done_m = nearest(&current.centerline, scene.ego().position).map_or(0.0, |foot| foot.arc_m);
    let mut distance_m = -done_m;
    for id in lanes.iter().skip_while(|id| **id != current.id) {
        distance_m += scene.road.lane(*id).map_or(0.0, Lane::length_m);
        let turns = |next: &LaneId| turns(scene, *next, direction);
        if scene.road.followers(*id).iter().any(turns) {
            return distance_m < scene.parameters.minimum_search_distance_m;
        }
    }
    false
}

fn is_inside(scene: &Scene<'_>, lanes: &[LaneId], direction: TurnDirection) -> bool {
    let Some(current) = scene.road.closest(lanes.iter().copied(), scene.ego()) else { return false };
    let holds = |before: &LaneId| {
        turns(scene, *before, direction)
            && scene.road.lane(*before).is_some_and(|lane| lane.contains(scene.ego().position))
    };
    scene.road.predecessors(current.id).iter().any(holds)
}

fn turns(scene: &Scene<'_>, lane: LaneId, direction: TurnDirection) -> bool {
    scene.road.lane(lane).is_some_and(|lane| lane.turn_direction == direction)
}
