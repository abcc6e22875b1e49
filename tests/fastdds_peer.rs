//! The session against Fast DDS, the other middleware of ROS 2.
//!
//! The reader is compiled here with `c++` against Debian's `libfastrtps-dev`; without either, the
//! tests say that they are skipped. It reads over UDP on the loopback, where not said otherwise.

#![cfg(feature = "ros")]
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests fail like tests

#[path = "dds_peer/autoware_topics.rs"]
mod autoware_topics;
#[allow(dead_code)] // the tests with Cyclone use more of it
#[path = "dds_peer/bench.rs"]
mod bench;
#[path = "dds_peer/lights.rs"]
mod lights;
#[path = "dds_peer/session.rs"]
mod session;

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::Duration;

use bench::{Gateway, Side, domain, inside};
use serde_json::{Value, json};
use signal_gateway::io::ros::session::DISTRO;

const TURN: &str = "rt/vehicle/status/turn_indicators_status";
const HAZARD: &str = "rt/vehicle/status/hazard_lights_status";
const DIAGNOSTICS: &str = "rt/diagnostics";

/// Long enough for a late joiner to be matched and handed something, if it ever is.
const SILENCE: Duration = Duration::from_secs(2);

/// The compiled reader, or `None` after saying what is skipped.
fn program(test: &str) -> Option<&'static Path> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    let program = PROGRAM.get_or_init(|| has_fast_dds().then(compile)).as_deref();
    if program.is_none() {
        println!("skipped: {test}: no c++, or no Fast DDS 2 for it (libfastrtps-dev)");
    }
    program
}

/// Whether there is a compiler that finds the headers.
fn has_fast_dds() -> bool {
    let mut compiler = Command::new("c++");
    compiler.args(["-E", "-x", "c++", "-"]).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
    let Ok(mut compiler) = compiler.spawn() else { return false };
    let source = b"#include <fastrtps/fastrtps_all.h>\n#include <fastcdr/Cdr.h>\n";
    compiler.stdin.take().unwrap().write_all(source).unwrap();
    compiler.wait().unwrap().success()
}

/// Compiles the reader unless that was done since it changed.
fn compile() -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/fastdds_reader.cpp");
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fastdds_reader");
    let changed = |path| fs::metadata(path).and_then(|metadata| metadata.modified());
    if changed(&program).is_ok_and(|compiled| compiled > changed(&source).unwrap()) {
        return program;
    }
    // Not in place: another run may be executing it.
    let fresh = program.with_extension(std::process::id().to_string());
    let mut compiler = Command::new("c++");
    compiler.args(["-std=c++17", "-Wall", "-Wextra", "-Werror", "-o"]).arg(&fresh).arg(source);
    let output = compiler.args(["-lfastrtps", "-lfastcdr"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    fs::rename(fresh, &program).unwrap();
    program
}

/// Starts a reader; `transport` is `loopback` or `default`.
fn reader_over(
    transport: &str,
    program: &Path,
    domain: u16,
    kind: &str,
    topic: &str,
    durability: &str,
) -> Side {
    let mut command = inside(None, program);
    command.arg(domain.to_string()).args([kind, topic, durability, transport]);
    let side = Side::start(&format!("{durability} reader of {topic}"), command);
    side.wait_for("its start", |line| line["event"] == "ready");
    side
}

fn reader(program: &Path, domain: u16, kind: &str, topic: &str, durability: &str) -> Side {
    reader_over("loopback", program, domain, kind, topic, durability)
}

fn is_report(report: u8, sec: i32) -> impl Fn(&Value) -> bool {
    move |line| {
        line["event"] == "sample"
            && line["data"] == json!({"stamp": {"sec": sec, "nanosec": 1}, "report": report})
    }
}

fn is_match(line: &Value) -> bool {
    line["event"] == "matched"
}

fn samples(lines: &[Value]) -> Vec<&Value> {
    lines.iter().filter(|line| line["event"] == "sample").collect()
}

#[test]
fn values_stamps_and_texts_arrive_as_sent() {
    let Some(program) = program("values_stamps_and_texts_arrive_as_sent") else { return };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let turn = reader(program, domain, "turn", TURN, "transient_local");
    let hazard = reader(program, domain, "hazard", HAZARD, "transient_local");
    let diagnostics = reader(program, domain, "diagnostics", DIAGNOSTICS, "volatile");
    gateway.wait_until("three readers", |status| status["readers"] == json!([1, 1, 1]));
    diagnostics.wait_for("a match", is_match);

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
}

#[test]
fn texts_too_long_for_one_datagram_arrive_whole() {
    let Some(program) = program("texts_too_long_for_one_datagram_arrive_whole") else { return };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let diagnostics = reader(program, domain, "diagnostics", DIAGNOSTICS, "volatile");
    gateway.wait_until("a reader", |status| status["readers"][2] == 1);
    diagnostics.wait_for("a match", is_match);
    let text: String = (0..50_000).map(|number: u32| number.to_string()).collect();
    gateway.tell(&format!("diagnostics {text}"));
    let array = diagnostics.wait_for("diagnostics", |line| line["event"] == "sample");
    assert_eq!(array["data"]["status"][0]["message"], text);
}

#[test]
fn a_late_joiner_gets_the_current_report_nothing_after_a_withdrawal_and_the_next_one_after_that() {
    let test = "a_late_joiner_gets_the_current_report_nothing_after_a_withdrawal_and_the_next_one_after_that";
    let Some(program) = program(test) else { return };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let early = ["transient_local", "volatile"].map(|kind| reader(program, domain, "turn", TURN, kind));
    gateway.wait_until("early readers", |status| status["readers"][0] == 2);
    for reader in &early {
        reader.wait_for("a match", is_match);
    }
    gateway.tell("turn left 1");
    for reader in &early {
        reader.wait_for("the first report", is_report(2, 1));
    }
    let late = reader(program, domain, "turn", TURN, "transient_local");
    late.wait_for("the current report", is_report(2, 1));
    drop(late);

    gateway.tell("turn right 2");
    for reader in &early {
        reader.wait_for("the last report before the withdrawal", is_report(3, 2));
    }
    gateway.tell("turn withdraw");
    for reader in &early {
        reader.wait_for("a match with the new writer", is_match);
    }
    let late = reader(program, domain, "turn", TURN, "transient_local");
    late.wait_for("a match with the new writer", is_match);
    assert_eq!(samples(&late.during(SILENCE)), Vec::<&Value>::new());

    gateway.tell("turn off 3");
    late.wait_for("the report after the withdrawal", is_report(1, 3));
    for reader in &early {
        reader.wait_for("the report after the withdrawal", is_report(1, 3));
    }
}

#[test]
fn a_report_right_after_a_withdrawal_reaches_every_matched_reader() {
    let Some(program) = program("a_report_right_after_a_withdrawal_reaches_every_matched_reader") else {
        return;
    };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let readers = ["transient_local", "volatile"].map(|kind| reader(program, domain, "turn", TURN, kind));
    gateway.wait_until("two readers", |status| status["readers"][0] == 2);
    for reader in &readers {
        reader.wait_for("a match", is_match);
    }
    for round in 1..=5 {
        gateway.tell(&format!("turn left {round}"));
        for reader in &readers {
            reader.wait_for("the report before the withdrawal", is_report(2, round));
        }
        gateway.tell("turn withdraw");
        // Milliseconds apart, but not so close that the report overtakes the withdrawal.
        std::thread::sleep(Duration::from_millis(3));
        gateway.tell(&format!("turn right {round}"));
        for reader in &readers {
            reader.wait_for("the report after the withdrawal", is_report(3, round));
        }
    }
}

#[test]
fn volatile_reports_reach_volatile_readers_and_are_refused_to_transient_local_ones() {
    let test = "volatile_reports_reach_volatile_readers_and_are_refused_to_transient_local_ones";
    let Some(program) = program(test) else { return };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "volatile");
    let suited = reader(program, domain, "turn", TURN, "volatile");
    let demanding = reader(program, domain, "turn", TURN, "transient_local");
    suited.wait_for("a match", is_match);
    demanding.wait_for("a refusal", |line| line["event"] == "incompatible");
    gateway.wait_until("a reader", |status| status["readers"][0] == 1);
    gateway.tell("turn left 1");
    suited.wait_for("a report", is_report(2, 1));
}

#[test]
fn a_reader_that_is_killed_gets_data_again_when_it_is_restarted() {
    let Some(program) = program("a_reader_that_is_killed_gets_data_again_when_it_is_restarted") else {
        return;
    };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let first = reader(program, domain, "turn", TURN, "transient_local");
    gateway.tell("turn left 1");
    first.wait_for("a report", is_report(2, 1));
    first.kill();
    let second = reader(program, domain, "turn", TURN, "transient_local");
    second.wait_for("the current report", is_report(2, 1));
    gateway.tell("turn right 2");
    second.wait_for("the next report", is_report(3, 2));
    assert_eq!(gateway.status()["rebuilds"], 0, "nobody was away: nothing to rebuild");
}

/// Fast DDS does not understand the goodbye of RustDDS 0.15, which names what goes by its key
/// without the key's hash: it forgets a gateway when the lease of 50 s is over, and the writers of
/// withdrawn reports no sooner. Neither may keep data from coming.
#[test]
fn a_reader_gets_data_of_the_next_gateway_at_once() {
    let Some(program) = program("a_reader_gets_data_of_the_next_gateway_at_once") else { return };
    let domain = domain();
    let turn = reader(program, domain, "turn", TURN, "transient_local");
    for (word, report) in [("left", 2), ("right", 3)] {
        let mut gateway = Gateway::start(None, domain, "transient_local");
        gateway.tell(&format!("turn {word} 1"));
        turn.wait_for("a report", is_report(report, 1));
        gateway.stop();
    }
    assert!(turn.during(Duration::ZERO).iter().all(|line| line["event"] != "garbled"));
}

/// Shared memory is offered by such a reader, and not understood by the gateway.
#[test]
fn a_reader_with_the_default_transports_is_served_too() {
    let Some(program) = program("a_reader_with_the_default_transports_is_served_too") else { return };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    gateway.tell("turn left 1");
    let late = reader_over("default", program, domain, "turn", TURN, "transient_local");
    late.wait_for("the current report", is_report(2, 1));
    gateway.tell("turn right 2");
    late.wait_for("the next report", is_report(3, 2));
}

#[test]
fn the_graph_shows_the_node_and_its_writers_with_identifiers_of_the_distributions_length() {
    let test = "the_graph_shows_the_node_and_its_writers_with_identifiers_of_the_distributions_length";
    let Some(program) = program(test) else { return };
    let length = if DISTRO == "humble" { 24 } else { 16 };
    let domain = domain();
    let _gateway = Gateway::start(None, domain, "transient_local");
    let graph = reader(program, domain, &format!("gid{length}"), "ros_discovery_info", "transient_local");
    let turn = reader(program, domain, "turn", TURN, "volatile");
    let writer = turn.wait_for("a match", is_match)["writer"].as_str().unwrap().to_owned();
    let bytes = (0..length)
        .map(|at| writer.get(2 * at..2 * at + 2).map_or(0, |digits| u8::from_str_radix(digits, 16).unwrap()));
    let listed = json!(bytes.collect::<Vec<u8>>());
    graph.wait_for("the node with the turn writer", |line| {
        let node = &line["data"]["node_entities_info_seq"][0];
        let gids = node["writer_gid_seq"].as_array().map_or(&[][..], Vec::as_slice);
        node["node_name"] == "gateway_under_test"
            && node["node_namespace"] == "/vehicle"
            && gids.len() == 3
            && gids.contains(&listed)
    });
}

#[test]
fn a_reader_that_says_goodbye_is_gone_at_once_and_not_missed() {
    let Some(program) = program("a_reader_that_says_goodbye_is_gone_at_once_and_not_missed") else { return };
    let domain = domain();
    let mut gateway = Gateway::start(None, domain, "transient_local");
    let turn = reader(program, domain, "turn", TURN, "transient_local");
    gateway.wait_until("a reader", |status| status["readers"][0] == 1);
    drop(turn);
    gateway.wait_until("no reader", |status| status["readers"][0] == 0);
    assert_eq!(gateway.status()["missing"], 0);
}
