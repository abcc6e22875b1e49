//! The rule for a vehicle that stands next to a turn with the signal of a manoeuvre on
//! (docs/spec/turn-signal-decider.md, "Stop rule"). Upstream meant to switch it off; the remaining effect is
//! that plain lanelets enter the queue of turns.

use crate::decision_context::DecisionContext;
use crate::side::Side;
use lanelet2_map::geometry::polyline::nearest;
use lanelet2_map::lane_network::{LaneId, Lanelet, TurnDirection};

/// Returns whether the vehicle stands near or inside a turn to `side`.
pub(super) fn stands_at_turn(context: &DecisionContext<'_>, lanes: &[LaneId], side: Side) -> bool {
    let direction = side.choose(TurnDirection::Left, TurnDirection::Right);
    context.stands() && (is_near(context, lanes, direction) || is_inside(context, lanes, direction))
}

fn is_near(context: &DecisionContext<'_>, lanes: &[LaneId], direction: TurnDirection) -> bool {
    let Some(current) = context.road.closest(lanes.iter().copied(), context.ego()) else { return false };
    let done_m = nearest(&current.centerline, context.ego().position).map_or(0.0, |nearest| nearest.arc_m);
    let mut distance_m = -done_m;
    for id in lanes.iter().skip_while(|id| **id != current.id) {
        distance_m += context.road.lane(*id).map_or(0.0, Lanelet::length_m);
        let turns = |next: &LaneId| turns(context, *next, direction);
        if context.road.followers(*id).iter().any(turns) {
            return distance_m < context.parameters.minimum_search_distance_m;
        }
    }
    false
}

fn is_inside(context: &DecisionContext<'_>, lanes: &[LaneId], direction: TurnDirection) -> bool {
    let Some(current) = context.road.closest(lanes.iter().copied(), context.ego()) else { return false };
    let holds = |before: &LaneId| {
        turns(context, *before, direction)
            && context.road.lane(*before).is_some_and(|lane| lane.contains(context.ego().position))
    };
    context.road.predecessors(current.id).iter().any(holds)
}

fn turns(context: &DecisionContext<'_>, lane: LaneId, direction: TurnDirection) -> bool {
    context.road.lane(lane).is_some_and(|lane| lane.turn_direction == direction)
}
