//! `[turn_signal.inputs]` and `[turn_signal.outputs]`: topics of the decider's inputs and outputs.

use std::sync::LazyLock;

use crate::config::gateway::topic_names::{TopicNames, written};
use crate::config::reading::{ConfigKey, Fields, optional_topic, topic};
use turn_signal::planner_input::FactorTopic;

const TURN_COMMAND: &str = "/planning/turn_indicators_cmd";
const HAZARD_COMMAND: &str = "/planning/hazard_lights_cmd";
const PATH: &str = "/planning/scenario_planning/lane_driving/behavior_planning/path_with_lane_id";

pub(in crate::config::gateway) static INPUTS: [ConfigKey<String>; 11] = [
    topic("odometry", "/localization/kinematic_state").doc("nav_msgs/Odometry"),
    topic("route", "/planning/mission_planning/route").doc("LaneletRoute"),
    optional_topic("planned_path", PATH).doc("PathWithLaneId"),
    optional_topic("trajectory", "")
        .doc("e.g. \"/planning/trajectory\": Trajectory of a planner that sends no planning factors"),
    optional_topic(FACTORS, "/planning/planning_factors").doc("prefix of the topics of the modules"),
    optional_topic("modified_goal", "/planning/scenario_planning/modified_goal").doc("PoseWithUuidStamped"),
    optional_topic("operation_mode", "/system/operation_mode/state").doc("OperationModeState"),
    optional_topic("scenario", "/planning/scenario_planning/scenario")
        .doc("Scenario of the scenario selector"),
    optional_topic("hazard_request", "/system/hazard_lights_cmd").doc("joined with the planner's request"),
    optional_topic("own_turn_command", TURN_COMMAND).doc("read in shadow mode only"),
    optional_topic("own_hazard_command", HAZARD_COMMAND).doc("read in shadow mode only"),
];
/// Key of the prefix under which each module of the planner publishes its planning factors.
const FACTORS: &str = "planning_factors";

pub(in crate::config::gateway) static OUTPUTS: LazyLock<Vec<ConfigKey<String>>> =
    LazyLock::new(|| written("turn_signal.outputs"));

/// Returns true for the key of a command, which is published only if the decider commands.
pub(super) fn is_command(key: &str) -> bool {
    key.ends_with("_command")
}

/// Reads the topics of both sections, and refuses duplicate names, so that a published topic does not come
/// back as an input. Autoware's own commands are subscribed to only if none are published, so they may share
/// names.
pub(super) fn topics(from: &Fields<'_>, to: &Fields<'_>, publishes: bool) -> (TopicNames, TopicNames) {
    let (inputs, outputs) = (TopicNames::read(from, &INPUTS), TopicNames::read(to, &OUTPUTS));
    let folder = inputs.name(FACTORS);
    let is_factors = |name: &str| {
        !folder.is_empty() && FactorTopic::ALL.iter().any(|topic| topic.in_folder(folder) == name)
    };
    let is_own = |key: &str| key.starts_with("own_");
    let read = inputs.iter().filter(|(key, _)| *key != FACTORS && !(publishes && is_own(key)));
    let written = outputs.iter().filter(|(key, _)| publishes || !is_command(key));
    let topics: Vec<_> = read.map(|topic| (from, topic)).chain(written.map(|topic| (to, topic))).collect();
    for (fields, (key, name)) in &topics {
        let is_shared = is_factors(name) || topics.iter().filter(|(_, (_, other))| other == name).count() > 1;
        if fields.has(key) && is_shared && !name.is_empty() {
            fields.refuse(key, "another topic has this name", "give each its own");
        }
    }
    (inputs, outputs)
}
