//! The topics, one row for each: name, type, quality of service, flow, and the key of the configuration that
//! renames it.
//!
//! docs/spec/vehicle-interface.md ("Topics and quality of service") and docs/spec/traffic-lights.md
//! ("Messages and topics") give the reasons; the log follows `rcl_qos_profile_rosout_default` of `rcl`.

mod flow;
mod incoming;

use std::collections::BTreeMap;

use super::messages::LightsType;
pub use flow::{TopicFlow, TopicKey};
pub use incoming::{IncomingRow, Subscription, SubscriptionKind};
use ros_messages::TypeName;
use ros_messages::autoware_adapi_v1_msgs::DoorStatusArray;
use ros_messages::autoware_internal_planning_msgs::PlanningFactorArray;
use ros_messages::autoware_perception_msgs::{TrafficLightGroupArray, TrafficSignalArray};
use ros_messages::autoware_vehicle_msgs::{
    ControlModeReport, GearReport, HazardLightsCommand, HazardLightsReport, SteeringReport,
    TurnIndicatorsCommand, TurnIndicatorsReport, VelocityReport,
};
use ros_messages::diagnostic_msgs::DiagnosticArray;
use ros_messages::rcl_interfaces::Log;
use ros_messages::rosgraph_msgs::Clock;
use ros_messages::traffic_simulator_msgs::TrafficLightArrayV1;
use ros_messages::visualization_msgs::MarkerArray;
pub use ros_transport::qos::{Delivery, Durability, LOG_DEPTH, LOG_LIFESPAN, Reliability};
use traffic_lights::compat::Compat;
use traffic_lights::emission::LightsTopic;

/// A published topic. Settings, statuses and recordings use this order; the topics of traffic lights, which
/// are configured individually ([`LightsTopicSettings`]), come before the topics of the decider.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)] // see the rows
pub enum OutgoingTopic {
    TurnIndicatorsReport,
    HazardLightsReport,
    VelocityReport,
    SteeringReport,
    GearReport,
    ControlModeReport,
    DoorStatusArray,
    Diagnostics,
    TurnCommand,
    HazardCommand,
    SectionMarkers,
    PlanningFactors,
    Log,
}

/// The fixed properties of a published topic.
#[derive(Debug, Clone, Copy)]
pub struct OutgoingRow {
    /// The topic of this row.
    pub topic: OutgoingTopic,
    /// The flow whose outputs are published.
    pub flow: TopicFlow,
    /// Key of the configuration that names the topic; `None` for a topic whose name is fixed.
    pub key: Option<TopicKey>,
    /// Absolute name unless configured; empty for a topic that is published only if the configuration names
    /// it.
    pub default_name: &'static str,
    /// Type of the messages.
    pub type_name: TypeName,
    /// Durability offered to readers; `None` if `[reports] durability` sets it.
    pub durability: Option<Durability>,
    /// History depth of the writer, samples.
    pub depth: i32,
    /// Delivery of the messages to readers.
    pub delivery: Delivery,
    /// Maximum number of messages that wait to be sent; beyond it the oldest are dropped.
    pub max_waiting: usize,
    /// Meaning of the key, for the documentation.
    pub doc: &'static str,
    /// When a message is published, for the documentation.
    pub when: &'static str,
}

/// The published topics, in the order of [`OutgoingTopic`].
pub const OUTGOING: [OutgoingRow; 13] = [
    OutgoingRow {
        topic: OutgoingTopic::TurnIndicatorsReport,
        key: Some(TopicKey { section: "ros.topics", key: "turn_indicators_status" }),
        default_name: "/vehicle/status/turn_indicators_status",
        type_name: TurnIndicatorsReport::TYPE_NAME,
        doc: "TurnIndicatorsReport",
        ..REPORT
    },
    OutgoingRow {
        topic: OutgoingTopic::HazardLightsReport,
        key: Some(TopicKey { section: "ros.topics", key: "hazard_lights_status" }),
        default_name: "/vehicle/status/hazard_lights_status",
        type_name: HazardLightsReport::TYPE_NAME,
        doc: "HazardLightsReport",
        ..REPORT
    },
    OutgoingRow {
        topic: OutgoingTopic::VelocityReport,
        key: Some(TopicKey { section: "ros.topics", key: "velocity_status" }),
        default_name: "/vehicle/status/velocity_status",
        type_name: VelocityReport::TYPE_NAME,
        doc: "VelocityReport; \"\": not published",
        ..MEASUREMENT
    },
    OutgoingRow {
        topic: OutgoingTopic::SteeringReport,
        key: Some(TopicKey { section: "ros.topics", key: "steering_status" }),
        default_name: "/vehicle/status/steering_status",
        type_name: SteeringReport::TYPE_NAME,
        doc: "SteeringReport; \"\": not published",
        ..MEASUREMENT
    },
    OutgoingRow {
        topic: OutgoingTopic::GearReport,
        key: Some(TopicKey { section: "ros.topics", key: "gear_status" }),
        default_name: "/vehicle/status/gear_status",
        type_name: GearReport::TYPE_NAME,
        doc: "GearReport; \"\": not published",
        ..STATE
    },
    OutgoingRow {
        topic: OutgoingTopic::ControlModeReport,
        key: Some(TopicKey { section: "ros.topics", key: "control_mode_status" }),
        default_name: "/vehicle/status/control_mode",
        type_name: ControlModeReport::TYPE_NAME,
        doc: "ControlModeReport; \"\": not published",
        ..STATE
    },
    OutgoingRow {
        topic: OutgoingTopic::DoorStatusArray,
        key: Some(TopicKey { section: "ros.topics", key: "doors_status" }),
        default_name: "/vehicle/doors/status",
        type_name: DoorStatusArray::TYPE_NAME,
        doc: "DoorStatusArray; \"\": not published",
        ..STATE
    },
    OutgoingRow {
        topic: OutgoingTopic::Diagnostics,
        flow: TopicFlow::Gateway,
        key: Some(TopicKey { section: "ros.topics", key: "diagnostics" }),
        default_name: "/diagnostics",
        type_name: DiagnosticArray::TYPE_NAME,
        doc: "DiagnosticArray",
        durability: Some(Durability::Volatile),
        depth: 10,
        delivery: Delivery::Once,
        max_waiting: 64,
        when: "4 Hz and at once on a change",
    },
    OutgoingRow {
        topic: OutgoingTopic::TurnCommand,
        key: Some(TopicKey { section: "turn_signal.outputs", key: "turn_command" }),
        default_name: "/planning/turn_indicators_cmd",
        type_name: TurnIndicatorsCommand::TYPE_NAME,
        doc: "TurnIndicatorsCommand",
        ..DECISION
    },
    OutgoingRow {
        topic: OutgoingTopic::HazardCommand,
        key: Some(TopicKey { section: "turn_signal.outputs", key: "hazard_command" }),
        default_name: "/planning/hazard_lights_cmd",
        type_name: HazardLightsCommand::TYPE_NAME,
        doc: "HazardLightsCommand",
        ..DECISION
    },
    OutgoingRow {
        topic: OutgoingTopic::SectionMarkers,
        key: Some(TopicKey { section: "turn_signal.outputs", key: "markers" }),
        type_name: MarkerArray::TYPE_NAME,
        doc: "e.g. \"/turn_signal/sections\": the sections as markers for RViz; also in shadow mode",
        ..DECISION
    },
    OutgoingRow {
        topic: OutgoingTopic::PlanningFactors,
        key: Some(TopicKey { section: "turn_signal.outputs", key: "planning_factors" }),
        type_name: PlanningFactorArray::TYPE_NAME,
        doc: "e.g. \"/planning/planning_factors/signal_gateway\": what is signalled, as a planning factor; also in \
              shadow mode",
        ..DECISION
    },
    OutgoingRow {
        topic: OutgoingTopic::Log,
        flow: TopicFlow::Gateway,
        key: None,
        default_name: LOG_NAME,
        type_name: Log::TYPE_NAME,
        doc: "",
        durability: Some(Durability::TransientLocal),
        // `rclcpp` keeps a thousand messages of all levels.
        depth: LOG_DEPTH,
        delivery: Delivery::Log,
        // As many as the process log keeps, plus one that counts the others.
        max_waiting: 129,
        when: "each warning and error of the log",
    },
];

/// Default row of a report.
const REPORT: OutgoingRow = OutgoingRow {
    topic: OutgoingTopic::TurnIndicatorsReport,
    flow: TopicFlow::VehicleLights,
    key: None,
    default_name: "",
    type_name: "",
    doc: "",
    durability: None,
    depth: 1,
    delivery: Delivery::Report,
    max_waiting: 1,
    when: "10 Hz and at once on a change",
};
/// Default row of a vehicle state.
const STATE: OutgoingRow = OutgoingRow { flow: TopicFlow::VehicleStatus, ..REPORT };
/// Default row of a report that is published with each frame. A late reader would mistake an earlier report
/// for a current one.
const MEASUREMENT: OutgoingRow = OutgoingRow {
    durability: Some(Durability::Volatile),
    delivery: Delivery::Live,
    when: "with each frame, at most 50 Hz",
    ..STATE
};
/// Default row of a topic of the decider. Messages are not kept for late readers, since they would be
/// outdated.
const DECISION: OutgoingRow = OutgoingRow {
    flow: TopicFlow::TurnSignal,
    durability: Some(Durability::Volatile),
    delivery: Delivery::Once,
    when: "10 Hz",
    ..REPORT
};

/// The log topic of all nodes; tools know it only by this name.
pub const LOG_NAME: &str = "/rosout";

impl OutgoingTopic {
    /// Returns the fixed properties of the topic.
    pub fn row(self) -> &'static OutgoingRow {
        &OUTGOING[self as usize]
    }
}

/// The published topics, by absolute names (`/…`).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topics {
    names: BTreeMap<OutgoingTopic, String>,
    /// Traffic lights; none unless configured.
    pub lights: Vec<LightsTopicSettings>,
}

impl Default for Topics {
    /// Creates the topics of the vehicle's lights and of the diagnostics, with the names that Autoware
    /// expects.
    fn default() -> Self {
        let topics = [
            OutgoingTopic::TurnIndicatorsReport,
            OutgoingTopic::HazardLightsReport,
            OutgoingTopic::Diagnostics,
        ];
        let names = topics.map(|topic| (topic, topic.row().default_name.to_owned()));
        Self { names: names.into(), lights: Vec::new() }
    }
}

impl Topics {
    /// Returns the topics with this topic under `name`, or without it if `name` is empty.
    pub fn with(mut self, topic: OutgoingTopic, name: &str) -> Self {
        if name.is_empty() {
            self.names.remove(&topic);
        } else {
            self.names.insert(topic, name.to_owned());
        }
        self
    }

    /// Returns the name of a topic; `None` if it is not published.
    pub fn name(&self, topic: OutgoingTopic) -> Option<&str> {
        self.names.get(&topic).map(String::as_str)
    }

    /// Returns the published topics except traffic lights, in order, with their names.
    pub fn named(&self) -> impl Iterator<Item = (OutgoingTopic, &str)> {
        self.names.iter().map(|(topic, name)| (*topic, name.as_str()))
    }

    /// Returns the names of all published topics.
    pub fn names_mut(&mut self) -> impl Iterator<Item = &mut String> {
        self.names.values_mut().chain(self.lights.iter_mut().map(|topic| &mut topic.name))
    }
}

/// A topic with traffic lights. Several topics can carry the same emissions, e.g. the V2I topic and its
/// legacy name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightsTopicSettings {
    /// The emissions that are published there.
    pub topic: LightsTopic,
    /// Absolute name of the topic.
    pub name: String,
    /// Message type of the emissions.
    pub lights: LightsType,
    /// The numbering of shapes and the width of ids that the message uses.
    pub compat: Compat,
}

/// Returns the type of the messages and the history depth of the writer.
pub const fn lights_row(lights: LightsType) -> (TypeName, i32) {
    match lights {
        LightsType::ArrayV1 => (TrafficLightArrayV1::TYPE_NAME, 10),
        LightsType::SignalArray => (TrafficSignalArray::TYPE_NAME, 10),
        LightsType::GroupArray => (TrafficLightGroupArray::TYPE_NAME, 10),
        LightsType::MarkerArray => (MarkerArray::TYPE_NAME, 1),
        LightsType::Clock => (Clock::TYPE_NAME, 1),
    }
}
