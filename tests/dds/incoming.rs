//! Messages of others for our subscriptions, among them harmful ones.

use std::time::Duration;

use serde_json::{Value, json};
use signal_gateway::io::ros::session::DISTRO;

use super::session::{Gateway, Role};
use crate::support::json_process::JsonProcess;
use crate::support::peer::{Cyclone, Writing, domain};
use crate::support::prerequisite::require;

const GROUPS: &str = "rt/groups";
const COMMANDS: &str = "rt/commands";

/// Subscriptions by position.
const LOSSY: usize = 2;
const KEPT: usize = 3;

fn writer(cyclone: &Cyclone, domain: u16, kind: &str, topic: &str, qos: [&str; 2]) -> JsonProcess {
    let [reliability, durability] = qos;
    cyclone.writer(domain, &[Writing { kind, topic, reliability, durability }])
}

const RELIABLE: [&str; 2] = ["reliable", "volatile"];

/// The only writer of a subscription, known on both sides: what a volatile writer publishes before the reader
/// knows of it is lost.
fn known_writer(
    gateway: &Gateway,
    subscription: usize,
    cyclone: &Cyclone,
    domain: u16,
    kind: &str,
    topic: &str,
) -> JsonProcess {
    let writers = |count: u32| move |status: &Value| status["incoming"][subscription]["writers"] == count;
    gateway.wait_until("the leave of who wrote before", writers(0));
    let side = writer(cyclone, domain, kind, topic, RELIABLE);
    gateway.wait_until("a writer", writers(1));
    side
}

fn arrived(gateway: &Gateway, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
    gateway.next(what, |line| line["event"] == "arrived" && is_it(&line["what"]))
}

#[test]
fn groups_and_commands_arrive_with_their_contents_and_are_counted() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).with_lights().start();
    let groups = known_writer(&gateway, 0, &cyclone, domain, "groups", GROUPS);
    let commands = known_writer(&gateway, 1, &cyclone, domain, "text", COMMANDS);
    groups.send("5 34806 1 5 3 0.25");
    let arrived_line = arrived(&gateway, "groups", |what| what["sec"] == 5);
    assert_eq!(arrived_line["subscription"], 0);
    assert_eq!(arrived_line["what"]["groups"], json!([[34806, "red flashing upperLeft", 0.25]]));
    // A colour that does not exist: the group is left out, and the next one is read.
    groups.send("6 1 9 1 2 1.0");
    let arrived_line = arrived(&gateway, "a rejection", |what| what["sec"] == 6);
    assert_eq!((&arrived_line["what"]["groups"], &arrived_line["what"]["rejected"]), (&json!([]), &json!(1)));
    let mut latencies = vec![];
    for number in 0..20 {
        let text = format!("grün {number}");
        commands.send(&text);
        let wrote = commands.next("its end", |line| line["event"] == "wrote");
        let arrived_line = gateway.next("a command", |line| line["event"] == "arrived");
        assert_eq!((&arrived_line["subscription"], &arrived_line["what"]["text"]), (&json!(1), &json!(text)));
        latencies.push((arrived_line["at"].as_f64().unwrap() - wrote["before"].as_f64().unwrap()) * 1000.0);
    }
    for number in 20..40 {
        commands.send(&number.to_string());
    }
    for number in 20..40 {
        let arrived_line = gateway.next("a command", |line| line["event"] == "arrived");
        assert_eq!(arrived_line["what"]["text"], number.to_string(), "in order");
    }
    latencies.sort_by(f64::total_cmp);
    println!("latency in ms: median {:.2}, worst {:.2}", latencies[10], latencies[19]);
    // The count may show a moment after the arrival.
    gateway.wait_until("the count", |status| status["incoming"][1]["received"].as_u64() >= Some(40));
    let counts = json!({"writers": 1, "received": 2, "undecodable": 0, "rejected": 1});
    let status = gateway.wait_until("the counts", |status| status["incoming"][0] == counts);
    assert_eq!(status["incoming"][1]["received"], 40, "{status}");
    drop(commands);
    gateway.wait_until("the writer's leave", |status| status["incoming"][1]["writers"] == 0);
}

#[test]
fn a_sample_of_half_a_megabyte_arrives_whole() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).with_lights().start();
    let commands = known_writer(&gateway, 1, &cyclone, domain, "text", COMMANDS);
    for length in [500_000, 65_536, 500_001] {
        commands.send(&format!("{length}*"));
        arrived(&gateway, "the sample", |what| what["length"] == length);
    }
}

#[test]
fn a_writer_that_is_not_reliable_is_read_where_best_effort_was_requested_and_only_there() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).with_lights().start();
    for (sec, reliability) in [(1, "best_effort"), (2, "reliable")] {
        let qos = [reliability, "volatile"];
        let groups = writer(&cyclone, domain, "groups", "rt/lossy_groups", qos);
        gateway.wait_until("a writer", |status| status["incoming"][LOSSY]["writers"] == 1);
        // One that is not reliable may lose some.
        let send = || groups.send(&format!("{sec} 1 1 1 2 1.0"));
        let is_it = |line: &Value| line["event"] == "arrived" && line["what"]["sec"] == sec;
        let arrived_line = gateway.wait_while_sending("groups", send, is_it);
        assert_eq!(arrived_line["subscription"], LOSSY);
        drop(groups);
        gateway.wait_until("its leave", |status| status["incoming"][LOSSY]["writers"] == 0);
    }
}

#[test]
fn a_transient_local_writer_hands_over_earlier_samples_and_nothing_twice() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let first = Role::new(domain).with_lights().start();
    let kept = ["reliable", "transient_local"];
    let commands = writer(&cyclone, domain, "text", "rt/kept_commands", kept);
    for text in ["one", "two"] {
        commands.send(text);
        arrived(&first, text, |what| what["text"] == text);
    }
    drop(first);
    let second = Role::new(domain).with_lights().start();
    for text in ["one", "two"] {
        let arrived_line = second.next(text, |line| line["event"] == "arrived");
        assert_eq!(
            (&arrived_line["subscription"], &arrived_line["what"]["text"]),
            (&json!(KEPT), &json!(text))
        );
    }
    commands.send("three");
    let arrived_line = second.next("three", |line| line["event"] == "arrived");
    assert_eq!(arrived_line["what"]["text"], "three");
}

#[test]
fn bytes_that_are_not_of_the_type_are_counted_and_the_next_message_is_read() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).with_lights().start();
    for (subscription, kind, topic) in [(0, "no_groups", GROUPS), (1, "no_text", COMMANDS)] {
        let garbage = known_writer(&gateway, subscription, &cyclone, domain, kind, topic);
        for length in [0, 1, 7, 100, 70_000] {
            garbage.send(&length.to_string());
        }
        // A text of no bytes, or of one that should be the final zero, is the empty text.
        let undecodable = if kind == "no_text" { 3 } else { 5 };
        gateway.wait_until("their count", |status| {
            status["incoming"][subscription]["undecodable"] == undecodable
        });
    }
    let commands = known_writer(&gateway, 1, &cyclone, domain, "text", COMMANDS);
    let groups = known_writer(&gateway, 0, &cyclone, domain, "groups", GROUPS);
    commands.send("after");
    arrived(&gateway, "a command", |what| what["text"] == "after");
    groups.send("8 1 1 1 2 1.0");
    arrived(&gateway, "groups", |what| what["sec"] == 8);
    assert_eq!(gateway.status()["running"], true);
}

#[test]
fn the_graph_lists_readers_and_writers() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let kind = if DISTRO == "humble" { "gid24" } else { "gid16" };
    let _gateway = Role::new(domain).with_lights().start();
    let graph = cyclone.topic_reader(domain, kind, "ros_discovery_info", "transient_local");
    let count = |list: &Value| list.as_array().map_or(0, Vec::len);
    graph.next("the node with its endpoints", |line| {
        let node = &line["data"]["node_entities_info_seq"][0];
        (count(&node["writer_gid_seq"]), count(&node["reader_gid_seq"])) == (8, 4)
    });
}

#[test]
fn without_anything_to_read_nothing_arrives() {
    let cyclone = require!(Cyclone::with_defaults());
    let domain = domain();
    let gateway = Role::new(domain).with_lights().start();
    let _commands = known_writer(&gateway, 1, &cyclone, domain, "text", COMMANDS);
    let arrived_line = gateway.next_during(Duration::from_millis(500));
    assert!(arrived_line.iter().all(|line| line["event"] != "arrived"), "{arrived_line:?}");
}
