//! `[turn_signal.inputs]` and `[turn_signal.outputs]`: topics that the decider reads and writes.

use crate::config::reading::fields::Fields;
use crate::core::turn_signal::planner_input::FactorTopic;

const TURN_COMMAND: &str = "/planning/turn_indicators_cmd";
const HAZARD_COMMAND: &str = "/planning/hazard_lights_cmd";

/// Topics that the decider reads; an empty name is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeciderInputs {
    /// `nav_msgs/Odometry` of the localisation.
    pub odometry: String,
    /// `LaneletRoute` of the mission planner.
    pub route: String,
    /// `PathWithLaneId` of the behaviour path planner.
    pub planned_path: String,
    /// `PlanningFactorArray` of each module.
    pub planning_factors: Vec<(FactorTopic, String)>,
    /// `OperationModeState` of the system.
    pub operation_mode: String,
    /// `Scenario` of the scenario selector.
    pub scenario: String,
    /// `HazardLightsCommand` of the system.
    pub hazard_request: String,
    /// `TurnIndicatorsCommand` of Autoware's own decider; read in shadow mode.
    pub own_turn_command: String,
    /// `HazardLightsCommand` of Autoware's own decider; read in shadow mode.
    pub own_hazard_command: String,
}

/// Topics that the decider writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeciderOutputs {
    /// `TurnIndicatorsCommand` of the decider.
    pub turn_command: String,
    /// `HazardLightsCommand` of the decider.
    pub hazard_command: String,
    /// `MarkerArray` of the sections; not written if empty.
    pub markers: String,
    /// `PlanningFactorArray` of what is signalled; not written if empty.
    pub planning_factors: String,
}

impl DeciderOutputs {
    /// True if sections are published, in either form.
    pub fn have_sections(&self) -> bool {
        !self.markers.is_empty() || !self.planning_factors.is_empty()
    }
}

/// Reads the topics of both sections, and refuses two of the same name, lest a topic that is published comes
/// back as an input. Autoware's own commands are read only where nothing is published, so they may share theirs.
pub(super) fn topics(from: Fields<'_>, to: Fields<'_>, publishes: bool) -> (DeciderInputs, DeciderOutputs) {
    const PATH: &str = "/planning/scenario_planning/lane_driving/behavior_planning/path_with_lane_id";
    let factors = from.optional_topic("planning_factors", "/planning/planning_factors");
    let factor = |topic: FactorTopic| (topic, format!("{factors}/{}", topic.name()));
    let inputs = DeciderInputs {
        odometry: from.topic("odometry", "/localization/kinematic_state"),
        route: from.topic("route", "/planning/mission_planning/route"),
        planned_path: from.optional_topic("planned_path", PATH),
        planning_factors: if factors.is_empty() {
            Vec::new()
        } else {
            FactorTopic::ALL.into_iter().map(factor).collect()
        },
        operation_mode: from.optional_topic("operation_mode", "/system/operation_mode/state"),
        scenario: from.optional_topic("scenario", "/planning/scenario_planning/scenario"),
        hazard_request: from.optional_topic("hazard_request", "/system/hazard_lights_cmd"),
        own_turn_command: from.optional_topic("own_turn_command", TURN_COMMAND),
        own_hazard_command: from.optional_topic("own_hazard_command", HAZARD_COMMAND),
    };
    let outputs = DeciderOutputs {
        turn_command: to.topic("turn_command", TURN_COMMAND),
        hazard_command: to.topic("hazard_command", HAZARD_COMMAND),
        markers: to.optional_topic("markers", ""),
        planning_factors: to.optional_topic("planning_factors", ""),
    };
    let [turn, hazard] = if publishes {
        [(&to, "turn_command", &outputs.turn_command), (&to, "hazard_command", &outputs.hazard_command)]
    } else {
        [
            (&from, "own_turn_command", &inputs.own_turn_command),
            (&from, "own_hazard_command", &inputs.own_hazard_command),
        ]
    };
    let topics = [
        (&from, "odometry", &inputs.odometry),
        (&from, "route", &inputs.route),
        (&from, "planned_path", &inputs.planned_path),
        (&from, "operation_mode", &inputs.operation_mode),
        (&from, "scenario", &inputs.scenario),
        (&from, "hazard_request", &inputs.hazard_request),
        turn,
        hazard,
        (&to, "markers", &outputs.markers),
        (&to, "planning_factors", &outputs.planning_factors),
    ];
    for (fields, key, name) in topics {
        let is_read = inputs.planning_factors.iter().any(|(_, read)| read == name);
        let is_shared = is_read || topics.iter().filter(|(_, _, other)| *other == name).count() > 1;
        if fields.has(key) && is_shared && !name.is_empty() {
            fields.refuse(key, "another topic has this name", "give each its own");
        }
    }
    from.done();
    to.done();
    (inputs, outputs)
}
