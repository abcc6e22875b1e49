//! The subscribed topics.

use super::flow::{TopicFlow, TopicKey};
use ros_messages::autoware_adapi_v1_msgs::OperationModeState;
use ros_messages::autoware_internal_planning_msgs::{PathWithLaneId, PlanningFactorArray, Scenario};
use ros_messages::autoware_perception_msgs::TrafficLightGroupArray;
use ros_messages::autoware_planning_msgs::{LaneletRoute, PoseWithUuidStamped, Trajectory};
use ros_messages::autoware_vehicle_msgs::{ControlModeReport, HazardLightsCommand, TurnIndicatorsCommand};
use ros_messages::nav_msgs::Odometry;
use ros_messages::rosgraph_msgs::Clock;
use ros_messages::{TypeName, std_msgs};
use ros_transport::qos::{Durability, Reliability};
use traffic_lights::target::StoreId;
use turn_signal::planner_input::FactorTopic;

/// A subscribed topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Subscription {
    /// Absolute name of the topic.
    pub name: String,
    /// Message and purpose of the topic.
    pub kind: SubscriptionKind,
    /// Reliability requested from writers.
    pub reliability: Reliability,
    /// Durability requested from writers.
    pub durability: Durability,
    /// Number of samples kept while the session is busy, at least 1.
    pub depth: i32,
}

impl Subscription {
    /// Creates a subscription with the quality of service of its kind.
    pub fn new(name: &str, kind: SubscriptionKind) -> Self {
        let IncomingRow { reliability, durability, depth, .. } = kind.row();
        Self { name: name.to_owned(), kind, reliability, durability, depth }
    }
}

/// Message and purpose of a subscribed topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SubscriptionKind {
    /// States of lights for a store.
    Groups(StoreId),
    /// A camera pipeline's states for the arbiter.
    Camera,
    /// The clock of a simulator.
    Clock,
    /// Commands of a scenario as texts.
    Command,
    /// Pose and speed for the decider.
    Odometry,
    /// The route for the decider.
    Route,
    /// The path for the decider.
    PlannedPath,
    /// The trajectory of a planner without planning factors, for the decider.
    Trajectory,
    /// Planning factors of one module for the decider.
    Factors(FactorTopic),
    /// The goal as moved by the goal planner, for the decider.
    ModifiedGoal,
    /// The operation mode for the decider.
    OperationMode,
    /// The planning scenario for the decider.
    Scenario,
    /// The system's request for hazard lights, for the decider.
    HazardRequest,
    /// The turn command of Autoware's own decider, for comparison.
    OwnTurnCommand,
    /// The hazard command of Autoware's own decider, for comparison.
    OwnHazardCommand,
    /// The turn command for the vehicle.
    TurnCommand,
    /// The hazard command for the vehicle.
    HazardCommand,
    /// The control mode of the vehicle.
    ControlMode,
}

/// The fixed properties of a subscribed topic.
#[derive(Debug, Clone, Copy)]
pub struct IncomingRow {
    /// The flow that receives the messages.
    pub flow: TopicFlow,
    /// Key of the configuration that names the topic; `None` for a topic whose name is fixed.
    pub key: Option<TopicKey>,
    /// Absolute name unless configured; empty for a topic that is subscribed to only if the configuration
    /// names it.
    pub default_name: &'static str,
    /// Type of the messages.
    pub type_name: TypeName,
    /// Reliability requested from writers.
    pub reliability: Reliability,
    /// Durability requested from writers.
    pub durability: Durability,
    /// Number of samples kept while the session is busy.
    pub depth: i32,
}

const fn lights(key: &'static str, type_name: TypeName) -> IncomingRow {
    newest(TopicFlow::TrafficLights, Some(TopicKey { section: "traffic_lights.inputs", key }), "", type_name)
}

const fn decider(key: &'static str, default_name: &'static str, type_name: TypeName) -> IncomingRow {
    newest(
        TopicFlow::TurnSignal,
        Some(TopicKey { section: "turn_signal.inputs", key }),
        default_name,
        type_name,
    )
}

const fn command(key: &'static str, default_name: &'static str, type_name: TypeName) -> IncomingRow {
    newest(TopicFlow::Command, Some(TopicKey { section: "command.topics", key }), default_name, type_name)
}

/// A topic of which only new messages count, since an earlier message may be outdated.
const fn newest(
    flow: TopicFlow,
    key: Option<TopicKey>,
    default_name: &'static str,
    type_name: TypeName,
) -> IncomingRow {
    let (reliability, durability) = (Reliability::Reliable, Durability::Volatile);
    IncomingRow { flow, key, default_name, type_name, reliability, durability, depth: 1 }
}

/// A topic that is published only on change, so late readers need the current message.
const fn kept(row: IncomingRow) -> IncomingRow {
    IncomingRow { durability: Durability::TransientLocal, ..row }
}

impl SubscriptionKind {
    /// The inputs of the decider, except planning factors.
    pub const DECIDER: [Self; 8] = [
        Self::Odometry,
        Self::Route,
        Self::PlannedPath,
        Self::Trajectory,
        Self::ModifiedGoal,
        Self::OperationMode,
        Self::Scenario,
        Self::HazardRequest,
    ];
    /// The commands of Autoware's own decider.
    pub const OWN_COMMANDS: [Self; 2] = [Self::OwnTurnCommand, Self::OwnHazardCommand];

    /// Returns the fixed properties of the topic.
    pub const fn row(self) -> IncomingRow {
        const BEHAVIOR_PATH: &str =
            "/planning/scenario_planning/lane_driving/behavior_planning/path_with_lane_id";
        const GOAL: &str = "/planning/scenario_planning/modified_goal";
        const TURN: TypeName = TurnIndicatorsCommand::TYPE_NAME;
        const HAZARD: TypeName = HazardLightsCommand::TYPE_NAME;
        match self {
            Self::Groups(store) => lights(store.name(), TrafficLightGroupArray::TYPE_NAME),
            Self::Camera => lights("camera", TrafficLightGroupArray::TYPE_NAME),
            // No command may be lost.
            Self::Command => IncomingRow { depth: 50, ..lights("command", std_msgs::String::TYPE_NAME) },
            // A clock is often published as best effort, and the next message follows soon.
            Self::Clock => IncomingRow {
                reliability: Reliability::BestEffort,
                ..newest(TopicFlow::TrafficLights, None, "/clock", Clock::TYPE_NAME)
            },
            Self::Odometry => decider("odometry", "/localization/kinematic_state", Odometry::TYPE_NAME),
            Self::Route => {
                kept(decider("route", "/planning/mission_planning/route", LaneletRoute::TYPE_NAME))
            }
            Self::PlannedPath => decider("planned_path", BEHAVIOR_PATH, PathWithLaneId::TYPE_NAME),
            Self::Trajectory => decider("trajectory", "", Trajectory::TYPE_NAME),
            // The name is a prefix, under which each module has its topic.
            Self::Factors(_) => {
                decider("planning_factors", "/planning/planning_factors", PlanningFactorArray::TYPE_NAME)
            }
            Self::ModifiedGoal => kept(decider("modified_goal", GOAL, PoseWithUuidStamped::TYPE_NAME)),
            Self::OperationMode => {
                kept(decider("operation_mode", "/system/operation_mode/state", OperationModeState::TYPE_NAME))
            }
            Self::Scenario => {
                decider("scenario", "/planning/scenario_planning/scenario", Scenario::TYPE_NAME)
            }
            Self::HazardRequest => decider("hazard_request", "/system/hazard_lights_cmd", HAZARD),
            Self::OwnTurnCommand => decider("own_turn_command", "/planning/turn_indicators_cmd", TURN),
            Self::OwnHazardCommand => decider("own_hazard_command", "/planning/hazard_lights_cmd", HAZARD),
            Self::TurnCommand => command("turn_indicators_cmd", "/control/command/turn_indicators_cmd", TURN),
            Self::HazardCommand => command("hazard_lights_cmd", "/control/command/hazard_lights_cmd", HAZARD),
            Self::ControlMode => {
                command("control_mode", "/vehicle/status/control_mode", ControlModeReport::TYPE_NAME)
            }
        }
    }
}
