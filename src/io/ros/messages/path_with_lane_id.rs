//! `autoware_internal_planning_msgs/msg/PathWithLaneId`.

use serde::{Deserialize, Serialize};

use super::bounded::at_most;
use super::geometry::{Point, Pose};
use super::stamp::Header;
use crate::core::turn_signal::planner_input::{self, PlannerInput};

/// Most points of a path.
pub(super) const MAX_POINTS: usize = 20_000;
/// Most lanelets of a point.
pub(super) const MAX_LANES: usize = 1_000;
/// Most points of a bound.
pub(super) const MAX_BOUND_POINTS: usize = 100_000;

/// `autoware_planning_msgs/msg/PathPoint`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PathPoint {
    /// Pose of the vehicle at the point.
    pub pose: Pose,
    /// Speed forwards, m/s.
    pub longitudinal_velocity_mps: f32,
    /// Speed to the left, m/s.
    pub lateral_velocity_mps: f32,
    /// Rate of turning to the left, rad/s.
    pub heading_rate_rps: f32,
    /// It will not be changed any more.
    pub is_final: bool,
}

/// `autoware_internal_planning_msgs/msg/PathPointWithLaneId`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PathPointWithLaneId {
    /// Pose and speed.
    pub point: PathPoint,
    /// The lanelets it belongs to.
    #[serde(deserialize_with = "at_most::<_, _, MAX_LANES>")]
    pub lane_ids: Vec<i64>,
}

/// `autoware_internal_planning_msgs/msg/PathWithLaneId`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PathWithLaneId {
    /// Time of the path, and the frame of the points.
    pub header: Header,
    /// Points in the order of driving.
    #[serde(deserialize_with = "at_most::<_, _, MAX_POINTS>")]
    pub points: Vec<PathPointWithLaneId>,
    /// Left bound of the drivable area.
    #[serde(deserialize_with = "at_most::<_, _, MAX_BOUND_POINTS>")]
    pub left_bound: Vec<Point>,
    /// Right bound of the drivable area.
    #[serde(deserialize_with = "at_most::<_, _, MAX_BOUND_POINTS>")]
    pub right_bound: Vec<Point>,
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
