//! Builds lane changes from planning factors, which have side, start and end. The planner is executing a lane
//! change when its planned path crosses a bound; the crossing is exact to the spacing of the path. The length
//! that the planner reserves for a lane change before the lane ends is not published; the length of the
//! change is used instead.

use super::factor::{Behavior, FactorContext, FactorInterval};
use super::path_offsets::{PathOffsets, crossing};
use crate::inputs::FactorFlaw;
use crate::manoeuvre::Manoeuvre;
use crate::manoeuvre::lane_change::{LaneChange, LaneChangePhase};
use crate::planner_input::{FactorTopic, PlanningFactor};
use crate::side::Side;

pub(super) fn sideways(
    context: &FactorContext<'_>,
    path_offsets: Option<&PathOffsets>,
    topic: FactorTopic,
    factor: &PlanningFactor,
) -> Result<Option<Manoeuvre>, FactorFlaw> {
    if factor.is_about_speed() {
        return Ok(None);
    }
    let interval = factor.interval()?;
    let side = side(topic, factor, &interval).ok_or(FactorFlaw::NoSide)?;
    let crossing = path_offsets.zip(context.path).and_then(|(path_offsets, path)| {
        let index = |pose| path_offsets.nearest_index(pose);
        crossing(context.road, path, index(interval.start.pose)..=index(interval.end.pose))
    });
    let phase = match (crossing, topic) {
        (Some(_), _) => LaneChangePhase::Running,
        // A waiting lane change of this kind is not signalled.
        (None, FactorTopic::AvoidanceByLaneChange) => LaneChangePhase::Unsignalled,
        (None, _) => LaneChangePhase::Waiting,
    };
    Ok(Some(Manoeuvre::LaneChange(LaneChange {
        side,
        phase,
        start: Some(interval.start.pose),
        crossing,
        end: Some(interval.end.pose),
        previous_path: path_offsets.map(|path_offsets| path_offsets.poses.clone()).unwrap_or_default(),
        minimum_length_m: interval.start.pose.position.distance_m(interval.end.pose.position),
    })))
}

/// Returns the side from the factor, or else from its module's name, or else from its offsets.
fn side(topic: FactorTopic, factor: &PlanningFactor, interval: &FactorInterval) -> Option<Side> {
    let named = match factor.known_behavior() {
        Behavior::ShiftLeft => Some(Side::Left),
        Behavior::ShiftRight => Some(Side::Right),
        Behavior::SlowDown | Behavior::Stop | Behavior::Other => None,
    };
    let by_name = || match topic {
        FactorTopic::LaneChangeLeft | FactorTopic::ExternalRequestLaneChangeLeft => Some(Side::Left),
        FactorTopic::LaneChangeRight | FactorTopic::ExternalRequestLaneChangeRight => Some(Side::Right),
        FactorTopic::AvoidanceByLaneChange
        | FactorTopic::StartPlanner
        | FactorTopic::StaticObstacleAvoidance
        | FactorTopic::GoalPlanner => None,
    };
    let by_offset = || match interval.shift_m() {
        shift_m if shift_m > 0.0 => Some(Side::Left),
        shift_m if shift_m < 0.0 => Some(Side::Right),
        _ => None,
    };
    named.or_else(by_name).or_else(by_offset)
}
