//! JSON objects for programs, with all states, changed or not. `lights --help` describes them.

use std::fmt::{Display, Write as _};
use std::sync::Arc;

use serde_json::{Value, json};

use super::entry::entry;
use super::snapshot::{Snapshot, States, time_of};
use crate::config::scenario::LightNames;
use crate::report::seconds;
use gateway_base::time::MonoTime;
use traffic_lights::bulb::Bulb;
use traffic_lights::emission::{GroupElement, GroupState, Groups, Prediction};
use traffic_lights::target::{LightChannel, StoreId, StoreLayer};

/// Returns the object of a snapshot as text. Values are serialised one by one, since the values of all lights
/// of a large map would need 60 times the memory of their text. Ids with names in `names` are shown by name.
pub(super) fn object(snapshot: &Snapshot<'_>, names: &LightNames) -> String {
    let states = snapshot.states;
    let events = snapshot.events.iter().map(|logged| entry(&logged.event, snapshot.scenario).fields);
    let groups = |groups: Option<&Groups>, value: fn(&Arc<GroupState>) -> Value| {
        groups.map_or_else(|| "null".to_owned(), |groups| array(groups.iter().map(value), names))
    };
    format!(
        "{{\"t\":{},\"events\":{},\"ground_truth\":{},\"detected\":{},\"internal\":{},\"external\":{}}}",
        json!(seconds(snapshot.at)),
        array(events, names),
        channels(states, StoreLayer::GroundTruth, names),
        channels(states, StoreLayer::Detected, names),
        groups(states.internal.as_ref(), internal),
        groups(states.external.as_ref(), external),
    )
}

pub(super) fn undecided(at: MonoTime, reason: &str) -> Value {
    json!({ "t": seconds(at), "events": [{ "what": "end", "verdict": "undecided", "reason": reason }] })
}

fn channels(states: &States, layer: StoreLayer, names: &LightNames) -> String {
    let lights = |channel| {
        let lights = states.store(StoreId { channel, layer });
        joined(lights.map(|(id, light)| {
            let state = json!({ "state": light.bulbs.to_string(), "confidence": light.confidence });
            format!("{}:{state}", Value::from(names.in_text(&id.to_string())))
        }))
    };
    format!(
        "{{\"conventional\":{{{}}},\"v2i\":{{{}}}}}",
        lights(LightChannel::Conventional),
        lights(LightChannel::V2i)
    )
}

fn array(values: impl Iterator<Item = Value>, names: &LightNames) -> String {
    format!("[{}]", joined(values.map(|value| names.in_json(value))))
}

fn joined<T: Display>(values: impl Iterator<Item = T>) -> String {
    let mut text = String::new();
    for value in values {
        if !text.is_empty() {
            text.push(',');
        }
        // Writing to a text cannot fail.
        let _ = write!(text, "{value}");
    }
    text
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
