//! `[traffic_lights]`: a scenario on its map, rates, topics, and faults on purpose.

mod arbiter;
mod faults;
mod topics;

use std::collections::BTreeSet;
use std::sync::Arc;

use serde::Deserialize;
use toml::Spanned;

use crate::config::files::Files;
use crate::config::map::read_lights;
use crate::config::reading::checker::Checker;
use crate::config::reading::keyword::Keyword;
use crate::config::scenario::{self, NotInterpreted, ScenarioFile};
use crate::core::compat::Compat;
use crate::core::map::light_map::LightMap;
use crate::core::map::light_roads::LampSource;
use crate::core::traffic_light::architecture::{Architecture, LightsType};
use crate::core::traffic_light::command::RATES_HZ;
use crate::core::traffic_light::emission::LightsTopic;
use crate::core::traffic_light::engine::LightsSettings;
use crate::core::traffic_light::flow::FlowSettings;
use crate::core::traffic_light::periodic_timer::Rate;
use crate::core::traffic_light::target::StoreId;
use arbiter::ArbiterFile;
use faults::{ChannelFaultsFile, faults};
pub use topics::LightsOutput;
use topics::{LightInputsFile, LightTopicsFile, inputs, outputs};

const DEFAULT_ARCHITECTURE: &str = "awf/universe/20240605";

/// `[traffic_lights]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrafficLightsFile {
    /// Scenario, relative to this file.
    pub scenario: Option<Spanned<String>>,
    /// Lanelet2 map, relative to this file.
    pub map: Option<Spanned<String>>,
    /// Whose behaviour.
    #[serde(default)]
    pub compat: Keyword<Compat>,
    /// Generation of Autoware, `awf/universe/<yyyymmdd>`.
    pub architecture: Option<Spanned<String>>,
    /// Evaluation and camera topic, Hz.
    pub frame_rate_hz: Option<Spanned<f64>>,
    /// Ground-truth topic and markers, Hz.
    pub ground_truth_rate_hz: Option<Spanned<f64>>,
    /// V2I topics, Hz.
    pub v2i_rate_hz: Option<Spanned<f64>>,
    /// Enabling a head for V2I copies what it shows.
    pub copy_on_enable: Option<bool>,
    /// A group is sent once for each lit head.
    pub one_group_per_head: Option<bool>,
    /// Limit of V2I states that come over ROS 2 and are not renewed, ms.
    pub v2i_timeout_ms: Option<Spanned<u64>>,
    /// Lamps of heads whose lamps the map does not draw.
    #[serde(default)]
    pub infer_lamps: bool,
    /// Names of the topics that are written.
    #[serde(default)]
    pub topics: LightTopicsFile,
    /// Topics that are read.
    #[serde(default)]
    pub inputs: LightInputsFile,
    /// The arbiter's view.
    pub arbiter: Option<ArbiterFile>,
    /// Faults on purpose.
    #[serde(default)]
    pub faults: ChannelFaultsFile,
}

/// Where traffic lights go to and come from, and what speaks of them.
#[derive(Debug, Default)]
pub struct LightTopics {
    /// In whose numbers messages are.
    pub compat: Compat,
    /// Topics that are written, with the message each carries.
    pub outputs: Vec<LightsOutput>,
    /// Topics that states are read from.
    pub inputs: Vec<(StoreId, String)>,
    /// Topic that actions are read from.
    pub command: Option<String>,
    /// Parts of the scenario that have no effect.
    pub not_interpreted: Vec<NotInterpreted>,
}

/// Checks the section; every problem found is noted.
pub(super) fn traffic_lights(
    files: &dyn Files,
    checker: &mut Checker<'_>,
    file: &TrafficLightsFile,
) -> Option<(FlowSettings, LightTopics)> {
    let compat = file.compat.0;
    let before = checker.problems.len();
    let scenario = read_scenario(checker, files, file, compat);
    let map = read_map(checker, files, file, scenario.as_ref());
    let architecture = messages(checker, file.architecture.as_ref(), compat);
    let rates = [&file.frame_rate_hz, &file.ground_truth_rate_hz, &file.v2i_rate_hz];
    let rates = rates.map(|given| rate(checker, given.as_ref()));
    let timeout = checker.limit(file.v2i_timeout_ms.as_ref());
    let arbiter = file.arbiter.as_ref().map(|arbiter| arbiter::arbiter(checker, arbiter));
    let outputs = architecture.map(|types| outputs(checker, &file.topics, types, arbiter.is_some()));
    let (inputs, command) = inputs(checker, &file.inputs, outputs.as_deref().unwrap_or_default());
    let [camera_faults, v2i_faults] =
        [&file.faults.camera, &file.faults.v2i].map(|given| faults(checker, given.as_ref()));
    if let (Some(scenario), Some(map)) = (&scenario, &map) {
        checker.problems.extend(scenario.check_against(map, compat));
    }
    if checker.problems.len() > before {
        return None;
    }
    let (map, outputs, [frame_rate, ground_truth_rate, v2i_rate]) = (map?, outputs?, rates);
    let (scenario, not_interpreted) =
        scenario.map(|file| (file.scenario, file.not_interpreted)).unwrap_or_default();
    let mut lights = LightsSettings::new(Arc::new(map), scenario, compat);
    lights.frame_rate = frame_rate.unwrap_or(lights.frame_rate);
    lights.ground_truth_rate = ground_truth_rate.unwrap_or(lights.ground_truth_rate);
    lights.v2i_rate = v2i_rate.unwrap_or(lights.v2i_rate);
    lights.copy_on_enable = file.copy_on_enable.unwrap_or(lights.copy_on_enable);
    lights.one_group_per_head = file.one_group_per_head.unwrap_or(lights.one_group_per_head);
    lights.v2i_timeout = timeout;
    lights.topics = topics(&outputs);
    let flow = FlowSettings { lights, camera_faults, v2i_faults, arbiter };
    Some((flow, LightTopics { compat, outputs, inputs, command, not_interpreted }))
}

/// What the engine must make for these outlets.
fn topics(outputs: &[LightsOutput]) -> BTreeSet<LightsTopic> {
    let of_engine = |topic: LightsTopic| match topic {
        // The arbiter judges what the other two say.
        LightsTopic::Arbiter => vec![LightsTopic::Camera, LightsTopic::V2i],
        LightsTopic::GroundTruth | LightsTopic::Camera | LightsTopic::V2i | LightsTopic::Markers => {
            vec![topic]
        }
    };
    outputs.iter().flat_map(|lights_output| of_engine(lights_output.topic)).collect()
}

/// The scenario that is named.
fn read_scenario(
    checker: &mut Checker<'_>,
    files: &dyn Files,
    file: &TrafficLightsFile,
    compat: Compat,
) -> Option<ScenarioFile> {
    let path = checker.beside(file.scenario.as_ref()?);
    scenario::read(files, &path, compat).map_err(|refused| checker.problems.extend(refused.0)).ok()
}

/// The map that is named here, else the scenario's own map or groups.
fn read_map(
    checker: &mut Checker<'_>,
    files: &dyn Files,
    file: &TrafficLightsFile,
    scenario: Option<&ScenarioFile>,
) -> Option<LightMap> {
    let lamps = if file.infer_lamps { LampSource::DrawnOrInferred } else { LampSource::Drawn };
    if let Some(map) = &file.map {
        let path = checker.beside(map);
        let remedy = "name a lanelet2 map, relative to this file";
        return read_lights(files, &path, lamps)
            .map_err(|reason| checker.refuse(map, format!("{}: {reason}", path.display()), remedy))
            .ok();
    }
    let at = file.scenario.as_ref().map_or(0..0, Spanned::span);
    let remedy = "name the lanelet2 map with [traffic_lights] map = \"….osm\"";
    let reason = match scenario {
        // What is wrong with it is told already.
        None if file.scenario.is_some() => return None,
        None => "traffic lights without a map: none of them is known".to_owned(),
        Some(ScenarioFile { map: Some(path), .. }) => match read_lights(files, path, lamps) {
            Ok(lights) => return Some(lights),
            Err(reason) => format!("the scenario's map, {}: {reason}", path.display()),
        },
        Some(scenario) if scenario.groups.is_empty() => {
            "the scenario names no map and no groups: its lights are not known".to_owned()
        }
        Some(scenario) => return Some(LightMap::new([], &scenario.groups)),
    };
    checker.refuse_at(at, reason, remedy);
    None
}

/// Messages of the camera topic and of the V2I topics.
fn messages(
    checker: &mut Checker<'_>,
    given: Option<&Spanned<String>>,
    compat: Compat,
) -> Option<[LightsType; 2]> {
    let text = given.map_or(DEFAULT_ARCHITECTURE, |given| given.get_ref().as_str());
    let types = Architecture::parse(text, compat)
        .and_then(|architecture| Ok([architecture.camera()?, architecture.v2i()?]));
    match (types, given) {
        (Ok(types), _) => Some(types),
        (Err(error), Some(given)) => {
            checker.refuse(given, error.to_string(), "");
            None
        }
        (Err(_), None) => None,
    }
}

fn rate(checker: &mut Checker<'_>, given: Option<&Spanned<f64>>) -> Option<Rate> {
    let given = given?;
    let rate = Rate::from_hz(*given.get_ref());
    if rate.is_none() {
        let reason = format!("invalid rate {} Hz", given.get_ref());
        let remedy = format!("give {} to {} Hz", RATES_HZ.start(), RATES_HZ.end());
        checker.refuse(given, reason, &remedy);
    }
    rate
}
