//! `[traffic_lights.topics]` and `[traffic_lights.inputs]`: topics that are written and read.

use crate::config::reading::fields::Fields;
use crate::core::traffic_light::architecture::LightsType;
use crate::core::traffic_light::emission::LightsTopic;
use crate::core::traffic_light::target::StoreId;

/// A topic that is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightsOutput {
    /// Content of the topic.
    pub topic: LightsTopic,
    /// Name of the topic.
    pub name: String,
    /// Type of the message.
    pub message: LightsType,
}

/// Reads the topics that are written; one without a name is not.
pub(super) fn outputs(
    fields: Fields<'_>,
    [camera, v2i]: [LightsType; 2],
    has_arbiter: bool,
) -> Vec<LightsOutput> {
    const GROUND_TRUTH: &str = "/simulation/traffic_lights";
    const CAMERA: &str = "/perception/traffic_light_recognition/internal/traffic_signals";
    const V2I: &str = "/perception/traffic_light_recognition/external/traffic_signals";
    const V2I_LEGACY: &str = "/v2x/traffic_signals";
    let arbiter = if has_arbiter { "/perception/traffic_light_recognition/traffic_signals" } else { "" };
    let topics = [
        ("ground_truth", GROUND_TRUTH, LightsTopic::GroundTruth, LightsType::ArrayV1),
        ("camera", CAMERA, LightsTopic::Camera, camera),
        ("v2i", V2I, LightsTopic::V2i, v2i),
        ("v2i_legacy", V2I_LEGACY, LightsTopic::V2i, v2i),
        ("arbiter", arbiter, LightsTopic::Arbiter, LightsType::GroupArray),
        ("markers", "", LightsTopic::Markers, LightsType::MarkerArray),
        ("clock", "", LightsTopic::Clock, LightsType::Clock),
    ];
    let mut outputs: Vec<LightsOutput> = Vec::new();
    for (key, default, topic, message) in topics {
        let name = fields.optional_topic(key, default);
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
    fields.done();
    outputs
}

/// The topics that are read.
#[derive(Debug, Default)]
pub(super) struct InputTopics {
    /// Topics of states, each for one store.
    pub(super) states: Vec<(StoreId, String)>,
    /// The topic of a camera pipeline, for the arbiter.
    pub(super) camera: Option<String>,
    /// The topic of actions.
    pub(super) command: Option<String>,
}

/// Reads the topics that are read.
pub(super) fn inputs(fields: Fields<'_>, outputs: &[LightsOutput], has_arbiter: bool) -> InputTopics {
    let mut taken: Vec<String> = outputs.iter().map(|lights_output| lights_output.name.clone()).collect();
    let mut input = |key| {
        fields.value(key)?;
        let name = fields.topic(key, "");
        // A topic that is written, or read for something else, is not an input.
        if taken.contains(&name) {
            fields.refuse(key, "another topic has this name", "give each its own");
        }
        taken.push(name.clone());
        Some(name)
    };
    let states = StoreId::ALL.map(|store| Some((store, input(store.name())?)));
    let (camera, command) = (input("camera"), input("command"));
    if camera.is_some() && !has_arbiter {
        fields.refuse("camera", "there is no arbiter", "add [traffic_lights.arbiter]");
    }
    fields.done();
    InputTopics { states: states.into_iter().flatten().collect(), camera, command }
}
