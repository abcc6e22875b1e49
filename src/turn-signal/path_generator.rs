//! The smaller decider in upstream's core path generator: turn lanelets only
//! (docs/spec/turn-signal-decider.md, "Path generator").

use std::collections::BTreeSet;

use derive_more::Display;

use super::compat::DeciderQuirks;
use super::parameters::DeciderParameters;
use super::planner_input::Odometry;
use super::route::Route;
use crate::light_command::TurnCommand;
use lanelet2_map::geometry::polyline::nearest;
use lanelet2_map::geometry::required_end::first_aligned;
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet, TurnDirection};

/// The lanelet whose tag `turn_direction` decided, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Display)]
pub enum TaggedLanelet {
    /// No tagged lanelet on the path from the vehicle on: no command.
    #[display("no tagged lanelet")]
    None,
    /// The vehicle is in this lanelet, not past its aligned start.
    #[display("in lanelet {_0}")]
    Own(LaneId),
    /// The first tagged lanelet ahead, within the search distance.
    #[display("lanelet {_0} ahead")]
    Ahead(LaneId),
    /// The first tagged lanelet ahead, beyond the search distance: no command.
    #[display("lanelet {_0} is too far ahead")]
    TooFar(LaneId),
    /// The vehicle is in this lanelet, past its aligned start, and no tagged lanelet is ahead: its tag still
    /// counts.
    #[display("in lanelet {_0}, past its aligned start")]
    PastEnd(LaneId),
}

/// Returns the command for a vehicle on a path through `lanes`, with its front `front_m` metres ahead of its
/// rear axle, and the lanelet that decided.
pub fn decide(
    (road, route, quirks): (&LaneNetwork, &Route, DeciderQuirks),
    lanes: &[LaneId],
    odometry: Odometry,
    front_m: f64,
    parameters: &DeciderParameters,
) -> (TurnCommand, TaggedLanelet) {
    let mut met = BTreeSet::new();
    let mut ahead = lanes
        .iter()
        .filter(|id| met.insert(**id) && route.next(road, **id, quirks).is_some())
        .filter_map(|id| road.lane(*id))
        .skip_while(|lane| !lane.contains(odometry.pose.position));
    let Some(own) = ahead.next() else { return (TurnCommand::NoCommand, TaggedLanelet::None) };
    let along_m = nearest(&own.centerline, odometry.pose.position).map_or(0.0, |nearest| nearest.arc_m);
    let own_command = command(own);
    if own_command != TurnCommand::NoCommand && along_m <= aligned_start_m(own, parameters) {
        return (own_command, TaggedLanelet::Own(own.id));
    }
    let mut gap_m = own.length_m() - along_m - front_m;
    for lane in ahead {
        let command = command(lane);
        if command != TurnCommand::NoCommand {
            let search_m = lane
                .turn_signal_distance_m
                .unwrap_or_else(|| parameters.intersection_search_m(odometry.speed_mps));
            return if gap_m > search_m {
                (TurnCommand::NoCommand, TaggedLanelet::TooFar(lane.id))
            } else {
                (command, TaggedLanelet::Ahead(lane.id))
            };
        }
        gap_m += lane.length_m();
    }
    let tagged = if own_command == TurnCommand::NoCommand {
        TaggedLanelet::None
    } else {
        TaggedLanelet::PastEnd(own.id)
    };
    (own_command, tagged)
}

fn command(lane: &Lanelet) -> TurnCommand {
    match lane.turn_direction {
        TurnDirection::None => TurnCommand::NoCommand,
        TurnDirection::Straight => TurnCommand::Disable,
        TurnDirection::Left => TurnCommand::Left,
        TurnDirection::Right => TurnCommand::Right,
    }
}

fn aligned_start_m(lane: &Lanelet, parameters: &DeciderParameters) -> f64 {
    let start = first_aligned(&lane.centerline, parameters.intersection_angle_threshold_deg);
    start.and_then(|start| nearest(&lane.centerline, start.position)).map_or(0.0, |nearest| nearest.arc_m)
}
