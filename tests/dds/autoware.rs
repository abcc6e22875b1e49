//! Messages between Autoware and the gateway: every message with an independent peer, large paths,
//! and bytes that are not messages.

use std::sync::Arc;
use std::time::Duration;

use gateway_base::time::WallStamp;
use lanelet2_map::geometry::Pose;
use serde_json::{Value, json};
use turn_signal::light_command::{EnumOrUnknown, HazardCommand, TurnCommand};
use turn_signal::planner_input::Odometry;
use turn_signal::planner_input::{
    ControlPoint, FactorTopic, OperationMode, PlannedPathPoint, PlannerInput, PlannerRoute, PlanningFactor,
};
use turn_signal::route::Segment;

use super::session::{Gateway, KINDS, Role};
use crate::support::json_process::{JsonProcess, Mark};
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;

const PATH: usize = 2;

/// Both sides know each other on every topic; nonsense has a writer of its own.
fn wait_for_matches(gateway: &Gateway, peer: &JsonProcess) {
    peer.next("its matches", |line| line["event"] == "matched");
    gateway.wait_until("its matches", |status| {
        status["commands"] == json!([1, 1])
            && status["incoming"].as_array().unwrap().iter().all(|topic| topic["writers"] == 2)
    });
}

fn arrival(gateway: &Gateway, subscription: usize) -> Value {
    let (name, _) = KINDS[subscription];
    gateway.next(name, |line| is_arrival(line, subscription))["what"].clone()
}

fn is_arrival(line: &Value, subscription: usize) -> bool {
    line["event"] == "arrived" && line["subscription"] == subscription
}

/// The input that each topic's sample becomes, in the order of [`KINDS`].
fn expected() -> [Value; 13] {
    let at = Pose::new(1.0, 2.0, std::f64::consts::PI);
    let pose = Pose { position: at.position.at_height(3.0), ..at };
    let stamp = WallStamp::from_nanos(7_000_000_001);
    let id = 0x0102_0304_0506_0708_090A_0B0C_0D0E_0F10;
    let segments = vec![Segment { preferred: 10, lanes: vec![11, 10] }];
    let control = ControlPoint { pose, distance_m: 12.0, speed_mps: 4.0, shift_length_m: -0.5 };
    let factor = PlanningFactor {
        behavior: 5,
        is_driving_forward: true,
        detail: "right shift".into(),
        control_points: vec![control],
    };
    let mode = OperationMode { mode: 2, is_autoware_control_enabled: true, is_in_transition: false };
    let planner = |input: PlannerInput| json!({"input": format!("{input:?}")});
    [
        planner(PlannerInput::Odometry { odometry: Odometry { pose, speed_mps: -4.5 }, stamp }),
        planner(PlannerInput::Route(Arc::new(PlannerRoute { id, start: pose, goal: pose, segments }))),
        planner(PlannerInput::PlannedPath(
            [PlannedPathPoint { pose, speed_mps: 4.5, lanes: vec![100, -7] }].into(),
        )),
        planner(PlannerInput::Factors { topic: FactorTopic::GoalPlanner, factors: [factor].into() }),
        planner(PlannerInput::ModifiedGoal { route: id, goal: pose }),
        planner(PlannerInput::OperationMode(mode)),
        planner(PlannerInput::LaneDriving(true)),
        planner(PlannerInput::HazardRequest(HazardCommand::Enable)),
        planner(PlannerInput::OwnTurnCommand(EnumOrUnknown::Known(TurnCommand::Right))),
        planner(PlannerInput::OwnHazardCommand(EnumOrUnknown::Known(HazardCommand::Disable))),
        json!({"turn": 9, "sec": 7}),
        json!({"hazard": 2, "sec": 7}),
        json!({"mode": 4, "sec": 7}),
    ]
}

/// In one process, as starting each peer takes a while.
#[test]
fn every_message_is_understood_on_both_sides_and_nonsense_is_counted() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let peer = cyclone.start("autoware.py", domain, &[]);
    // Before the gateway is there: what changes seldom is handed over to it, what is old is not.
    for topic in ["route", "modified_goal", "operation_mode", "scenario"] {
        peer.send(&format!("publish {topic}"));
    }
    let gateway = Role::new(domain).with_autoware().start();
    // In whichever order their writers are discovered.
    for subscription in [1, 4, 5] {
        let arrived =
            gateway.wait_for(Mark::START, KINDS[subscription].0, |line| is_arrival(line, subscription));
        assert_eq!(arrived["what"], expected()[subscription]);
    }
    wait_for_matches(&gateway, &peer);
    assert_eq!(gateway.status()["incoming"][6]["received"], 0, "an old scenario");

    for round in 1..=2 {
        for (subscription, expected) in expected().iter().enumerate() {
            peer.send(&format!("publish {}", KINDS[subscription].0));
            assert_eq!(arrival(&gateway, subscription), *expected, "{}", KINDS[subscription].0);
            // In the second round after nonsense.
            for length in [3, 70_000] {
                peer.send(&format!("nonsense {} {length}", KINDS[subscription].0));
            }
        }
        gateway.wait_until("what is not a message", |status| {
            status["incoming"].as_array().unwrap().iter().all(|topic| topic["undecodable"] == 2 * round)
        });
    }

    // The peer's readers may know the writers a little later than these know them: volatile commands are lost
    // until then.
    for (command, topic) in [("left", "commanded_turn"), ("hazard", "commanded_hazard")] {
        let send = || gateway.send(&format!("command {command} 4"));
        let is_it = |line: &Value| line["event"] == "received" && line["topic"] == topic;
        peer.wait_while_doing(Mark::START, command, Duration::from_millis(100), send, is_it);
    }
    for (sec, (command, topic, number)) in (5..).zip([
        ("left", "commanded_turn", 2),
        ("right", "commanded_turn", 3),
        ("disable", "commanded_turn", 1),
        ("none", "commanded_turn", 0),
        ("hazard", "commanded_hazard", 2),
        ("no_hazard", "commanded_hazard", 1),
    ]) {
        gateway.send(&format!("command {command} {sec}"));
        // Those of before may still come.
        let is_it = |line: &Value| line["event"] == "received" && line["data"]["stamp"]["sec"] == sec;
        let received = peer.next(command, is_it);
        let data = json!({"stamp": {"sec": sec, "nanosec": 1}, "command": number});
        assert_eq!((&received["topic"], &received["data"]), (&json!(topic), &data), "{command}");
    }
}

#[test]
fn large_paths_ten_times_a_second_arrive_without_a_loss() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let peer = cyclone.start("autoware.py", domain, &[]);
    let gateway = Role::new(domain).with_autoware().start();
    wait_for_matches(&gateway, &peer);
    let mut all = 0;
    for (points, bound) in [(400, 5_000), (500, 20_000)] {
        let times = 30;
        peer.send(&format!("path {points} {bound} {times}"));
        let sent = peer.next("the end of the paths", |line| line["event"] == "sent");
        all += times;
        let status = gateway
            .wait_until("all paths", |status| status["incoming"][PATH]["received"].as_i64() >= Some(all));
        println!("{sent}: {}", status["incoming"][PATH]);
        assert_eq!(status["incoming"][PATH]["received"], all, "{status}");
        assert_eq!(status["incoming"][PATH]["undecodable"], 0, "{status}");
        gateway.expect_rebuilds(0);
        // The request for the status skips arrivals: one more path, to check its input.
        peer.send(&format!("path {points} {bound} 1"));
        gateway.next("a path", |line| line["what"]["points"] == points);
        all += 1;
    }
}
