//! `[traffic_lights]`: a scenario on its map, rates, topics, and injected faults.

pub(super) mod arbiter;
pub(super) mod faults;
pub(super) mod topics;
mod v2i;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use crate::config::built_in::{BuiltIn, display};
use crate::config::files::Files;
use crate::config::map::{MapLights, read_lights, read_named};
use crate::config::named_file;
use crate::config::reading::{
    ConfigKey, Entry, Fields, Keywords, Value, ValueShape, collection, flag, key_rows, keyword, limit,
    number_as, text,
};
use crate::config::scenario::{self, BulbOrder, NotInterpreted, ReadOptions, ScenarioFile};
use faults::faults;
use lanelet2_map::light_map::{LampSource, LightMap};
pub use topics::LightsOutput;
use topics::{InputTopics, inputs, outputs};
use traffic_lights::architecture::{Architecture, LightsType};
use traffic_lights::command::RATES_HZ;
use traffic_lights::compat::Compat;
use traffic_lights::emission::LightsTopic;
use traffic_lights::engine::LightsSettings;
use traffic_lights::flow::LightsFlowSettings;
use traffic_lights::periodic_timer::Rate;
use traffic_lights::target::StoreId;
pub(super) use v2i::check_ids;

const DEFAULT_ARCHITECTURE: &str = "awf/universe/20240605";
const COMPAT: Keywords<Compat> = &[("improved", Compat::Improved), ("upstream", Compat::Upstream)];

key_rows! {
    SCENARIO: String = text("scenario").example("\"scenarios/bench.toml\"")
        .doc(".xosc, TIER IV's .yaml, or bench file (.toml); default: none, states come from outside");
    MAP: String = text("map").example("\"lanelet2_map.osm\"")
        .doc("lanelet2 map with the lights; default: the map or the groups that the scenario names");
    COMPAT_KEY: Compat = keyword("compat", COMPAT).or_text("improved").restart()
        .doc("\"improved\", or \"upstream\": as scenario_simulator_v2 does, see docs/traffic-lights.md");
    ARCHITECTURE: String = text("architecture").or_text(DEFAULT_ARCHITECTURE).restart()
        .doc("message generation: 20230906 TrafficSignalArray, later TrafficLightGroupArray");
    FRAME_RATE_HZ: Rate = rate("frame_rate_hz").or_number(30.0).doc("evaluation of the scenario, and camera topic");
    GROUND_TRUTH_RATE_HZ: Rate = rate("ground_truth_rate_hz").or_number(30.0).doc("ground-truth topic and markers");
    V2I_RATE_HZ: Rate = rate("v2i_rate_hz").or_number(10.0).doc("V2I topics, until the scenario changes it");
    COPY_ON_ENABLE: bool = flag("copy_on_enable", true)
        .doc("enabling V2I for a head copies what it shows; default with \"upstream\": false");
    ONE_GROUP_PER_HEAD: bool = flag("one_group_per_head", false)
        .doc("a group once for each of its lit heads; \"upstream\" always does");
    PACKAGES: BTreeMap<String, PathBuf> = collection("packages", || ValueShape::Names, packages)
        .example("{ town = \"../maps/town\" }").doc("folders of packages, for $(find-pkg-share town) in the scenario");
    BULB_ORDER: Vec<BulbOrder> = collection("bulb_order", || ValueShape::Texts, bulb_orders)
        .example("[\"red,yellow,green\", \"21,22=red,green\"]")
        .doc("bulbs by position, for states such as \"on;off;off\": for all lights with as many, or some");
    MODIFIERS: BTreeMap<String, String> = collection("modifiers", || ValueShape::Names, modifiers).example("{}")
        .doc("values of scenario modifiers that have several, e.g. { LANE_ID = 34513 }");
    V2I_TIMEOUT_MS: Duration = limit("v2i_timeout_ms").example("1000")
        .doc("V2I states from ROS topics that are not renewed are removed, {range}; default: never");
    USE_SIM_TIME: bool = flag("use_sim_time", false).restart()
        .doc("true: the lights follow /clock of a simulator; nothing is sent before its first time");
    INFER_LAMPS: bool = flag("infer_lamps", false).doc("markers also for heads whose lamps the map does not draw");
}

const fn rate(name: &'static str) -> ConfigKey<Rate> {
    number_as(name, *RATES_HZ.start(), *RATES_HZ.end(), "Hz", Rate::from_hz)
}

/// Topics of the traffic lights.
#[derive(Debug, Default)]
pub struct LightTopics {
    /// Mode that determines the numbers in messages.
    pub compat: Compat,
    /// Published topics, with their message types.
    pub outputs: Vec<LightsOutput>,
    /// Topics with states, each for one store.
    pub inputs: Vec<(StoreId, String)>,
    /// Topic of a camera pipeline, for the arbiter.
    pub camera: Option<String>,
    /// Topic with actions.
    pub command: Option<String>,
    /// True when a simulator gives the time on `/clock`.
    pub use_sim_time: bool,
    /// Parts of the scenario that have no effect.
    pub not_interpreted: Vec<NotInterpreted>,
}

/// Reads the section; `None` if it has a problem. `use_sim_time` from the command line has priority.
pub(super) fn traffic_lights(
    files: &dyn Files,
    fields: Fields<'_>,
    use_sim_time: Option<bool>,
) -> Option<(LightsFlowSettings, LightTopics)> {
    let checker = fields.checker;
    let before = checker.count();
    let compat = fields.read(&COMPAT_KEY);
    let scenario = read_scenario(files, &fields, compat);
    let map = read_map(files, &fields, scenario.as_ref());
    let architecture = messages(&fields, compat);
    let [frame_rate, ground_truth_rate, v2i_rate] =
        [&FRAME_RATE_HZ, &GROUND_TRUTH_RATE_HZ, &V2I_RATE_HZ].map(|key| fields.given(key));
    let v2i_timeout = fields.given(&V2I_TIMEOUT_MS);
    let arbiter = fields.table("arbiter").map(|section| section.read_all(arbiter::arbiter));
    let topics_of =
        |types| fields.section("topics").read_all(|section| outputs(section, types, arbiter.is_some()));
    let outputs = architecture.map(topics_of).unwrap_or_default();
    let InputTopics { states, camera, command } =
        fields.section("inputs").read_all(|section| inputs(section, &outputs, arbiter.is_some()));
    let use_sim_time = use_sim_time.unwrap_or(fields.read(&USE_SIM_TIME));
    // The command line has priority.
    fields.record(&USE_SIM_TIME, use_sim_time.to_string());
    if use_sim_time && outputs.iter().any(|lights_output| lights_output.topic == LightsTopic::Clock) {
        fields.refuse("use_sim_time", "topics.clock publishes a clock as well", "keep one of them");
    }
    let draws = outputs.iter().any(|lights_output| lights_output.topic == LightsTopic::Markers);
    if let Some(MapLights { unplaced: Some(reason), .. }) = map.as_ref().filter(|_| draws) {
        let remedy = "correct the map or its map_projector_info.yaml, or leave out topics.markers";
        fields.refuse("map", format!("lamps cannot be placed for the markers: {reason}"), remedy);
    }
    let [camera_faults, v2i_faults] = fields
        .section("faults")
        .read_all(|section| ["camera", "v2i"].map(|channel| section.read_table(channel, faults)));
    if let (Some(scenario), Some(map)) = (&scenario, &map) {
        checker.adopt(scenario.check_against(&map.lights, compat));
    }
    let (copy_on_enable, one_group_per_head) =
        (fields.given(&COPY_ON_ENABLE), fields.given(&ONE_GROUP_PER_HEAD));
    let path = fields.table_path();
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
    // The defaults of these two depend on `compat`.
    checker.record(&path, &COPY_ON_ENABLE, lights.copy_on_enable.to_string());
    checker.record(&path, &ONE_GROUP_PER_HEAD, lights.one_group_per_head.to_string());
    lights.v2i_timeout = v2i_timeout;
    lights.topics = topics(&outputs, camera.is_some());
    let external_camera = camera.is_some();
    let flow =
        LightsFlowSettings { lights, camera_faults, v2i_faults, arbiter, external_camera, use_sim_time };
    let topics =
        LightTopics { compat, outputs, inputs: states, camera, command, use_sim_time, not_interpreted };
    Some((flow, topics))
}

/// Returns the topics that the engine must produce for these outputs.
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
        packages: fields.read(&PACKAGES),
        bulb_orders: fields.read(&BULB_ORDER),
        modifiers: fields.read(&MODIFIERS),
        takes_text_ids: false,
    };
    let named = fields.given(&SCENARIO)?;
    let path = named_file::find(BuiltIn::Scenario, files, &named, fields.checker.beside(&named));
    scenario::read(files, &path, options).map_err(|refused| fields.checker.adopt(refused.0)).ok()
}

/// Reads the folders of packages by name, relative to this file.
fn packages(fields: &Fields<'_>, key: &'static str) -> BTreeMap<String, PathBuf> {
    let entries = fields.entries(key, "give the folder of each package: packages = { name = \"folder\" }");
    let folder = |entry: &Entry| {
        let folder = fields.checker.text(&entry.value)?;
        Some((entry.key.clone(), fields.checker.beside(&folder.text)))
    };
    entries.iter().filter_map(folder).collect()
}

fn bulb_orders(fields: &Fields<'_>, key: &'static str) -> Vec<BulbOrder> {
    let values = fields.list(key, "give the bulbs by position: bulb_order = [\"red,yellow,green\"]");
    let order = |value: &Value| {
        let given = fields.checker.text(value)?;
        let remedy = "give bulbs, or ids and bulbs: \"21,22=red,yellow,green\"";
        fields.checker.accept(&given.location, given.text.parse(), remedy)
    };
    values.iter().filter_map(order).collect()
}

fn modifiers(fields: &Fields<'_>, key: &'static str) -> BTreeMap<String, String> {
    let entries =
        fields.entries(key, "give the value of each scenario modifier: modifiers = { NAME = \"value\" }");
    let value = |entry: &Entry| Some((entry.key.clone(), fields.checker.text(&entry.value)?.text));
    entries.iter().filter_map(value).collect()
}

/// Reads the map named here, otherwise the scenario's own map or groups.
fn read_map(files: &dyn Files, fields: &Fields<'_>, scenario: Option<&ScenarioFile>) -> Option<MapLights> {
    let named = fields.given(&MAP);
    let lamps = if fields.read(&INFER_LAMPS) { LampSource::DrawnOrInferred } else { LampSource::Drawn };
    if fields.has(MAP.name) {
        let named = named?;
        let path = named_file::find(BuiltIn::Map, files, &named, fields.checker.beside(&named));
        let remedy = "name a lanelet2 map, relative to this file";
        let read = |files: &dyn Files, path: &Path| read_lights(files, path, lamps);
        return read_named(files, fields.checker, fields.at("map"), &path, remedy, read);
    }
    let reason = match scenario {
        // Its problems are already listed.
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
    fields.refused("scenario", reason, "name the lanelet2 map with [traffic_lights] map = \"….osm\"")
}

fn messages(fields: &Fields<'_>, compat: Compat) -> Option<[LightsType; 2]> {
    let types = Architecture::parse(&fields.read(&ARCHITECTURE), compat)
        .and_then(|architecture| Ok([architecture.camera()?, architecture.v2i()?]));
    fields.checker.accept(fields.at("architecture"), types, "")
}
