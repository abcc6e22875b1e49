//! Inputs of the decider of turn signals from messages of Autoware's planning and localisation.

use super::autoware_adapi_v1_msgs::OperationModeState;
use super::autoware_internal_planning_msgs::{PathPointWithLaneId, PathWithLaneId, Scenario};
use super::autoware_planning_msgs::PoseWithUuidStamped;
use super::nav_msgs::Odometry;
use crate::core::turn_signal::planner_input::{self, OperationMode, PlannerInput};

impl From<Odometry> for PlannerInput {
    fn from(message: Odometry) -> Self {
        let (pose, speed_mps) = (message.pose.pose.into(), message.twist.twist.linear.x);
        let odometry = planner_input::Odometry { pose, speed_mps };
        Self::Odometry { odometry, stamp: message.header.stamp.into() }
    }
}

impl From<OperationModeState> for PlannerInput {
    fn from(message: OperationModeState) -> Self {
        Self::OperationMode(OperationMode {
            mode: message.mode,
            is_autoware_control_enabled: message.is_autoware_control_enabled,
            is_in_transition: message.is_in_transition,
        })
    }
}

impl From<PathWithLaneId> for PlannerInput {
    fn from(message: PathWithLaneId) -> Self {
        let point = |PathPointWithLaneId { point, lane_ids }| planner_input::PlannedPathPoint {
            pose: point.pose.into(),
            speed_mps: point.longitudinal_velocity_mps.into(),
            lanes: lane_ids,
        };
        Self::PlannedPath(message.points.into_iter().map(point).collect())
    }
}

impl From<PoseWithUuidStamped> for PlannerInput {
    fn from(message: PoseWithUuidStamped) -> Self {
        Self::ModifiedGoal { route: u128::from_be_bytes(message.uuid.uuid), goal: message.pose.into() }
    }
}

impl From<Scenario> for PlannerInput {
    fn from(message: Scenario) -> Self {
        Self::LaneDriving(message.current_scenario == Scenario::LANEDRIVING)
    }
}
