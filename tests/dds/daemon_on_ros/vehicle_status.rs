//! The reports on the vehicle's status end to end: frames that are played go out of the built binary to
//! readers of another make.

use std::time::Duration;

use serde_json::{Value, json};

use super::peer::{Reader, TopicToRead};
use crate::dds::delivery::SILENCE;
use crate::dds::isolation::{network_process, signal};
use crate::dds::session::Role;
use crate::support::json_process::Mark;
use crate::support::mcap::{McapReaders, only_entry};
use crate::support::peer::{Cyclone, Reading, domain};
use crate::support::prerequisite::require;
use crate::support::process::{Folder, Process, ros_in};
use crate::support::status_vehicle;
use crate::support::waiting::let_pass;

const VELOCITY: TopicToRead<'_> = ("velocity", "velocity", "vehicle/status/velocity_status");
const STEERING: TopicToRead<'_> = ("steering", "steering", "vehicle/status/steering_status");
const GEAR: TopicToRead<'_> = ("gear", "gear", "vehicle/status/gear_status");
const CONTROL_MODE: TopicToRead<'_> = ("control_mode", "control_mode", "vehicle/status/control_mode");
const DOORS: TopicToRead<'_> = ("doors", "doors", "vehicle/doors/status");

/// The invented vehicle on its drive, which is played with these keys.
fn folder(domain: u16, playback: &str) -> Folder {
    let folder = Folder::with_configuration(&format!(
        "profile = \"bench.toml\"\nsource = \"recording\"\n[can.body]\ninterface = \"can0\"\n\
         [recording]\nfile = \"drive.log\"\n{playback}{}",
        ros_in(domain)
    ));
    folder.write("bench.toml", status_vehicle::PROFILE);
    folder.write("bench.dbc", status_vehicle::DBC);
    folder.write("drive.log", &status_vehicle::drive());
    folder
}

#[test]
fn every_report_arrives_as_it_is_recorded_and_a_late_reader_gets_states_but_no_measurement() {
    let readers = require!(McapReaders::find());
    let (cyclone, domain) = (require!(Cyclone::on_loopback()), domain());
    let folder = folder(domain, "");
    let topics = [VELOCITY, STEERING, GEAR, CONTROL_MODE, DOORS];
    let reader = Reader::start(&cyclone, domain, &topics);
    let mut gateway = Process::run_with(&folder, |command| _ = command.args(["--record", "bags"]));
    for (_, name, _) in topics {
        let durability = if [VELOCITY.1, STEERING.1].contains(&name) { "Volatile" } else { "TransientLocal" };
        let qos = reader.matched(name);
        for part in ["Policy.Reliability.Reliable", &format!("Policy.Durability.{durability}")] {
            assert!(qos.contains(part), "{name}: {qos}");
        }
    }
    // The end of the drive; afterwards no frame comes, so that everything is withdrawn.
    reader.wait(Mark::START, "doors", "open doors", |data| (data["doors"][0]["status"] == 4).then_some(()));
    gateway.wait_for_log("doors: no longer published");
    let late = Reader::start(&cyclone, domain, &topics);
    for (_, name, _) in topics {
        late.matched(name);
    }
    let_pass(SILENCE, "in which a late reader would be handed a report");
    for (_, name, _) in topics {
        assert_eq!(late.samples(Mark::START, name), [Value::Null; 0], "{name}");
    }
    let is_undisturbed = !super::stood_still(&gateway);
    gateway.stop("TERM");
    let messages = readers.messages(&only_entry(&folder.path().join("bags")));
    for (_, name, topic) in topics {
        let samples = reader.samples(Mark::START, name);
        let mut received: Vec<_> = samples.iter().map(|line| &line["data"]).collect();
        if ![VELOCITY.1, STEERING.1].contains(&name) {
            // A state is sent again for readers that have joined.
            received.dedup();
        }
        let of_topic = messages.iter().filter(|message| message["topic"] == format!("/{topic}"));
        let recorded: Vec<_> = of_topic.map(|message| &message["fields"]).collect();
        println!("{name}: {} received, {} recorded", received.len(), recorded.len());
        let mut rest = recorded.iter();
        if is_undisturbed {
            assert!(received.iter().all(|sample| rest.any(|message| message == sample)), "{name}");
        }
        assert!(received.len() > 10, "{name}");
    }
}

/// A velocity was true at its stamp alone.
#[test]
fn the_next_network_side_sends_the_gear_again_and_no_velocity() {
    let (cyclone, domain) = (require!(Cyclone::on_loopback()), domain());
    let gateway = Role::new(domain).only_on("127.0.0.1").isolated().with_vehicle_status().start();
    let topic = |kind, topic, durability| Reading { kind, topic, durability };
    let reader = cyclone.reader(
        domain,
        &[
            topic("velocity", "rt/vehicle/status/velocity_status", "volatile"),
            topic("gear", "rt/vehicle/status/gear_status", "transient_local"),
        ],
    );
    let is_velocity = |second: i64| {
        move |line: &Value| line["event"] == "sample" && line["data"]["header"]["stamp"]["sec"] == second
    };
    let is_gear = |line: &Value| line["event"] == "sample" && line["data"]["report"] == 20;
    // The writer may know its reader somewhat later.
    let send = || gateway.send("velocity 2.5 5");
    reader.wait_while_doing(Mark::START, "a velocity", Duration::from_millis(100), send, is_velocity(5));
    gateway.send("velocity 2.5 6");
    gateway.send("gear reverse 6");
    for is_it in [&is_velocity(6) as &dyn Fn(&Value) -> bool, &is_gear] {
        reader.wait_for(Mark::START, "the reports", is_it);
    }
    let mark = reader.mark();
    signal("-KILL", network_process(gateway.id()).unwrap());
    reader.wait_for(mark, "the gear again", is_gear);
    let_pass(SILENCE, "in which a velocity would be sent again");
    let send = || gateway.send("velocity 3.5 7");
    reader.wait_while_doing(mark, "the next velocity", Duration::from_millis(100), send, is_velocity(7));
    let lines = reader.lines(Mark::START);
    assert_eq!(lines.iter().filter(|(_, line)| is_velocity(6)(line)).count(), 1);
}

/// Neither its network side that was killed nor a gateway that it replaces is another writer.
#[test]
fn another_writer_of_a_report_is_named_while_it_is_there_and_a_former_own_one_is_not() {
    let (cyclone, domain) = (require!(Cyclone::on_loopback()), domain());
    let role = || Role::new(domain).only_on("127.0.0.1").isolated().with_vehicle_status().start();
    let shares = |topics: Value, restarts: u64| {
        move |status: &Value| status["shared"] == topics && status["restarts"] == restarts
    };
    let velocity = json!(["/vehicle/status/velocity_status 1"]);
    let gateway = role();
    let arguments = ["text", "rt/vehicle/status/velocity_status", "reliable", "volatile"];
    let writer = cyclone.start("writer.py", domain, &arguments);
    gateway.wait_until("another writer of the velocity", shares(velocity.clone(), 0));
    signal("-KILL", network_process(gateway.id()).unwrap());
    gateway.wait_until("the same writer beside the next network side", shares(velocity, 1));
    drop(writer);
    gateway.wait_until("no other writer", shares(json!([]), 1));
    signal("-KILL", network_process(gateway.id()).unwrap());
    signal("-KILL", gateway.id());
    let next = role();
    let gear = Reading { kind: "gear", topic: "rt/vehicle/status/gear_status", durability: "volatile" };
    let _reader = cyclone.reader(domain, &[gear]);
    let is_read = |status: &Value| status["lights"].to_string().contains('1');
    next.wait_until("a reader, which the next gateway has discovered", is_read);
    let_pass(SILENCE, "in which the killed gateway would be discovered");
    assert_eq!(next.status()["shared"], json!([]));
}

/// Autoware's readers, with their rules.
#[test]
fn the_readers_of_autoware_take_velocity_gear_steering_mode_and_doors() {
    let (cyclone, domain) = (require!(Cyclone::on_loopback()), domain());
    let folder = folder(domain, "repeat = true\n");
    let autoware = cyclone.start("autoware_vehicle.py", domain, &[]);
    let _gateway = Process::run(&folder);
    let event = |name: &'static str, fields: Value| {
        move |line: &Value| {
            line["event"] == name
                && fields.as_object().unwrap().iter().all(|(key, value)| line[key] == *value)
        }
    };
    let expected = [
        event("twist", json!({"frame": "base_link", "vx": 10.0, "wz": f64::from(5.0_f32.to_radians())})),
        event("twist", json!({"frame": "base_link", "vx": -2.0, "wz": f64::from((-2.0_f32).to_radians())})),
        event("gear_command", json!({"command": 2})),
        event("gear_command", json!({"command": 20})),
        event("gear_command", json!({"command": 22})),
        event("status", json!({"gear": "DRIVE", "turn": "DISABLE", "hazard": "DISABLE", "angle": 0.0349})),
        event("status", json!({"gear": "REVERSE", "turn": "DISABLE", "hazard": "DISABLE", "angle": -0.0175})),
        event("engaged", json!({"is_autonomous": true})),
        event("engaged", json!({"is_autonomous": false})),
        event("doors", json!({"states": [1, 3]})),
        event("doors", json!({"states": [4, 2]})),
    ];
    for (number, is_it) in expected.into_iter().enumerate() {
        autoware.wait_for(Mark::START, &format!("event {number} of Autoware's readers"), is_it);
    }
    // A gear that is not known is never a command.
    let lines = autoware.lines(Mark::START);
    let of =
        |name: &'static str| lines.iter().map(|(_, line)| line).filter(move |line| line["event"] == name);
    assert!(of("gear_command").all(|line| [2, 20, 22].contains(&line["command"].as_u64().unwrap())));
    assert!(of("status").all(|line| line["gear"] != "UNKNOWN"));
    assert!(of("twist").all(|line| line["frame"] == "base_link"));
    println!("{} twists taken, {} stale", of("twist").count(), of("stale").count());
}
