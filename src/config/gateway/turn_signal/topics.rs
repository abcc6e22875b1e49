//! `[turn_signal.inputs]` and `[turn_signal.outputs]`: topics that the decider reads and writes.

use serde::Deserialize;
use toml::Spanned;

use crate::config::reading::checker::Checker;
use crate::core::turn_signal::planner_input::FactorTopic;

const TURN_COMMAND: &str = "/planning/turn_indicators_cmd";
const HAZARD_COMMAND: &str = "/planning/hazard_lights_cmd";

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
    /// Prefix of the topics of the modules' `PlanningFactorArray`s.
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

/// Topics that the decider reads; empty = not read.
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

/// The topics that are read.
pub(super) fn inputs(checker: &mut Checker<'_>, file: &DeciderInputsFile) -> DeciderInputs {
    const PLANNER: &str = "/planning/scenario_planning";
    let path = format!("{PLANNER}/lane_driving/behavior_planning/path_with_lane_id");
    let factors = checker.optional_topic(file.planning_factors.as_ref(), "/planning/planning_factors");
    let factor = |topic: FactorTopic| (topic, format!("{factors}/{}", topic.name()));
    DeciderInputs {
        odometry: checker.topic(file.odometry.as_ref(), "/localization/kinematic_state"),
        route: checker.topic(file.route.as_ref(), "/planning/mission_planning/route"),
        planned_path: checker.optional_topic(file.planned_path.as_ref(), &path),
        planning_factors: if factors.is_empty() {
            Vec::new()
        } else {
            FactorTopic::ALL.into_iter().map(factor).collect()
        },
        operation_mode: checker.optional_topic(file.operation_mode.as_ref(), "/system/operation_mode/state"),
        scenario: checker.optional_topic(file.scenario.as_ref(), &format!("{PLANNER}/scenario")),
        hazard_request: checker.optional_topic(file.hazard_request.as_ref(), "/system/hazard_lights_cmd"),
        own_turn_command: checker.optional_topic(file.own_turn_command.as_ref(), TURN_COMMAND),
        own_hazard_command: checker.optional_topic(file.own_hazard_command.as_ref(), HAZARD_COMMAND),
    }
}

/// The topics that are written.
pub(super) fn outputs(checker: &mut Checker<'_>, file: &DeciderOutputsFile) -> DeciderOutputs {
    DeciderOutputs {
        turn_command: checker.topic(file.turn_command.as_ref(), TURN_COMMAND),
        hazard_command: checker.topic(file.hazard_command.as_ref(), HAZARD_COMMAND),
    }
}

/// No two topics share a name, lest what is published comes back as what somebody else wants.
/// Autoware's own commands are read only where nothing is published, so those may.
pub(super) fn distinct(
    checker: &mut Checker<'_>,
    (from, inputs): (&DeciderInputsFile, &DeciderInputs),
    (to, outputs): (&DeciderOutputsFile, &DeciderOutputs),
    publishes: bool,
) {
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
            checker.refuse(given, "another topic has this name", "give each its own");
        }
    }
}
