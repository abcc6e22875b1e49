//! `autoware_perception_msgs/msg/TrafficLightGroupArray`: one entry per group, with predictions.
//!
//! Releases before 2025-05 have no `predictions` and use the layout of `TrafficSignalArray`, the legacy form.

use std::borrow::Cow;
use std::sync::Arc;

use super::array_element::{ArrayElement, StampPosition};
use super::element::{bulb, group_elements, id};
use gateway_base::time::WallStamp;
use ros_messages::autoware_perception_msgs::{
    PredictedTrafficLightState, TrafficLightElement, TrafficLightGroup, TrafficLightGroupArray, TrafficSignal,
};
use traffic_lights::bulb::BulbSet;
use traffic_lights::compat::Compat;
use traffic_lights::emission::{GroupElement, GroupState, Prediction};
use traffic_lights::input::TrafficLightInput;
use traffic_lights::received::ReceivedState;
use traffic_lights::target::{LightChannel, StoreId};

pub(super) fn predicted_state(prediction: &Prediction, compat: Compat) -> PredictedTrafficLightState {
    #[allow(clippy::cast_possible_truncation)] // the field is no wider
    let reliability = prediction.reliability as f32;
    PredictedTrafficLightState {
        predicted_stamp: prediction.at.into(),
        simultaneous_elements: group_elements(&prediction.elements, compat),
        reliability,
        information_source: prediction.source.clone().into_owned(),
    }
}

/// Returns the prediction of a message; `None` if one of its numbers is not a constant of its type, or its
/// stamp is invalid.
fn prediction(message: &PredictedTrafficLightState) -> Option<Prediction> {
    let elements = elements_of(&message.simultaneous_elements)?;
    let source = INFORMATION_SOURCES.into_iter().find(|known| *known == message.information_source);
    Some(Prediction {
        at: message.predicted_stamp.checked()?,
        elements,
        reliability: message.reliability.into(),
        source: source.map_or_else(|| message.information_source.clone().into(), Cow::Borrowed),
    })
}

/// Sources for which the type has a constant.
const INFORMATION_SOURCES: [&str; 7] = [
    PredictedTrafficLightState::INFORMATION_SOURCE_V2N,
    PredictedTrafficLightState::INFORMATION_SOURCE_V2I,
    PredictedTrafficLightState::INFORMATION_SOURCE_V2V,
    PredictedTrafficLightState::INFORMATION_SOURCE_LOCAL_PERCEPTION,
    PredictedTrafficLightState::INFORMATION_SOURCE_MANUAL_OVERRIDE,
    PredictedTrafficLightState::INFORMATION_SOURCE_SIMULATION,
    PredictedTrafficLightState::INFORMATION_SOURCE_INTERNAL_ESTIMATION,
];

/// Returns the bulbs with their confidences; `None` if one of them has an undefined number.
fn elements_of(elements: &[TrafficLightElement]) -> Option<Vec<GroupElement>> {
    let element = |element: &TrafficLightElement| {
        Some(GroupElement { bulb: bulb(*element)?, confidence: f64::from(element.confidence) })
    };
    elements.iter().map(element).collect()
}

/// Converts a message to an input for a store. A group without elements removes its state; a group with an
/// undefined number is omitted as a whole and counted; for a prediction, only the prediction is omitted. Only
/// V2I states have predictions.
pub fn groups_for_store(message: &TrafficLightGroupArray, store: StoreId) -> TrafficLightInput {
    let (mut states, mut rejected) = (Vec::new(), 0);
    for group in &message.traffic_light_groups {
        let bulbs: Option<BulbSet> = group.elements.iter().copied().map(bulb).collect();
        let Some(bulbs) = bulbs else {
            rejected += 1;
            continue;
        };
        // The least certain bulb determines the confidence.
        let confidences = group.elements.iter().map(|element| f64::from(element.confidence));
        let confidence = confidences.fold(1.0, f64::min);
        let state = (!bulbs.is_empty()).then(|| {
            let has_predictions = store.channel == LightChannel::V2i;
            let predicted = if has_predictions { group.predictions.as_slice() } else { &[] };
            let predictions: Vec<_> = predicted.iter().filter_map(prediction).collect();
            rejected += u32::try_from(predicted.len() - predictions.len()).unwrap_or(u32::MAX);
            ReceivedState { bulbs, confidence, predictions }
        });
        states.push((group.traffic_light_group_id, state));
    }
    TrafficLightInput::States { store, stamp: message.stamp.into(), states, rejected }
}

/// Converts a camera pipeline's message to an input. A group with an undefined number is omitted as a whole
/// and counted; predictions from cameras are not used.
pub fn groups_for_arbiter(message: &TrafficLightGroupArray) -> TrafficLightInput {
    let group = |group: &TrafficLightGroup| {
        let elements = elements_of(&group.elements)?;
        let relation_id = group.traffic_light_group_id;
        Some(Arc::new(GroupState { relation_id, elements, predictions: Vec::new() }))
    };
    let groups: Vec<_> = message.traffic_light_groups.iter().filter_map(group).collect();
    let rejected = u32::try_from(message.traffic_light_groups.len() - groups.len()).unwrap_or(u32::MAX);
    TrafficLightInput::Camera { stamp: message.stamp.into(), groups: groups.into(), rejected }
}

impl ArrayElement for TrafficLightGroup {
    type Item = Arc<GroupState>;
    const STAMP: StampPosition = StampPosition::Message;
    const ALIGNMENT: usize = 8;

    fn new(group: &Arc<GroupState>, _stamp: WallStamp, compat: Compat) -> Self {
        let predicted = |prediction: &Prediction| predicted_state(prediction, compat);
        Self {
            traffic_light_group_id: id(group.relation_id, compat),
            elements: group_elements(&group.elements, compat),
            predictions: group.predictions.iter().map(predicted).collect(),
        }
    }

    fn is_same(one: &Arc<GroupState>, other: &Arc<GroupState>) -> bool {
        Arc::ptr_eq(one, other) || one == other
    }
}

impl ArrayElement for TrafficSignal {
    type Item = Arc<GroupState>;
    const STAMP: StampPosition = StampPosition::Message;
    const ALIGNMENT: usize = 8;

    fn new(group: &Arc<GroupState>, _stamp: WallStamp, compat: Compat) -> Self {
        let elements = group_elements(&group.elements, compat);
        Self {
            traffic_signal_id: id(group.relation_id, compat),
            elements: elements.into_iter().map(Into::into).collect(),
        }
    }

    fn is_same(one: &Arc<GroupState>, other: &Arc<GroupState>) -> bool {
        Arc::ptr_eq(one, other) || one.elements == other.elements && one.relation_id == other.relation_id
    }
}
