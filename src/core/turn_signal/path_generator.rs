//! The other, smaller decider upstream has, in its core path generator: turn lanelets only
//! (docs/spec/turn-signal-decider.md, "Path generator"). A second opinion on turns.

use std::collections::BTreeSet;

use super::geometry::polyline::nearest;
use super::geometry::required_end::first_aligned;
use super::lane_network::{Lane, LaneId, LaneNetwork, TurnDirection};
use super::parameters::Parameters;
use super::planner_input::Odometry;
use super::route::Route;
use super::signal::Signal;

/// The command for a vehicle on a path through `lanes`, front `front_m` before its rear axle.
pub fn decide(
    (road, route): (&LaneNetwork, &Route),
    lanes: &[LaneId],
    odometry: Odometry,
    front_m: f64,
    parameters: &Parameters,
) -> Signal {
    let mut seen = BTreeSet::new();
    let mut ahead = lanes
        .iter()
        .filter(|id| seen.insert(**id) && route.next(road, **id).is_some())
        .filter_map(|id| road.lane(*id))
        .skip_while(|lane| !lane.contains(odometry.pose.position));
    let Some(own) = ahead.next() else { return Signal::NoCommand };
    let along_m = nearest(&own.centerline, odometry.pose.position).map_or(0.0, |foot| foot.arc_m);
    let own_command = command(own);
    if own_command != Signal::NoCommand && along_m <= required_end_m(own, parameters) {
        return own_command;
    }
    let mut gap_m = own.length_m() - along_m - front_m;
    for lane in ahead {
        let command = command(lane);
        if command != Signal::NoCommand {
            let search_m = lane
                .turn_signal_distance_m
                .unwrap_or_else(|| parameters.intersection_search_m(odometry.speed_mps));
            return if gap_m > search_m { Signal::NoCommand } else { command };
        }
        gap_m += lane.length_m();
    }
    // Nothing follows: what the vehicle's own lanelet says still stands.
    own_command
}

fn command(lane: &Lane) -> Signal {
    match lane.turn_direction {
        TurnDirection::None => Signal::NoCommand,
        TurnDirection::Straight => Signal::Disable,
        TurnDirection::Left => Signal::Left,
        TurnDirection::Right => Signal::Right,
    }
}

fn required_end_m(lane: &Lane, parameters: &Parameters) -> f64 {
    let end = first_aligned(&lane.centerline, parameters.intersection_angle_threshold_deg);
    end.and_then(|end| nearest(&lane.centerline, end.position)).map_or(0.0, |foot| foot.arc_m)
}
