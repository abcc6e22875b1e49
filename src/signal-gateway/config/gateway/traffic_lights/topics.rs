//! `[traffic_lights.topics]` and `[traffic_lights.inputs]`: published and subscribed topics.

use crate::config::reading::{ConfigKey, Fields};
use traffic_lights::architecture::LightsType;
use traffic_lights::emission::LightsTopic;
use traffic_lights::target::StoreId;

/// A published topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightsOutput {
    /// Content of the topic.
    pub topic: LightsTopic,
    /// Name of the topic.
    pub name: String,
    /// Type of the message.
    pub message: LightsType,
}

pub(in crate::config::gateway) mod written {
    use crate::config::reading::{key_rows, optional_topic};

    key_rows! {
        GROUND_TRUTH: String = optional_topic("ground_truth", "/simulation/traffic_lights").doc("TrafficLightArrayV1");
        CAMERA: String = optional_topic("camera", "/perception/traffic_light_recognition/internal/traffic_signals").doc("the camera's states");
        V2I: String = optional_topic("v2i", "/perception/traffic_light_recognition/external/traffic_signals").doc("V2I states");
        V2I_LEGACY: String = optional_topic("v2i_legacy", "/v2x/traffic_signals").doc("V2I states, for older receivers");
        ARBITER: String = optional_topic("arbiter", "/perception/traffic_light_recognition/traffic_signals")
            .doc("published only with [traffic_lights.arbiter]");
        MARKERS: String = optional_topic("markers", "").doc("e.g. \"/traffic_light/marker\": spheres for RViz");
        CLOCK: String = optional_topic("clock", "").doc("\"/clock\": rosgraph_msgs/Clock with the time of each frame; not with use_sim_time");
    }

    pub(super) static ALL: [&super::ConfigKey<String>; 7] =
        [&GROUND_TRUTH, &CAMERA, &V2I, &V2I_LEGACY, &ARBITER, &MARKERS, &CLOCK];
}

/// Reads the published topics; a topic without a name is not published.
pub(super) fn outputs(
    fields: &Fields<'_>,
    [camera, v2i]: [LightsType; 2],
    has_arbiter: bool,
) -> Vec<LightsOutput> {
    let topics = [
        (LightsTopic::GroundTruth, LightsType::ArrayV1),
        (LightsTopic::Camera, camera),
        (LightsTopic::V2i, v2i),
        (LightsTopic::V2i, v2i),
        (LightsTopic::Arbiter, LightsType::GroupArray),
        (LightsTopic::Markers, LightsType::MarkerArray),
        (LightsTopic::Clock, LightsType::Clock),
    ];
    let mut outputs: Vec<LightsOutput> = Vec::new();
    for (row, (topic, message)) in written::ALL.into_iter().zip(topics) {
        let (key, name) = (row.name, fields.read(row));
        if topic == LightsTopic::Arbiter && !has_arbiter && !fields.has(key) {
            fields.record(row, "\"\"");
            continue;
        }
        if name.is_empty() {
            continue;
        }
        if fields.has(key) && outputs.iter().any(|other| other.name == name) {
            fields.refuse(key, "another topic has this name", "give each its own, or \"\"");
        }
        if topic == LightsTopic::Arbiter && !has_arbiter {
            fields.refuse(key, "there is no arbiter", "add [traffic_lights.arbiter]");
        }
        outputs.push(LightsOutput { topic, name, message });
    }
    outputs
}

pub(in crate::config::gateway) mod read {
    use crate::config::reading::{ConfigKey, ValueShape, key_rows, other, read_topic};

    key_rows! {
        CONVENTIONAL: String = input("conventional").example("\"/traffic_lights/ground_truth/conventional\"")
            .doc("TrafficLightGroupArray; ids of groups or heads");
        CONVENTIONAL_DETECTED: String = input("conventional_detected").example("\"/traffic_lights/detected/conventional\"").doc("states as a detector reports them");
        V2I: String = input("v2i").example("\"/traffic_lights/ground_truth/v2i\"").doc("states that the infrastructure sends");
        V2I_DETECTED: String = input("v2i_detected").example("\"/traffic_lights/detected/v2i\"").doc("infrastructure states as they are received");
        CAMERA: String = input("camera").example("\"/traffic_lights/camera\"")
            .doc("TrafficLightGroupArray of a camera pipeline for the arbiter; Autoware's is on …/internal/traffic_signals: then topics.camera = \"\"");
        COMMAND: String = input("command").example("\"/traffic_lights/command\"")
            .doc("std_msgs/String, e.g. TrafficSignalControllerAction(A, go)");
    }

    pub(super) static STATES: [&ConfigKey<String>; 4] =
        [&CONVENTIONAL, &CONVENTIONAL_DETECTED, &V2I, &V2I_DETECTED];
    pub(super) static OTHERS: [&ConfigKey<String>; 2] = [&CAMERA, &COMMAND];

    const fn input(name: &'static str) -> ConfigKey<String> {
        other(name, || ValueShape::Text, read_topic, |_| None).restart()
    }
}

#[derive(Debug, Default)]
pub(super) struct InputTopics {
    /// Topics of states, each for one store.
    pub(super) states: Vec<(StoreId, String)>,
    /// The topic of a camera pipeline, for the arbiter.
    pub(super) camera: Option<String>,
    pub(super) command: Option<String>,
}

pub(super) fn inputs(fields: &Fields<'_>, outputs: &[LightsOutput], has_arbiter: bool) -> InputTopics {
    let mut taken: Vec<String> = outputs.iter().map(|lights_output| lights_output.name.clone()).collect();
    let mut input = |key: &'static ConfigKey<String>| {
        let name = fields.given(key)?;
        // A topic that is published, or subscribed to for another purpose, is not an input.
        if taken.contains(&name) {
            fields.refuse(key.name, "another topic has this name", "give each its own");
        }
        taken.push(name.clone());
        Some(name)
    };
    let states = read::STATES.map(|key| {
        let store = StoreId::ALL.into_iter().find(|store| store.name() == key.name)?;
        Some((store, input(key)?))
    });
    let [camera, command] = read::OTHERS.map(input);
    if camera.is_some() && !has_arbiter {
        fields.refuse("camera", "there is no arbiter", "add [traffic_lights.arbiter]");
    }
    InputTopics { states: states.into_iter().flatten().collect(), camera, command }
}
