//! TLS on both sides and access control, with the shipped example of a fleet's router.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use ros_messages::{dds_type, type_hash};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::delivery::turn_key;
use super::peer::Peer;
use crate::session::{KINDS, Role};
use crate::support::json_process::Mark;
use crate::support::peer::domain;
use crate::support::ports::free_port;
use crate::support::prerequisite::require;

/// Time in which a sample that was let through would have come.
const SILENCE: Duration = Duration::from_millis(2500);
/// The subscription to commands for turn signals among [`KINDS`].
const TURN_COMMAND: usize = 10;

fn openssl(folder: &Path, arguments: &str) {
    let mut command = Command::new("openssl");
    let output = command.current_dir(folder).args(arguments.split(' ')).output().unwrap();
    assert!(output.status.success(), "openssl {arguments}: {}", String::from_utf8_lossy(&output.stderr));
}

/// A certificate authority, and a certificate of it for each name.
pub(crate) fn certificates(names: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let key = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes";
    openssl(
        folder.path(),
        &format!("req -x509 {key} -keyout ca.key -out ca.pem -days 2 -subj /CN=authority"),
    );
    for name in names {
        openssl(folder.path(), &format!("req {key} -keyout {name}.key -out {name}.csr -subj /CN={name}"));
        std::fs::write(
            folder.path().join("names"),
            format!("subjectAltName=DNS:{name},DNS:localhost,IP:127.0.0.1"),
        )
        .unwrap();
        openssl(
            folder.path(),
            &format!(
                "x509 -req -in {name}.csr -CA ca.pem -CAkey ca.key -CAcreateserial -out {name}.pem -days 2 -extfile names"
            ),
        );
    }
    folder
}

/// The shipped configuration of a vehicle, with a certificate of its own and this port.
fn client(folder: &Path, name: &str, port: u16) -> String {
    let folder = folder.display();
    include_str!("../../config/zenoh/fleet.json5")
        .replace(
            "connect: {",
            "timestamping: { enabled: true }, connect: { timeout_ms: -1, exit_on_failure: false,",
        )
        .replace("tls/fleet.example:7447", &format!("tls/localhost:{port}"))
        .replace("/etc/signal-gateway/zenoh/ca.pem", &format!("{folder}/ca.pem"))
        .replace("/etc/signal-gateway/zenoh/vehicle", &format!("{folder}/{name}"))
}

/// Likewise of the router, for the topics of the test's session.
fn router(folder: &Path, domain: u16, port: u16) -> String {
    include_str!("../../config/zenoh/fleet_router.json5")
        .replace("tls/0.0.0.0:7447", &format!("tls/127.0.0.1:{port}"))
        .replace("/etc/zenohd", &folder.display().to_string())
        .replace("\"0/car1/control/command/**\"", &format!("\"{domain}/turn_command/**\""))
        .replace("\"0/car1/", &format!("\"{domain}/"))
        .replace("\"0/**", &format!("\"{domain}/**"))
        .replace("@ros2_lv/0/", &format!("@ros2_lv/{domain}/"))
}

#[test]
fn who_has_no_certificate_or_no_grant_moves_no_light() {
    let (domain, port) = (domain(), free_port());
    let folder = certificates(&["router", "car1", "control-room", "observer"]);
    let folder = folder.path();
    let _router = require!(Peer::start(domain, &router(folder, domain, port)));
    let gateway =
        Role::new(domain).with_autoware().over_zenoh(&client(folder, "car1", port)).isolated().start();
    let control = require!(Peer::start(domain, &client(folder, "control-room", port)));
    let observer = require!(Peer::start(domain, &client(folder, "observer", port)));
    // A client would wait for a router that lets it in.
    let without = client(folder, "observer", port)
        .replace("mode: \"client\"", "mode: \"peer\"")
        .lines()
        .filter(|line| !line.contains("connect_certificate") && !line.contains("connect_private_key"))
        .filter(|line| !line.contains("enable_mtls"))
        .map(|line| line.to_owned() + "\n")
        .collect::<String>();
    let stranger = require!(Peer::start(domain, &without));

    gateway.send("turn left 1");
    for peer in [&control, &observer] {
        // The graph is visible, and so is what is current.
        peer.token(Mark::START, "put", &["/MS/", "/%turn_command/"]);
        peer.token(Mark::START, "put", &["/MP/", "turn_indicators_status"]);
        peer.read("turn", "turn", &turn_key(domain), true);
        peer.sample(Mark::START, "turn", |line| line["data"]["report"] == 2);
    }
    stranger.read("turn", "turn", &turn_key(domain), true);

    let (name, kind) = KINDS[TURN_COMMAND];
    let type_name = kind.row().type_name;
    let key = format!("{domain}/{name}/{}/{}", dds_type(type_name), type_hash(type_name).unwrap());
    let command = json!({"write": key, "sample": name});
    let report = json!({"write": turn_key(domain), "raw": "00010000090000000100000003"});
    for peer in [&observer, &stranger] {
        peer.order(&command);
        peer.order(&report);
    }
    // Nor does anybody but the vehicle report.
    control.order(&report);
    let arrived = gateway.next_during(SILENCE);
    assert!(!arrived.iter().any(|line| line["event"] == "arrived"), "{arrived:?}");
    let all: Vec<Value> =
        [&control, &observer].iter().flat_map(|peer| peer.samples(Mark::START, "turn")).collect();
    assert!(all.iter().all(|line| line["data"]["report"] == 2), "{all:?}");
    assert_eq!(stranger.samples(Mark::START, "turn"), Vec::<Value>::new());

    control.order(&command);
    gateway.next("the command of the control room", |line| {
        line["event"] == "arrived" && line["subscription"] == TURN_COMMAND
    });
}
