//! Messages with traffic lights: converts an emission to the message of each type.

use serde::{Serialize, Serializer};

use super::marker_array::{delete_all, spheres};
use super::traffic_light_array_v1::light_array_v1;
use super::traffic_light_group_array::{group_array, signal_array};
use ros_messages::autoware_perception_msgs::{TrafficLightGroupArray, TrafficSignalArray};
use ros_messages::rosgraph_msgs::Clock;
use ros_messages::traffic_simulator_msgs::TrafficLightArrayV1;
use ros_messages::visualization_msgs::MarkerArray;
pub use traffic_lights::architecture::LightsType;
use traffic_lights::compat::Compat;
use traffic_lights::emission::{Emission, LightsContent};

/// A message that shows traffic lights.
#[derive(Debug, Clone, PartialEq)]
pub enum LightsMessage {
    /// One entry for each head.
    ArrayV1(TrafficLightArrayV1),
    /// One entry for each group.
    SignalArray(TrafficSignalArray),
    /// One entry for each group, with predictions.
    GroupArray(TrafficLightGroupArray),
    /// One marker for each lamp.
    MarkerArray(MarkerArray),
    /// Time of the frame.
    Clock(Clock),
}

impl LightsMessage {
    /// Returns the messages of a type for an emission, in sending order: none if the type does not fit the
    /// content, two for upstream's markers, otherwise one.
    pub fn of(emission: &Emission, lights: LightsType, compat: Compat) -> Vec<Self> {
        let stamp = emission.stamp;
        match (&emission.content, lights) {
            (LightsContent::Lights(heads), LightsType::ArrayV1) => {
                vec![Self::ArrayV1(light_array_v1(heads, compat))]
            }
            (LightsContent::Groups(groups), LightsType::SignalArray) => {
                vec![Self::SignalArray(signal_array(groups, stamp, compat))]
            }
            (LightsContent::Groups(groups), LightsType::GroupArray) => {
                vec![Self::GroupArray(group_array(groups, stamp, compat))]
            }
            (LightsContent::Markers(lamps), LightsType::MarkerArray) => {
                let spheres = Self::MarkerArray(spheres(lamps, stamp, compat));
                match compat {
                    Compat::Improved => vec![spheres],
                    Compat::Upstream => vec![Self::MarkerArray(delete_all(stamp)), spheres],
                }
            }
            (LightsContent::Clock, LightsType::Clock) => vec![Self::Clock(Clock { clock: stamp.into() })],
            (
                LightsContent::Lights(_)
                | LightsContent::Groups(_)
                | LightsContent::Markers(_)
                | LightsContent::Clock,
                _,
            ) => Vec::new(),
        }
    }
}

/// Serialises the message itself, without the variant.
impl Serialize for LightsMessage {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::ArrayV1(message) => message.serialize(serializer),
            Self::SignalArray(message) => message.serialize(serializer),
            Self::GroupArray(message) => message.serialize(serializer),
            Self::MarkerArray(message) => message.serialize(serializer),
            Self::Clock(message) => message.serialize(serializer),
        }
    }
}
