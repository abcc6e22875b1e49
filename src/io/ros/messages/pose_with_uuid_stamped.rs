//! `autoware_planning_msgs/msg/PoseWithUuidStamped`.

use serde::{Deserialize, Serialize};

use super::geometry::Pose;
use super::lanelet_route::Uuid;
use super::stamp::Header;
use crate::core::turn_signal::planner_input::PlannerInput;

/// `autoware_planning_msgs/msg/PoseWithUuidStamped`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PoseWithUuidStamped {
    /// Time of the pose, and its frame.
    pub header: Header,
    /// The pose.
    pub pose: Pose,
    /// Id of the route that it belongs to.
    pub uuid: Uuid,
}

/// The same in releases that have a flag behind it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FlaggedPoseWithUuidStamped {
    /// The message as other releases have it.
    pub pose: PoseWithUuidStamped,
    /// The goal may be moved.
    pub allow_modification: bool,
}

impl From<PoseWithUuidStamped> for PlannerInput {
    fn from(message: PoseWithUuidStamped) -> Self {
        Self::ModifiedGoal { route: u128::from_be_bytes(message.uuid.uuid), goal: message.pose.into() }
    }
}
