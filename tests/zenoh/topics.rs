//! Every message with an independent session: keys, tokens, attachments, contents; bytes that are no
//! messages.

use ros_messages::{dds_type, type_hash};
use serde_json::{Value, json};

use super::peer::{Peer, router, session};
use crate::session::{Gateway, KINDS, Role};
use crate::support::json_process::Mark;
use crate::support::peer::domain;
use crate::support::ports::free_port;
use crate::support::prerequisite::{Missing, require};

/// A router, the gateway and a peer.
struct Bench {
    domain: u16,
    gateway: Gateway,
    peer: Peer,
    _router: Peer,
}

impl Bench {
    fn new(change: impl FnOnce(Role) -> Role) -> Result<Self, Missing> {
        let (domain, port) = (domain(), free_port());
        let router = Peer::start(domain, &router(port))?;
        let gateway = change(Role::new(domain).over_zenoh(&session(port)).isolated()).start();
        let peer = Peer::start(domain, &session(port))?;
        Ok(Self { domain, gateway, peer, _router: router })
    }

    fn key(&self, topic: &str, type_name: &str) -> String {
        format!("{}/{topic}/{}/{}", self.domain, dds_type(type_name), type_hash(type_name).unwrap())
    }

    fn read(&self, name: &str, kind: &str, topic: &str, type_name: &str) -> String {
        let key = self.key(topic, type_name);
        self.peer.read(name, kind, &key, true);
        key
    }

    fn arrival(&self, subscription: usize) -> Value {
        let is_it = |line: &Value| line["event"] == "arrived" && line["subscription"] == subscription;
        self.gateway.next(&format!("an arrival of {subscription}"), is_it)["what"].clone()
    }
}

const TURN: &str = "autoware_vehicle_msgs/msg/TurnIndicatorsReport";
const HAZARD: &str = "autoware_vehicle_msgs/msg/HazardLightsReport";

#[test]
fn every_output_arrives_with_its_key_its_token_and_its_attachment() {
    let bench = require!(Bench::new(|role| role.with_lights().with_rosout()));
    let vehicle = |name: &str| format!("vehicle/status/{name}");
    let groups = "autoware_perception_msgs/msg/TrafficLightGroupArray";
    #[rustfmt::skip]
    let topics = [
        ("turn", "turn", vehicle("turn_indicators_status"), TURN, "turn left 5"),
        ("hazard", "hazard", vehicle("hazard_lights_status"), HAZARD, "hazard on 5"),
        ("diagnostics", "diagnostics", "diagnostics".to_owned(), "diagnostic_msgs/msg/DiagnosticArray",
            "diagnostics a"),
        ("truth", "array_v1", "simulation/traffic_lights".to_owned(),
            "traffic_simulator_msgs/msg/TrafficLightArrayV1", "lights truth 5"),
        ("camera", "signals", "camera/traffic_signals".to_owned(),
            "autoware_perception_msgs/msg/TrafficSignalArray", "lights camera 5"),
        ("v2i", "groups", "external/traffic_signals".to_owned(), groups, "lights v2i 5"),
        ("legacy", "groups", "v2x/traffic_signals".to_owned(), groups, "lights v2i 5"),
        ("markers", "markers", "traffic_light/marker".to_owned(), "visualization_msgs/msg/MarkerArray",
            "lights markers 5"),
        ("log", "log", "rosout".to_owned(), "rcl_interfaces/msg/Log", "warn it is late"),
    ];
    let mut readers = vec![];
    for (name, kind, topic, type_name, command) in &topics {
        let key = bench.read(name, kind, topic, type_name);
        let escaped = format!("/%{}/", topic.replace('/', "%"));
        let token = bench.peer.token(Mark::START, "put", &["/MP/%/%vehicle/gateway_under_test/", &escaped]);
        let reader = token["key"].as_str().unwrap().replace("/MP/", "/MS/");
        assert!(
            reader.contains(&key[key.find("::msg").unwrap()..]),
            "type and hash are those of the key: {reader}"
        );
        readers.push((name, key, token, command));
    }
    for (name, key, token, command) in readers {
        bench.gateway.send(command);
        let sample = bench.peer.sample(Mark::START, name, |_| true);
        assert_eq!(
            (sample["key"].as_str().unwrap(), &sample["gid"]),
            (key.as_str(), &token["gid"]),
            "{name}"
        );
        assert_eq!((&sample["number"], &sample["attached"]), (&json!(1), &json!(33)), "{name}");
        let seconds = sample["sent"].as_i64().unwrap() / 1_000_000_000;
        assert!(seconds > 1_700_000_000, "{name} was sent at {seconds} s");
        let data = &sample["data"];
        match *name {
            "turn" | "hazard" => assert_eq!(data, &json!({"stamp": {"sec": 5, "nanosec": 1}, "report": 2})),
            "diagnostics" => assert_eq!(data["status"][0]["message"], "a"),
            "truth" => assert_eq!(data["traffic_lights"].as_array().unwrap().len(), 1),
            "camera" => assert_eq!(data["signals"].as_array().unwrap().len(), 1),
            "v2i" | "legacy" => {
                assert_eq!(data["traffic_light_groups"][0]["predictions"].as_array().unwrap().len(), 1);
            }
            "markers" => assert_eq!(data["markers"].as_array().unwrap().len(), 1),
            "log" => assert_eq!(data["msg"], "it is late"),
            other => panic!("{other}"),
        }
    }
}

#[test]
fn every_input_is_understood_and_nonsense_is_counted() {
    let bench = require!(Bench::new(Role::with_autoware));
    for (name, kind) in KINDS {
        let key = bench.key(name, kind.row().type_name);
        bench.peer.token(
            Mark::START,
            "put",
            &["/MS/", &format!("/%{name}/"), key.rsplit('/').next().unwrap()],
        );
        bench.peer.order(&json!({"write": key, "sample": name}));
    }
    for (position, (name, _)) in KINDS.iter().enumerate() {
        assert!(!bench.arrival(position).is_null(), "{name}");
    }
    for (name, kind) in KINDS {
        let key = bench.key(name, kind.row().type_name);
        for raw in ["", "00", "00010000", "00010000ffffff", "0009000001020304", "ffffffffffffffffff"] {
            bench.peer.order(&json!({"write": key, "raw": raw}));
        }
        bench.peer.order(&json!({"write": key, "sample": name, "attach": false}));
    }
    bench.gateway.wait_until("seven unreadable samples of each", |status| {
        let topics = status["incoming"].as_array().unwrap();
        topics.iter().all(|topic| topic["undecodable"].as_u64() == Some(7))
    });
    // And it still understands.
    let (name, kind) = KINDS[10];
    bench.peer.order(&json!({"write": bench.key(name, kind.row().type_name), "sample": name}));
    bench.gateway.next("another arrival", |line| line["event"] == "arrived" && line["subscription"] == 10);
}

#[test]
fn commands_of_the_decider_arrive() {
    let bench = require!(Bench::new(Role::with_autoware));
    let turn = "autoware_vehicle_msgs/msg/TurnIndicatorsCommand";
    let hazard = "autoware_vehicle_msgs/msg/HazardLightsCommand";
    bench.read("turn", "turn_command", "commanded_turn", turn);
    bench.read("hazard", "hazard_command", "commanded_hazard", hazard);
    bench.peer.order(
        &json!({"token": format!("@ros2_lv/{}/1/0/1/MS/%/%/p/%commanded_turn/{}", bench.domain, tail(turn))}),
    );
    bench.gateway.wait_until("a reader", |status| status["commands"] == json!([1, 0]));
    for (command, name, number) in [("command left 5", "turn", 2), ("command hazard 6", "hazard", 2)] {
        bench.gateway.send(command);
        let data = bench.peer.sample(Mark::START, name, |_| true)["data"].clone();
        assert_eq!(data["command"], number, "{command}");
    }
}

#[test]
fn velocity_and_gear_arrive() {
    let bench = require!(Bench::new(Role::with_vehicle_status));
    let velocity = "autoware_vehicle_msgs/msg/VelocityReport";
    bench.read("velocity", "velocity", "vehicle/status/velocity_status", velocity);
    bench.read("gear", "gear", "vehicle/status/gear_status", "autoware_vehicle_msgs/msg/GearReport");
    let token = format!(
        "@ros2_lv/{}/1/0/1/MS/%/%/p/%vehicle%status%velocity_status/{}",
        bench.domain,
        tail(velocity)
    );
    bench.peer.order(&json!({"token": token}));
    bench.gateway.wait_until("a reader", |status| status["lights"] == json!([1, 0]));
    for (command, name) in [("velocity -2.5 5", "velocity"), ("gear reverse 5", "gear")] {
        bench.gateway.send(command);
        let data = bench.peer.sample(Mark::START, name, |_| true)["data"].clone();
        let expected = if name == "gear" {
            json!({"stamp": {"sec": 5, "nanosec": 1}, "report": 20})
        } else {
            let header = json!({"stamp": {"sec": 5, "nanosec": 1}, "frame_id": "base_link"});
            json!({"header": header, "longitudinal_velocity": -2.5, "lateral_velocity": 0.0, "heading_rate": 0.0})
        };
        assert_eq!(data, expected);
    }
}

fn tail(type_name: &str) -> String {
    format!("{}/{}/::,1:,:,:,,", dds_type(type_name), type_hash(type_name).unwrap())
}

#[test]
fn humble_has_its_word_in_the_place_of_hashes() {
    let bench = require!(Bench::new(Role::with_keys_of_humble));
    let key = format!(
        "{}/vehicle/status/turn_indicators_status/autoware_vehicle_msgs::msg::dds_::TurnIndicatorsReport_/TypeHashNotSupported",
        bench.domain
    );
    bench.peer.read("turn", "turn", &key, true);
    bench.peer.token(Mark::START, "put", &["/MP/", "turn_indicators_status/", "/TypeHashNotSupported/"]);
    bench.gateway.send("turn right 5");
    assert_eq!(bench.peer.sample(Mark::START, "turn", |_| true)["data"]["report"], 3);
}
