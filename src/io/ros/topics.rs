//! The topics: names, types and quality of service.
//!
//! Reports are reliable with depth 1, diagnostics reliable, volatile, with depth 10
//! (docs/spec/vehicle-interface.md, "Topics and quality of service"); traffic lights reliable,
//! transient local, with depth 10, markers and clock with depth 1
//! (docs/spec/traffic-lights.md, "Messages and topics"); commands reliable, volatile, with depth 1; the log
//! as `rcl_qos_profile_rosout_default` of `rcl` has it.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::messages::LightsType;
pub use super::messages::TypeName;
use crate::core::compat::Compat;
use crate::core::traffic_light::emission::LightsTopic;
use crate::core::traffic_light::target::StoreId;
use crate::core::turn_signal::planner_input::FactorTopic;

/// The topics that are written, by absolute names (`/…`).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topics {
    /// `autoware_vehicle_msgs/msg/TurnIndicatorsReport`; not written if empty.
    pub turn_indicators: String,
    /// `autoware_vehicle_msgs/msg/HazardLightsReport`; not written if empty.
    pub hazard_lights: String,
    /// `diagnostic_msgs/msg/DiagnosticArray`.
    pub diagnostics: String,
    /// Traffic lights; none unless configured.
    pub lights: Vec<LightsTopicSettings>,
    /// `autoware_vehicle_msgs/msg/TurnIndicatorsCommand`; none unless configured.
    pub turn_command: Option<String>,
    /// `autoware_vehicle_msgs/msg/HazardLightsCommand`; none unless configured.
    pub hazard_command: Option<String>,
    /// `visualization_msgs/msg/MarkerArray` of the decider's sections; none unless configured.
    pub section_markers: Option<String>,
    /// `autoware_internal_planning_msgs/msg/PlanningFactorArray` of the decider; none unless configured.
    pub planning_factors: Option<String>,
}

impl Default for Topics {
    /// The names that Autoware and its diagnostics expect.
    fn default() -> Self {
        Self {
            turn_indicators: "/vehicle/status/turn_indicators_status".to_owned(),
            hazard_lights: "/vehicle/status/hazard_lights_status".to_owned(),
            diagnostics: "/diagnostics".to_owned(),
            lights: Vec::new(),
            turn_command: None,
            hazard_command: None,
            section_markers: None,
            planning_factors: None,
        }
    }
}

impl Topics {
    /// The names of all topics, empty for those that are not written.
    pub fn names_mut(&mut self) -> impl Iterator<Item = &mut String> {
        let Self { turn_indicators, hazard_lights, diagnostics, lights, .. } = self;
        let optional = [
            &mut self.turn_command,
            &mut self.hazard_command,
            &mut self.section_markers,
            &mut self.planning_factors,
        ];
        let lights = lights.iter_mut().map(|topic| &mut topic.name);
        [turn_indicators, hazard_lights, diagnostics]
            .into_iter()
            .chain(lights)
            .chain(optional.into_iter().flatten())
    }
}

/// A topic with traffic lights. Several can carry the same emissions, as the V2I topic and its legacy
/// name do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightsTopicSettings {
    /// The emissions that go there.
    pub topic: LightsTopic,
    /// Its absolute name.
    pub name: String,
    /// The message they become.
    pub lights: LightsType,
    /// The numbering of shapes and the width of ids that the message uses.
    pub compat: Compat,
}

/// The durability of a topic: does a late reader get the current sample?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Durability {
    /// It is. A writer serves transient-local and volatile readers alike; a reader takes transient-local writers only.
    #[default]
    TransientLocal,
    /// It waits for the next message. A writer does not serve transient-local readers; a reader takes any writer.
    Volatile,
}

/// The reliability that a reader requests: are lost samples sent again?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Reliability {
    /// They are, by reliable writers; others are not read at all.
    #[default]
    Reliable,
    /// They are not, and every writer is read. Samples of more than one datagram are easily lost.
    BestEffort,
}

/// A topic that is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Subscription {
    /// Its absolute name.
    pub name: String,
    /// The message, and what it is for.
    pub kind: SubscriptionKind,
    /// Reliability requested from writers.
    pub reliability: Reliability,
    /// Durability requested from writers.
    pub durability: Durability,
    /// Samples kept while the session is busy, at least 1.
    pub depth: i32,
}

impl Subscription {
    /// A subscription with the reliability, durability and depth of its kind.
    pub fn new(name: &str, kind: SubscriptionKind) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            reliability: kind.reliability(),
            durability: kind.durability(),
            depth: kind.depth(),
        }
    }
}

/// The message of a topic, and what it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SubscriptionKind {
    /// `TrafficLightGroupArray` for a store: states, of which the newest counts.
    Groups(StoreId),
    /// `TrafficLightGroupArray` of a camera pipeline for the arbiter, of which the newest counts.
    Camera,
    /// `Clock` of a simulator, `/clock`, of which the newest counts.
    Clock,
    /// `std_msgs/msg/String`: commands, of which each counts.
    Command,
    /// `Odometry` for the decider, `/localization/kinematic_state`. The newest counts, of this and of all
    /// that follow (docs/spec/turn-signal-decider.md, "Manoeuvres from planning factors").
    Odometry,
    /// `LaneletRoute` for the decider, `/planning/mission_planning/route`.
    Route,
    /// `PathWithLaneId` for the decider.
    PlannedPath,
    /// `PlanningFactorArray` for the decider, of one module.
    Factors(FactorTopic),
    /// `PoseWithUuidStamped` for the decider, `/planning/scenario_planning/modified_goal`.
    ModifiedGoal,
    /// `OperationModeState` for the decider, `/system/operation_mode/state`.
    OperationMode,
    /// `Scenario` for the decider, `/planning/scenario_planning/scenario`.
    Scenario,
    /// `HazardLightsCommand` of the system for the decider, `/system/hazard_lights_cmd`.
    HazardRequest,
    /// `TurnIndicatorsCommand` of Autoware's own decider, to compare with.
    OwnTurnCommand,
    /// `HazardLightsCommand` of Autoware's own decider, to compare with.
    OwnHazardCommand,
    /// `TurnIndicatorsCommand` for the vehicle, `/control/command/turn_indicators_cmd`.
    TurnCommand,
    /// `HazardLightsCommand` for the vehicle, `/control/command/hazard_lights_cmd`.
    HazardCommand,
    /// `ControlModeReport` of the vehicle, `/vehicle/status/control_mode`.
    ControlMode,
}

impl SubscriptionKind {
    /// The topic's type.
    pub const fn type_name(self) -> TypeName {
        match self {
            Self::Groups(_) | Self::Camera => LightsType::GroupArray.type_name(),
            Self::Clock => LightsType::Clock.type_name(),
            Self::Command => TEXT_TYPE,
            Self::Odometry => ("nav_msgs", "Odometry"),
            Self::Route => ("autoware_planning_msgs", "LaneletRoute"),
            Self::PlannedPath => ("autoware_internal_planning_msgs", "PathWithLaneId"),
            Self::Factors(_) => PLANNING_FACTORS_TYPE,
            Self::ModifiedGoal => ("autoware_planning_msgs", "PoseWithUuidStamped"),
            Self::OperationMode => ("autoware_adapi_v1_msgs", "OperationModeState"),
            Self::Scenario => ("autoware_internal_planning_msgs", "Scenario"),
            Self::OwnTurnCommand | Self::TurnCommand => TURN_COMMAND_TYPE,
            Self::HazardRequest | Self::OwnHazardCommand | Self::HazardCommand => HAZARD_COMMAND_TYPE,
            Self::ControlMode => ("autoware_vehicle_msgs", "ControlModeReport"),
        }
    }

    /// Reliability to request from writers: a clock is often published at best effort, and the next message follows soon.
    pub const fn reliability(self) -> Reliability {
        if matches!(self, Self::Clock) { Reliability::BestEffort } else { Reliability::Reliable }
    }

    /// Durability to request from writers: what is published only when it changes is handed to late readers too; of the
    /// rest, what was published before may no longer hold.
    pub const fn durability(self) -> Durability {
        if matches!(self, Self::Route | Self::ModifiedGoal | Self::OperationMode) {
            Durability::TransientLocal
        } else {
            Durability::Volatile
        }
    }

    /// Samples kept while the session is busy: text commands, which each count, and the newest of the rest.
    pub const fn depth(self) -> i32 {
        if matches!(self, Self::Command) { 50 } else { 1 }
    }
}

/// Type of the turn-indicators topic.
pub const TURN_INDICATORS_TYPE: TypeName = ("autoware_vehicle_msgs", "TurnIndicatorsReport");
/// Type of the hazard-lights topic.
pub const HAZARD_LIGHTS_TYPE: TypeName = ("autoware_vehicle_msgs", "HazardLightsReport");
/// Type of the diagnostics topic.
pub const DIAGNOSTICS_TYPE: TypeName = ("diagnostic_msgs", "DiagnosticArray");
/// Type of the log.
pub const LOG_TYPE: TypeName = ("rcl_interfaces", "Log");
/// Type of turn commands.
pub const TURN_COMMAND_TYPE: TypeName = ("autoware_vehicle_msgs", "TurnIndicatorsCommand");
/// Type of planning factors.
pub const PLANNING_FACTORS_TYPE: TypeName = ("autoware_internal_planning_msgs", "PlanningFactorArray");
/// Type of hazard commands.
pub const HAZARD_COMMAND_TYPE: TypeName = ("autoware_vehicle_msgs", "HazardLightsCommand");
/// Type of text commands.
const TEXT_TYPE: TypeName = ("std_msgs", "String");

impl LightsType {
    /// The message type.
    pub const fn type_name(self) -> TypeName {
        match self {
            Self::ArrayV1 => ("traffic_simulator_msgs", "TrafficLightArrayV1"),
            Self::SignalArray => ("autoware_perception_msgs", "TrafficSignalArray"),
            Self::GroupArray => ("autoware_perception_msgs", "TrafficLightGroupArray"),
            Self::MarkerArray => ("visualization_msgs", "MarkerArray"),
            Self::Clock => ("rosgraph_msgs", "Clock"),
        }
    }

    /// Samples that a writer keeps.
    pub const fn depth(self) -> i32 {
        match self {
            Self::ArrayV1 | Self::SignalArray | Self::GroupArray => 10,
            Self::MarkerArray | Self::Clock => 1,
        }
    }
}

/// Samples that a writer of reports keeps: the current one.
pub const REPORT_DEPTH: i32 = 1;
/// Samples that a writer of commands keeps: the current one.
pub const COMMAND_DEPTH: i32 = 1;
/// Samples that the writer of diagnostics keeps.
pub const DIAGNOSTICS_DEPTH: i32 = 10;
/// Samples that the writer of the log keeps. `rclcpp` keeps a thousand, of all levels.
pub const LOG_DEPTH: i32 = 100;
/// Age at which a line of the log is not handed to a late reader any more, as `rclcpp` has it.
pub const LOG_LIFESPAN: Duration = Duration::from_secs(10);
