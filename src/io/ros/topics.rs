//! Where the messages go and come from: topic names, type names and quality of service.
//!
//! Reports are reliable with depth 1, diagnostics reliable, volatile, with depth 10
//! (docs/spec/vehicle-interface.md, "Topics and quality of service"); traffic lights reliable,
//! transient local, with depth 10, markers with depth 1
//! (docs/spec/traffic-lights.md, "Messages and topics"); commands reliable, volatile, with depth 1.

use super::messages::LightsType;
use crate::core::compat::Compat;
use crate::core::traffic_light::emission::LightsTopic;
use crate::core::traffic_light::target::StoreId;
use crate::core::turn_signal::planner_input::FactorTopic;

/// The topics we write, by absolute names (`/…`).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topics {
    /// `autoware_vehicle_msgs/msg/TurnIndicatorsReport`; empty = there is none.
    pub turn_indicators: String,
    /// `autoware_vehicle_msgs/msg/HazardLightsReport`; likewise.
    pub hazard_lights: String,
    /// `diagnostic_msgs/msg/DiagnosticArray`.
    pub diagnostics: String,
    /// Traffic lights; none unless configured.
    pub lights: Vec<LightsTopicSettings>,
    /// `autoware_vehicle_msgs/msg/TurnIndicatorsCommand`; none unless configured.
    pub turn_command: Option<String>,
    /// `autoware_vehicle_msgs/msg/HazardLightsCommand`; none unless configured.
    pub hazard_command: Option<String>,
}

impl Default for Topics {
    /// What Autoware and its diagnostics expect.
    fn default() -> Self {
        Self {
            turn_indicators: "/vehicle/status/turn_indicators_status".to_owned(),
            hazard_lights: "/vehicle/status/hazard_lights_status".to_owned(),
            diagnostics: "/diagnostics".to_owned(),
            lights: Vec::new(),
            turn_command: None,
            hazard_command: None,
        }
    }
}

/// A topic with traffic lights. Several can show the same emissions, as the V2I topic and its legacy
/// name do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightsTopicSettings {
    /// Whose emissions go there.
    pub topic: LightsTopic,
    /// Its name.
    pub name: String,
    /// As which message.
    pub lights: LightsType,
    /// In whose numbers.
    pub compat: Compat,
}

/// Whether a reader that comes later is handed what is current.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Durability {
    /// It is. Serves transient-local and volatile readers alike; asks for transient-local writers.
    #[default]
    TransientLocal,
    /// It waits for the next message. Transient-local readers are not served at all; takes any writer.
    Volatile,
}

/// Whether lost samples are sent again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reliability {
    /// They are, by writers that are reliable; others are not read at all.
    #[default]
    Reliable,
    /// They are not. Reads every writer. Samples of more than one datagram are easily lost.
    BestEffort,
}

/// A topic we read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Subscription {
    /// Its name, absolute.
    pub name: String,
    /// What comes there.
    pub kind: SubscriptionKind,
    /// Asked of writers.
    pub reliability: Reliability,
    /// Asked of writers.
    pub durability: Durability,
    /// Samples kept for us while we are busy, at least 1.
    pub depth: i32,
}

impl Subscription {
    /// As topics of its kind are to be read, reliably.
    pub fn new(name: &str, kind: SubscriptionKind) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            reliability: Reliability::Reliable,
            durability: kind.durability(),
            depth: kind.depth(),
        }
    }
}

/// What comes on a topic, and what it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SubscriptionKind {
    /// `TrafficLightGroupArray` for a store: states, of which the newest counts.
    Groups(StoreId),
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
            Self::Groups(_) => LightsType::GroupArray.type_name(),
            Self::Command => TEXT_TYPE,
            Self::Odometry => ("nav_msgs", "Odometry"),
            Self::Route => ("autoware_planning_msgs", "LaneletRoute"),
            Self::PlannedPath => ("autoware_internal_planning_msgs", "PathWithLaneId"),
            Self::Factors(_) => ("autoware_internal_planning_msgs", "PlanningFactorArray"),
            Self::OperationMode => ("autoware_adapi_v1_msgs", "OperationModeState"),
            Self::Scenario => ("autoware_internal_planning_msgs", "Scenario"),
            Self::OwnTurnCommand | Self::TurnCommand => TURN_COMMAND_TYPE,
            Self::HazardRequest | Self::OwnHazardCommand | Self::HazardCommand => HAZARD_COMMAND_TYPE,
            Self::ControlMode => ("autoware_vehicle_msgs", "ControlModeReport"),
        }
    }

    /// What to ask of writers. What is said only when it changes is said once more to who comes later;
    /// of the rest, what was said before we came may no longer hold.
    pub const fn durability(self) -> Durability {
        match self {
            Self::Route | Self::OperationMode => Durability::TransientLocal,
            Self::Groups(_)
            | Self::Command
            | Self::Odometry
            | Self::PlannedPath
            | Self::Factors(_)
            | Self::Scenario
            | Self::HazardRequest
            | Self::OwnTurnCommand
            | Self::OwnHazardCommand
            | Self::TurnCommand
            | Self::HazardCommand
            | Self::ControlMode => Durability::Volatile,
        }
    }

    /// Samples kept for us while we are busy: all commands that each count, of the rest the newest.
    pub const fn depth(self) -> i32 {
        match self {
            Self::Command => 50,
            Self::Groups(_)
            | Self::Odometry
            | Self::Route
            | Self::PlannedPath
            | Self::Factors(_)
            | Self::OperationMode
            | Self::Scenario
            | Self::HazardRequest
            | Self::OwnTurnCommand
            | Self::OwnHazardCommand
            | Self::TurnCommand
            | Self::HazardCommand
            | Self::ControlMode => 1,
        }
    }
}

/// A message type as `(package, name)`.
pub type TypeName = (&'static str, &'static str);

/// Type of the turn-indicators topic.
pub const TURN_INDICATORS_TYPE: TypeName = ("autoware_vehicle_msgs", "TurnIndicatorsReport");
/// Type of the hazard-lights topic.
pub const HAZARD_LIGHTS_TYPE: TypeName = ("autoware_vehicle_msgs", "HazardLightsReport");
/// Type of the diagnostics topic.
pub const DIAGNOSTICS_TYPE: TypeName = ("diagnostic_msgs", "DiagnosticArray");
/// Type of turn commands.
pub const TURN_COMMAND_TYPE: TypeName = ("autoware_vehicle_msgs", "TurnIndicatorsCommand");
/// Type of hazard commands.
pub const HAZARD_COMMAND_TYPE: TypeName = ("autoware_vehicle_msgs", "HazardLightsCommand");
/// Type of commands in words.
pub const TEXT_TYPE: TypeName = ("std_msgs", "String");

impl LightsType {
    /// The message type.
    pub const fn type_name(self) -> TypeName {
        match self {
            Self::ArrayV1 => ("traffic_simulator_msgs", "TrafficLightArrayV1"),
            Self::SignalArray => ("autoware_perception_msgs", "TrafficSignalArray"),
            Self::GroupArray => ("autoware_perception_msgs", "TrafficLightGroupArray"),
            Self::MarkerArray => ("visualization_msgs", "MarkerArray"),
        }
    }

    /// Samples kept.
    pub const fn depth(self) -> i32 {
        match self {
            Self::ArrayV1 | Self::SignalArray | Self::GroupArray => 10,
            Self::MarkerArray => 1,
        }
    }
}

/// Samples kept for a report: the current one.
pub const REPORT_DEPTH: i32 = 1;
/// Samples kept for a command: the current one.
pub const COMMAND_DEPTH: i32 = 1;
/// Samples kept for diagnostics.
pub const DIAGNOSTICS_DEPTH: i32 = 10;
