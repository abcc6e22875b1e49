//! The daemon with `transport = "zenoh"`: what it logs, and what its status tells.

use std::process::Command;
use std::time::Duration;

use ros_messages::type_hash;
use serde_json::{Value, json};

use super::peer::{Peer, router, session};
use crate::support::json_process::Mark;
use crate::support::peer::domain;
use crate::support::ports::free_port;
use crate::support::prerequisite::require;
use crate::support::process::{Folder, Process};
use crate::support::waiting::{let_pass, wait_for};

const CONFIGURATION: &str = "\
[ros]
transport = \"zenoh\"
domain_id = DOMAIN
[ros.zenoh]
config = \"zenoh.json5\"
[status]
socket = \"status.sock\"
[turn_signal]
enabled = true
map = \"crossroads.osm\"
";

/// A daemon's folder, in this domain, with a session of the router at this port.
fn folder(domain: u16, port: u16) -> Folder {
    let folder = Folder::with_configuration(&CONFIGURATION.replace("DOMAIN", &domain.to_string()));
    folder.write("crossroads.osm", include_str!("../maps/crossroads.osm"));
    folder.write("zenoh.json5", &session(port));
    folder
}

/// The daemon's connections, once its status has them as required.
fn links(folder: &Folder, is_it: impl Fn(&Value) -> bool) -> Value {
    wait_for("connections as they are required", || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
        command.current_dir(folder.path()).args(["status", "--json", "--socket", "status.sock"]);
        let output = command.output().unwrap();
        let status = serde_json::from_slice::<Value>(&output.stdout).unwrap_or_default();
        Some(status["process"]["ros"]["links"].clone()).filter(|links| is_it(links))
    })
}

#[test]
fn connections_show_in_the_status_and_another_definition_is_named_once() {
    let (domain, port) = (domain(), free_port());
    let folder = folder(domain, port);
    let peer = require!(Peer::start(domain, &session(port)));
    let mut gateway = Process::run(&folder);
    assert_eq!(links(&folder, |links| links["routers"] == 0)["lost"], 0);
    let started = require!(Peer::start(domain, &router(port)));
    gateway.wait_for_log("connected with Zenoh router");
    assert_eq!(links(&folder, |links| links["routers"] == 1 && links["peers"] == 1)["lost"], 0);
    let topic = "%localization%kinematic_state";
    let other = |hash: &str, id: u32| {
        json!({"token": format!(
            "@ros2_lv/{domain}/1/0/{id}/MP/%/%/stranger/{topic}/nav_msgs::msg::dds_::Odometry_/{hash}/::,1:,:,:,,"
        )})
    };
    for (hash, id) in [("RIHS01_00", 1), ("RIHS01_00", 2), ("RIHS01_01", 3)] {
        peer.order(&other(hash, id));
    }
    gateway.wait_for_log("its type is RIHS01_01, ours");
    let ours = type_hash("nav_msgs/msg/Odometry").unwrap();
    let named =
        gateway.log().into_iter().filter(|line| line.contains("node /stranger has another definition"));
    let named: Vec<_> = named.collect();
    assert_eq!(named.len(), 2, "each hash once: {named:?}");
    assert!(named[0].contains("/localization/kinematic_state: node /stranger") && named[0].contains(ours));
    started.kill();
    gateway.wait_for_log("the connection with Zenoh router");
    assert_eq!(links(&folder, |links| links["routers"] == 0)["lost"], 1);
    gateway.stop("TERM");
}

/// Each `ros2` command is such a node.
#[test]
fn a_start_and_a_node_that_comes_and_goes_are_no_warnings_and_no_lines() {
    let (domain, port) = (domain(), free_port());
    let folder = folder(domain, port);
    let _router = require!(Peer::start(domain, &router(port)));
    let reader = require!(Peer::start(domain, &session(port)));
    let hash = type_hash("diagnostic_msgs/msg/DiagnosticArray").unwrap();
    let key = format!("{domain}/diagnostics/diagnostic_msgs::msg::dds_::DiagnosticArray_/{hash}");
    reader.read("diagnostics", "diagnostics", &key, false);
    let mut gateway = Process::run(&folder);
    let ros = |line: &Value| {
        let statuses = line["data"]["status"].as_array().unwrap();
        statuses.iter().find(|status| status["name"].as_str().unwrap().ends_with(": ros")).cloned()
    };
    let first = reader.sample(Mark::START, "diagnostics", |line| ros(line).is_some());
    let message = ros(&first).unwrap()["message"].as_str().unwrap().to_owned();
    assert!(message == "joined" || message.starts_with("joined, looking"), "{message}");
    links(&folder, |links| links["routers"] == 1 && links["peers"] == 1);
    if message != "joined" {
        gateway.wait_for_log("INFO ros: joined");
    }
    let before = gateway.log();
    let lost = links(&folder, |_| true)["lost"].as_u64().unwrap();
    let node = require!(Peer::start(domain, &session(port)));
    node.order(&json!({"token": format!("@ros2_lv/{domain}/1/0/0/NN/%/%/ros2cli")}));
    links(&folder, |links| links["peers"] == 2);
    drop(node);
    links(&folder, |links| links["peers"] == 1 && links["lost"].as_u64().unwrap() > lost);
    let_pass(Duration::from_secs(3), "in which a router is asked whether the node is still there");
    assert_eq!(links(&folder, |_| true)["unreachable"], json!([]));
    assert_eq!(gateway.log(), before);
    gateway.stop("TERM");
}
