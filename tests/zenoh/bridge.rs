//! A fleet that stays on DDS: the gateway in one domain, readers in another, and between them two
//! `zenoh-bridge-ros2dds` with the shipped configurations.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

use super::security::certificates;
use crate::session::{Gateway, Role};
use crate::support::json_process::JsonProcess;
use crate::support::peer::{Cyclone, LOOPBACK, domain};
use crate::support::ports::free_port;
use crate::support::prerequisite::{Missing, Prerequisite, require};

/// The report on turn indicators, as it is called in the control room.
const TURN: &str = "rt/car1/vehicle/status/turn_indicators_status";
/// Time in which a bridge hands over what it has kept, and carries what it is to carry.
const SILENCE: Duration = Duration::from_millis(2500);

/// A process of `zenoh-bridge-ros2dds`.
struct Bridge(Child);

impl Bridge {
    fn start(program: &Path, folder: &Path, name: &str, domain: u16, configuration: &str) -> Self {
        let file = folder.join(name);
        std::fs::write(&file, configuration).unwrap();
        let mut command = Command::new(program);
        command.arg("-c").arg(file).stdin(Stdio::null()).stdout(Stdio::null());
        command.env("ROS_DISTRO", "jazzy").env("ROS_DOMAIN_ID", domain.to_string());
        command.env("CYCLONEDDS_URI", LOOPBACK).env("RUST_LOG", "warn");
        Self(command.spawn().unwrap())
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        let _ended = (self.0.kill(), self.0.wait());
    }
}

/// Two bridges, and who is on their two sides.
struct Bench {
    vehicle: u16,
    control_room: u16,
    cyclone: Cyclone,
    program: PathBuf,
    folder: TempDir,
    port: u16,
    bridges: Vec<Bridge>,
}

impl Bench {
    fn new() -> Result<Self, Missing> {
        let why = "SIGNAL_GATEWAY_BRIDGE is not set (docs/fleet.md tells how to build one)";
        let program = std::env::var_os("SIGNAL_GATEWAY_BRIDGE").map(PathBuf::from);
        let mut bench = Self {
            program: program.ok_or_else(|| Prerequisite::ZenohBridge.missing(why))?,
            cyclone: Cyclone::on_loopback()?,
            vehicle: domain(),
            control_room: domain(),
            folder: certificates(&["control-room", "vehicle"]),
            port: free_port(),
            bridges: Vec::new(),
        };
        bench.carry(|configuration| configuration);
        Ok(bench)
    }

    /// Starts both bridges anew, with something changed about the shipped configurations.
    fn carry(&mut self, change: impl Fn(String) -> String) {
        self.bridges.clear();
        let folder = self.folder.path();
        let prepared = |shipped: &str| {
            let here = folder.display().to_string();
            let shipped = shipped.replace("/etc/zenoh-bridge", &here);
            let shipped = shipped.replace("control-room.example:7447", &format!("localhost:{}", self.port));
            change(shipped.replace("0.0.0.0:7447", &format!("127.0.0.1:{}", self.port)))
        };
        let vehicle = prepared(include_str!("../../config/zenoh/bridge_vehicle.json5"));
        let control_room = prepared(include_str!("../../config/zenoh/bridge_control_room.json5"));
        self.bridges = vec![
            Bridge::start(&self.program, folder, "vehicle.json5", self.vehicle, &vehicle),
            Bridge::start(&self.program, folder, "control_room.json5", self.control_room, &control_room),
        ];
    }

    /// A gateway on the vehicle, in the role that `change` makes of the usual one.
    fn gateway(&self, change: impl Fn(Role) -> Role) -> Gateway {
        change(Role::new(self.vehicle).only_on("127.0.0.1")).start()
    }

    /// A script of the peer in the control room, as a node of ROS 2.
    fn node(&self, script: &str, arguments: &[&str]) -> JsonProcess {
        let mut command = self.cyclone.command(script, self.control_room);
        command.args(arguments).env("SIGNAL_GATEWAY_PEER_NODE", "observer");
        let process = JsonProcess::start(script, &mut command);
        process.next("its start", |line| line["event"] == "ready");
        process
    }

    /// A reader that has found the bridge's writer.
    fn reader(&self, durability: &str) -> JsonProcess {
        let reader = self.node("reader.py", &["turn", TURN, durability]);
        reader.next("the bridge", |line| line["event"] == "matched");
        reader
    }

    fn commander(&self) -> JsonProcess {
        self.node("writer.py", &["text", "rt/car1/commands", "reliable", "volatile"])
    }
}

/// Sends a report, and waits until somebody in the control room reads it.
fn report(gateway: &Gateway, reader: &JsonProcess, state: &str, sec: i64) {
    gateway.wait_until("a reader, the vehicle's bridge", |status| status["readers"][0] == 1);
    gateway.send(&format!("turn {state} {sec}"));
    reader.next(state, |line| line["data"]["stamp"]["sec"] == sec);
}

/// Seconds of the stamps of what a reader has got.
fn stamps(lines: &[Value]) -> Vec<i64> {
    let samples = lines.iter().filter(|line| line["event"] == "sample");
    samples.map(|line| line["data"]["stamp"]["sec"].as_i64().unwrap()).collect()
}

#[test]
fn a_volatile_report_crosses_and_is_nowhere_once_it_is_withdrawn() {
    let bench = require!(Bench::new());
    let gateway = bench.gateway(Role::volatile);
    let first = bench.reader("volatile");
    report(&gateway, &first, "left", 1);
    let second = bench.reader("volatile");
    report(&gateway, &second, "right", 2);
    gateway.send("turn withdraw");
    second.next_during(SILENCE); // what was on its way
    let third = bench.reader("volatile");
    assert_eq!(stamps(&third.next_during(SILENCE)), Vec::<i64>::new());
    // Nor when all of them have left.
    drop((first, second, third));
    gateway.wait_until("no reader", |status| status["readers"][0] == 0);
    let late = bench.reader("volatile");
    gateway.wait_until("a reader", |status| status["readers"][0] == 1);
    assert_eq!(stamps(&late.next_during(SILENCE)), Vec::<i64>::new());
    report(&gateway, &late, "off", 9);
}

/// Not as we want it, but as the bridge is: why docs/fleet.md asks for volatile reports.
#[test]
fn a_bridge_hands_out_a_transient_local_report_after_its_withdrawal() {
    let bench = require!(Bench::new());
    let gateway = bench.gateway(|role| role);
    let first = bench.reader("transient_local");
    report(&gateway, &first, "left", 1);
    let late = bench.reader("transient_local");
    late.next("the report that stands", |line| line["data"]["stamp"]["sec"] == 1);
    gateway.send("turn withdraw");
    gateway.wait_until("the bridge at the new writer", |status| status["readers"][0] == 1);
    let later = bench.reader("transient_local");
    later.next("the report that is withdrawn", |line| line["data"]["stamp"]["sec"] == 1);
}

#[test]
fn nobody_in_the_control_room_commands_a_vehicle_that_does_not_list_it() {
    let mut bench = require!(Bench::new());
    let gateway = bench.gateway(|role| role.with_lights().volatile());
    let (sender, reader) = (bench.commander(), bench.reader("volatile"));
    report(&gateway, &reader, "left", 1);
    sender.send("not carried");
    let arrived = gateway.next_during(SILENCE);
    assert!(!arrived.iter().any(|line| line["event"] == "arrived"), "{arrived:?}");
    drop((sender, reader));
    // What keeps it away is the list: the opposite of both lists carries it.
    bench.carry(|configuration| configuration.replace("allow: {", "deny: {"));
    let sender = bench.commander();
    sender.next("the gateway", |line| line["event"] == "matched");
    sender.send("carried");
    let command = gateway.next("a command", |line| line["event"] == "arrived");
    assert_eq!(command["what"], json!({"text": "carried"}));
}
