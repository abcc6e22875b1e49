//! `[turn_signal]`: the decider on its map, parameters, age limits, topics.

mod topics;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crate::config::built_in::{BuiltIn, display};
use crate::config::country::parameters;
use crate::config::dimensions::vehicle;
use crate::config::files::Files;
use crate::config::map::read_lane_network;
use crate::config::named_file;
use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;
use crate::core::map::lane_network::LaneNetwork;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::country::Country;
use crate::core::turn_signal::decider::Settings as DeciderSettings;
use crate::core::turn_signal::flow::{FlowSettings, Role};
use crate::core::turn_signal::inputs::AgeLimits;
use crate::core::turn_signal::min_duration::MinDurations;
use topics::topics;
pub use topics::{DeciderInputs, DeciderOutputs};

const COMPAT: Keywords<DeciderCompat> = &[
    (DeciderCompat::Improved.name(), DeciderCompat::Improved),
    (DeciderCompat::Upstream.name(), DeciderCompat::Upstream),
    (DeciderCompat::PathGenerator.name(), DeciderCompat::PathGenerator),
];

/// The settings of the decider.
#[derive(Debug, Clone)]
pub struct TurnSignalConfig {
    /// Settings of the decider and of its inputs.
    pub flow: FlowSettings,
    /// True if it runs; otherwise its section was only checked.
    pub runs: bool,
    /// Path of its lanelet2 map.
    pub map: PathBuf,
    /// Country whose rules apply; `None` for the parameters that Autoware is deployed with.
    pub country: Option<Country>,
    /// Topics that its inputs are read from.
    pub inputs: DeciderInputs,
    /// Topics that its commands are written to.
    pub outputs: DeciderOutputs,
}

impl TurnSignalConfig {
    /// True if it publishes commands.
    pub fn publishes_commands(&self) -> bool {
        self.runs && self.flow.role == Role::Command
    }
}

const DEFAULT_HZ: f64 = 10.0;
const DEFAULT_TOLERANCE: Duration = Duration::from_millis(500);
/// Longest signal, gap, age limit and tolerance, ms.
const MAX_MS: u64 = 60_000;

/// Reads the section; `None` when a problem was noted.
pub(super) fn turn_signal(files: &dyn Files, fields: Fields<'_>) -> Option<TurnSignalConfig> {
    let checker = fields.checker;
    let before = checker.count();
    let compat = fields.keyword("compat", COMPAT).unwrap_or_default();
    let map = map(files, &fields);
    let (country, parameters) = parameters(files, &fields);
    let hz = fields.number("planning_hz", 1.0..=100.0, "Hz").unwrap_or(DEFAULT_HZ);
    // Whole microseconds, as all times of the gateway.
    let period = Duration::from_secs_f64(1.0 / hz).as_micros();
    let period = Duration::from_micros(period.try_into().unwrap_or(u64::MAX));
    let time = |key, default| fields.millis(key, 0..=MAX_MS).unwrap_or(default);
    let min_durations = MinDurations {
        minimum_on: time("minimum_on_ms", MinDurations::READABLE.minimum_on),
        minimum_gap: time("minimum_gap_ms", MinDurations::READABLE.minimum_gap),
    };
    let tolerance = time("shadow_tolerance_ms", DEFAULT_TOLERANCE);
    let age_limits = age_limits(fields.section("age_limits"));
    let vehicle = vehicle(fields.section("vehicle"));
    let [is_enabled, is_shadow] = ["enabled", "shadow"].map(|key| fields.flag(key).unwrap_or_default());
    let (inputs, outputs) = topics(fields.section("inputs"), fields.section("outputs"), !is_shadow);
    if is_enabled && is_shadow {
        fields.refuse("shadow", "a shadow publishes nothing", "set enabled = false, or shadow = false");
    }
    fields.done();
    if checker.count() > before {
        return None;
    }
    let (map, road) = map?;
    let decider = DeciderSettings { compat, parameters, vehicle, age_limits, min_durations };
    let role = if is_shadow { Role::Shadow { tolerance } } else { Role::Command };
    Some(TurnSignalConfig {
        flow: FlowSettings {
            decider,
            road: Arc::new(road),
            role,
            period,
            publishes_sections: outputs.have_sections(),
        },
        runs: is_enabled || is_shadow,
        map,
        country,
        inputs,
        outputs,
    })
}

/// Reads the lanelets of the map that is named.
fn map(files: &dyn Files, fields: &Fields<'_>) -> Option<(PathBuf, LaneNetwork)> {
    let remedy = "name the lanelet2 map, relative to this file, with [turn_signal] map = \"….osm\"";
    if !fields.has("map") {
        fields.refuse("map", "the turn signal decider has no map", remedy);
    }
    let path = named_file::path_at(BuiltIn::Map, files, fields, "map")?;
    let road = read_lane_network(files, &path).and_then(|road| {
        if road.lanes().next().is_none() { Err("it has no lanelet".to_owned()) } else { Ok(road) }
    });
    let road = road.map_err(|reason| format!("{}: {reason}", display(&path)));
    let remedy = named_file::remedy(BuiltIn::Map, files, &path, remedy);
    let road = fields.checker.accept(fields.at("map"), road, &remedy)?;
    Some((path, road))
}

fn age_limits(fields: Fields<'_>) -> AgeLimits {
    let limit = |key, default| fields.millis(key, 10..=MAX_MS).unwrap_or(default);
    let limits = AgeLimits {
        odometry: limit("odometry_ms", AgeLimits::DEFAULT.odometry),
        planned_path: limit("planned_path_ms", AgeLimits::DEFAULT.planned_path),
        manoeuvre: limit("manoeuvre_ms", AgeLimits::DEFAULT.manoeuvre),
        scenario: limit("scenario_ms", AgeLimits::DEFAULT.scenario),
        hazard_request: limit("hazard_request_ms", AgeLimits::DEFAULT.hazard_request),
        own_command: limit("own_command_ms", AgeLimits::DEFAULT.own_command),
    };
    fields.done();
    limits
}
