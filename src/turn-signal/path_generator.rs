//! The smaller decider in upstream's core path generator: turn lanelets only
//! (docs/spec/turn-signal-decider.md, "Path generator").

use std::collections::BTreeSet;

use derive_more::Display;

use super::distance_path::arc_m;
use super::parameters::DeciderParameters;
use super::planner_input::Odometry;
use super::route::Route;
use crate::light_command::TurnCommand;
use lanelet2_map::geometry::required_end::first_aligned;
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet, TurnDirection};

pub mod planned_lanes;

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
    /// The vehicle is in this lanelet, past its aligned start or without one, and no tagged lanelet is ahead:
    /// its tag still counts.
    #[display("in lanelet {_0}, past its aligned start")]
    PastEnd(LaneId),
}

/// Returns the command for a vehicle on a path through `lanes`, with its front `front_m` metres ahead of its
/// rear axle, and the lanelet that decided.
pub fn decide(
    (road, route): (&LaneNetwork, &Route),
    lanes: &[LaneId],
    odometry: Odometry,
    front_m: f64,
    parameters: &DeciderParameters,
) -> (TurnCommand, TaggedLanelet) {
    let mut met = BTreeSet::new();
    let searched = lanes.iter().filter(|id| met.insert(**id) && route.goes_on_after(road, **id));
    let mut behind = (TurnCommand::NoCommand, TaggedLanelet::None);
    // From the front to the start of the next lanelet, metres; `None` before the vehicle's lanelet.
    let mut gap_m: Option<f64> = None;
    for lane in searched.filter_map(|id| road.lane(*id)) {
        let command = command(lane);
        let is_tagged = command != TurnCommand::NoCommand;
        if let Some(before_m) = gap_m {
            let search_m = lane
                .turn_signal_distance_m
                .unwrap_or_else(|| parameters.intersection_search_m(odometry.speed_mps));
            if is_tagged && before_m > search_m {
                return (TurnCommand::NoCommand, TaggedLanelet::TooFar(lane.id));
            }
            if is_tagged {
                return (command, TaggedLanelet::Ahead(lane.id));
            }
            gap_m = Some(before_m + lane.length_m());
        } else if lane.contains(odometry.pose.position) {
            let along_m = arc_m(&lane.centerline, odometry.pose);
            if is_tagged {
                behind = (command, TaggedLanelet::PastEnd(lane.id));
                // Without an aligned start, the vehicle counts as not yet in a lanelet of its path.
                let Some(start_m) = aligned_start_m(lane, parameters) else { continue };
                if along_m <= start_m {
                    return (command, TaggedLanelet::Own(lane.id));
                }
            }
            gap_m = Some(lane.length_m() - along_m - front_m);
        }
    }
    behind
}

fn command(lane: &Lanelet) -> TurnCommand {
    match lane.turn_direction {
        TurnDirection::None => TurnCommand::NoCommand,
        TurnDirection::Straight => TurnCommand::Disable,
        TurnDirection::Left => TurnCommand::Left,
        TurnDirection::Right => TurnCommand::Right,
    }
}

/// Returns the place of the aligned start on the centreline, metres; `None` if there is none.
fn aligned_start_m(lane: &Lanelet, parameters: &DeciderParameters) -> Option<f64> {
    let start = first_aligned(&lane.centerline, parameters.intersection_angle_threshold_deg)?;
    Some(arc_m(&lane.centerline, start))
}
