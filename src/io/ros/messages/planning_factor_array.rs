//! `autoware_internal_planning_msgs/msg/PlanningFactorArray` of release 1.12.

use serde::{Deserialize, Serialize};

use super::bounded::at_most;
use super::geometry::{Point, Pose};
use super::lanelet_route::Uuid;
use super::stamp::{Duration, Header};
use crate::core::turn_signal::planner_input::{self, FactorTopic, PlannerInput};

/// Factors of a message, and control points of a factor.
pub(super) const MAX_FACTORS: usize = 1_000;
/// Objects of a factor.
pub(super) const MAX_SAFETY_FACTORS: usize = 10_000;
/// Points of an object, or of its path.
pub(super) const MAX_OBJECT_POINTS: usize = 100_000;

/// `autoware_internal_planning_msgs/msg/ControlPoint`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ControlPoint {
    /// Where, in the map.
    pub pose: Pose,
    /// m/s.
    pub velocity: f32,
    /// Metres, to the left.
    pub shift_length: f32,
    /// From the vehicle, metres.
    pub distance: f32,
}

/// `autoware_perception_msgs/msg/PredictedPath`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PredictedPath {
    /// Where an object will be.
    #[serde(deserialize_with = "at_most::<_, _, MAX_OBJECT_POINTS>")]
    pub path: Vec<Pose>,
    /// From one pose to the next.
    pub time_step: Duration,
    /// 0 to 1.
    pub confidence: f32,
}

/// `autoware_internal_planning_msgs/msg/SafetyFactor`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SafetyFactor {
    /// `UNKNOWN` 0, `POINTCLOUD` 1, `OBJECT` 2.
    pub r#type: u16,
    /// Of an object.
    pub object_id: Uuid,
    /// Of an object.
    pub predicted_path: PredictedPath,
    /// Time to collision, seconds.
    pub ttc_begin: f32,
    /// Its end, likewise.
    pub ttc_end: f32,
    /// Where it is.
    #[serde(deserialize_with = "at_most::<_, _, MAX_OBJECT_POINTS>")]
    pub points: Vec<Point>,
    /// What the module thinks of it.
    pub is_safe: bool,
}

/// `autoware_internal_planning_msgs/msg/SafetyFactorArray`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SafetyFactorArray {
    /// When.
    pub header: Header,
    /// What may be in the way.
    #[serde(deserialize_with = "at_most::<_, _, MAX_SAFETY_FACTORS>")]
    pub factors: Vec<SafetyFactor>,
    /// All of it.
    pub is_safe: bool,
    /// Text for people.
    pub detail: String,
}

/// `autoware_internal_planning_msgs/msg/PlanningFactor`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PlanningFactor {
    /// Who planned it.
    pub module: String,
    /// Not backing up.
    pub is_driving_forward: bool,
    /// Where it begins, and where it ends.
    #[serde(deserialize_with = "at_most::<_, _, MAX_FACTORS>")]
    pub control_points: Vec<ControlPoint>,
    /// See [`planner_input::PlanningFactor::behavior`].
    pub behavior: u16,
    /// Text for people.
    pub detail: String,
    /// What it pays attention to.
    pub safety_factors: SafetyFactorArray,
}

/// `autoware_internal_planning_msgs/msg/PlanningFactorArray`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PlanningFactorArray {
    /// When.
    pub header: Header,
    /// Of one module.
    #[serde(deserialize_with = "at_most::<_, _, MAX_FACTORS>")]
    pub factors: Vec<PlanningFactor>,
}

impl PlanningFactorArray {
    /// The decider's input when it is received on a topic.
    pub fn into_input(self, topic: FactorTopic) -> PlannerInput {
        PlannerInput::Factors { topic, factors: self.factors.into_iter().map(Into::into).collect() }
    }
}

impl From<PlanningFactor> for planner_input::PlanningFactor {
    fn from(factor: PlanningFactor) -> Self {
        Self {
            behavior: factor.behavior,
            is_driving_forward: factor.is_driving_forward,
            detail: factor.detail.into_boxed_str(),
            control_points: factor.control_points.into_iter().map(Into::into).collect(),
        }
    }
}

impl From<ControlPoint> for planner_input::ControlPoint {
    fn from(point: ControlPoint) -> Self {
        Self {
            pose: point.pose.into(),
            distance_m: point.distance.into(),
            speed_mps: point.velocity.into(),
            shift_length_m: point.shift_length.into(),
        }
    }
}
