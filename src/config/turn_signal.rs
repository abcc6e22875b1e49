//! What `[turn_signal]` means: the decider on its map, parameters, age limits, topics.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use toml::Spanned;

use super::country::{NoCountry, country};
use super::files::Files;
use super::problem::{Document, Problem};
use super::sections::is_topic;
use super::traffic_lights::projector;
use super::traffic_lights_file::CompatFile;
use super::turn_signal_file::{
    AgeLimitsFile, DeciderInputsFile, DeciderOutputsFile, DimensionsFile, TurnSignalFile,
};
use crate::core::map::road_map::RoadMap;
use crate::core::turn_signal::country::Country;
use crate::core::turn_signal::decider::Settings as DeciderSettings;
use crate::core::turn_signal::flow::{FlowSettings, Limits, Role};
use crate::core::turn_signal::inputs::AgeLimits;
use crate::core::turn_signal::parameters::{Parameter, ParameterError, Parameters, Vehicle};
use crate::core::turn_signal::road::Road;
use crate::core::turn_signal::scene::Mode;
use crate::core::turn_signal::steady::Rhythm;
use crate::core::turn_signal::told::FactorTopic;

/// The decider as configured.
#[derive(Debug, Clone)]
pub struct TurnSignalConfig {
    /// What it runs on.
    pub flow: FlowSettings,
    /// It runs at all; otherwise it was only checked.
    pub runs: bool,
    /// Its map.
    pub map: PathBuf,
    /// Country whose rules are meant; none = the parameters that Autoware is deployed with.
    pub country: Option<Country>,
    /// Topics that are read.
    pub inputs: DeciderInputs,
    /// Topics that are written.
    pub outputs: DeciderOutputs,
}

impl TurnSignalConfig {
    /// It publishes commands.
    pub fn commands(&self) -> bool {
        self.runs && self.flow.role == Role::Command
    }
}

/// Topics that the decider is told by; empty = not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeciderInputs {
    /// `nav_msgs/Odometry`
    pub odometry: String,
    /// `LaneletRoute`
    pub route: String,
    /// `PathWithLaneId`
    pub planned_path: String,
    /// `PlanningFactorArray` of each module.
    pub planning_factors: Vec<(FactorTopic, String)>,
    /// `OperationModeState`
    pub operation_mode: String,
    /// `Scenario`
    pub scenario: String,
    /// `HazardLightsCommand` of the system.
    pub hazard_request: String,
    /// `TurnIndicatorsCommand` of Autoware's own decider; read in shadow mode.
    pub own_turn_command: String,
    /// `HazardLightsCommand` of Autoware's own decider; read in shadow mode.
    pub own_hazard_command: String,
}

/// Topics that the decider's commands go to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeciderOutputs {
    /// `TurnIndicatorsCommand`
    pub turn_command: String,
    /// `HazardLightsCommand`
    pub hazard_command: String,
}

const TURN_COMMAND: &str = "/planning/turn_indicators_cmd";
const HAZARD_COMMAND: &str = "/planning/hazard_lights_cmd";
const DEFAULT_HZ: f64 = 10.0;
const DEFAULT_TOLERANCE_MS: u64 = 500;
/// Longest signal, gap, age and tolerance, ms.
const LONGEST_MS: u64 = 60_000;

/// Checks the section; every problem found is added.
pub(super) fn turn_signal(
    files: &dyn Files,
    document: &Document,
    file: &TurnSignalFile,
    problems: &mut Vec<Problem>,
) -> Option<TurnSignalConfig> {
    let before = problems.len();
    let mut checks = Checks { document, problems };
    let map = checks.map(files, file.map.as_ref());
    let (country, parameters) = checks.parameters(files, file);
    let mode = match file.compat {
        CompatFile::Improved => Mode::Improved,
        CompatFile::Upstream => Mode::Compat,
    };
    let period = checks.period(file.planning_hz.as_ref());
    let rhythm = Rhythm {
        minimum_on: checks.ms(file.minimum_on_ms.as_ref(), Rhythm::READABLE.minimum_on, 0),
        minimum_gap: checks.ms(file.minimum_gap_ms.as_ref(), Rhythm::READABLE.minimum_gap, 0),
    };
    let (age_limits, limits) = checks.age_limits(&file.age_limits);
    let vehicle = checks.vehicle(&file.vehicle);
    let inputs = checks.inputs(&file.inputs);
    let outputs = checks.outputs(&file.outputs);
    let default = Duration::from_millis(DEFAULT_TOLERANCE_MS);
    let tolerance = checks.ms(file.agreement_tolerance_ms.as_ref(), default, 0);
    let shadow = file.shadow.as_ref().filter(|shadow| *shadow.get_ref());
    checks.distinct(file, (&inputs, &outputs), shadow.is_none());
    if let Some(shadow) = shadow.filter(|_| file.enabled) {
        checks.refuse(shadow, "a shadow publishes nothing", "set enabled = false, or shadow = false");
    }
    if problems.len() > before {
        return None;
    }
    let (map, road) = map?;
    let decider = DeciderSettings { mode, parameters, vehicle, age_limits, rhythm };
    let role = if shadow.is_some() { Role::Shadow { tolerance } } else { Role::Command };
    Some(TurnSignalConfig {
        flow: FlowSettings { decider, road: Arc::new(road), role, period, limits },
        runs: file.enabled || shadow.is_some(),
        map,
        country,
        inputs,
        outputs,
    })
}

struct Checks<'a> {
    document: &'a Document,
    problems: &'a mut Vec<Problem>,
}

impl Checks<'_> {
    fn refuse<T>(&mut self, value: &Spanned<T>, reason: impl Into<String>, remedy: &str) {
        self.problems.push(self.document.problem(value.span(), reason, remedy));
    }

    /// Where this file lies.
    fn folder(&self) -> &Path {
        self.document.path().parent().unwrap_or(Path::new(""))
    }

    fn map(&mut self, files: &dyn Files, given: Option<&Spanned<String>>) -> Option<(PathBuf, Road)> {
        let Some(given) = given else {
            let reason = "the turn signal decider has no map: no lanelet is known";
            let remedy = "name the lanelet2 map with [turn_signal] map = \"….osm\"";
            self.problems.push(self.document.problem(0..0, reason, remedy));
            return None;
        };
        let path = self.folder().join(given.get_ref());
        match read_road(files, &path) {
            Ok(road) => Some((path, road)),
            Err(reason) => {
                let remedy = "name a lanelet2 map, relative to this file";
                self.refuse(given, format!("{}: {reason}", path.display()), remedy);
                None
            }
        }
    }

    fn parameters(&mut self, files: &dyn Files, file: &TurnSignalFile) -> (Option<Country>, Parameters) {
        let country = file.country.as_ref().and_then(|given| {
            match country(files, self.folder(), given.get_ref()) {
                Ok(country) => return Some(country),
                Err(NoCountry::Nowhere { reason, remedy }) => self.refuse(given, reason, &remedy),
                Err(NoCountry::Refused(problems)) => self.problems.extend(problems),
            }
            None
        });
        let mut parameters = country.as_ref().map_or(Parameters::DEPLOYED, Parameters::for_country);
        let mut taken: Vec<&str> = Vec::new();
        for (name, value) in &file.parameters {
            let text = value.get_ref().as_str().map_or_else(|| value.get_ref().to_string(), str::to_owned);
            match parameters.set(name.get_ref(), &text) {
                Ok(()) => {}
                Err(error @ ParameterError::Unknown { .. }) => {
                    self.refuse(name, error.to_string(), "see config/gateway.toml for every key");
                }
                Err(ParameterError::Value { wanted, .. }) => {
                    self.refuse(value, format!("{text} does not fit"), &format!("give {wanted}"));
                }
            }
            let Some(known) = Parameter::named(name.get_ref()).map(|parameter| parameter.name) else {
                continue;
            };
            if taken.contains(&known) {
                self.refuse(name, format!("{known} is given twice"), "keep one of its names");
            }
            taken.push(known);
        }
        (country, parameters)
    }

    fn period(&mut self, given: Option<&Spanned<f64>>) -> Duration {
        let hz = given.map_or(DEFAULT_HZ, |given| *given.get_ref());
        if let Some(given) = given.filter(|_| !(1.0..=100.0).contains(&hz)) {
            self.refuse(given, format!("{hz} Hz is no usable rate"), "give 1 to 100 Hz");
            return Duration::from_secs(1);
        }
        // Whole microseconds, as all times of the gateway.
        Duration::from_micros(Duration::from_secs_f64(1.0 / hz).as_micros().try_into().unwrap_or(u64::MAX))
    }

    fn ms(&mut self, given: Option<&Spanned<u64>>, default: Duration, least: u64) -> Duration {
        let Some(given) = given else { return default };
        if !(least..=LONGEST_MS).contains(given.get_ref()) {
            let remedy = format!("give {least} to {LONGEST_MS} ms");
            self.refuse(given, format!("{} ms is no usable time", given.get_ref()), &remedy);
        }
        Duration::from_millis(*given.get_ref())
    }

    fn age_limits(&mut self, file: &AgeLimitsFile) -> (AgeLimits, Limits) {
        let mut limit = |given: &Option<Spanned<u64>>, default| self.ms(given.as_ref(), default, 10);
        let decider = AgeLimits {
            odometry: limit(&file.odometry_ms, AgeLimits::DEFAULT.odometry),
            planned_path: limit(&file.planned_path_ms, AgeLimits::DEFAULT.planned_path),
            manoeuvre: limit(&file.manoeuvre_ms, AgeLimits::DEFAULT.manoeuvre),
        };
        let beside = Limits {
            scenario: limit(&file.scenario_ms, Limits::DEFAULT.scenario),
            hazard_request: limit(&file.hazard_request_ms, Limits::DEFAULT.hazard_request),
            own_command: limit(&file.own_command_ms, Limits::DEFAULT.own_command),
        };
        (decider, beside)
    }

    fn vehicle(&mut self, file: &DimensionsFile) -> Vehicle {
        let mut metres = |given: &Option<Spanned<f64>>, default: f64| {
            let value = given.as_ref().map_or(default, |given| *given.get_ref());
            if let Some(given) = given.as_ref().filter(|_| !(0.0..=50.0).contains(&value)) {
                self.refuse(given, format!("{value} m is no dimension of a vehicle"), "give 0 to 50 m");
            }
            value
        };
        let sample = Vehicle::SAMPLE;
        Vehicle {
            wheel_base_m: metres(&file.wheel_base_m, sample.wheel_base_m),
            front_overhang_m: metres(&file.front_overhang_m, sample.front_overhang_m),
            rear_overhang_m: metres(&file.rear_overhang_m, sample.rear_overhang_m),
            left_m: metres(&file.left_m, sample.left_m),
            right_m: metres(&file.right_m, sample.right_m),
        }
    }

    fn inputs(&mut self, file: &DeciderInputsFile) -> DeciderInputs {
        const PLANNER: &str = "/planning/scenario_planning";
        let path = format!("{PLANNER}/lane_driving/behavior_planning/path_with_lane_id");
        let factors = self.topic(file.planning_factors.as_ref(), "/planning/planning_factors", true);
        let factor = |topic: FactorTopic| (topic, format!("{factors}/{}", topic.name()));
        DeciderInputs {
            odometry: self.topic(file.odometry.as_ref(), "/localization/kinematic_state", false),
            route: self.topic(file.route.as_ref(), "/planning/mission_planning/route", false),
            planned_path: self.topic(file.planned_path.as_ref(), &path, true),
            planning_factors: if factors.is_empty() {
                Vec::new()
            } else {
                FactorTopic::ALL.into_iter().map(factor).collect()
            },
            operation_mode: self.topic(file.operation_mode.as_ref(), "/system/operation_mode/state", true),
            scenario: self.topic(file.scenario.as_ref(), &format!("{PLANNER}/scenario"), true),
            hazard_request: self.topic(file.hazard_request.as_ref(), "/system/hazard_lights_cmd", true),
            own_turn_command: self.topic(file.own_turn_command.as_ref(), TURN_COMMAND, true),
            own_hazard_command: self.topic(file.own_hazard_command.as_ref(), HAZARD_COMMAND, true),
        }
    }

    fn outputs(&mut self, file: &DeciderOutputsFile) -> DeciderOutputs {
        DeciderOutputs {
            turn_command: self.topic(file.turn_command.as_ref(), TURN_COMMAND, false),
            hazard_command: self.topic(file.hazard_command.as_ref(), HAZARD_COMMAND, false),
        }
    }

    /// No two topics share a name, lest what is published comes back as what somebody else wants.
    /// Autoware's own commands are read only where nothing is published, so those may.
    fn distinct(&mut self, file: &TurnSignalFile, all: (&DeciderInputs, &DeciderOutputs), publishes: bool) {
        let (from, to, (inputs, outputs)) = (&file.inputs, &file.outputs, all);
        let mut topics = vec![
            (&from.odometry, &inputs.odometry),
            (&from.route, &inputs.route),
            (&from.planned_path, &inputs.planned_path),
            (&from.operation_mode, &inputs.operation_mode),
            (&from.scenario, &inputs.scenario),
            (&from.hazard_request, &inputs.hazard_request),
        ];
        topics.extend(if publishes {
            [(&to.turn_command, &outputs.turn_command), (&to.hazard_command, &outputs.hazard_command)]
        } else {
            [
                (&from.own_turn_command, &inputs.own_turn_command),
                (&from.own_hazard_command, &inputs.own_hazard_command),
            ]
        });
        for (given, name) in &topics {
            let is_shared = topics.iter().filter(|(_, other)| other == name).count() > 1;
            if let Some(given) = given.as_ref().filter(|_| is_shared && !name.is_empty()) {
                self.refuse(given, "another topic has this name", "give each its own");
            }
        }
    }

    fn topic(&mut self, given: Option<&Spanned<String>>, default: &str, may_be_empty: bool) -> String {
        let name = given.map_or(default.to_owned(), |given| given.get_ref().clone());
        let is_good = is_topic(&name) || may_be_empty && name.is_empty();
        if let Some(given) = given.filter(|_| !is_good) {
            self.refuse(given, format!("{name:?} is no absolute topic"), "write it as /a/b");
        }
        name
    }
}

/// The lanelets of a map in a file, as the projector file beside it says they are meant.
fn read_road(files: &dyn Files, path: &Path) -> Result<Road, String> {
    let bytes = files.read(path).map_err(|error| format!("cannot read it: {error}"))?;
    let map = RoadMap::read(&bytes, &projector(files, path)?).map_err(|error| error.to_string())?;
    if map.lanelets().is_empty() {
        return Err("it has no lanelet".to_owned());
    }
    Ok(Road::of_map(&map))
}
