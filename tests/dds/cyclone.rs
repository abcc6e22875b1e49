//! Cases that need Cyclone DDS: quality of service, and a gateway that stood still.

use std::process::Command;
use std::time::Duration;

use serde_json::Value;

use super::delivery::{SILENCE, TURN, await_last_repetition, is_match, is_report, samples};
use super::session::Role;
use crate::support::json_process::JsonProcess;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::waiting::Bystander;

#[test]
fn reports_suit_both_kinds_of_readers_and_announce_their_qos() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).start();
    let readers =
        ["transient_local", "volatile"].map(|kind| cyclone.topic_reader(domain, "turn", TURN, kind));
    for reader in &readers {
        let matched = reader.next("a match", is_match);
        let qos = matched["qos"].as_str().unwrap();
        assert!(qos.contains("Durability.TransientLocal"), "{qos}");
        assert!(qos.contains("Reliability.Reliable"), "{qos}");
    }
    gateway.wait_until("two readers", |status| status["readers"][0] == 2);
    gateway.send("turn left 1");
    for reader in &readers {
        reader.next("a sample", is_report(2, 1));
    }
}

#[test]
fn volatile_reports_hand_nothing_to_late_joiners_and_still_reach_them_afterwards() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).volatile().start();
    let early = cyclone.topic_reader(domain, "turn", TURN, "volatile");
    gateway.wait_until("the early reader", |status| status["readers"][0] == 1);
    early.next("a match", is_match);
    gateway.send("turn left 1");
    await_last_repetition(&early, is_report(2, 1));
    let late = cyclone.topic_reader(domain, "turn", TURN, "volatile");
    let matched = late.next("a match", is_match);
    assert!(matched["qos"].as_str().unwrap().contains("Durability.Volatile"), "{matched}");
    gateway.wait_until("the late joiner", |status| status["readers"][0] == 2);
    let received = late.next_during(SILENCE);
    if gateway.is_undisturbed() {
        assert_eq!(samples(&received), Vec::<&Value>::new());
    }
    gateway.send("turn right 2");
    late.next("the next report", is_report(3, 2));
    gateway.send("turn withdraw");
    gateway.send("turn off 3");
    late.next("the report after a withdrawal", is_report(1, 3));
}

/// RustDDS sends no multicast there, and the peer has no port where it would be looked for. It does not
/// announce itself again, so that the gateway has to be the one whose announcement arrives.
#[test]
fn a_reader_that_listens_to_multicast_on_the_loopback_meets_a_gateway_that_starts_later() {
    const URI: &str = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>\
        <Discovery><SPDPInterval>1hr</SPDPInterval><LeaseDuration>1hr</LeaseDuration></Discovery></Domain></CycloneDDS>";
    let cyclone = require!(Cyclone::with_defaults()).configured(URI);
    let domain = domain();
    let turn = cyclone.topic_reader(domain, "turn", TURN, "transient_local");
    let gateway = Role::new(domain).only_on("127.0.0.1").start();
    gateway.send("turn left 1");
    turn.next("a report", is_report(2, 1));
}

/// Its peers may have given it up meanwhile, or it them.
#[test]
fn a_gateway_that_was_stopped_joins_the_graph_again() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).start();
    let turn = cyclone.topic_reader(domain, "turn", TURN, "transient_local");
    gateway.send("turn left 1");
    turn.next("a report", is_report(2, 1));
    gateway.stand_still(Duration::from_secs(3));
    gateway.wait_until("a new participant", |status| status["rebuilds"].as_u64() >= Some(1));
    gateway.send("turn right 2");
    turn.next("the next report", is_report(3, 2));
}

#[test]
fn a_node_that_is_left_out_of_the_graph_delivers_its_reports_all_the_same() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).without_graph().start();
    let turn = cyclone.topic_reader(domain, "turn", TURN, "transient_local");
    let kind = if signal_gateway::io::ros::session::DISTRO == "humble" { "gid24" } else { "gid16" };
    let graph = cyclone.topic_reader(domain, kind, "ros_discovery_info", "transient_local");
    gateway.send("turn left 1");
    turn.next("a report", is_report(2, 1));
    assert_eq!(graph.next_during(SILENCE), Vec::<Value>::new());
}

/// With Cyclone DDS in Humble, an entry in the layout of Jazzy makes `ros2 node list` fail for everybody.
#[test]
fn a_gateway_leaves_the_graph_of_another_distribution() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let (own, other) =
        if signal_gateway::io::ros::session::DISTRO == "humble" { ("gid24", "16") } else { ("gid16", "24") };
    let gateway = Role::new(domain).start();
    let graph = cyclone.topic_reader(domain, own, "ros_discovery_info", "transient_local");
    graph.next("the gateway's entry", |line| line["event"] == "sample");
    let mut command = cyclone.command("reader.py", domain);
    command.args(["turn", TURN, "transient_local"]);
    command.env("SIGNAL_GATEWAY_PEER_NODE", "observer").env("SIGNAL_GATEWAY_PEER_GRAPH", other);
    let observer = JsonProcess::start("reader.py", &mut command);
    graph.next("its end", |line| line["event"] == "unmatched");
    gateway.send("turn left 1");
    observer.next("a report", is_report(2, 1));
}

/// Its network process outlives it just long enough to say so: the lease of RustDDS would take 50 s.
#[test]
fn a_gateway_that_is_killed_leaves_the_graph_long_before_its_lease_ends() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).isolated().start();
    let turn = cyclone.topic_reader(domain, "turn", TURN, "transient_local");
    gateway.send("turn left 1");
    let sample = turn.next("a report", is_report(2, 1));
    let beside = Bystander::start();
    assert!(Command::new("kill").args(["-KILL", &gateway.id().to_string()]).status().unwrap().success());
    let gone = turn.next("the leave", |line| line["event"] == "unmatched");
    let took = Duration::from_secs_f64(gone["at"].as_f64().unwrap() - sample["at"].as_f64().unwrap());
    println!("gone {took:?} after the last report");
    beside.finish().assert_gap("the leave of a gateway that was killed", took, Duration::from_secs(20));
}
