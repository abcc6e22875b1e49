//! `[turn_signal]`: the decider on its map, parameters, age limits, topics.

pub(super) mod topics;
pub(super) mod vehicle;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crate::config::built_in::BuiltIn;
use crate::config::decider;
use crate::config::files::Files;
use crate::config::gateway::topic_names::TopicNames;
use crate::config::map::{read_lane_network, read_named};
use crate::config::named_file;
use crate::config::reading::{Fields, Keywords, flag, key_rows, keyword, millis, number_as, text};
use crate::config::vehicle::Vehicle;
use lanelet2_map::lane_network::LaneNetwork;
use topics::{is_command, topics};
use turn_signal::compat::DeciderCompat;
use turn_signal::flow::{DeciderRole, TurnSignalSettings};
use turn_signal::parameters::VehicleInfo;

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
    /// Topics of its inputs.
    pub inputs: TopicNames,
    /// Topics of its commands.
    pub outputs: TopicNames,
}

impl TurnSignalConfig {
    /// Returns true if it publishes commands.
    pub fn publishes_commands(&self) -> bool {
        self.runs && self.flow.role == DeciderRole::Command
    }
}

key_rows! {
    ENABLED: bool = flag("enabled", false).restart().doc("true: commands are published at planning_hz, instead of Autoware's own");
    SHADOW: bool = flag("shadow", false).restart()
        .doc("true: nothing is published; commands are compared with Autoware's own");
    MAP: String = text("map").example("\"lanelet2_map.osm\"")
        .doc("the lanelet2 map, or its folder; projected by map_projector_info.yaml beside it, else by MGRS");
    COMPAT_KEY: DeciderCompat = keyword("compat", COMPAT).or_text("improved")
        .doc("\"improved\", \"upstream\": as Autoware's behavior path planner, weaknesses included, or \"path_generator\": as its core path generator, turns only");
    PLANNING_HZ: Duration = number_as("planning_hz", 1.0, 100.0, "Hz", period).or_number(10.0).doc("cycles, and commands, a second");
    SHADOW_TOLERANCE_MS: Duration = millis("shadow_tolerance_ms", 0, 60_000).or(500)
        .doc("shadow: so long commands may differ before it counts");
}

/// Returns the cycle time, in whole microseconds like all times of the gateway.
fn period(hz: f64) -> Option<Duration> {
    let period = Duration::from_secs_f64(1.0 / hz).as_micros();
    Some(Duration::from_micros(period.try_into().ok()?))
}

pub(super) fn turn_signal(
    files: &dyn Files,
    fields: Fields<'_>,
    outline: VehicleInfo,
    profile: Option<&Vehicle>,
) -> Option<TurnSignalConfig> {
    let checker = fields.checker;
    let before = checker.count();
    let compat = fields.read(&COMPAT_KEY);
    let map = map(files, &fields);
    let decider = decider::decider(files, &fields, compat, outline);
    let (period, tolerance) = (fields.read(&PLANNING_HZ), fields.read(&SHADOW_TOLERANCE_MS));
    let (is_enabled, is_shadow) = (fields.read(&ENABLED), fields.read(&SHADOW));
    let (inputs, outputs) = fields
        .section("inputs")
        .read_all(|from| fields.section("outputs").read_all(|to| topics(from, to, !is_shadow)));
    let vehicle = vehicle::vehicle_use(&fields, profile);
    if is_enabled && is_shadow {
        fields.refuse("shadow", "a shadow publishes nothing", "set enabled = false, or shadow = false");
    }
    fields.done();
    if checker.count() > before {
        return None;
    }
    if !is_enabled && !is_shadow {
        // A decider that does not run is not in effect.
        checker.keep_recorded(|key| !key.section.starts_with("turn_signal"));
    }
    let (map, road) = map?;
    let role = if is_shadow { DeciderRole::Shadow { tolerance } } else { DeciderRole::Command };
    let publishes_sections = outputs.iter().any(|(key, name)| !is_command(key) && !name.is_empty());
    Some(TurnSignalConfig {
        flow: TurnSignalSettings { decider, road: Arc::new(road), role, period, publishes_sections, vehicle },
        runs: is_enabled || is_shadow,
        map,
        inputs,
        outputs,
    })
}

fn map(files: &dyn Files, fields: &Fields<'_>) -> Option<(PathBuf, LaneNetwork)> {
    let remedy = "name the lanelet2 map, relative to this file, with [turn_signal] map = \"….osm\"";
    if !fields.has("map") {
        fields.refuse("map", "the turn signal decider has no map", remedy);
    }
    let named = fields.given(&MAP)?;
    let path = named_file::find(BuiltIn::Map, files, &named, fields.checker.beside(&named));
    let road = read_named(files, fields.checker, fields.at("map"), &path, remedy, read_lane_network)?;
    Some((path, road))
}
