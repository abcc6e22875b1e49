//! What `[traffic_lights]` means: a scenario on its map, rates, topics, and faults on purpose.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use toml::Spanned;

use super::files::Files;
use super::problem::{Document, Problem};
use super::scenario::{self, NotInterpreted, ScenarioFile};
use super::settings::is_topic;
use super::traffic_lights_file::{
    ArbiterFile, CompatFile, ConfusionFile, FaultsFile, LightInputsFile, LightTopicsFile, TrafficLightsFile,
};
use crate::core::map::light_map::LightMap;
use crate::core::map::light_roads::{LampSource, LightRoads};
use crate::core::map::osm;
use crate::core::map::points::Points;
use crate::core::map::projector::Projector;
use crate::core::traffic_light::arbiter::{ArbiterSettings, Priority};
use crate::core::traffic_light::architecture::{Architecture, LightsType};
use crate::core::traffic_light::bulb::Color;
use crate::core::traffic_light::cadence::Rate;
use crate::core::traffic_light::command::RATES_HZ;
use crate::core::traffic_light::compat::Compat;
use crate::core::traffic_light::emission::LightsTopic;
use crate::core::traffic_light::engine::LightsSettings;
use crate::core::traffic_light::faults::{Confusion, FaultSettings, Faults, Spells};
use crate::core::traffic_light::flow::FlowSettings;
use crate::core::traffic_light::scenario::Controller;
use crate::core::traffic_light::target::{Channel, Layer, StoreId};

/// Where traffic lights go to and come from, and what speaks of them.
#[derive(Debug, Default)]
pub struct LightTopics {
    /// In whose numbers messages are.
    pub compat: Compat,
    /// Topics that are written, with the message each carries.
    pub outlets: Vec<Outlet>,
    /// Topics that states are read from.
    pub inputs: Vec<(StoreId, String)>,
    /// Topic that actions are read from.
    pub command: Option<String>,
    /// The scenario's controllers, by whose names actions call them.
    pub controllers: Vec<Controller>,
    /// Parts of the scenario that have no effect.
    pub not_interpreted: Vec<NotInterpreted>,
}

/// A topic that is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outlet {
    /// What goes there.
    pub topic: LightsTopic,
    /// Its name.
    pub name: String,
    /// As which message.
    pub message: LightsType,
}

const DEFAULT_ARCHITECTURE: &str = "awf/universe/20240605";
/// Longest that a V2I state is believed, at most.
const LONGEST_TIMEOUT_MS: u64 = 3_600_000;

/// Checks the section; every problem found is added.
pub(super) fn traffic_lights(
    files: &dyn Files,
    document: &Document,
    file: &TrafficLightsFile,
    problems: &mut Vec<Problem>,
) -> Option<(FlowSettings, LightTopics)> {
    let compat = match file.compat {
        CompatFile::Improved => Compat::Improved,
        CompatFile::Upstream => Compat::Upstream,
    };
    let before = problems.len();
    let mut checks = Checks { document, problems };
    let scenario = checks.scenario(files, file, compat);
    let map = checks.map(files, file, scenario.as_ref());
    let architecture = checks.architecture(file.architecture.as_ref(), compat);
    let rates = [&file.frame_rate_hz, &file.ground_truth_rate_hz, &file.v2i_rate_hz];
    let rates = rates.map(|rate| checks.rate(rate.as_ref()));
    let timeout = checks.timeout(file.v2i_timeout_ms.as_ref());
    let arbiter = file.arbiter.as_ref().map(|arbiter| checks.arbiter(arbiter));
    let outlets = architecture.map(|types| checks.outlets(&file.topics, types, arbiter.is_some()));
    let (inputs, command) = checks.inputs(&file.inputs, outlets.as_deref().unwrap_or_default());
    let [camera_faults, v2i_faults] =
        [&file.faults.camera, &file.faults.v2i].map(|faults| checks.faults(faults.as_ref()));
    if let (Some(scenario), Some(map)) = (&scenario, &map) {
        checks.problems.extend(scenario.check_against(map, compat));
    }
    if problems.len() > before {
        return None;
    }
    let (map, outlets, [frame_rate, ground_truth_rate, v2i_rate]) = (map?, outlets?, rates);
    let (scenario, not_interpreted) =
        scenario.map(|file| (file.scenario, file.not_interpreted)).unwrap_or_default();
    let mut lights = LightsSettings::new(Arc::new(map), scenario, compat);
    lights.frame_rate = frame_rate.unwrap_or(lights.frame_rate);
    lights.ground_truth_rate = ground_truth_rate.unwrap_or(lights.ground_truth_rate);
    lights.v2i_rate = v2i_rate.unwrap_or(lights.v2i_rate);
    lights.copy_on_enable = file.copy_on_enable.unwrap_or(lights.copy_on_enable);
    lights.one_group_per_head = file.one_group_per_head.unwrap_or(lights.one_group_per_head);
    lights.v2i_timeout = timeout;
    lights.topics = topics(&outlets);
    let controllers = lights.scenario.controllers.clone();
    let flow = FlowSettings { lights, camera_faults, v2i_faults, arbiter };
    Some((flow, LightTopics { compat, outlets, inputs, command, controllers, not_interpreted }))
}

/// The lights of a map in a file.
///
/// # Errors
/// Why there are none, in words.
pub fn read_lights(files: &dyn Files, path: &Path, lamps: LampSource) -> Result<LightMap, String> {
    let bytes = files.read(path).map_err(|error| format!("cannot read it: {error}"))?;
    let osm = osm::read(&bytes).map_err(|error| error.to_string())?;
    // Places are for viewers: a map without them has its lights all the same.
    let points = Points::new(&osm, &projector(files, path)?).ok();
    let roads = LightRoads::read(&osm, points.as_ref(), lamps).map_err(|error| error.to_string())?;
    Ok(roads.lights().clone())
}

/// How the map's places are meant, as the file beside it says that Autoware reads; else they are local.
pub(super) fn projector(files: &dyn Files, map: &Path) -> Result<Projector, String> {
    let path = map.with_file_name("map_projector_info.yaml");
    let Ok(bytes) = files.read(&path) else { return Ok(Projector::Local) };
    let text = String::from_utf8_lossy(&bytes);
    Projector::parse(&text).map_err(|error| format!("{}: {error}", path.display()))
}

/// What the engine must make for these outlets.
fn topics(outlets: &[Outlet]) -> BTreeSet<LightsTopic> {
    let of_engine = |topic: LightsTopic| match topic {
        // The arbiter judges what the other two say.
        LightsTopic::Arbiter => vec![LightsTopic::Camera, LightsTopic::V2i],
        LightsTopic::GroundTruth | LightsTopic::Camera | LightsTopic::V2i | LightsTopic::Markers => {
            vec![topic]
        }
    };
    outlets.iter().flat_map(|outlet| of_engine(outlet.topic)).collect()
}

struct Checks<'a> {
    document: &'a Document,
    problems: &'a mut Vec<Problem>,
}

impl Checks<'_> {
    fn refuse<T>(&mut self, value: &Spanned<T>, reason: impl Into<String>, remedy: &str) {
        self.problems.push(self.document.problem(value.span(), reason, remedy));
    }

    fn beside(&self, path: &str) -> PathBuf {
        self.document.path().parent().unwrap_or(Path::new("")).join(path)
    }

    fn scenario(
        &mut self,
        files: &dyn Files,
        file: &TrafficLightsFile,
        compat: Compat,
    ) -> Option<ScenarioFile> {
        let path = self.beside(file.scenario.as_ref()?.get_ref());
        scenario::read(files, &path, compat).map_err(|refused| self.problems.extend(refused.0)).ok()
    }

    /// The map that is named here, else the scenario's own map or groups.
    fn map(
        &mut self,
        files: &dyn Files,
        file: &TrafficLightsFile,
        scenario: Option<&ScenarioFile>,
    ) -> Option<LightMap> {
        let lamps = if file.infer_lamps { LampSource::DrawnOrInferred } else { LampSource::Drawn };
        if let Some(map) = &file.map {
            let path = self.beside(map.get_ref());
            let remedy = "name a lanelet2 map, relative to this file";
            return read_lights(files, &path, lamps)
                .map_err(|reason| self.refuse(map, format!("{}: {reason}", path.display()), remedy))
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
        self.problems.push(self.document.problem(at, reason, remedy));
        None
    }

    /// Messages of the camera topic and of the V2I topics.
    fn architecture(&mut self, given: Option<&Spanned<String>>, compat: Compat) -> Option<[LightsType; 2]> {
        let text = given.map_or(DEFAULT_ARCHITECTURE, |given| given.get_ref().as_str());
        let types = Architecture::parse(text, compat)
            .and_then(|architecture| Ok([architecture.camera()?, architecture.v2i()?]));
        match (types, given) {
            (Ok(types), _) => Some(types),
            (Err(error), Some(given)) => {
                self.refuse(given, error.to_string(), "");
                None
            }
            (Err(_), None) => None,
        }
    }

    fn rate(&mut self, given: Option<&Spanned<f64>>) -> Option<Rate> {
        let given = given?;
        let rate = Rate::from_hz(*given.get_ref());
        if rate.is_none() {
            let reason = format!("{} Hz is no usable rate", given.get_ref());
            let remedy = format!("give {} to {} Hz", RATES_HZ.start(), RATES_HZ.end());
            self.refuse(given, reason, &remedy);
        }
        rate
    }

    fn timeout(&mut self, given: Option<&Spanned<u64>>) -> Option<Duration> {
        let given = given?;
        if !(1..=LONGEST_TIMEOUT_MS).contains(given.get_ref()) {
            let remedy = format!("give 1 to {LONGEST_TIMEOUT_MS} ms");
            self.refuse(given, format!("{} ms is no usable limit", given.get_ref()), &remedy);
        }
        Some(Duration::from_millis(*given.get_ref()))
    }

    fn arbiter(&mut self, file: &ArbiterFile) -> ArbiterSettings {
        let mut settings = ArbiterSettings { matching: file.enable_signal_matching, ..Default::default() };
        let tolerances = [
            (&file.external_delay_tolerance_s, &mut settings.external_delay_tolerance),
            (&file.external_time_tolerance_s, &mut settings.external_time_tolerance),
            (&file.perception_time_tolerance_s, &mut settings.perception_time_tolerance),
        ];
        for (given, tolerance) in tolerances {
            let Some(given) = given else { continue };
            match Duration::try_from_secs_f64(*given.get_ref()) {
                Ok(value) if value <= Duration::from_secs(3600) => *tolerance = value,
                Ok(_) | Err(_) => self.refuse(
                    given,
                    format!("{} s is no usable tolerance", given.get_ref()),
                    "give 0 to 3600 s",
                ),
            }
        }
        if let Some(given) = &file.source_priority {
            match Priority::named(given.get_ref()) {
                Some(priority) => settings.priority = priority,
                None => self.refuse(
                    given,
                    format!("{:?} is no priority", given.get_ref()),
                    "give \"confidence\", \"external\" or \"perception\"",
                ),
            }
        }
        settings
    }

    fn outlets(
        &mut self,
        file: &LightTopicsFile,
        [camera, v2i]: [LightsType; 2],
        has_arbiter: bool,
    ) -> Vec<Outlet> {
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
        if let Some(given) = file.arbiter.as_ref().filter(|given| !has_arbiter && !given.get_ref().is_empty())
        {
            self.refuse(given, "there is no arbiter", "add [traffic_lights.arbiter]");
        }
        let mut outlets: Vec<Outlet> = Vec::new();
        for (given, default, topic, message) in named {
            let name = given.as_ref().map_or(default, |given| given.get_ref().clone());
            if name.is_empty() {
                continue;
            }
            if let Some(given) = given {
                self.topic(given);
                if outlets.iter().any(|other| other.name == name) {
                    self.refuse(given, "another topic has this name", "give each its own, or \"\"");
                }
            }
            outlets.push(Outlet { topic, name, message });
        }
        outlets
    }

    fn inputs<'f>(
        &mut self,
        file: &'f LightInputsFile,
        outlets: &'f [Outlet],
    ) -> (Vec<(StoreId, String)>, Option<String>) {
        let mut taken: Vec<&'f str> = outlets.iter().map(|outlet| outlet.name.as_str()).collect();
        let stores = [
            (&file.conventional, Channel::Conventional, Layer::GroundTruth),
            (&file.conventional_detected, Channel::Conventional, Layer::Detected),
            (&file.v2i, Channel::V2i, Layer::GroundTruth),
            (&file.v2i_detected, Channel::V2i, Layer::Detected),
        ];
        let mut inputs = Vec::new();
        for (given, channel, layer) in stores {
            if let Some(given) = given {
                self.input(given, &mut taken);
                inputs.push((StoreId { channel, layer }, given.get_ref().clone()));
            }
        }
        let command = file.command.as_ref().map(|given| {
            self.input(given, &mut taken);
            given.get_ref().clone()
        });
        (inputs, command)
    }

    /// What we publish, or read for something else, is no input.
    fn input<'f>(&mut self, given: &'f Spanned<String>, taken: &mut Vec<&'f str>) {
        self.topic(given);
        let name = given.get_ref().as_str();
        if taken.contains(&name) {
            self.refuse(given, "another topic has this name", "give each its own");
        }
        taken.push(name);
    }

    fn topic(&mut self, given: &Spanned<String>) {
        if !is_topic(given.get_ref()) {
            self.refuse(given, format!("{:?} is no absolute topic", given.get_ref()), "write it as /a/b");
        }
    }

    fn faults(&mut self, given: Option<&Spanned<FaultsFile>>) -> Option<Faults> {
        let given = given?;
        let file = given.get_ref();
        let spells = |probability: f64, messages: Option<f64>| Spells {
            probability,
            mean_length: messages.unwrap_or(1.0),
        };
        let settings = FaultSettings {
            seed: file.seed,
            latency: Duration::from_millis(file.latency_ms),
            jitter: Duration::from_millis(file.jitter_ms),
            loss: file.loss,
            freeze: spells(file.freeze, file.freeze_messages),
            stamp_offset_ns: file.stamp_offset_ms.saturating_mul(1_000_000),
            miss: spells(file.miss, file.miss_messages),
            unknown: file.unknown,
            confusions: file.confusion.iter().filter_map(|entry| self.confusion(entry)).collect(),
            confidence_mean: file.confidence,
            confidence_spread: file.confidence_spread,
        };
        Faults::new(settings).map_err(|error| self.refuse(given, error.to_string(), "")).ok()
    }

    fn confusion(&mut self, file: &ConfusionFile) -> Option<Confusion> {
        let mut color = |given: &Spanned<String>| {
            given.get_ref().parse::<Color>().map_err(|error| self.refuse(given, error.to_string(), "")).ok()
        };
        let (from, to) = (color(&file.from), color(&file.to));
        Some(Confusion { from: from?, to: to?, probability: file.probability })
    }
}
