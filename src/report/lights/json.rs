//! Objects for programs: all states, changed or not. `lights --help` describes them.

use std::sync::Arc;

use serde_json::{Map, Value, json};

use super::entry::entry;
use super::snapshot::{Snapshot, States, time_of};
use crate::core::time::MonoTime;
use crate::core::traffic_light::bulb::Bulb;
use crate::core::traffic_light::emission::{GroupElement, GroupState, Prediction};
use crate::core::traffic_light::target::{LightChannel, StoreId, StoreLayer};
use crate::report::seconds;

pub(super) fn object(snapshot: &Snapshot<'_>) -> Value {
    let states = snapshot.states;
    let events = snapshot.events.iter().map(|logged| entry(&logged.event, snapshot.scenario).fields);
    json!({
        "t": seconds(snapshot.at),
        "events": events.collect::<Vec<_>>(),
        "ground_truth": channels(states, StoreLayer::GroundTruth),
        "detected": channels(states, StoreLayer::Detected),
        "internal": states.internal.as_ref().map(|groups| list(groups, internal)),
        "external": states.external.as_ref().map(|groups| list(groups, external)),
    })
}

/// The object of a verdict that is not known.
pub(super) fn undecided(at: MonoTime, reason: &str) -> Value {
    json!({ "t": seconds(at), "events": [{ "what": "end", "verdict": "undecided", "reason": reason }] })
}

fn channels(states: &States, layer: StoreLayer) -> Value {
    let lights = |channel| -> Map<String, Value> {
        let lights = states.store(StoreId { channel, layer });
        let light = lights.map(|(id, light)| {
            let state = json!({ "state": light.bulbs.to_string(), "confidence": light.confidence });
            (id.to_string(), state)
        });
        light.collect()
    };
    json!({ "conventional": lights(LightChannel::Conventional), "v2i": lights(LightChannel::V2i) })
}

fn internal(group: &Arc<GroupState>) -> Value {
    json!({ "id": group.relation_id, "elements": list(&group.elements, element) })
}

fn external(group: &Arc<GroupState>) -> Value {
    json!({
        "id": group.relation_id,
        "elements": list(&group.elements, element),
        "predictions": list(&group.predictions, prediction),
    })
}

fn element(element: &GroupElement) -> Value {
    let Bulb { color, status, shape } = element.bulb;
    let (color, status, shape) = (color.name(), status.name(), shape.name());
    json!({ "color": color, "status": status, "shape": shape, "confidence": element.confidence })
}

fn prediction(prediction: &Prediction) -> Value {
    json!({
        "at": seconds(time_of(prediction.at)),
        "elements": list(&prediction.elements, element),
        "reliability": prediction.reliability,
        "source": prediction.source,
    })
}

fn list<T>(all: &[T], value: impl Fn(&T) -> Value) -> Vec<Value> {
    all.iter().map(value).collect()
}
