//! `autoware_perception_msgs/msg/TrafficLightGroupArray`: group by group, with predictions.
//!
//! Releases before 2025-05 have no `predictions`; their layout is that of
//! [`TrafficSignalArray`](super::TrafficSignalArray).

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::array_element::{ArrayElement, StampPlace, elements};
use super::element::{TrafficLightElement, id};
use super::stamp::Time;
use crate::core::compat::Compat;
use crate::core::time::WallStamp;
use crate::core::traffic_light::emission::{GroupState, Prediction};

/// `autoware_perception_msgs/msg/PredictedTrafficLightState`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PredictedTrafficLightState {
    /// When it begins.
    pub predicted_stamp: Time,
    /// The elements from then on.
    pub simultaneous_elements: Vec<TrafficLightElement>,
    /// 0 to 1.
    pub reliability: f32,
    /// One of the constants below.
    pub information_source: String,
}

impl PredictedTrafficLightState {
    /// From a network of the operator.
    pub const INFORMATION_SOURCE_V2N: &'static str = "V2N";
    /// From the infrastructure.
    pub const INFORMATION_SOURCE_V2I: &'static str = "V2I";
    /// From another vehicle.
    pub const INFORMATION_SOURCE_V2V: &'static str = "V2V";
    /// From the vehicle's own sensors.
    pub const INFORMATION_SOURCE_LOCAL_PERCEPTION: &'static str = "LOCAL_PERCEPTION";
    /// From a person.
    pub const INFORMATION_SOURCE_MANUAL_OVERRIDE: &'static str = "MANUAL_OVERRIDE";
    /// From a simulation.
    pub const INFORMATION_SOURCE_SIMULATION: &'static str = "SIMULATION";
    /// From an estimation of its own.
    pub const INFORMATION_SOURCE_INTERNAL_ESTIMATION: &'static str = "INTERNAL_ESTIMATION";

    fn new(prediction: &Prediction, compat: Compat) -> Self {
        #[allow(clippy::cast_possible_truncation)] // the field is no wider
        let reliability = prediction.reliability as f32;
        Self {
            predicted_stamp: prediction.at.into(),
            simultaneous_elements: TrafficLightElement::all(&prediction.elements, compat),
            reliability,
            information_source: prediction.source.to_owned(),
        }
    }
}

/// `autoware_perception_msgs/msg/TrafficLightGroup`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrafficLightGroup {
    /// Id of the regulatory element.
    pub traffic_light_group_id: i64,
    /// Ascending by the key of the bulb.
    pub elements: Vec<TrafficLightElement>,
    /// Ascending by time.
    pub predictions: Vec<PredictedTrafficLightState>,
}

/// `autoware_perception_msgs/msg/TrafficLightGroupArray`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrafficLightGroupArray {
    /// Time of the states.
    pub stamp: Time,
    /// The groups.
    pub traffic_light_groups: Vec<TrafficLightGroup>,
}

impl TrafficLightGroupArray {
    /// The message that shows `groups`.
    pub fn new(groups: &[Arc<GroupState>], stamp: WallStamp, compat: Compat) -> Self {
        Self { stamp: stamp.into(), traffic_light_groups: elements(groups, stamp, compat) }
    }
}

impl ArrayElement for TrafficLightGroup {
    type Item = Arc<GroupState>;
    const STAMP: StampPlace = StampPlace::Message;
    const ALIGNMENT: usize = 8;

    fn new(group: &Arc<GroupState>, _stamp: WallStamp, compat: Compat) -> Self {
        let predicted = |prediction: &Prediction| PredictedTrafficLightState::new(prediction, compat);
        Self {
            traffic_light_group_id: id(group.relation_id, compat),
            elements: TrafficLightElement::all(&group.elements, compat),
            predictions: group.predictions.iter().map(predicted).collect(),
        }
    }

    fn is_same(one: &Arc<GroupState>, other: &Arc<GroupState>) -> bool {
        Arc::ptr_eq(one, other) || one == other
    }
}
