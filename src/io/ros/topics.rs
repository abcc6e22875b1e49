//! Where the messages go and come from: topic names, type names and quality of service.
//!
//! Reports are reliable with depth 1, diagnostics reliable, volatile, with depth 10
//! (vehicle-interface sections 1.1 and 1.7); traffic lights reliable, transient local, with depth 10,
//! markers with depth 1 (traffic-lights section 5.3).

use super::messages::LightsType;
use crate::core::traffic_light::compat::Compat;
use crate::core::traffic_light::emission::LightsTopic;
use crate::core::traffic_light::target::StoreId;

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
    pub lights: Vec<LightsOutlet>,
}

impl Default for Topics {
    /// What Autoware and its diagnostics expect.
    fn default() -> Self {
        Self {
            turn_indicators: "/vehicle/status/turn_indicators_status".to_owned(),
            hazard_lights: "/vehicle/status/hazard_lights_status".to_owned(),
            diagnostics: "/diagnostics".to_owned(),
            lights: Vec::new(),
        }
    }
}

/// A topic with traffic lights. Several can show the same emissions, as the V2I topic and its legacy
/// name do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightsOutlet {
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

/// What comes on a topic, and what it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SubscriptionKind {
    /// `TrafficLightGroupArray` for a store: states, of which the newest counts.
    Groups(StoreId),
    /// `std_msgs/msg/String`: commands, of which each counts.
    Command,
}

impl SubscriptionKind {
    /// The topic's type.
    pub const fn type_name(self) -> TypeName {
        match self {
            Self::Groups(_) => LightsType::GroupArray.type_name(),
            Self::Command => TEXT_TYPE,
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
/// Type of commands.
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
/// Samples kept for diagnostics.
pub const DIAGNOSTICS_DEPTH: i32 = 10;
