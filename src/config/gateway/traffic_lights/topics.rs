//! `[traffic_lights.topics]` and `[traffic_lights.inputs]`: topics that are written and read.

use serde::Deserialize;
use toml::Spanned;

use crate::config::reading::checker::Checker;
use crate::core::traffic_light::architecture::LightsType;
use crate::core::traffic_light::emission::LightsTopic;
use crate::core::traffic_light::target::{Channel, Layer, StoreId};

/// `[traffic_lights.topics]`; an empty name = not published.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightTopicsFile {
    /// `TrafficLightArrayV1`
    pub ground_truth: Option<Spanned<String>>,
    /// By architecture.
    pub camera: Option<Spanned<String>>,
    /// By architecture.
    pub v2i: Option<Spanned<String>>,
    /// The older name of the same.
    pub v2i_legacy: Option<Spanned<String>>,
    /// `TrafficLightGroupArray`
    pub arbiter: Option<Spanned<String>>,
    /// `MarkerArray`
    pub markers: Option<Spanned<String>>,
}

/// `[traffic_lights.inputs]`; absent = not read.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightInputsFile {
    /// `TrafficLightGroupArray` for a store.
    pub conventional: Option<Spanned<String>>,
    /// Likewise.
    pub conventional_detected: Option<Spanned<String>>,
    /// Likewise.
    pub v2i: Option<Spanned<String>>,
    /// Likewise.
    pub v2i_detected: Option<Spanned<String>>,
    /// `std_msgs/String`: actions.
    pub command: Option<Spanned<String>>,
}

/// A topic that is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightsOutput {
    /// What goes there.
    pub topic: LightsTopic,
    /// Its name.
    pub name: String,
    /// As which message.
    pub message: LightsType,
}

/// The topics that are written, of those that have a name.
pub(super) fn outputs(
    checker: &mut Checker<'_>,
    file: &LightTopicsFile,
    [camera, v2i]: [LightsType; 2],
    has_arbiter: bool,
) -> Vec<LightsOutput> {
    const SIGNALS: &str = "/perception/traffic_light_recognition";
    let named = [
        (
            &file.ground_truth,
            "/simulation/traffic_lights".to_owned(),
            LightsTopic::GroundTruth,
            LightsType::ArrayV1,
        ),
        (&file.camera, format!("{SIGNALS}/internal/traffic_signals"), LightsTopic::Camera, camera),
        (&file.v2i, format!("{SIGNALS}/external/traffic_signals"), LightsTopic::V2i, v2i),
        (&file.v2i_legacy, "/v2x/traffic_signals".to_owned(), LightsTopic::V2i, v2i),
        (
            &file.arbiter,
            if has_arbiter { format!("{SIGNALS}/traffic_signals") } else { String::new() },
            LightsTopic::Arbiter,
            LightsType::GroupArray,
        ),
        (&file.markers, String::new(), LightsTopic::Markers, LightsType::MarkerArray),
    ];
    if let Some(given) = file.arbiter.as_ref().filter(|given| !has_arbiter && !given.get_ref().is_empty()) {
        checker.refuse(given, "there is no arbiter", "add [traffic_lights.arbiter]");
    }
    let mut outputs: Vec<LightsOutput> = Vec::new();
    for (given, default, topic, message) in named {
        let name = given.as_ref().map_or(default, |given| given.get_ref().clone());
        if name.is_empty() {
            continue;
        }
        if let Some(given) = given {
            checker.topic(Some(given), "");
            if outputs.iter().any(|other| other.name == name) {
                checker.refuse(given, "another topic has this name", "give each its own, or \"\"");
            }
        }
        outputs.push(LightsOutput { topic, name, message });
    }
    outputs
}

/// The topics that are read: for a store each, and for actions.
pub(super) fn inputs<'f>(
    checker: &mut Checker<'_>,
    file: &'f LightInputsFile,
    outputs: &'f [LightsOutput],
) -> (Vec<(StoreId, String)>, Option<String>) {
    let mut taken: Vec<&'f str> = outputs.iter().map(|lights_output| lights_output.name.as_str()).collect();
    let stores = [
        (&file.conventional, Channel::Conventional, Layer::GroundTruth),
        (&file.conventional_detected, Channel::Conventional, Layer::Detected),
        (&file.v2i, Channel::V2i, Layer::GroundTruth),
        (&file.v2i_detected, Channel::V2i, Layer::Detected),
    ];
    let mut inputs = Vec::new();
    for (given, channel, layer) in stores {
        if let Some(given) = given {
            input(checker, given, &mut taken);
            inputs.push((StoreId { channel, layer }, given.get_ref().clone()));
        }
    }
    let command = file.command.as_ref().map(|given| {
        input(checker, given, &mut taken);
        given.get_ref().clone()
    });
    (inputs, command)
}

/// What we publish, or read for something else, is not an input.
fn input<'f>(checker: &mut Checker<'_>, given: &'f Spanned<String>, taken: &mut Vec<&'f str>) {
    checker.topic(Some(given), "");
    let name = given.get_ref().as_str();
    if taken.contains(&name) {
        checker.refuse(given, "another topic has this name", "give each its own");
    }
    taken.push(name);
}
