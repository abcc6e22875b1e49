//! Inputs of the decider of turn signals from messages of Autoware's planning and localisation.

use std::sync::Arc;

use super::autoware_adapi_v1_msgs::OperationModeState;
use super::autoware_internal_planning_msgs::{PathPointWithLaneId, PathWithLaneId, Scenario};
use super::autoware_planning_msgs::{
    LaneletPrimitive, LaneletRoute, LaneletSegment, PoseWithUuidStamped, Trajectory, TrajectoryPoint,
};
use super::nav_msgs::Odometry;
use turn_signal::planner_input::{self, OperationMode, PlannerInput, PlannerRoute};
use turn_signal::route::Segment;

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

impl From<Trajectory> for PlannerInput {
    fn from(message: Trajectory) -> Self {
        let point = |point: TrajectoryPoint| planner_input::TrajectoryPoint {
            pose: point.pose.into(),
            speed_mps: point.longitudinal_velocity_mps.into(),
        };
        Self::Trajectory(message.points.into_iter().map(point).collect())
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

impl LaneletPrimitive {
    fn is_lanelet(&self) -> bool {
        self.primitive_type != "area"
    }
}

impl LaneletSegment {
    /// Returns the lanelets of the segment; `None` without one. The first lanelet replaces a preferred area.
    fn lanes(&self) -> Option<Segment> {
        let lanelets = self.primitives.iter().filter(|primitive| primitive.is_lanelet());
        let mut lanes: Vec<i64> = lanelets.map(|primitive| primitive.id).collect();
        let preferred = Some(&self.preferred_primitive).filter(|primitive| primitive.is_lanelet());
        let preferred = preferred.map(|primitive| primitive.id).or_else(|| lanes.first().copied())?;
        if !lanes.contains(&preferred) {
            lanes.insert(0, preferred);
        }
        Some(Segment { preferred, lanes })
    }
}

impl From<LaneletRoute> for PlannerInput {
    fn from(message: LaneletRoute) -> Self {
        Self::Route(Arc::new(PlannerRoute {
            id: u128::from_be_bytes(message.uuid.uuid),
            start: message.start_pose.into(),
            goal: message.goal_pose.into(),
            segments: message.segments.iter().filter_map(LaneletSegment::lanes).collect(),
        }))
    }
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
        let lanes = |preferred, lanes: &[i64]| Some(Segment { preferred, lanes: lanes.to_vec() });
        let cases = [
            ("lanes", segment((2, "lane"), &[(1, "lane"), (2, "lane")]), lanes(2, &[1, 2])),
            ("no types", segment((1, ""), &[(1, ""), (2, "")]), lanes(1, &[1, 2])),
            ("not listed", segment((1, "lane"), &[(2, "lane")]), lanes(1, &[1, 2])),
            ("no list", segment((1, "lane"), &[]), lanes(1, &[1])),
            ("an area beside", segment((1, "lane"), &[(1, "lane"), (7, "area")]), lanes(1, &[1])),
            ("an area preferred", segment((7, "area"), &[(7, "area"), (1, "lane")]), lanes(1, &[1])),
            ("areas only", segment((7, "area"), &[(7, "area")]), None),
        ];
        for (name, segment, expected) in cases {
            assert_eq!(segment.lanes(), expected, "{name}");
        }
    }
}
