//! What Autoware and the gateway tell each other: every message with an independent peer, large paths,
//! and bytes that are no messages.

use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use serde_json::{Value, json};
use signal_gateway::core::time::WallStamp;
use signal_gateway::core::turn_signal::geometry::Pose;
use signal_gateway::core::turn_signal::inputs::Odometry;
use signal_gateway::core::turn_signal::route::Segment;
use signal_gateway::core::turn_signal::signal::Hazard;
use signal_gateway::core::turn_signal::told::{
    ControlPoint, FactorTopic, OperationMode, PathPoint, PlanningFactor, Told, ToldRoute,
};

use super::autoware_topics::KINDS;
use super::bench::{Gateway, Side, domain};
use super::cyclone::python;

const PATH: usize = 2;

fn peer(python: &Path, domain: u16) -> Side {
    let mut command = Command::new(python);
    command.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dds_peer/autoware.py"));
    command.arg(domain.to_string()).env_remove("CYCLONEDDS_URI");
    let side = Side::start("Autoware", command);
    side.wait_for("its start", |line| line["event"] == "ready");
    side
}

/// Both sides know each other on every topic; nonsense has a writer of its own.
fn wait_for_matches(gateway: &mut Gateway, peer: &Side) {
    peer.wait_for("its matches", |line| line["event"] == "matched");
    gateway.wait_until("its matches", |status| {
        status["commands"] == json!([1, 1])
            && status["incoming"].as_array().unwrap().iter().all(|topic| topic["writers"] == 2)
    });
}

fn arrival(gateway: &Gateway, subscription: usize) -> Value {
    let (name, _) = KINDS[subscription];
    let arrived = |line: &Value| line["event"] == "arrived" && line["subscription"] == subscription;
    gateway.wait_for(name, arrived)["what"].clone()
}

/// What each topic's sample says, in the order of [`KINDS`].
fn expected() -> [Value; 12] {
    let pose = Pose::new(1.0, 2.0, std::f64::consts::PI);
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
    let told = |told: Told| json!({"told": format!("{told:?}")});
    [
        told(Told::Odometry { odometry: Odometry { pose, speed_mps: -4.5 }, stamp }),
        told(Told::Route(Arc::new(ToldRoute { id, start: pose, goal: pose, segments }))),
        told(Told::PlannedPath([PathPoint { pose, speed_mps: 4.5, lanes: vec![100, -7] }].into())),
        told(Told::Factors { topic: FactorTopic::GoalPlanner, factors: [factor].into() }),
        told(Told::OperationMode(mode)),
        told(Told::LaneDriving(true)),
        told(Told::HazardRequest(Hazard::Enable)),
        told(Told::OwnTurnCommand(3)),
        told(Told::OwnHazardCommand(1)),
        json!({"turn": 9, "sec": 7}),
        json!({"hazard": 2, "sec": 7}),
        json!({"mode": 4, "sec": 7}),
    ]
}

/// In one process, as starting each peer takes a while.
#[test]
fn every_message_is_understood_on_both_sides_and_nonsense_is_counted() {
    let test = "every_message_is_understood_on_both_sides_and_nonsense_is_counted";
    let Some(python) = python(test) else { return };
    let domain = domain();
    let mut peer = peer(&python, domain);
    // Before the gateway is there: what changes seldom is handed over to it, what is old is not.
    for topic in ["route", "operation_mode", "scenario"] {
        peer.tell(&format!("say {topic}"));
    }
    let mut gateway = Gateway::start_with_autoware(domain);
    for subscription in [1, 4] {
        assert_eq!(arrival(&gateway, subscription), expected()[subscription]);
    }
    wait_for_matches(&mut gateway, &peer);
    assert_eq!(gateway.status()["incoming"][5]["received"], 0, "an old scenario");

    for round in 1..=2 {
        for (subscription, expected) in expected().iter().enumerate() {
            peer.tell(&format!("say {}", KINDS[subscription].0));
            assert_eq!(arrival(&gateway, subscription), *expected, "{}", KINDS[subscription].0);
            // In the second round after nonsense.
            for length in [3, 70_000] {
                peer.tell(&format!("nonsense {} {length}", KINDS[subscription].0));
            }
        }
        gateway.wait_until("what is no message", |status| {
            status["incoming"].as_array().unwrap().iter().all(|topic| topic["undecodable"] == 2 * round)
        });
    }

    for (command, topic, number) in [
        ("left", "commanded_turn", 2),
        ("right", "commanded_turn", 3),
        ("disable", "commanded_turn", 1),
        ("none", "commanded_turn", 0),
        ("hazard", "commanded_hazard", 2),
        ("no_hazard", "commanded_hazard", 1),
    ] {
        gateway.tell(&format!("command {command} 5"));
        let heard = peer.wait_for(command, |line| line["event"] == "heard");
        let data = json!({"stamp": {"sec": 5, "nanosec": 1}, "command": number});
        assert_eq!((&heard["topic"], &heard["data"]), (&json!(topic), &data), "{command}");
    }
}

#[test]
fn large_paths_ten_times_a_second_arrive_without_a_loss() {
    let Some(python) = python("large_paths_ten_times_a_second_arrive_without_a_loss") else { return };
    let domain = domain();
    let mut peer = peer(&python, domain);
    let mut gateway = Gateway::start_with_autoware(domain);
    wait_for_matches(&mut gateway, &peer);
    let mut all = 0;
    for (points, bound) in [(400, 5_000), (500, 20_000)] {
        let times = 30;
        peer.tell(&format!("path {points} {bound} {times}"));
        let sent = peer.wait_for("the end of the paths", |line| line["event"] == "sent");
        all += times;
        let status = gateway
            .wait_until("all paths", |status| status["incoming"][PATH]["received"].as_i64() >= Some(all));
        println!("{sent}: {}", status["incoming"][PATH]);
        assert_eq!(status["incoming"][PATH]["received"], all, "{status}");
        assert_eq!(status["incoming"][PATH]["undecodable"], 0, "{status}");
        assert_eq!(status["rebuilds"], 0, "{status}");
        // Asking for the status passes over arrivals: once more to see what a path says.
        peer.tell(&format!("path {points} {bound} 1"));
        gateway.wait_for("a path", |line| line["what"]["points"] == points);
        all += 1;
    }
}
