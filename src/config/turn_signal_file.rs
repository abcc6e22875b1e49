//! What `[turn_signal]` of the gateway's file says, as it stands there.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use super::traffic_lights_file::CompatFile;

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
    /// Whose behaviour.
    #[serde(default)]
    pub compat: CompatFile,
    /// Country whose rules are meant, ISO 3166, or a file of rules.
    pub country: Option<Spanned<String>>,
    /// Cycles a second.
    pub planning_hz: Option<Spanned<f64>>,
    /// So long the commands may differ in shadow mode, ms.
    pub agreement_tolerance_ms: Option<Spanned<u64>>,
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
    /// How old inputs may be.
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

/// `[turn_signal.inputs]`; an empty name = not read.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeciderInputsFile {
    /// `nav_msgs/Odometry`
    pub odometry: Option<Spanned<String>>,
    /// `LaneletRoute`
    pub route: Option<Spanned<String>>,
    /// `PathWithLaneId`
    pub planned_path: Option<Spanned<String>>,
    /// What the topics of the modules' `PlanningFactorArray`s begin with.
    pub planning_factors: Option<Spanned<String>>,
    /// `OperationModeState`
    pub operation_mode: Option<Spanned<String>>,
    /// `Scenario`
    pub scenario: Option<Spanned<String>>,
    /// `HazardLightsCommand` of the system.
    pub hazard_request: Option<Spanned<String>>,
    /// `TurnIndicatorsCommand` of Autoware's own decider.
    pub own_turn_command: Option<Spanned<String>>,
    /// `HazardLightsCommand` of Autoware's own decider.
    pub own_hazard_command: Option<Spanned<String>>,
}

/// `[turn_signal.outputs]`
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeciderOutputsFile {
    /// `TurnIndicatorsCommand`
    pub turn_command: Option<Spanned<String>>,
    /// `HazardLightsCommand`
    pub hazard_command: Option<Spanned<String>>,
}
