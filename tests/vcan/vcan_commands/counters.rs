//! Counters over many frames, while the request changes all the time and the link goes down and up.

use std::time::Duration;

use super::bytes;
use super::commander::{Commander, Durability};
use super::recording::{BusTime, Recording};
use super::rhythm::measured;
use super::vehicles::{Change, NEW_EAGLE};
use crate::support::json_process::Mark;
use crate::support::peer::Cyclone;
use crate::support::prerequisite::require;
use crate::support::process::Process;
use crate::support::vcan::Vcan;
use crate::support::waiting::wait_until;

/// As fast as a message may be, with as many frames after each change as there may be.
const FASTEST: (&str, &str) =
    ("period_ms = 50", "period_ms = 10\nburst = 10\nburst_gap_ms = 1\nmin_send_interval_ms = 1");

#[test]
fn a_thousand_frames_have_no_gap_in_their_counter_over_changes_and_a_lost_link() {
    let vcan = require!(Vcan::new("vcan-count"));
    count(&vcan, &require!(Cyclone::on_loopback()), 1000);
}

mod slow {
    use super::{Cyclone, Vcan, count, require};

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn ten_thousand_frames_have_no_gap_in_their_counter_over_changes_and_a_lost_link() {
        let vcan = require!(Vcan::new("vcan-counts"));
        count(&vcan, &require!(Cyclone::on_loopback()), 10_000);
    }
}

fn count(vcan: &Vcan, cyclone: &Cyclone, least: usize) {
    let change = Change { profile: &[FASTEST], ..Change::NONE };
    let (folder, domain) = NEW_EAGLE.patient_folder(vcan.name, &change);
    let mut recording = Recording::of(vcan.name);
    let commander = Commander::start(cyclone, domain, Durability::Volatile);
    let mut gateway = Process::run(&folder);
    commander.wait_for_readers(Mark::START, true);
    commander.send("mode 1 10; hazard 1 10; turn 2,3 80");
    let wait = |count: usize| {
        let count_now = || recording.count(NEW_EAGLE.command());
        // However slow the machine, some more come.
        for some in (0..=count).step_by(100).chain([count]) {
            wait_until(format!("{some} of {count} frames"), || count_now() >= some);
        }
    };
    wait(least / 3);
    vcan.bring_down();
    gateway.wait_for_log("nothing can be sent on dbw");
    commander.send("hazard 2 10");
    vcan.bring_up();
    wait(least / 2);
    commander.send("hazard 1 10");
    wait(least);
    gateway.stop("TERM");
    recording.finish();

    let frames = recording.since(BusTime::START, NEW_EAGLE.command());
    NEW_EAGLE.assert_counted(frames.iter().map(|frame| frame.data.as_slice()));
    let changes = NEW_EAGLE.runs(&frames).len() - 1;
    assert!(changes > least / 100, "only {changes} changes");
    println!("{} frames, {changes} changes", frames.len());
    // The gateway keeps its least distance by its own clock; what the machine holds up may come closer.
    let closer = frames.windows(2).filter(|pair| pair[1].at < pair[0].at + Duration::from_millis(1)).count();
    println!("measured: {closer} of them came within 1 ms after the one before, by the kernel's stamps");
    measured("10 ms, ten frames 1 ms apart after each change", &frames);
    bytes::check(&folder, &NEW_EAGLE, &frames, &["off", "left", "right", "hazard"]);
}
