//! Messages of Autoware for the decider (docs/spec/turn-signal-decider.md, "Inputs and outputs"). The values
//! are as sent, so that an invalid value becomes a finding rather than a lost message.

use std::sync::Arc;

use serde::Serialize;

use super::route::Segment;
use crate::light_command::{EnumOrUnknown, HazardCommand, TurnCommand};
use gateway_base::names::named_by_variant;
use gateway_base::time::WallStamp;
use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::LaneId;

/// One message for the decider.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // their names say it
pub enum PlannerInput {
    /// The message `nav_msgs/Odometry` of the localisation.
    Odometry {
        /// Pose and speed; numbers may be not finite.
        odometry: Odometry,
        /// Time of the measurement.
        stamp: WallStamp,
    },
    /// The message `autoware_planning_msgs/LaneletRoute` of the mission planner.
    Route(Arc<PlannerRoute>),
    /// The message `autoware_internal_planning_msgs/PathWithLaneId` of the behavior planner.
    PlannedPath(Arc<[PlannedPathPoint]>),
    /// The message `autoware_planning_msgs/Trajectory`, of a planner that sends no planning factors.
    Trajectory(Arc<[TrajectoryPoint]>),
    /// `autoware_internal_planning_msgs/PlanningFactorArray` of one module.
    Factors { topic: FactorTopic, factors: Arc<[PlanningFactor]> },
    /// `autoware_planning_msgs/PoseWithUuidStamped`: the goal of a pull-over.
    ModifiedGoal {
        /// Id of the route to which it belongs.
        route: u128,
        goal: Pose,
    },
    /// The message `autoware_adapi_v1_msgs/OperationModeState` of the system.
    OperationMode(OperationMode),
    /// `autoware_internal_planning_msgs/Scenario`: whether the planner drives lanes.
    LaneDriving(bool),
    /// `HazardLightsCommand` of the system, as its request.
    HazardRequest(HazardCommand),
    /// `TurnIndicatorsCommand` of Autoware's own decider, as sent.
    OwnTurnCommand(EnumOrUnknown<TurnCommand>),
    /// `HazardLightsCommand` of Autoware's own decider, as sent.
    OwnHazardCommand(EnumOrUnknown<HazardCommand>),
}

/// Pose and speed of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Odometry {
    /// Pose of the rear axle in the map frame.
    pub pose: Pose,
    /// Speed, m/s, negative backwards.
    pub speed_mps: f64,
}

/// A route as sent.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannerRoute {
    /// The route's `uuid`, first byte highest.
    pub id: u128,
    /// Pose at its start.
    pub start: Pose,
    /// Pose at its end.
    pub goal: Pose,
    /// Its segments; primitives that are areas are left out.
    pub segments: Vec<Segment>,
}

/// A point of the planned path.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedPathPoint {
    /// Pose in the map frame.
    pub pose: Pose,
    /// Planned speed at the point, m/s.
    pub speed_mps: f64,
    /// The lanelets to which the point belongs.
    pub lanes: Vec<LaneId>,
}

/// A point of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrajectoryPoint {
    /// Pose in the map frame.
    pub pose: Pose,
    /// Planned speed at the point, m/s, negative backwards.
    pub speed_mps: f64,
}

/// Modules of the planner with relevant factors, by the last part of their topic
/// (`/planning/planning_factors/…`), in the order in which the planner runs them
/// (docs/spec/turn-signal-decider.md, "Joining records").
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FactorTopic {
    /// Pull-outs from the roadside, topic `start_planner`.
    StartPlanner,
    /// Lane changes around obstacles, topic `avoidance_by_lane_change`.
    AvoidanceByLaneChange,
    /// Avoidance within the lane, topic `static_obstacle_avoidance`.
    StaticObstacleAvoidance,
    /// Lane changes, topic `lane_change_left`.
    LaneChangeLeft,
    /// Lane changes, topic `lane_change_right`.
    LaneChangeRight,
    /// Requested lane changes, topic `external_request_lane_change_left`.
    ExternalRequestLaneChangeLeft,
    /// Requested lane changes, topic `external_request_lane_change_right`.
    ExternalRequestLaneChangeRight,
    /// Pull-overs to the roadside, topic `goal_planner`.
    GoalPlanner,
}

/// A planning factor of a module.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanningFactor {
    /// `UNKNOWN` 0, `NONE` 1, `SLOW_DOWN` 2, `STOP` 3, `SHIFT_LEFT` 4, `SHIFT_RIGHT` 5, `TURN_LEFT` 6,
    /// `TURN_RIGHT` 7; as sent.
    pub behavior: u16,
    /// The vehicle drives forward; otherwise it backs up.
    pub is_driving_forward: bool,
    /// Explanation as text, such as `left shift` or `backward`.
    pub detail: Box<str>,
    /// The points at which it begins and ends.
    pub control_points: Vec<ControlPoint>,
}

/// A control point of a planning factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlPoint {
    /// Pose in the map frame.
    pub pose: Pose,
    /// Distance from the vehicle along its path, metres.
    pub distance_m: f64,
    /// Planned speed there, m/s.
    pub speed_mps: f64,
    /// Offset to the left of the reference path, metres.
    pub shift_length_m: f64,
}

/// The operation mode, and whether Autoware's control is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OperationMode {
    /// `STOP` 1, `AUTONOMOUS` 2, `LOCAL` 3, `REMOTE` 4; as sent.
    pub mode: u8,
    /// Autoware controls the vehicle.
    pub is_autoware_control_enabled: bool,
    /// The mode is changing.
    pub is_in_transition: bool,
}

named_by_variant!(FactorTopic);

impl FactorTopic {
    /// Every module, in the order of the variants.
    pub const ALL: [Self; 8] = [
        Self::StartPlanner,
        Self::AvoidanceByLaneChange,
        Self::StaticObstacleAvoidance,
        Self::LaneChangeLeft,
        Self::LaneChangeRight,
        Self::ExternalRequestLaneChangeLeft,
        Self::ExternalRequestLaneChangeRight,
        Self::GoalPlanner,
    ];

    /// Returns the topic's name in a namespace with a topic for each module.
    pub fn in_folder(self, folder: &str) -> String {
        format!("{folder}/{}", self.name())
    }
}
