//! The ROS 2 messages this gateway sends and receives, field by field as their `.msg` files define
//! them; one file for each target.
//!
//! One `Serialize` serves two readers: CDR on the wire (fields in order) and JSON for people and
//! scripts (fields by name; `level` is a number). Conversions from the core's types go one way.
//! Sources: `builtin_interfaces`, `std_msgs`, `geometry_msgs`, `sensor_msgs`, `visualization_msgs` and
//! `diagnostic_msgs` of `common_interfaces` (Humble and Jazzy lay them out alike);
//! `autoware_vehicle_msgs` 1.12, `autoware_perception_msgs` 1.12, `traffic_simulator_msgs` 25.0.

mod diagnostics;
mod element;
mod lights;
mod marker;
mod marker_array;
mod received_groups;
mod reports;
mod stamp;
mod text;
mod traffic_light_array_v1;
mod traffic_light_group_array;
mod traffic_signal_array;

pub use diagnostics::{DiagnosticArray, DiagnosticStatus, KeyValue};
pub use element::{TrafficLightElement, Unfit};
pub use lights::{LightsMessage, LightsType};
pub use marker::{
    ColorRgba, CompressedImage, Duration, Marker, MeshFile, Point, Pose, Quaternion, UvCoordinate, Vector3,
};
pub use marker_array::MarkerArray;
pub use received_groups::{ReceivedGroup, ReceivedGroups, Rejection};
pub use reports::{HazardLightsReport, TurnIndicatorsReport};
pub use stamp::{Header, Time};
pub use text::Text;
pub use traffic_light_array_v1::{TrafficLightArrayV1, TrafficLightBulbV1, TrafficLightV1};
pub use traffic_light_group_array::{PredictedTrafficLightState, TrafficLightGroup, TrafficLightGroupArray};
pub use traffic_signal_array::{TrafficSignal, TrafficSignalArray};

#[cfg(test)]
mod golden;
#[cfg(test)]
mod lights_tests;
#[cfg(test)]
mod vehicle_tests;
