//! `autoware_internal_planning_msgs/msg/PlanningFactorArray` of release 1.12.

use serde::{Deserialize, Serialize};

use super::bounded::at_most;
use super::geometry::{Point, Pose};
use super::lanelet_route::Uuid;
use super::stamp::{Duration, Header};
use crate::core::map::geometry as plane;
use crate::core::time::WallStamp;
use crate::core::turn_signal::decision::Decision;
use crate::core::turn_signal::planner_input::{self, FactorTopic, PlannerInput};
use crate::core::turn_signal::side::Side;
use crate::core::turn_signal::subject::SignalSubject;

/// Name of the module in factors of our own.
const MODULE: &str = "signal_gateway";
/// Values of `behavior` in factors of our own.
const SHIFT_LEFT: u16 = 4;
const SHIFT_RIGHT: u16 = 5;
const TURN_LEFT: u16 = 6;
const TURN_RIGHT: u16 = 7;
/// Most factors of a message, and most control points of a factor.
pub(super) const MAX_FACTORS: usize = 1_000;
/// Most objects of a factor.
pub(super) const MAX_SAFETY_FACTORS: usize = 10_000;
/// Most points of an object, or of its path.
pub(super) const MAX_OBJECT_POINTS: usize = 100_000;

/// `autoware_internal_planning_msgs/msg/ControlPoint`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ControlPoint {
    /// Pose in the map.
    pub pose: Pose,
    /// Speed at the point, m/s.
    pub velocity: f32,
    /// Shift to the left, metres.
    pub shift_length: f32,
    /// Distance from the vehicle along the path, metres.
    pub distance: f32,
}

/// `autoware_perception_msgs/msg/PredictedPath`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PredictedPath {
    /// Future poses of the object.
    #[serde(deserialize_with = "at_most::<_, _, MAX_OBJECT_POINTS>")]
    pub path: Vec<Pose>,
    /// Time from one pose to the next.
    pub time_step: Duration,
    /// Confidence, 0 to 1.
    pub confidence: f32,
}

/// `autoware_internal_planning_msgs/msg/SafetyFactor`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SafetyFactor {
    /// `UNKNOWN` 0, `POINTCLOUD` 1, `OBJECT` 2.
    pub r#type: u16,
    /// Id of the object.
    pub object_id: Uuid,
    /// Predicted path of the object.
    pub predicted_path: PredictedPath,
    /// Begin of the time to collision, seconds.
    pub ttc_begin: f32,
    /// End of the time to collision, seconds.
    pub ttc_end: f32,
    /// Points of the object.
    #[serde(deserialize_with = "at_most::<_, _, MAX_OBJECT_POINTS>")]
    pub points: Vec<Point>,
    /// The module's assessment of the object.
    pub is_safe: bool,
}

/// `autoware_internal_planning_msgs/msg/SafetyFactorArray`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SafetyFactorArray {
    /// Time of the factors.
    pub header: Header,
    /// Objects that may lead to a collision.
    #[serde(deserialize_with = "at_most::<_, _, MAX_SAFETY_FACTORS>")]
    pub factors: Vec<SafetyFactor>,
    /// The assessment of all objects together.
    pub is_safe: bool,
    /// Text for people.
    pub detail: String,
}

/// `autoware_internal_planning_msgs/msg/PlanningFactor`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PlanningFactor {
    /// Name of the planning module.
    pub module: String,
    /// False when reversing.
    pub is_driving_forward: bool,
    /// Begin and end of the manoeuvre.
    #[serde(deserialize_with = "at_most::<_, _, MAX_FACTORS>")]
    pub control_points: Vec<ControlPoint>,
    /// See [`planner_input::PlanningFactor::behavior`].
    pub behavior: u16,
    /// Text for people.
    pub detail: String,
    /// Objects that the module considers.
    pub safety_factors: SafetyFactorArray,
}

/// `autoware_internal_planning_msgs/msg/PlanningFactorArray`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PlanningFactorArray {
    /// Time of the factors.
    pub header: Header,
    /// Factors of one module.
    #[serde(deserialize_with = "at_most::<_, _, MAX_FACTORS>")]
    pub factors: Vec<PlanningFactor>,
}

impl PlanningFactorArray {
    /// What a decision signals, as the factor of a module: none, or one from the start of the required section to its
    /// end (docs/spec/turn-signal-decider.md, "Published sections").
    pub fn of_decision(decision: &Decision, stamp: WallStamp) -> Self {
        let header = Header { stamp: stamp.into(), frame_id: "map".to_owned() };
        let factor = decision.won().and_then(|won| {
            let (section, distances) = (decision.sections.of(won.source)?, won.distances?);
            let is_left = won.turn.side()? == Side::Left;
            let behavior = match won.subject {
                SignalSubject::Turn(_)
                | SignalSubject::RoundaboutEntry(_)
                | SignalSubject::RoundaboutExit(_) => {
                    if is_left {
                        TURN_LEFT
                    } else {
                        TURN_RIGHT
                    }
                }
                SignalSubject::Unnamed | SignalSubject::Manoeuvre(_) => {
                    if is_left {
                        SHIFT_LEFT
                    } else {
                        SHIFT_RIGHT
                    }
                }
            };
            #[allow(clippy::cast_possible_truncation)] // the message has 32 bits
            let point = |pose: plane::Pose, distance_m: f64| ControlPoint {
                pose: pose.into(),
                distance: distance_m as f32,
                ..ControlPoint::default()
            };
            Some(PlanningFactor {
                module: MODULE.to_owned(),
                is_driving_forward: true,
                control_points: vec![
                    point(section.required_start, distances.required_start_m),
                    point(section.required_end, distances.required_end_m),
                ],
                behavior,
                detail: won.subject.name(won.turn).unwrap_or_default(),
                safety_factors: SafetyFactorArray {
                    header: header.clone(),
                    is_safe: true,
                    ..SafetyFactorArray::default()
                },
            })
        });
        Self { header, factors: factor.into_iter().collect() }
    }

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
