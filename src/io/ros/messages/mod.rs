//! The ROS 2 messages this gateway sends and receives, field by field as their `.msg` files define
//! them; one file for each message, with those of `autoware_vehicle_msgs` in `vehicle`.
//!
//! One `Serialize` serves two readers: CDR on the wire (fields in order) and JSON for people and
//! scripts (fields by name; `level` is a number). Conversions from the core's types go one way.
//! Sources: `builtin_interfaces`, `rcl_interfaces`, `rosgraph_msgs`, `std_msgs`, `geometry_msgs`, `nav_msgs`, `sensor_msgs`,
//! `visualization_msgs` and `diagnostic_msgs` of `common_interfaces`, `unique_identifier_msgs` (Humble and
//! Jazzy lay them out alike); `autoware_vehicle_msgs`, `autoware_perception_msgs` and
//! `autoware_planning_msgs` 1.12, `autoware_internal_planning_msgs` 1.12, `autoware_adapi_v1_msgs`,
//! `traffic_simulator_msgs` 25.0.

mod array_element;
mod bounded;
mod cdr_bytes;
mod clock;
mod diagnostics;
mod element;
mod geometry;
mod lanelet_route;
mod lights;
mod lights_encoder;
mod log;
mod marker;
mod marker_array;
mod odometry;
mod operation_mode_state;
mod parameters;
mod path_with_lane_id;
mod planning_factor_array;
mod pose_with_uuid_stamped;
mod scenario;
mod section_markers;
mod stamp;
mod text;
mod traffic_light_array_v1;
mod traffic_light_group_array;
mod traffic_signal_array;
mod vehicle;

pub use cdr_bytes::CdrBytes;
pub use clock::Clock;
pub use diagnostics::{DiagnosticArray, DiagnosticStatus, KeyValue};
pub use element::TrafficLightElement;
pub use geometry::{Point, Pose, PoseWithCovariance, Quaternion, Twist, TwistWithCovariance, Vector3};
pub use lanelet_route::{LaneletPrimitive, LaneletRoute, LaneletSegment, Uuid};
pub use lights::{LightsMessage, LightsType};
pub use lights_encoder::LightsEncoder;
pub use log::Log;
pub use marker::{ColorRgba, CompressedImage, Marker, MeshFile, UvCoordinate};
pub use marker_array::MarkerArray;
pub use odometry::Odometry;
pub use operation_mode_state::OperationModeState;
pub use parameters::{
    FloatingPointRange, IntegerRange, ListParametersRequest, ListParametersResponse, NamedParameterValue,
    ParameterDescriptor, ParameterEvent, ParameterNames, ParameterValue, SetParametersRequest,
    SetParametersResult,
};
pub use path_with_lane_id::{PathPoint, PathPointWithLaneId, PathWithLaneId};
pub use planning_factor_array::{
    ControlPoint, PlanningFactor, PlanningFactorArray, PredictedPath, SafetyFactor, SafetyFactorArray,
};
pub use pose_with_uuid_stamped::{FlaggedPoseWithUuidStamped, PoseWithUuidStamped};
pub use scenario::Scenario;
pub use stamp::{Duration, Header, Time};
pub use text::Text;
pub use traffic_light_array_v1::{TrafficLightArrayV1, TrafficLightBulbV1, TrafficLightV1};
pub use traffic_light_group_array::{PredictedTrafficLightState, TrafficLightGroup, TrafficLightGroupArray};
pub use traffic_signal_array::{TrafficSignal, TrafficSignalArray};
pub use vehicle::{
    ControlModeReport, HazardLightsCommand, HazardLightsReport, TurnIndicatorsCommand, TurnIndicatorsReport,
};

#[cfg(test)]
mod autoware_tests;
#[cfg(test)]
mod golden;
#[cfg(test)]
mod lights_tests;
#[cfg(test)]
mod vehicle_tests;
