//! What others write to our subscriptions, and that nothing they write does harm.

use std::path::Path;
use std::time::Duration;

use serde_json::{Value, json};
use signal_gateway::io::ros::session::DISTRO;

use super::bench::{Gateway, Side, domain};
use super::cyclone::{Reader, Writer, python};

const GROUPS: &str = "rt/groups";
const COMMANDS: &str = "rt/commands";

/// Subscriptions by position.
const LOSSY: usize = 2;
const KEPT: usize = 3;

fn writer(python: &Path, domain: u16, kind: &str, topic: &str, qos: [&str; 2]) -> Side {
    let [reliability, durability] = qos;
    Writer { python, domain, kind, topic, reliability, durability, config: "", namespace: None }.start()
}

const RELIABLE: [&str; 2] = ["reliable", "volatile"];

/// The only writer of a subscription, known on both sides: what a volatile writer says before the reader
/// knows of it is lost.
fn known_writer(
    gateway: &mut Gateway,
    subscription: usize,
    python: &Path,
    domain: u16,
    kind: &str,
    topic: &str,
) -> Side {
    let writers = |count: u32| move |status: &Value| status["incoming"][subscription]["writers"] == count;
    gateway.wait_until("the leave of who wrote before", writers(0));
    let side = writer(python, domain, kind, topic, RELIABLE);
    gateway.wait_until("a writer", writers(1));
    side
}

fn arrived(gateway: &Gateway, what: &str, is_it: impl Fn(&Value) -> bool) -> Value {
    gateway.wait_for(what, |line| line["event"] == "arrived" && is_it(&line["what"]))
}

#[test]
fn groups_and_commands_arrive_with_their_contents_and_are_counted() {
    let Some(python) = python("groups_and_commands_arrive_with_their_contents_and_are_counted") else {
        return;
    };
    let domain = domain();
    let mut gateway = Gateway::start_with_lights(None, domain);
    let mut groups = known_writer(&mut gateway, 0, &python, domain, "groups", GROUPS);
    let mut commands = known_writer(&mut gateway, 1, &python, domain, "text", COMMANDS);
    groups.tell("5 34806 1 5 3 0.25");
    let seen = arrived(&gateway, "groups", |what| what["sec"] == 5);
    assert_eq!(seen["subscription"], 0);
    assert_eq!(seen["what"]["groups"], json!([[34806, "red flashing upperLeft", 0.25]]));
    // A colour that does not exist: the group is left out, and the next one is read.
    groups.tell("6 1 9 1 2 1.0");
    let seen = arrived(&gateway, "a rejection", |what| what["sec"] == 6);
    assert_eq!((&seen["what"]["groups"], &seen["what"]["rejected"]), (&json!([]), &json!(1)));
    let mut latencies = vec![];
    for number in 0..20 {
        let text = format!("grün {number}");
        commands.tell(&text);
        let wrote = commands.wait_for("its end", |line| line["event"] == "wrote");
        let seen = gateway.wait_for("a command", |line| line["event"] == "arrived");
        assert_eq!((&seen["subscription"], &seen["what"]["text"]), (&json!(1), &json!(text)));
        latencies.push((seen["at"].as_f64().unwrap() - wrote["before"].as_f64().unwrap()) * 1000.0);
    }
    for number in 20..40 {
        commands.tell(&number.to_string());
    }
    for number in 20..40 {
        let seen = gateway.wait_for("a command", |line| line["event"] == "arrived");
        assert_eq!(seen["what"]["text"], number.to_string(), "in order");
    }
    latencies.sort_by(f64::total_cmp);
    println!("latency in ms: median {:.2}, worst {:.2}", latencies[10], latencies[19]);
    let status = gateway.status();
    let counts = json!({"writers": 1, "received": 2, "undecodable": 0, "rejected": 1});
    assert_eq!(status["incoming"][0], counts, "{status}");
    assert_eq!(status["incoming"][1]["received"], 40, "{status}");
    drop(commands);
    gateway.wait_until("the writer's leave", |status| status["incoming"][1]["writers"] == 0);
}

#[test]
fn a_sample_of_half_a_megabyte_arrives_whole() {
    let Some(python) = python("a_sample_of_half_a_megabyte_arrives_whole") else { return };
    let domain = domain();
    let mut gateway = Gateway::start_with_lights(None, domain);
    let mut commands = known_writer(&mut gateway, 1, &python, domain, "text", COMMANDS);
    for length in [500_000, 65_536, 500_001] {
        commands.tell(&format!("{length}*"));
        arrived(&gateway, "the sample", |what| what["length"] == length);
    }
}

#[test]
fn a_writer_that_is_not_reliable_is_read_where_best_effort_was_asked_for_and_only_there() {
    let test = "a_writer_that_is_not_reliable_is_read_where_best_effort_was_asked_for_and_only_there";
    let Some(python) = python(test) else { return };
    let domain = domain();
    let mut gateway = Gateway::start_with_lights(None, domain);
    for (sec, reliability) in [(1, "best_effort"), (2, "reliable")] {
        let qos = [reliability, "volatile"];
        let mut groups = writer(&python, domain, "groups", "rt/lossy_groups", qos);
        gateway.wait_until("a writer", |status| status["incoming"][LOSSY]["writers"] == 1);
        groups.tell(&format!("{sec} 1 1 1 2 1.0"));
        let seen = arrived(&gateway, "groups", |what| what["sec"] == sec);
        assert_eq!(seen["subscription"], LOSSY);
        drop(groups);
        gateway.wait_until("its leave", |status| status["incoming"][LOSSY]["writers"] == 0);
    }
}

#[test]
fn a_transient_local_writer_hands_over_what_it_said_before_and_nothing_twice() {
    let test = "a_transient_local_writer_hands_over_what_it_said_before_and_nothing_twice";
    let Some(python) = python(test) else { return };
    let domain = domain();
    let first = Gateway::start_with_lights(None, domain);
    let kept = ["reliable", "transient_local"];
    let mut commands = writer(&python, domain, "text", "rt/kept_commands", kept);
    for word in ["one", "two"] {
        commands.tell(word);
        arrived(&first, word, |what| what["text"] == word);
    }
    drop(first);
    let second = Gateway::start_with_lights(None, domain);
    for word in ["one", "two"] {
        let seen = second.wait_for(word, |line| line["event"] == "arrived");
        assert_eq!((&seen["subscription"], &seen["what"]["text"]), (&json!(KEPT), &json!(word)));
    }
    commands.tell("three");
    let seen = second.wait_for("three", |line| line["event"] == "arrived");
    assert_eq!(seen["what"]["text"], "three");
}

#[test]
fn bytes_that_are_not_of_the_type_are_counted_and_the_next_message_is_read() {
    let test = "bytes_that_are_not_of_the_type_are_counted_and_the_next_message_is_read";
    let Some(python) = python(test) else { return };
    let domain = domain();
    let mut gateway = Gateway::start_with_lights(None, domain);
    for (subscription, kind, topic) in [(0, "no_groups", GROUPS), (1, "no_text", COMMANDS)] {
        let mut garbage = known_writer(&mut gateway, subscription, &python, domain, kind, topic);
        for length in [0, 1, 7, 100, 70_000] {
            garbage.tell(&length.to_string());
        }
        // A text of no bytes, or of one that should be the final zero, is the empty text.
        let undecodable = if kind == "no_text" { 3 } else { 5 };
        gateway.wait_until("their count", |status| {
            status["incoming"][subscription]["undecodable"] == undecodable
        });
    }
    let mut commands = known_writer(&mut gateway, 1, &python, domain, "text", COMMANDS);
    let mut groups = known_writer(&mut gateway, 0, &python, domain, "groups", GROUPS);
    commands.tell("after");
    arrived(&gateway, "a command", |what| what["text"] == "after");
    groups.tell("8 1 1 1 2 1.0");
    arrived(&gateway, "groups", |what| what["sec"] == 8);
    assert_eq!(gateway.status()["running"], true);
}

#[test]
fn the_graph_lists_readers_and_writers() {
    let Some(python) = python("the_graph_lists_readers_and_writers") else { return };
    let (domain, topic, durability) = (domain(), "ros_discovery_info", "transient_local");
    let kind = if DISTRO == "humble" { "gid24" } else { "gid16" };
    let _gateway = Gateway::start_with_lights(None, domain);
    let graph =
        Reader { python: &python, domain, kind, topic, durability, config: "", namespace: None }.start();
    let count = |list: &Value| list.as_array().map_or(0, Vec::len);
    graph.wait_for("the node with its endpoints", |line| {
        let node = &line["data"]["node_entities_info_seq"][0];
        (count(&node["writer_gid_seq"]), count(&node["reader_gid_seq"])) == (8, 4)
    });
}

#[test]
fn without_anything_to_read_nothing_arrives() {
    let Some(python) = python("without_anything_to_read_nothing_arrives") else { return };
    let domain = domain();
    let mut gateway = Gateway::start_with_lights(None, domain);
    let _commands = known_writer(&mut gateway, 1, &python, domain, "text", COMMANDS);
    let seen = gateway.during(Duration::from_millis(500));
    assert!(seen.iter().all(|line| line["event"] != "arrived"), "{seen:?}");
}
