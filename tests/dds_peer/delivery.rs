//! What arrives, with which quality of service, and what late joiners get.

use std::path::Path;
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};
use signal_gateway::io::ros::session::DISTRO;

use super::bench::{Gateway, Side, domain};
use super::cyclone::{Reader, python};

const TURN: &str = "rt/vehicle/status/turn_indicators_status";
const HAZARD: &str = "rt/vehicle/status/hazard_lights_status";
const DIAGNOSTICS: &str = "rt/diagnostics";

/// Long enough for a late joiner to be matched and handed something, if it ever is.
const SILENCE: Duration = Duration::from_secs(2);

fn reader(python: &Path, domain: u16, kind: &str, topic: &str, durability: &str) -> Side {
    Reader { python, domain, kind, topic, durability, config: "", namespace: None }.start()
}

fn is_report(report: u8, sec: i32) -> impl Fn(&Value) -> bool {
    move |line| {
        line["event"] == "sample"
            && line["data"] == json!({"stamp": {"sec": sec, "nanosec": 1}, "report": report})
    }
}

fn samples(lines: &[Value]) -> Vec<&Value> {
    lines.iter().filter(|line| line["event"] == "sample").collect()
}

#[test]
fn values_stamps_and_texts_arrive_as_sent() {
    let Some(python) = python("values_stamps_and_texts_arrive_as_sent") else { return };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let turn = reader(&python, domain, "turn", TURN, "transient_local");
    let hazard = reader(&python, domain, "hazard", HAZARD, "transient_local");
    let diagnostics = reader(&python, domain, "diagnostics", DIAGNOSTICS, "volatile");
    gateway.wait_until("three readers", |status| status["readers"] == json!([1, 1, 1]));
    diagnostics.wait_for("a match", |line| line["event"] == "matched");

    for (word, report, sec) in [("left", 2, 5), ("right", 3, -6), ("off", 1, 7)] {
        gateway.tell(&format!("turn {word} {sec}"));
        turn.wait_for(word, is_report(report, sec));
    }
    gateway.tell("hazard on 8");
    hazard.wait_for("hazard on", is_report(2, 8));
    gateway.tell("diagnostics Grüße");
    let array = diagnostics.wait_for("diagnostics", |line| line["event"] == "sample");
    let status = |level, message: &str, values: Value| json!({"level": level, "name": "gw: turn", "message": message, "hardware_id": "bench", "values": values});
    assert_eq!(
        array["data"],
        json!({
            "header": {"stamp": {"sec": -1, "nanosec": 999_999_999}, "frame_id": ""},
            "status": [
                status(2, "Grüße", json!([{"key": "bus", "value": "can0"}, {"key": "", "value": "größer"}])),
                status(3, "", json!([])),
            ],
        })
    );
    let took = gateway.stop();
    println!("stop took {took:?}");
    assert!(took < Duration::from_millis(500));
    turn.wait_for("a goodbye", |line| line["event"] == "unmatched");
}

#[test]
fn reports_suit_both_kinds_of_readers_and_tell_their_qos() {
    let Some(python) = python("reports_suit_both_kinds_of_readers_and_tell_their_qos") else { return };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let readers = ["transient_local", "volatile"].map(|kind| reader(&python, domain, "turn", TURN, kind));
    for reader in &readers {
        let matched = reader.wait_for("a match", |line| line["event"] == "matched");
        let qos = matched["qos"].as_str().unwrap();
        assert!(qos.contains("Durability.TransientLocal"), "{qos}");
        assert!(qos.contains("Reliability.Reliable"), "{qos}");
    }
    gateway.wait_until("two readers", |status| status["readers"][0] == 2);
    gateway.tell("turn left 1");
    for reader in &readers {
        reader.wait_for("a sample", is_report(2, 1));
    }
}

#[test]
fn volatile_reports_hand_nothing_to_late_joiners_and_still_reach_them_afterwards() {
    let Some(python) =
        python("volatile_reports_hand_nothing_to_late_joiners_and_still_reach_them_afterwards")
    else {
        return;
    };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "volatile");
    gateway.tell("turn left 1");
    thread::sleep(2 * SILENCE); // the first seconds' repetitions are over
    let late = reader(&python, domain, "turn", TURN, "volatile");
    let matched = late.wait_for("a match", |line| line["event"] == "matched");
    assert!(matched["qos"].as_str().unwrap().contains("Durability.Volatile"), "{matched}");
    assert_eq!(samples(&late.during(SILENCE)), Vec::<&Value>::new());
    gateway.wait_until("the late joiner", |status| status["readers"][0] == 1);
    gateway.tell("turn right 2");
    late.wait_for("the next report", is_report(3, 2));
    gateway.tell("turn withdraw");
    gateway.tell("turn off 3");
    late.wait_for("the report after a withdrawal", is_report(1, 3));
}

#[test]
fn a_late_joiner_gets_the_current_report_nothing_after_a_withdrawal_and_the_next_one_after_that() {
    let Some(python) = python(
        "a_late_joiner_gets_the_current_report_nothing_after_a_withdrawal_and_the_next_one_after_that",
    ) else {
        return;
    };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let early = ["transient_local", "volatile"].map(|kind| reader(&python, domain, "turn", TURN, kind));
    gateway.wait_until("early readers", |status| status["readers"][0] == 2);
    for reader in &early {
        reader.wait_for("a match", |line| line["event"] == "matched");
    }
    gateway.tell("turn left 1");
    for reader in &early {
        reader.wait_for("the first report", is_report(2, 1));
    }
    let late = reader(&python, domain, "turn", TURN, "transient_local");
    late.wait_for("the current report", is_report(2, 1));
    drop(late);

    gateway.tell("turn right 2"); // must arrive although the writer goes at once
    gateway.tell("status");
    thread::sleep(Duration::from_millis(20)); // letters may overtake each other; let this one go
    gateway.tell("turn withdraw");
    for reader in &early {
        reader.wait_for("the last report before the withdrawal", is_report(3, 2));
    }
    let late = reader(&python, domain, "turn", TURN, "transient_local");
    late.wait_for("a match with the new writer", |line| line["event"] == "matched");
    assert_eq!(samples(&late.during(SILENCE)), Vec::<&Value>::new());

    gateway.tell("turn off 3");
    late.wait_for("the report after the withdrawal", is_report(1, 3));
    for reader in &early {
        reader.wait_for("the report after the withdrawal", is_report(1, 3));
    }
}

#[test]
fn a_late_joiner_is_handed_the_one_current_report_whoever_read_those_before() {
    let Some(python) = python("a_late_joiner_is_handed_the_one_current_report_whoever_read_those_before")
    else {
        return;
    };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    // First nobody has read the earlier reports, then somebody who is gone.
    for round in 0..2 {
        for sec in 1..=5 {
            gateway.tell(&format!("turn left {sec}"));
            thread::sleep(Duration::from_millis(20)); // or they overtake each other
        }
        gateway.tell(&format!("turn right {round}"));
        let late = reader(&python, domain, "turn", TURN, "transient_local");
        late.wait_for("the current report first", |line| {
            assert!(line["event"] != "sample" || is_report(3, round)(line), "{line}");
            is_report(3, round)(line)
        });
        gateway.tell("turn off 9");
        late.wait_for("what comes later", is_report(1, 9));
        drop(late);
        gateway.wait_until("the reader's leave", |status| status["readers"][0] == 0);
    }
}

#[test]
fn a_report_right_after_a_withdrawal_reaches_every_matched_reader() {
    let Some(python) = python("a_report_right_after_a_withdrawal_reaches_every_matched_reader") else {
        return;
    };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let readers = ["transient_local", "volatile"].map(|kind| reader(&python, domain, "turn", TURN, kind));
    gateway.wait_until("two readers", |status| status["readers"][0] == 2);
    for reader in &readers {
        reader.wait_for("a match", |line| line["event"] == "matched");
    }
    for round in 1..=5 {
        gateway.tell(&format!("turn left {round}"));
        thread::sleep(Duration::from_millis(30));
        gateway.tell("turn withdraw");
        // Milliseconds apart, but not so close that the report overtakes the withdrawal.
        thread::sleep(Duration::from_millis(3));
        gateway.tell(&format!("turn right {round}"));
        for reader in &readers {
            reader.wait_for("the report after the withdrawal", is_report(3, round));
        }
    }
}

#[test]
fn a_reader_that_is_killed_gets_data_again_when_it_is_restarted() {
    let Some(python) = python("a_reader_that_is_killed_gets_data_again_when_it_is_restarted") else { return };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let first = reader(&python, domain, "turn", TURN, "transient_local");
    gateway.tell("turn left 1");
    first.wait_for("a report", is_report(2, 1));
    first.kill();
    let second = reader(&python, domain, "turn", TURN, "transient_local");
    second.wait_for("the current report", is_report(2, 1));
    gateway.tell("turn right 2");
    second.wait_for("the next report", is_report(3, 2));
    assert_eq!(gateway.status()["rebuilds"], 0, "nobody was away: nothing to rebuild");
}

/// Its peers may have given it up meanwhile, or it them.
#[test]
fn a_gateway_that_stood_still_joins_the_graph_anew() {
    let Some(python) = python("a_gateway_that_stood_still_joins_the_graph_anew") else { return };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let turn = reader(&python, domain, "turn", TURN, "transient_local");
    gateway.tell("turn left 1");
    turn.wait_for("a report", is_report(2, 1));
    gateway.stand_still(Duration::from_secs(3));
    gateway.wait_until("a new participant", |status| status["rebuilds"] == 1);
    gateway.tell("turn right 2");
    turn.wait_for("the next report", is_report(3, 2));
}

#[test]
fn the_graph_shows_the_node_and_its_writers_with_identifiers_of_the_distributions_length() {
    let Some(python) =
        python("the_graph_shows_the_node_and_its_writers_with_identifiers_of_the_distributions_length")
    else {
        return;
    };
    let length = if DISTRO == "humble" { 24 } else { 16 };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let graph = reader(&python, domain, &format!("gid{length}"), "ros_discovery_info", "transient_local");
    let turn = reader(&python, domain, "turn", TURN, "volatile");
    let writer = |side: &Side| {
        let matched = side.wait_for("a match", |line| line["event"] == "matched");
        matched["writer"].as_str().unwrap().to_owned()
    };
    let lists = |writer: String| {
        move |line: &Value| {
            let node = &line["data"]["node_entities_info_seq"][0];
            let gids = node["writer_gid_seq"].as_array().map_or(&[][..], Vec::as_slice);
            let listed =
                gids.iter().any(|gid| hex(&gid["data"]) == format!("{writer:0<width$}", width = 2 * length));
            let named = node["node_name"] == "gateway_under_test" && node["node_namespace"] == "/vehicle";
            named && listed && gids.len() == 3 && node["reader_gid_seq"] == json!([])
        }
    };
    let before = writer(&turn);
    graph.wait_for("the node with the turn writer", lists(before.clone()));
    // A withdrawal makes a new writer: the graph follows.
    gateway.tell("turn left 1");
    turn.wait_for("a report", is_report(2, 1));
    gateway.tell("turn withdraw");
    let after = writer(&turn);
    assert_ne!(before, after);
    graph.wait_for("the node with the new turn writer", lists(after));
}

fn hex(bytes: &Value) -> String {
    let digit = |nibble: u64| char::from_digit(u32::try_from(nibble).unwrap(), 16).unwrap();
    let digits = |byte: &Value| [byte.as_u64().unwrap() / 16, byte.as_u64().unwrap() % 16].map(digit);
    bytes.as_array().map_or(&[][..], Vec::as_slice).iter().flat_map(digits).collect()
}
