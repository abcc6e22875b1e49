//! Converts messages of Autoware's planning and localisation to inputs of the turn-signal decider.

use std::sync::Arc;

use super::geometry::plane_pose;
use ros_messages::autoware_adapi_v1_msgs::OperationModeState;
use ros_messages::autoware_internal_planning_msgs::{PathPointWithLaneId, PathWithLaneId, Scenario};
use ros_messages::autoware_planning_msgs::{
    LaneletPrimitive, LaneletRoute, LaneletSegment, PoseWithUuidStamped, Trajectory, TrajectoryPoint,
};
use ros_messages::nav_msgs::Odometry;
use turn_signal::planner_input::{self, OperationMode, PlannerInput, PlannerRoute};
use turn_signal::route::Segment;

/// Converts pose and speed.
pub fn odometry(message: &Odometry) -> PlannerInput {
    let (pose, speed_mps) = (plane_pose(message.pose.pose), message.twist.twist.linear.x);
    let odometry = planner_input::Odometry { pose, speed_mps };
    PlannerInput::Odometry { odometry, stamp: message.header.stamp.into() }
}

/// Converts the operation mode.
pub fn operation_mode(message: OperationModeState) -> PlannerInput {
    PlannerInput::OperationMode(OperationMode {
        mode: message.mode,
        is_autoware_control_enabled: message.is_autoware_control_enabled,
        is_in_transition: message.is_in_transition,
    })
}

/// Converts the path.
pub fn planned_path(message: PathWithLaneId) -> PlannerInput {
    let point = |PathPointWithLaneId { point, lane_ids }| planner_input::PlannedPathPoint {
        pose: plane_pose(point.pose),
        speed_mps: point.longitudinal_velocity_mps.into(),
        lanes: lane_ids,
    };
    PlannerInput::PlannedPath(message.points.into_iter().map(point).collect())
}

/// Converts the trajectory of a planner without planning factors.
pub fn trajectory(message: Trajectory) -> PlannerInput {
    let point = |point: TrajectoryPoint| planner_input::TrajectoryPoint {
        pose: plane_pose(point.pose),
        speed_mps: point.longitudinal_velocity_mps.into(),
    };
    PlannerInput::Trajectory(message.points.into_iter().map(point).collect())
}

/// Converts the goal as moved by the goal planner.
pub fn modified_goal(message: &PoseWithUuidStamped) -> PlannerInput {
    PlannerInput::ModifiedGoal {
        route: u128::from_be_bytes(message.uuid.uuid),
        goal: plane_pose(message.pose),
    }
}

/// Converts the planning scenario.
pub fn scenario(message: &Scenario) -> PlannerInput {
    PlannerInput::LaneDriving(message.current_scenario == Scenario::LANEDRIVING)
}

fn is_lanelet(primitive: &LaneletPrimitive) -> bool {
    primitive.primitive_type != "area"
}

/// Returns the lanelets of a segment; `None` if it has none. The first lanelet replaces a preferred area.
fn lanes(segment: &LaneletSegment) -> Option<Segment> {
    let lanelets = segment.primitives.iter().filter(|primitive| is_lanelet(primitive));
    let mut lanes: Vec<i64> = lanelets.map(|primitive| primitive.id).collect();
    let preferred = Some(&segment.preferred_primitive).filter(|primitive| is_lanelet(primitive));
    let preferred = preferred.map(|primitive| primitive.id).or_else(|| lanes.first().copied())?;
    if !lanes.contains(&preferred) {
        lanes.insert(0, preferred);
    }
    Some(Segment { preferred, lanes })
}

/// Converts the route.
pub fn route(message: &LaneletRoute) -> PlannerInput {
    PlannerInput::Route(Arc::new(PlannerRoute {
        id: u128::from_be_bytes(message.uuid.uuid),
        start: plane_pose(message.start_pose),
        goal: plane_pose(message.goal_pose),
        segments: message.segments.iter().filter_map(lanes).collect(),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(preferred: (i64, &str), primitives: &[(i64, &str)]) -> LaneletSegment {
        let primitive = |(id, kind): (i64, &str)| LaneletPrimitive { id, primitive_type: kind.to_owned() };
        LaneletSegment {
            preferred_primitive: primitive(preferred),
            primitives: primitives.iter().copied().map(primitive).collect(),
        }
    }

    #[test]
    fn segments_are_taken_without_their_areas() {
        let expected_lanes = |preferred, lanes: &[i64]| Some(Segment { preferred, lanes: lanes.to_vec() });
        let cases = [
            ("lanes", segment((2, "lane"), &[(1, "lane"), (2, "lane")]), expected_lanes(2, &[1, 2])),
            ("no types", segment((1, ""), &[(1, ""), (2, "")]), expected_lanes(1, &[1, 2])),
            ("not listed", segment((1, "lane"), &[(2, "lane")]), expected_lanes(1, &[1, 2])),
            ("no list", segment((1, "lane"), &[]), expected_lanes(1, &[1])),
            ("an area beside", segment((1, "lane"), &[(1, "lane"), (7, "area")]), expected_lanes(1, &[1])),
            ("an area preferred", segment((7, "area"), &[(7, "area"), (1, "lane")]), expected_lanes(1, &[1])),
            ("areas only", segment((7, "area"), &[(7, "area")]), None),
        ];
        for (name, segment, expected) in cases {
            assert_eq!(lanes(&segment), expected, "{name}");
        }
    }
}
