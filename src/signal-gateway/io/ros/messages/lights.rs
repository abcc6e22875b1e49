//! Messages with traffic lights: converts an emission to the message of each type.

use serde::Serialize;

use super::array_element::elements;
use super::marker_array::delete_all;
use ros_messages::autoware_perception_msgs::{TrafficLightGroupArray, TrafficSignalArray};
use ros_messages::rosgraph_msgs::Clock;
use ros_messages::traffic_simulator_msgs::TrafficLightArrayV1;
use ros_messages::visualization_msgs::MarkerArray;
pub use traffic_lights::architecture::LightsType;
use traffic_lights::compat::Compat;
use traffic_lights::emission::{Emission, LightsContent};

/// A message that shows traffic lights.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
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
                let traffic_lights = elements(heads, stamp, compat);
                vec![Self::ArrayV1(TrafficLightArrayV1 { traffic_lights })]
            }
            (LightsContent::Groups(groups), LightsType::SignalArray) => {
                let signals = elements(groups, stamp, compat);
                vec![Self::SignalArray(TrafficSignalArray { stamp: stamp.into(), signals })]
            }
            (LightsContent::Groups(groups), LightsType::GroupArray) => {
                let traffic_light_groups = elements(groups, stamp, compat);
                vec![Self::GroupArray(TrafficLightGroupArray { stamp: stamp.into(), traffic_light_groups })]
            }
            (LightsContent::Markers(lamps), LightsType::MarkerArray) => {
                let spheres = Self::MarkerArray(MarkerArray { markers: elements(lamps, stamp, compat) });
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
