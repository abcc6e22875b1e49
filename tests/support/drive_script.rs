//! A drive as a script for `tests/peer/autoware_drive.py`: what Autoware would publish, cycle by cycle; and
//! the decisions on the same drive without messages.

use std::fmt::Write as _;

use lanelet2_map::geometry::Pose;
use serde_json::{Map, Value, json};
use signal_gateway::config::drive::ExpectedDecision;
use signal_gateway::desk::drive::run::DriveRun;
use signal_gateway::desk::drive::simulation::{DriveCycle, DriveSimulation};
use turn_signal::compat::DeciderCompat;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::manoeuvre::Manoeuvre;
use turn_signal::manoeuvre::avoidance::AvoidanceLine;
use turn_signal::manoeuvre::pull_over::{PullOver, Undecided};
use turn_signal::planner_input::{FactorTopic, Odometry};
use turn_signal::shift::ShiftedPath;
use turn_signal::side::Side;

/// Improved and upstream, in the order of everything that is kept for each.
pub(crate) const COMPATS: [DeciderCompat; 2] = [DeciderCompat::Improved, DeciderCompat::Upstream];

/// Numbers of `PlanningFactor.behavior`.
const SLOW_DOWN: u8 = 2;
const STOP: u8 = 3;
const SHIFT_LEFT: u8 = 4;
const SHIFT_RIGHT: u8 = 5;

/// A drive and its script.
pub(crate) struct Script {
    pub(crate) steps: Vec<Step>,
    cycles: Vec<Map<String, Value>>,
}

/// One cycle of the drive.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    pub(crate) at_m: f64,
    pub(crate) speed_mps: f64,
    /// The decider's commands.
    pub(crate) decided: [(TurnCommand, HazardCommand); 2],
    /// The decisions that the scenario expects.
    pub(crate) expected: [Vec<ExpectedDecision>; 2],
}

impl Script {
    pub(crate) fn new(simulation: &DriveSimulation) -> Self {
        let mut runs = COMPATS.map(|compat| DriveRun::new(simulation, compat));
        let mut script = Self { steps: Vec::new(), cycles: Vec::new() };
        let mut route = None;
        for cycle in simulation.cycles() {
            let decided = runs.each_mut().map(|run| {
                let decision = run.step(&cycle);
                (decision.turn, decision.hazard)
            });
            let expected = COMPATS.map(|compat| {
                simulation.expected(&cycle, compat).map(|(_, expected)| expected.decision.clone()).collect()
            });
            script.steps.push(Step { at_m: cycle.at_m, speed_mps: cycle.speed_mps, decided, expected });
            let mut messages = messages(&cycle);
            if route.replace(cycle.route.id()) != Some(cycle.route.id()) {
                messages.insert("route".to_owned(), planner_route(&cycle));
            }
            script.cycles.push(messages);
        }
        script
    }

    /// Adds a message to each cycle.
    pub(crate) fn add(&mut self, key: &str, value: impl Fn(usize, &Step) -> Option<u8>) {
        for (index, (cycle, step)) in self.cycles.iter_mut().zip(&self.steps).enumerate() {
            if let Some(value) = value(index, step) {
                cycle.insert(key.to_owned(), json!(value));
            }
        }
    }

    /// The script, lines of JSON.
    pub(crate) fn text(&self) -> String {
        let mut topics = json!({
            "odometry": "/localization/kinematic_state",
            "route": "/planning/mission_planning/route",
            "path": "/planning/scenario_planning/lane_driving/behavior_planning/path_with_lane_id",
            "operation_mode": "/system/operation_mode/state",
            "scenario": "/planning/scenario_planning/scenario",
        });
        for topic in FactorTopic::ALL {
            let name = topic.name();
            topics[format!("factors:{name}")] = json!(format!("/planning/planning_factors/{name}"));
        }
        for (key, topic) in [
            ("hazard_request", "/system/hazard_lights_cmd"),
            ("own_turn", "/planning/turn_indicators_cmd"),
            ("own_hazard", "/planning/hazard_lights_cmd"),
            ("control_mode", "/vehicle/status/control_mode"),
        ] {
            if self.cycles.iter().any(|cycle| cycle.contains_key(key)) {
                topics[key] = json!(topic);
            }
        }
        let mut text = format!("{topics}\n");
        for cycle in &self.cycles {
            writeln!(text, "{}", Value::Object(cycle.clone())).unwrap();
        }
        text
    }
}

/// The messages of Autoware at a cycle.
fn messages(cycle: &DriveCycle) -> Map<String, Value> {
    let odometry = cycle.odometry.map(|Odometry { pose: Pose { position, yaw_rad }, speed_mps }| {
        json!([position.x_m, position.y_m, yaw_rad, position.z_m, speed_mps])
    });
    let speed_mps = cycle.speed_mps;
    let point = |pose: Pose, lane: Option<i64>| {
        json!([pose.position.x_m, pose.position.y_m, pose.yaw_rad, pose.position.z_m, speed_mps, lane])
    };
    let path: Vec<_> =
        cycle.path.iter().map(|planned| point(planned.pose, planned.lanes.first().copied())).collect();
    let mut factors = Map::new();
    for (module, factor) in cycle.manoeuvres.iter().flat_map(factors_of) {
        let listed = factors.entry(module.name()).or_insert_with(|| json!([]));
        listed.as_array_mut().unwrap().push(factor);
    }
    let messages = json!({
        "t": cycle.at_s,
        "odometry": odometry,
        "path": path,
        "factors": factors,
        "lane_driving": cycle.lane_driving,
    });
    messages.as_object().unwrap().clone()
}

fn planner_route(cycle: &DriveCycle) -> Value {
    let pose = |Pose { position, yaw_rad }: Pose| json!([position.x_m, position.y_m, yaw_rad, position.z_m]);
    // In the message the preferred lanelet comes in front of all of them, itself included.
    let segments = cycle.route.segments().iter().map(|segment| {
        let others = segment.lanes.iter().filter(|lane| **lane != segment.preferred);
        std::iter::once(segment.preferred).chain(others.copied()).collect::<Vec<_>>()
    });
    json!({
        // More digits than a number of JSON has.
        "id": cycle.route.id().to_string(),
        "start": pose(cycle.route.start()),
        "goal": pose(cycle.goal),
        "segments": segments.collect::<Vec<_>>(),
    })
}

/// The planning factors that the planner's modules publish of a manoeuvre: less than it is.
fn factors_of(manoeuvre: &Manoeuvre) -> Vec<(FactorTopic, Value)> {
    match manoeuvre {
        Manoeuvre::LaneChange(change) => {
            let (topic, behavior) = match change.side {
                Side::Left => (FactorTopic::LaneChangeLeft, SHIFT_LEFT),
                Side::Right => (FactorTopic::LaneChangeRight, SHIFT_RIGHT),
            };
            let ends = change.start.zip(change.end);
            ends.map(|(start, end)| (topic, factor(behavior, true, &[(start, 0.0), (end, 0.0)])))
                .into_iter()
                .collect()
        }
        // One for all lines that are registered: from the start of the first to the end of the last.
        Manoeuvre::Avoidance(avoidance) => {
            let batch = avoidance.lines.first().zip(avoidance.lines.last());
            let batch = batch.map(|(first, last): (&AvoidanceLine, &AvoidanceLine)| {
                shift((first.line.start, first.start_shift_m), (last.line.end, last.end_shift_m), true)
            });
            batch.map(|factor| (FactorTopic::StaticObstacleAvoidance, factor)).into_iter().collect()
        }
        Manoeuvre::PullOut(out) => {
            let begin_m = -change_m(out.path.as_ref(), out.start, out.end);
            vec![(FactorTopic::StartPlanner, shift((out.start, begin_m), (out.end, 0.0), out.forward))]
        }
        Manoeuvre::PullOver(PullOver::Decided(over)) => {
            let end_m = change_m(over.path.as_ref(), over.start, over.goal);
            vec![(FactorTopic::GoalPlanner, shift((over.start, 0.0), (over.goal, end_m), true))]
        }
        Manoeuvre::PullOver(PullOver::Undecided(Undecided { deceleration, stop, .. })) => {
            let poses = [(SLOW_DOWN, deceleration), (STOP, stop)];
            let known = poses.into_iter().filter_map(|(behavior, pose)| Some((behavior, (*pose)?)));
            known
                .map(|(behavior, pose)| (FactorTopic::GoalPlanner, factor(behavior, true, &[(pose, 0.0)])))
                .collect()
        }
        Manoeuvre::SideShift => Vec::new(),
    }
}

/// Change of the offset between two poses, metres.
fn change_m(path: Option<&ShiftedPath>, from: Pose, to: Pose) -> f64 {
    path.map_or(0.0, |path| {
        path.offset_between_m(path.nearest_index(from.position), path.nearest_index(to.position))
    })
}

fn shift(from: (Pose, f64), to: (Pose, f64), forward: bool) -> Value {
    factor(if to.1 < from.1 { SHIFT_RIGHT } else { SHIFT_LEFT }, forward, &[from, to])
}

fn factor(behavior: u8, forward: bool, points: &[(Pose, f64)]) -> Value {
    let point = |(pose, shift_m): &(Pose, f64)| {
        json!([pose.position.x_m, pose.position.y_m, pose.yaw_rad, pose.position.z_m, shift_m])
    };
    json!({
        "behavior": behavior,
        "forward": forward,
        "points": points.iter().map(point).collect::<Vec<_>>(),
    })
}
