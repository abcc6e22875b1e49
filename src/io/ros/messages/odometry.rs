//! `nav_msgs/msg/Odometry`.

use serde::{Deserialize, Serialize};

use super::geometry::{PoseWithCovariance, TwistWithCovariance};
use super::stamp::Header;
use crate::core::turn_signal::planner_input::Odometry as Motion;
use crate::core::turn_signal::planner_input::PlannerInput;

/// `nav_msgs/msg/Odometry`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Odometry {
    /// Time of measurement, and the frame of the pose.
    pub header: Header,
    /// Frame of the twist.
    pub child_frame_id: String,
    /// Pose of the vehicle.
    pub pose: PoseWithCovariance,
    /// Velocity of the vehicle; forward is x.
    pub twist: TwistWithCovariance,
}

impl From<Odometry> for PlannerInput {
    fn from(message: Odometry) -> Self {
        let odometry = Motion { pose: message.pose.pose.into(), speed_mps: message.twist.twist.linear.x };
        Self::Odometry { odometry, stamp: message.header.stamp.into() }
    }
}
