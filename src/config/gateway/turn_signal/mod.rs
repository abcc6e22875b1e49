//! `[turn_signal]`: the decider on its map, parameters, age limits, topics.

mod topics;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crate::config::built_in::BuiltIn;
use crate::config::decider;
use crate::config::files::Files;
use crate::config::map::{read_lane_network, refuse as refuse_map};
use crate::config::named_file;
use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;
use crate::config::reading::problem::Problem;
use crate::core::map::lane_network::LaneNetwork;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::flow::{DeciderRole, TurnSignalSettings};
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
    pub flow: TurnSignalSettings,
    /// True if it runs; otherwise its section was only checked.
    pub runs: bool,
    /// Path of its lanelet2 map.
    pub map: PathBuf,
    /// Topics that its inputs are read from.
    pub inputs: DeciderInputs,
    /// Topics that its commands are written to.
    pub outputs: DeciderOutputs,
}

impl TurnSignalConfig {
    /// True if it publishes commands.
    pub fn publishes_commands(&self) -> bool {
        self.runs && self.flow.role == DeciderRole::Command
    }
}

const DEFAULT_HZ: f64 = 10.0;
const DEFAULT_TOLERANCE: Duration = Duration::from_millis(500);
/// Longest tolerance, ms.
const MAX_MS: u64 = 60_000;

/// Reads the section; `None` when a problem was noted.
pub(super) fn turn_signal(files: &dyn Files, fields: Fields<'_>) -> Option<TurnSignalConfig> {
    let checker = fields.checker;
    let before = checker.count();
    let compat = fields.keyword("compat", COMPAT).unwrap_or_default();
    let map = map(files, &fields);
    let decider = decider::decider(files, &fields, compat);
    let hz = fields.number("planning_hz", 1.0..=100.0, "Hz").unwrap_or(DEFAULT_HZ);
    // Whole microseconds, as all times of the gateway.
    let period = Duration::from_secs_f64(1.0 / hz).as_micros();
    let period = Duration::from_micros(period.try_into().unwrap_or(u64::MAX));
    let tolerance = fields.millis("shadow_tolerance_ms", 0..=MAX_MS).unwrap_or(DEFAULT_TOLERANCE);
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
    let role = if is_shadow { DeciderRole::Shadow { tolerance } } else { DeciderRole::Command };
    Some(TurnSignalConfig {
        flow: TurnSignalSettings {
            decider,
            road: Arc::new(road),
            role,
            period,
            publishes_sections: outputs.have_sections(),
        },
        runs: is_enabled || is_shadow,
        map,
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
        let without = || Problem::whole_file(&path, "it has no lanelet", "");
        if road.lanes().next().is_none() { Err(without()) } else { Ok(road) }
    });
    let remedy = named_file::remedy(BuiltIn::Map, files, &path, remedy);
    let refuse = |problem| refuse_map(fields.checker, fields.at("map"), problem, &remedy);
    let road = road.map_err(refuse).ok()?;
    Some((path, road))
}
