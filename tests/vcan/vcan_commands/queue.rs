//! A queue of the kernel that is really full: frames wait, and none is lost or counted twice.

use super::commander::{Commander, Durability, ERROR, OK, TRANSMISSION, WARN};
use super::vehicles::{Change, NEW_EAGLE};
use crate::support::json_process::Mark;
use crate::support::peer::Cyclone;
use crate::support::prerequisite::require;
use crate::support::process::Process;
use crate::support::slcan::Adapter;
use crate::support::waiting::wait_until;

/// Ten failures in a row take half a second: long enough for a warning before the error.
const SLOWLY_AGAIN: (&str, &str) = ("period_ms = 50", "period_ms = 50\nmin_send_interval_ms = 50");

#[test]
fn a_full_queue_delays_the_same_frame_with_a_warning_then_an_error_and_the_counter_continues() {
    let adapter = require!(Adapter::plug_in());
    let cyclone = require!(Cyclone::on_loopback());
    let change = Change { profile: &[SLOWLY_AGAIN], ..Change::NONE };
    let (folder, domain) = NEW_EAGLE.patient_folder(&adapter.name, &change);
    let commander = Commander::start(&cyclone, domain, Durability::Volatile);
    let mut gateway = Process::run(&folder);
    commander.wait_for_readers(Mark::START, true);
    let since = commander.send("mode 1 10; turn 2 10; hazard 1 10");
    commander.status(since, TRANSMISSION, OK, "control mode AUTONOMOUS");
    let wait = |request: &str| {
        let newest = || adapter.frames(NEW_EAGLE.command()).last().map(|data| NEW_EAGLE.request(data));
        wait_until(format!("{request} on the line"), || newest() == Some(request));
    };
    wait("left");

    let since = commander.mark();
    let others = adapter.stall();
    assert!(others > 0, "nothing but the gateway's frames was in the queue");
    commander.status(since, TRANSMISSION, WARN, "frames are delayed");
    commander.status(since, TRANSMISSION, ERROR, "frames cannot be sent");
    // The latest command is in the first frame that finds room.
    commander.send("hazard 2 10");
    let failed = commander.count(since, TRANSMISSION, "queue_full", 10);
    let since = commander.mark();
    adapter.go_on();
    commander.status(since, TRANSMISSION, OK, "control mode AUTONOMOUS");
    wait("hazard");
    commander.send("hazard 1 10");
    wait("left");
    gateway.stop("TERM");

    let log = gateway.log();
    let at = |part: &str| log.iter().position(|line| line.contains(part)).unwrap_or_else(|| panic!("{part}"));
    assert!(
        at("command_transmission: frames are delayed") < at("command_transmission: frames cannot be sent")
    );
    let frames = adapter.frames(NEW_EAGLE.command());
    println!("{failed} times full, {others} frames of others in front, {} frames on the bus", frames.len());
    NEW_EAGLE.assert_counted(frames.iter().map(Vec::as_slice));
    let mut requests: Vec<_> = frames.iter().map(|data| NEW_EAGLE.request(data)).collect();
    requests.dedup();
    assert_eq!(requests[..4], ["off", "left", "hazard", "left"]);
}
