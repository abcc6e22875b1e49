//! Delivered messages, their quality of service, and those that late joiners get: the same with each peer.

use std::time::Duration;

use serde_json::{Value, json};
use signal_gateway::io::ros::session::DISTRO;

use super::session::{Gateway, Role};
use crate::support::json_process::{JsonProcess, Mark};
use crate::support::peer::{Cyclone, domain};
use crate::support::processor::waited_in_all;
use crate::support::waiting::let_pass;

pub(crate) const TURN: &str = "rt/vehicle/status/turn_indicators_status";
const HAZARD: &str = "rt/vehicle/status/hazard_lights_status";
const DIAGNOSTICS: &str = "rt/diagnostics";

/// Long enough for a late joiner to be matched and handed something, if it ever is.
pub(crate) const SILENCE: Duration = Duration::from_secs(2);

/// A gateway that waited for a processor for so long may meet a late joiner too late.
const SOON: Duration = Duration::from_millis(30);

/// A DDS that is not ours.
pub(crate) trait Peer {
    /// Starts a reader in a process of its own, and waits until it reads.
    fn reader(&self, domain: u16, kind: &str, topic: &str, durability: &str) -> JsonProcess;

    /// True if the peer understands how a writer of RustDDS leaves.
    fn understands_goodbyes(&self) -> bool;
}

impl Peer for Cyclone {
    fn reader(&self, domain: u16, kind: &str, topic: &str, durability: &str) -> JsonProcess {
        self.topic_reader(domain, kind, topic, durability)
    }

    fn understands_goodbyes(&self) -> bool {
        true
    }
}

/// Makes a test of each case for each peer.
macro_rules! with_both_peers {
    ($($case:ident),* $(,)?) => {
        mod cyclone {
            use crate::support::{peer::Cyclone, prerequisite::require};
            $(#[test] fn $case() { super::$case(&require!(Cyclone::with_defaults())); })*
        }

        mod fast_dds {
            use crate::{dds::fast_dds::FastDds, support::prerequisite::require};
            $(#[test] fn $case() { super::$case(&require!(FastDds::compiled())); })*
        }
    };
}

mod cyclone_alone {
    use crate::support::{peer::Cyclone, prerequisite::require};

    /// The peer of Fast DDS does not say when a sample was sent.
    #[test]
    fn a_late_joiner_is_handed_the_current_report_and_none_before_it_while_others_read() {
        super::a_late_joiner_is_handed_the_current_report_and_none_before_it_while_others_read(&require!(
            Cyclone::with_defaults()
        ));
    }
}

with_both_peers!(
    values_stamps_and_texts_arrive_as_sent,
    texts_too_long_for_one_datagram_arrive_whole,
    a_late_joiner_gets_the_current_report_nothing_after_a_withdrawal_and_the_next_one_after_that,
    a_late_joiner_is_handed_the_one_current_report_whoever_read_those_before,
    a_report_right_after_a_withdrawal_reaches_every_matched_reader,
    a_reader_that_is_killed_gets_data_again_when_it_is_restarted,
    a_reader_gets_data_of_the_next_gateway_at_once,
    a_reader_that_leaves_orderly_is_gone_at_once_and_not_missed,
    the_graph_shows_the_node_and_its_writers_with_identifiers_of_the_distributions_length,
);

pub(crate) fn is_report(report: u8, sec: i32) -> impl Fn(&Value) -> bool {
    move |line| {
        line["event"] == "sample"
            && line["data"] == json!({"stamp": {"sec": sec, "nanosec": 1}, "report": report})
    }
}

/// Waits for the first report of a new writer and its last repetition, which is due 3 s later; a busy machine
/// sends the first one late. The repetition before is due 1 s after it.
pub(crate) fn await_last_repetition(reader: &JsonProcess, is_report: impl Fn(&Value) -> bool) {
    let sent = |line: &Value| line["sent"].as_i64().unwrap();
    let first = sent(&reader.next("the first report", &is_report));
    reader.next("its repetition after 3 s", |line| is_report(line) && sent(line) - first > 2_500_000_000);
}

pub(crate) fn is_match(line: &Value) -> bool {
    line["event"] == "matched"
}

pub(crate) fn samples(lines: &[Value]) -> Vec<&Value> {
    lines.iter().filter(|line| line["event"] == "sample").collect()
}

fn values_stamps_and_texts_arrive_as_sent(peer: &dyn Peer) {
    let domain = domain();
    let gateway = Role::new(domain).start();
    let turn = peer.reader(domain, "turn", TURN, "transient_local");
    let hazard = peer.reader(domain, "hazard", HAZARD, "transient_local");
    let diagnostics = peer.reader(domain, "diagnostics", DIAGNOSTICS, "volatile");
    gateway.wait_until("three readers", |status| status["readers"] == json!([1, 1, 1]));
    diagnostics.next("a match", is_match);

    for (state, report, sec) in [("left", 2, 5), ("right", 3, -6), ("off", 1, 7)] {
        gateway.send(&format!("turn {state} {sec}"));
        turn.next(state, is_report(report, sec));
    }
    gateway.send("hazard on 8");
    hazard.next("hazard on", is_report(2, 8));
    gateway.send("diagnostics Grüße");
    let array = diagnostics.next("diagnostics", |line| line["event"] == "sample");
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
    gateway.stop();
    if peer.understands_goodbyes() {
        turn.next("a goodbye", |line| line["event"] == "unmatched");
    }
}

fn texts_too_long_for_one_datagram_arrive_whole(peer: &dyn Peer) {
    let domain = domain();
    let gateway = Role::new(domain).start();
    let diagnostics = peer.reader(domain, "diagnostics", DIAGNOSTICS, "volatile");
    gateway.wait_until("a reader", |status| status["readers"][2] == 1);
    diagnostics.next("a match", is_match);
    let text: String = (0..50_000).map(|number: u32| number.to_string()).collect();
    gateway.send(&format!("diagnostics {text}"));
    let array = diagnostics.next("diagnostics", |line| line["event"] == "sample");
    assert_eq!(array["data"]["status"][0]["message"], text);
}

fn a_late_joiner_gets_the_current_report_nothing_after_a_withdrawal_and_the_next_one_after_that(
    peer: &dyn Peer,
) {
    let domain = domain();
    let gateway = Role::new(domain).start();
    let early = ["transient_local", "volatile"].map(|kind| peer.reader(domain, "turn", TURN, kind));
    gateway.wait_until("early readers", |status| status["readers"][0] == 2);
    for reader in &early {
        reader.next("a match", is_match);
    }
    gateway.send("turn left 1");
    for reader in &early {
        reader.next("the first report", is_report(2, 1));
    }
    let late = peer.reader(domain, "turn", TURN, "transient_local");
    late.next("the current report", is_report(2, 1));
    drop(late);

    gateway.send("turn right 2");
    for reader in &early {
        reader.next("the last report before the withdrawal", is_report(3, 2));
    }
    gateway.send("turn withdraw");
    for reader in &early {
        reader.next("a match with the new writer", is_match);
    }
    let late = peer.reader(domain, "turn", TURN, "transient_local");
    late.next("a match with the new writer", is_match);
    let received = late.next_during(SILENCE);
    if gateway.is_undisturbed() {
        assert_eq!(samples(&received), Vec::<&Value>::new());
    }

    gateway.wait_until("all readers", |status| status["readers"][0] == 3);
    gateway.send("turn off 3");
    late.next("the report after the withdrawal", is_report(1, 3));
    for reader in &early {
        reader.next("the report after the withdrawal", is_report(1, 3));
    }
}

fn a_late_joiner_is_handed_the_one_current_report_whoever_read_those_before(peer: &dyn Peer) {
    let domain = domain();
    let gateway = Role::new(domain).start();
    let hazard = peer.reader(domain, "hazard", HAZARD, "transient_local");
    // First nobody has read the earlier reports, then somebody who is gone.
    for round in 0..2 {
        for sec in 1..=5 {
            written(&gateway, &hazard, &format!("turn left {sec}"), 10 * round + sec);
        }
        written(&gateway, &hazard, &format!("turn right {round}"), 10 * round + 6);
        let late = peer.reader(domain, "turn", TURN, "transient_local");
        late.next("the current report first", |line| {
            assert!(line["event"] != "sample" || is_report(3, round)(line), "{line}");
            is_report(3, round)(line)
        });
        gateway.send("turn off 9");
        late.next("what comes later", is_report(1, 9));
        drop(late);
        gateway.wait_until("the reader's leave", |status| status["readers"][0] == 0);
    }
}

/// Its depth would be enough for all of them.
fn a_late_joiner_is_handed_the_current_report_and_none_before_it_while_others_read(peer: &dyn Peer) {
    let domain = domain();
    let gateway = Role::new(domain).start();
    let early = ["transient_local", "volatile"].map(|kind| peer.reader(domain, "turn", TURN, kind));
    gateway.wait_until("early readers", |status| status["readers"][0] == 2);
    for reader in &early {
        reader.next("a match", is_match);
    }
    gateway.send("turn left 1");
    // The writer is not a new one any more.
    await_last_repetition(&early[0], is_report(2, 1));
    for sec in 2..30 {
        gateway.send(&format!("turn left {sec}"));
        early[0].next("a report", is_report(2, sec));
    }
    gateway.send("turn right 30");
    for reader in &early {
        reader.next("the last report", is_report(3, 30));
    }
    let kept_waiting = waited_in_all(gateway.id());
    let late = peer.reader(domain, "turn", TURN, "transient_local");
    late.next("the current report", is_report(3, 30));
    let kept_waiting = waited_in_all(gateway.id()).saturating_sub(kept_waiting);
    let lines: Vec<Value> = late.lines(Mark::START).into_iter().map(|(_, line)| line).collect();
    let outdated = samples(&lines).into_iter().take_while(|line| !is_report(3, 30)(line)).count();
    println!("{outdated} outdated reports; the gateway waited {kept_waiting:?} for a processor");
    if kept_waiting < SOON {
        assert_eq!(outdated, 0, "reports before the current one");
    }
    for reader in &early {
        reader.next("the current report of another writer", is_report(3, 30));
    }
    gateway.send("turn off 31");
    for reader in early.iter().chain([&late]) {
        reader.next("the next report", is_report(1, 31));
    }
}

/// Sends a report, and waits until the network side has it: a report on the other topic follows on the same
/// way. Otherwise one report may overtake another.
fn written(gateway: &Gateway, hazard: &JsonProcess, command: &str, number: i32) {
    gateway.send(command);
    gateway.send(&format!("hazard on {number}"));
    hazard.next("the report that follows", is_report(2, number));
}

fn a_report_right_after_a_withdrawal_reaches_every_matched_reader(peer: &dyn Peer) {
    let domain = domain();
    let gateway = Role::new(domain).start();
    let readers = ["transient_local", "volatile"].map(|kind| peer.reader(domain, "turn", TURN, kind));
    gateway.wait_until("two readers", |status| status["readers"][0] == 2);
    for reader in &readers {
        reader.next("a match", is_match);
    }
    for round in 1..=5 {
        gateway.send(&format!("turn left {round}"));
        for reader in &readers {
            reader.next("the report before the withdrawal", is_report(2, round));
        }
        gateway.send("turn withdraw");
        // Milliseconds apart, but not so close that the report overtakes the withdrawal, unless the machine
        // is busy.
        let_pass(Duration::from_millis(3), "between a withdrawal and a report");
        let [transient, volatile] = &readers;
        gateway.expect_at(volatile, &format!("turn right {round}"), is_report(3, round));
        transient.next("the report after the withdrawal", is_report(3, round));
    }
}

fn a_reader_that_is_killed_gets_data_again_when_it_is_restarted(peer: &dyn Peer) {
    let domain = domain();
    let gateway = Role::new(domain).start();
    let first = peer.reader(domain, "turn", TURN, "transient_local");
    gateway.send("turn left 1");
    first.next("a report", is_report(2, 1));
    first.kill();
    let second = peer.reader(domain, "turn", TURN, "transient_local");
    second.next("the current report", is_report(2, 1));
    gateway.send("turn right 2");
    second.next("the next report", is_report(3, 2));
    gateway.expect_rebuilds(0); // nobody was away
}

/// Fast DDS does not understand the goodbye of RustDDS 0.15, which names what goes by its key
/// without the key's hash: it forgets a gateway when the lease of 50 s is over, and the writers of
/// withdrawn reports no sooner. Neither may keep data from coming.
fn a_reader_gets_data_of_the_next_gateway_at_once(peer: &dyn Peer) {
    let domain = domain();
    let turn = peer.reader(domain, "turn", TURN, "transient_local");
    for (state, report) in [("left", 2), ("right", 3)] {
        let gateway = Role::new(domain).start();
        gateway.send(&format!("turn {state} 1"));
        turn.next("a report", is_report(report, 1));
        gateway.stop();
    }
    assert!(turn.next_during(Duration::ZERO).iter().all(|line| line["event"] != "garbled"));
}

fn a_reader_that_leaves_orderly_is_gone_at_once_and_not_missed(peer: &dyn Peer) {
    let domain = domain();
    let gateway = Role::new(domain).start();
    let turn = peer.reader(domain, "turn", TURN, "transient_local");
    gateway.wait_until("a reader", |status| status["readers"][0] == 1);
    drop(turn);
    gateway.wait_until("no reader", |status| status["readers"][0] == 0);
    assert_eq!(gateway.status()["missing"], 0);
}

fn the_graph_shows_the_node_and_its_writers_with_identifiers_of_the_distributions_length(peer: &dyn Peer) {
    let length = if DISTRO == "humble" { 24 } else { 16 };
    let domain = domain();
    let gateway = Role::new(domain).start();
    let graph = peer.reader(domain, &format!("gid{length}"), "ros_discovery_info", "transient_local");
    let turn = peer.reader(domain, "turn", TURN, "volatile");
    let writer =
        |reader: &JsonProcess| reader.next("a match", is_match)["writer"].as_str().unwrap().to_owned();
    let lists = |writer: String| {
        move |line: &Value| {
            let node = &line["data"]["node_entities_info_seq"][0];
            let gids = node["writer_gid_seq"].as_array().map_or(&[][..], Vec::as_slice);
            let listed = gids.iter().any(|gid| {
                hex(gid.get("data").unwrap_or(gid)) == format!("{writer:0<width$}", width = 2 * length)
            });
            let named = node["node_name"] == "gateway_under_test" && node["node_namespace"] == "/vehicle";
            named && listed && gids.len() == 3 && node["reader_gid_seq"] == json!([])
        }
    };
    let before = writer(&turn);
    graph.next("the node with the turn writer", lists(before.clone()));
    // A withdrawal makes a new writer: the graph follows.
    gateway.send("turn left 1");
    turn.next("a report", is_report(2, 1));
    gateway.send("turn withdraw");
    let after = writer(&turn);
    assert_ne!(before, after);
    graph.next("the node with the new turn writer", lists(after));
}

fn hex(bytes: &Value) -> String {
    let digit = |nibble: u64| char::from_digit(u32::try_from(nibble).unwrap(), 16).unwrap();
    let digits = |byte: &Value| [byte.as_u64().unwrap() / 16, byte.as_u64().unwrap() % 16].map(digit);
    bytes.as_array().map_or(&[][..], Vec::as_slice).iter().flat_map(digits).collect()
}
