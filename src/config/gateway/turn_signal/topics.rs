//! `[turn_signal.inputs]` and `[turn_signal.outputs]`: topics that the decider reads and writes.

use crate::config::reading::{Fields, key_rows, optional_topic, topic};
use crate::core::turn_signal::planner_input::FactorTopic;

const TURN_COMMAND: &str = "/planning/turn_indicators_cmd";
const HAZARD_COMMAND: &str = "/planning/hazard_lights_cmd";

const PATH: &str = "/planning/scenario_planning/lane_driving/behavior_planning/path_with_lane_id";

key_rows! {
    ODOMETRY: String = topic("odometry", "/localization/kinematic_state").doc("nav_msgs/Odometry");
    ROUTE: String = topic("route", "/planning/mission_planning/route").doc("LaneletRoute");
    PLANNED_PATH: String = optional_topic("planned_path", PATH).doc("PathWithLaneId");
    PLANNING_FACTORS: String = optional_topic("planning_factors", "/planning/planning_factors").doc("prefix of the topics of the modules");
    MODIFIED_GOAL: String = optional_topic("modified_goal", "/planning/scenario_planning/modified_goal").doc("PoseWithUuidStamped");
    OPERATION_MODE: String = optional_topic("operation_mode", "/system/operation_mode/state").doc("OperationModeState");
    SCENARIO: String = optional_topic("scenario", "/planning/scenario_planning/scenario").doc("Scenario of the scenario selector");
    HAZARD_REQUEST: String = optional_topic("hazard_request", "/system/hazard_lights_cmd").doc("joined with the planner's request");
    OWN_TURN_COMMAND: String = optional_topic("own_turn_command", TURN_COMMAND).doc("read in shadow mode only");
    OWN_HAZARD_COMMAND: String = optional_topic("own_hazard_command", HAZARD_COMMAND).doc("read in shadow mode only");
}

pub(in crate::config::gateway) mod written {
    use super::{HAZARD_COMMAND, TURN_COMMAND, key_rows, optional_topic, topic};

    key_rows! {
        TURN: String = topic("turn_command", TURN_COMMAND).doc("TurnIndicatorsCommand");
        HAZARD: String = topic("hazard_command", HAZARD_COMMAND).doc("HazardLightsCommand");
        MARKERS: String = optional_topic("markers", "")
            .doc("e.g. \"/turn_signal/sections\": the sections as markers for RViz; also in shadow mode");
        FACTORS: String = optional_topic("planning_factors", "")
            .doc("e.g. \"/planning/planning_factors/signal_gateway\": what is signalled, as a planning factor; also in shadow mode");
    }

    /// Reads the topics that the decider writes.
    pub(super) fn read(fields: &super::Fields<'_>) -> super::DeciderOutputs {
        super::DeciderOutputs {
            turn_command: fields.read(&TURN),
            hazard_command: fields.read(&HAZARD),
            markers: fields.read(&MARKERS),
            planning_factors: fields.read(&FACTORS),
        }
    }
}

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
    /// `PoseWithUuidStamped` of the goal planner.
    pub modified_goal: String,
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
    let factors = from.read(&PLANNING_FACTORS);
    let factor = |topic: FactorTopic| (topic, format!("{factors}/{}", topic.name()));
    let inputs = DeciderInputs {
        odometry: from.read(&ODOMETRY),
        route: from.read(&ROUTE),
        planned_path: from.read(&PLANNED_PATH),
        planning_factors: if factors.is_empty() {
            Vec::new()
        } else {
            FactorTopic::ALL.into_iter().map(factor).collect()
        },
        modified_goal: from.read(&MODIFIED_GOAL),
        operation_mode: from.read(&OPERATION_MODE),
        scenario: from.read(&SCENARIO),
        hazard_request: from.read(&HAZARD_REQUEST),
        own_turn_command: from.read(&OWN_TURN_COMMAND),
        own_hazard_command: from.read(&OWN_HAZARD_COMMAND),
    };
    let outputs = written::read(&to);
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
        (&from, "modified_goal", &inputs.modified_goal),
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
