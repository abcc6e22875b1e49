//! `[turn_signal]`: the decider on its map, parameters, age limits, topics.

mod topics;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use crate::config::country::{NoCountry, country};
use crate::config::files::Files;
use crate::config::map::read_lane_network;
use crate::config::reading::checker::Checker;
use crate::config::reading::keyword::{Keyword, keywords};
use crate::core::map::lane_network::LaneNetwork;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::country::Country;
use crate::core::turn_signal::decider::Settings as DeciderSettings;
use crate::core::turn_signal::flow::{FlowSettings, Limits, Role};
use crate::core::turn_signal::inputs::AgeLimits;
use crate::core::turn_signal::min_duration::MinDurations;
use crate::core::turn_signal::parameters::{Parameter, ParameterError, Parameters, Vehicle};
pub use topics::{DeciderInputs, DeciderOutputs};
use topics::{DeciderInputsFile, DeciderOutputsFile, distinct, inputs, outputs};

keywords!(DeciderCompat {
    "improved" => DeciderCompat::Improved,
    "upstream" => DeciderCompat::Upstream,
    "path_generator" => DeciderCompat::PathGenerator,
});

/// `[turn_signal]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TurnSignalFile {
    /// Commands are published.
    #[serde(default)]
    pub enabled: bool,
    /// Commands are compared with Autoware's own, and nothing is published.
    pub shadow: Option<Spanned<bool>>,
    /// Lanelet2 map, relative to this file.
    pub map: Option<Spanned<String>>,
    /// The behaviour of the decider.
    #[serde(default)]
    pub compat: Keyword<DeciderCompat>,
    /// Country whose rules are meant, ISO 3166, or a file of rules.
    pub country: Option<Spanned<String>>,
    /// Cycles a second.
    pub planning_hz: Option<Spanned<f64>>,
    /// So long the commands may differ in shadow mode, ms.
    pub shadow_tolerance_ms: Option<Spanned<u64>>,
    /// Shortest signal, ms.
    pub minimum_on_ms: Option<Spanned<u64>>,
    /// Shortest time between two signals, ms.
    pub minimum_gap_ms: Option<Spanned<u64>>,
    /// Parameters by the names of Autoware.
    #[serde(default)]
    pub parameters: BTreeMap<Spanned<String>, Spanned<toml::Value>>,
    /// Dimensions.
    #[serde(default)]
    pub vehicle: DimensionsFile,
    /// Age limits of inputs.
    #[serde(default)]
    pub age_limits: AgeLimitsFile,
    /// Names of the topics that are read.
    #[serde(default)]
    pub inputs: DeciderInputsFile,
    /// Names of the topics that are written.
    #[serde(default)]
    pub outputs: DeciderOutputsFile,
}

/// `[turn_signal.vehicle]`, metres.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DimensionsFile {
    /// Between the axles.
    pub wheel_base_m: Option<Spanned<f64>>,
    /// Front axle to front bumper.
    pub front_overhang_m: Option<Spanned<f64>>,
    /// Rear axle to rear bumper.
    pub rear_overhang_m: Option<Spanned<f64>>,
    /// Centre line to the left side.
    pub left_m: Option<Spanned<f64>>,
    /// Centre line to the right side.
    pub right_m: Option<Spanned<f64>>,
}

/// `[turn_signal.age_limits]`, ms.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AgeLimitsFile {
    /// Odometry.
    pub odometry_ms: Option<Spanned<u64>>,
    /// Planned path.
    pub planned_path_ms: Option<Spanned<u64>>,
    /// Planning factors.
    pub manoeuvre_ms: Option<Spanned<u64>>,
    /// Scenario.
    pub scenario_ms: Option<Spanned<u64>>,
    /// The system's hazard request.
    pub hazard_request_ms: Option<Spanned<u64>>,
    /// Autoware's own commands.
    pub own_command_ms: Option<Spanned<u64>>,
}

/// The decider as configured.
#[derive(Debug, Clone)]
pub struct TurnSignalConfig {
    /// Settings of the flow.
    pub flow: FlowSettings,
    /// It runs at all; otherwise it was only checked.
    pub runs: bool,
    /// Path of its map.
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

const DEFAULT_HZ: f64 = 10.0;
const DEFAULT_TOLERANCE: Duration = Duration::from_millis(500);
/// Longest signal, gap, age and tolerance, ms.
const MAX_MS: u64 = 60_000;

/// Checks the section; every problem found is noted.
pub(super) fn turn_signal(
    files: &dyn Files,
    checker: &mut Checker<'_>,
    file: &TurnSignalFile,
) -> Option<TurnSignalConfig> {
    let before = checker.problems.len();
    let map = map(checker, files, file.map.as_ref());
    let (country, parameters) = parameters(checker, files, file);
    let compat = file.compat.0;
    let period = period(checker, file.planning_hz.as_ref());
    let min_durations = MinDurations {
        minimum_on: time(checker, file.minimum_on_ms.as_ref(), 0, MinDurations::READABLE.minimum_on),
        minimum_gap: time(checker, file.minimum_gap_ms.as_ref(), 0, MinDurations::READABLE.minimum_gap),
    };
    let (age_limits, limits) = age_limits(checker, &file.age_limits);
    let vehicle = vehicle(checker, &file.vehicle);
    let inputs = inputs(checker, &file.inputs);
    let outputs = outputs(checker, &file.outputs);
    let tolerance = time(checker, file.shadow_tolerance_ms.as_ref(), 0, DEFAULT_TOLERANCE);
    let shadow = file.shadow.as_ref().filter(|shadow| *shadow.get_ref());
    distinct(checker, (&file.inputs, &inputs), (&file.outputs, &outputs), shadow.is_none());
    if let Some(shadow) = shadow.filter(|_| file.enabled) {
        checker.refuse(shadow, "a shadow publishes nothing", "set enabled = false, or shadow = false");
    }
    if checker.problems.len() > before {
        return None;
    }
    let (map, road) = map?;
    let decider = DeciderSettings { compat, parameters, vehicle, age_limits, min_durations };
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

/// The lanelets of the map that is named.
fn map(
    checker: &mut Checker<'_>,
    files: &dyn Files,
    given: Option<&Spanned<String>>,
) -> Option<(PathBuf, LaneNetwork)> {
    let Some(given) = given else {
        let reason = "the turn signal decider has no map: no lanelet is known";
        let remedy = "name the lanelet2 map with [turn_signal] map = \"….osm\"";
        checker.refuse_at(0..0, reason, remedy);
        return None;
    };
    let path = checker.beside(given);
    let road = read_lane_network(files, &path).and_then(|road| {
        if road.lanes().next().is_none() { Err("it has no lanelet".to_owned()) } else { Ok(road) }
    });
    let remedy = "name a lanelet2 map, relative to this file";
    road.map_err(|reason| checker.refuse(given, format!("{}: {reason}", path.display()), remedy))
        .ok()
        .map(|road| (path, road))
}

fn parameters(
    checker: &mut Checker<'_>,
    files: &dyn Files,
    file: &TurnSignalFile,
) -> (Option<Country>, Parameters) {
    let country = file.country.as_ref().and_then(|given| {
        match country(files, checker.folder(), given.get_ref()) {
            Ok(country) => return Some(country),
            Err(NoCountry::Nowhere { reason, remedy }) => checker.refuse(given, reason, &remedy),
            Err(NoCountry::Refused(problems)) => checker.problems.extend(problems),
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
                checker.refuse(name, error.to_string(), "see config/gateway.toml for every key");
            }
            Err(ParameterError::Value { wanted, .. }) => {
                checker.refuse(value, format!("{text} does not fit"), &format!("give {wanted}"));
            }
        }
        let Some(known) = Parameter::named(name.get_ref()).map(|parameter| parameter.name) else {
            continue;
        };
        if taken.contains(&known) {
            checker.refuse(name, format!("{known} is given twice"), "keep one of its names");
        }
        taken.push(known);
    }
    (country, parameters)
}

fn period(checker: &mut Checker<'_>, given: Option<&Spanned<f64>>) -> Duration {
    let hz = given.map_or(DEFAULT_HZ, |given| *given.get_ref());
    if let Some(given) = given.filter(|_| !(1.0..=100.0).contains(&hz)) {
        checker.refuse(given, format!("invalid rate {hz} Hz"), "give 1 to 100 Hz");
        return Duration::from_secs(1);
    }
    // Whole microseconds, as all times of the gateway.
    Duration::from_micros(Duration::from_secs_f64(1.0 / hz).as_micros().try_into().unwrap_or(u64::MAX))
}

/// A time of up to a minute; `default` without one.
fn time(
    checker: &mut Checker<'_>,
    given: Option<&Spanned<u64>>,
    least_ms: u64,
    default: Duration,
) -> Duration {
    checker.millis(given, &(least_ms..=MAX_MS), "invalid time {} ms").unwrap_or(default)
}

fn age_limits(checker: &mut Checker<'_>, file: &AgeLimitsFile) -> (AgeLimits, Limits) {
    let mut limit = |given: &Option<Spanned<u64>>, default| time(checker, given.as_ref(), 10, default);
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

fn vehicle(checker: &mut Checker<'_>, file: &DimensionsFile) -> Vehicle {
    let mut metres = |given: &Option<_>, default| {
        let reason = "invalid vehicle dimension {} m";
        checker.in_range(given.as_ref(), &(0.0..=50.0), reason, "give 0 to 50 m").unwrap_or(default)
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
