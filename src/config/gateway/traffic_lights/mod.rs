//! `[traffic_lights]`: a scenario on its map, rates, topics, and faults on purpose.

mod arbiter;
mod faults;
mod topics;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

use crate::config::built_in::{BuiltIn, display};
use crate::config::files::Files;
use crate::config::map::{MapLights, read_lights, refuse as refuse_map};
use crate::config::named_file;
use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;
use crate::config::reading::value::{Entry, Value};
use crate::config::scenario::{self, BulbOrder, NotInterpreted, ReadOptions, ScenarioFile};
use crate::core::compat::Compat;
use crate::core::map::light_map::{LampSource, LightMap};
use crate::core::traffic_light::architecture::{Architecture, LightsType};
use crate::core::traffic_light::command::RATES_HZ;
use crate::core::traffic_light::emission::LightsTopic;
use crate::core::traffic_light::engine::LightsSettings;
use crate::core::traffic_light::flow::LightsFlowSettings;
use crate::core::traffic_light::periodic_timer::Rate;
use crate::core::traffic_light::target::StoreId;
use faults::faults;
pub use topics::LightsOutput;
use topics::{InputTopics, inputs, outputs};

const DEFAULT_ARCHITECTURE: &str = "awf/universe/20240605";
const COMPAT: Keywords<Compat> = &[("improved", Compat::Improved), ("upstream", Compat::Upstream)];

/// Topics of the traffic lights.
#[derive(Debug, Default)]
pub struct LightTopics {
    /// The mode whose numbers messages use.
    pub compat: Compat,
    /// Topics that are written, with the message each carries.
    pub outputs: Vec<LightsOutput>,
    /// Topics from which states are read.
    pub inputs: Vec<(StoreId, String)>,
    /// Topic of a camera pipeline, for the arbiter.
    pub camera: Option<String>,
    /// Topic from which actions are read.
    pub command: Option<String>,
    /// True when the time is that of a simulator, on `/clock`.
    pub use_sim_time: bool,
    /// Parts of the scenario that have no effect.
    pub not_interpreted: Vec<NotInterpreted>,
}

/// Reads the section; `None` when it has a problem. `use_sim_time` is that of the command line, which comes first.
pub(super) fn traffic_lights(
    files: &dyn Files,
    fields: Fields<'_>,
    use_sim_time: Option<bool>,
) -> Option<(LightsFlowSettings, LightTopics)> {
    let checker = fields.checker;
    let before = checker.count();
    let compat = fields.keyword("compat", COMPAT).unwrap_or_default();
    let scenario = read_scenario(files, &fields, compat);
    let map = read_map(files, &fields, scenario.as_ref());
    let architecture = messages(&fields, compat);
    let [frame_rate, ground_truth_rate, v2i_rate] = ["frame_rate_hz", "ground_truth_rate_hz", "v2i_rate_hz"]
        .map(|key| fields.number(key, RATES_HZ, "Hz").and_then(Rate::from_hz));
    let v2i_timeout = fields.limit("v2i_timeout_ms");
    let arbiter = fields.table("arbiter").map(arbiter::arbiter);
    let outputs = architecture
        .map(|types| outputs(fields.section("topics"), types, arbiter.is_some()))
        .unwrap_or_default();
    let InputTopics { states, camera, command } =
        inputs(fields.section("inputs"), &outputs, arbiter.is_some());
    let configured = fields.flag("use_sim_time");
    let use_sim_time = use_sim_time.or(configured).unwrap_or_default();
    if use_sim_time && outputs.iter().any(|lights_output| lights_output.topic == LightsTopic::Clock) {
        fields.refuse("use_sim_time", "topics.clock publishes a clock as well", "keep one of them");
    }
    let draws = outputs.iter().any(|lights_output| lights_output.topic == LightsTopic::Markers);
    if let Some(MapLights { unplaced: Some(reason), .. }) = map.as_ref().filter(|_| draws) {
        let remedy = "correct the map or its map_projector_info.yaml, or leave out topics.markers";
        fields.refuse("map", format!("lamps cannot be placed for the markers: {reason}"), remedy);
    }
    let channels = fields.section("faults");
    let [camera_faults, v2i_faults] =
        ["camera", "v2i"].map(|channel| channels.table(channel).and_then(faults));
    channels.done();
    if let (Some(scenario), Some(map)) = (&scenario, &map) {
        checker.adopt(scenario.check_against(&map.lights, compat));
    }
    let (copy_on_enable, one_group_per_head) =
        (fields.flag("copy_on_enable"), fields.flag("one_group_per_head"));
    fields.done();
    if checker.count() > before {
        return None;
    }
    let (scenario, not_interpreted) =
        scenario.map(|file| (file.scenario, file.not_interpreted)).unwrap_or_default();
    let mut lights = LightsSettings::new(Arc::new(map?.lights), scenario, compat);
    lights.frame_rate = frame_rate.unwrap_or(lights.frame_rate);
    lights.ground_truth_rate = ground_truth_rate.unwrap_or(lights.ground_truth_rate);
    lights.v2i_rate = v2i_rate.unwrap_or(lights.v2i_rate);
    lights.copy_on_enable = copy_on_enable.unwrap_or(lights.copy_on_enable);
    lights.one_group_per_head = one_group_per_head.unwrap_or(lights.one_group_per_head);
    lights.v2i_timeout = v2i_timeout;
    lights.topics = topics(&outputs, camera.is_some());
    let external_camera = camera.is_some();
    let flow =
        LightsFlowSettings { lights, camera_faults, v2i_faults, arbiter, external_camera, use_sim_time };
    let topics =
        LightTopics { compat, outputs, inputs: states, camera, command, use_sim_time, not_interpreted };
    Some((flow, topics))
}

/// The topics that the engine must make for these outputs.
fn topics(outputs: &[LightsOutput], external_camera: bool) -> BTreeSet<LightsTopic> {
    let of_engine = |topic: LightsTopic| match topic {
        // The arbiter merges the other two.
        LightsTopic::Arbiter if external_camera => vec![LightsTopic::V2i],
        LightsTopic::Arbiter => vec![LightsTopic::Camera, LightsTopic::V2i],
        LightsTopic::GroundTruth
        | LightsTopic::Camera
        | LightsTopic::V2i
        | LightsTopic::Markers
        | LightsTopic::Clock => vec![topic],
    };
    outputs.iter().flat_map(|lights_output| of_engine(lights_output.topic)).collect()
}

fn read_scenario(files: &dyn Files, fields: &Fields<'_>, compat: Compat) -> Option<ScenarioFile> {
    let options = ReadOptions {
        compat,
        packages: packages(fields),
        bulb_orders: bulb_orders(fields),
        modifiers: modifiers(fields),
    };
    let path = named_file::path_at(BuiltIn::Scenario, files, fields, "scenario")?;
    scenario::read(files, &path, options).map_err(|refused| fields.checker.adopt(refused.0)).ok()
}

/// The folders of packages by name, relative to this file.
fn packages(fields: &Fields<'_>) -> BTreeMap<String, PathBuf> {
    let entries =
        fields.entries("packages", "give the folder of each package: packages = { name = \"folder\" }");
    let folder = |entry: &Entry| {
        let folder = fields.checker.text(&entry.value)?;
        Some((entry.key.clone(), fields.checker.beside(&folder.text)))
    };
    entries.iter().filter_map(folder).collect()
}

/// The bulbs of lights by position.
fn bulb_orders(fields: &Fields<'_>) -> Vec<BulbOrder> {
    let values = fields.list("bulb_order", "give the bulbs by position: bulb_order = [\"red,yellow,green\"]");
    let order = |value: &Value| {
        let given = fields.checker.text(value)?;
        let remedy = "give bulbs, or ids and bulbs: \"21,22=red,yellow,green\"";
        fields.checker.accept(&given.location, given.text.parse(), remedy)
    };
    values.iter().filter_map(order).collect()
}

/// The values of scenario modifiers by name.
fn modifiers(fields: &Fields<'_>) -> BTreeMap<String, String> {
    let entries = fields
        .entries("modifiers", "give the value of each scenario modifier: modifiers = { NAME = \"value\" }");
    let value = |entry: &Entry| Some((entry.key.clone(), fields.checker.text(&entry.value)?.text));
    entries.iter().filter_map(value).collect()
}

/// Reads the map that is named here, else the scenario's own map or groups.
fn read_map(files: &dyn Files, fields: &Fields<'_>, scenario: Option<&ScenarioFile>) -> Option<MapLights> {
    let infers = fields.flag("infer_lamps").unwrap_or_default();
    let lamps = if infers { LampSource::DrawnOrInferred } else { LampSource::Drawn };
    if fields.has("map") {
        let path = named_file::path_at(BuiltIn::Map, files, fields, "map")?;
        let remedy =
            named_file::remedy(BuiltIn::Map, files, &path, "name a lanelet2 map, relative to this file");
        let refuse = |problem| refuse_map(fields.checker, fields.at("map"), problem, &remedy);
        return read_lights(files, &path, lamps).map_err(refuse).ok();
    }
    let reason = match scenario {
        // Its problems are listed already.
        None if fields.has("scenario") => return None,
        None => "traffic lights without a map: none of them is known".to_owned(),
        Some(ScenarioFile { map: Some(path), .. }) => match read_lights(files, path, lamps) {
            Ok(map) => return Some(map),
            Err(problem) if problem.position.is_some() => {
                fields.checker.adopt(vec![problem]);
                return None;
            }
            Err(problem) => format!("the scenario's map, {}: {}", display(&problem.file), problem.reason),
        },
        Some(scenario) if scenario.groups.is_empty() => {
            "the scenario names no map and no groups: its lights are not known".to_owned()
        }
        Some(scenario) => {
            return Some(MapLights { lights: LightMap::new([], &scenario.groups), unplaced: None });
        }
    };
    fields.refuse("scenario", reason, "name the lanelet2 map with [traffic_lights] map = \"….osm\"");
    None
}

/// Reads the messages of the camera topic and of the V2I topics.
fn messages(fields: &Fields<'_>, compat: Compat) -> Option<[LightsType; 2]> {
    let given = fields.string("architecture");
    let text = given.as_ref().map_or(DEFAULT_ARCHITECTURE, |given| &given.text);
    let types = Architecture::parse(text, compat)
        .and_then(|architecture| Ok([architecture.camera()?, architecture.v2i()?]));
    fields.checker.accept(fields.at("architecture"), types, "")
}
