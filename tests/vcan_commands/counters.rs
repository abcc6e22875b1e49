//! Counters over many frames, while what is asked changes all the time and the link goes down and up.

use std::time::Duration;

use crate::bytes;
use crate::commander::{Commander, Durability, Heard, Python};
use crate::interface::Vcan;
use crate::process::{self, DEADLINE, Process};
use crate::recording::Recording;
use crate::rhythm::measured;
use crate::vehicles::{Change, NEW_EAGLE, PATIENT};

const FRAMES: usize = 10_000;

/// As fast as a message may be, with as many frames after each change as there may be.
const FASTEST: (&str, &str) =
    ("period_ms = 50", "period_ms = 10\nburst = 10\nburst_gap_ms = 1\nleast_gap_ms = 1");

#[test]
fn ten_thousand_frames_have_no_gap_in_their_counter_over_changes_and_a_lost_link() {
    let test = "ten_thousand_frames_have_no_gap_in_their_counter_over_changes_and_a_lost_link";
    let Some(vcan) = Vcan::for_test(test, "vcan-count") else { return };
    let Some(python) = Python::for_test(test) else { return };
    let ros = process::ros();
    let domain = ros.split_whitespace().find_map(|word| word.parse().ok()).unwrap();
    let keys = format!("{PATIENT}{ros}");
    let change = Change { profile: &[FASTEST], ..Change::NONE };
    let folder = NEW_EAGLE.folder(vcan.name, &keys, &change);
    let mut recording = Recording::of(vcan.name);
    let commander = Commander::start(&python, domain, Durability::Volatile);
    let mut gateway = Process::run(&folder);
    commander.wait_for_readers(Heard::START, true);
    commander.say("mode 1 10; hazard 1 10; turn 2,3 80");
    let wait = |count: usize| {
        let begun = std::time::Instant::now();
        let count_now = || recording.count(NEW_EAGLE.command);
        while count_now() < count {
            assert!(begun.elapsed() < 2 * DEADLINE, "{} of {count} frames", count_now());
            std::thread::sleep(Duration::from_millis(100));
        }
    };
    wait(FRAMES / 3);
    vcan.bring_down();
    gateway.wait_for_log("nothing can be sent on dbw");
    commander.say("hazard 2 10");
    vcan.bring_up();
    wait(FRAMES / 2);
    commander.say("hazard 1 10");
    wait(FRAMES);
    gateway.stop("TERM");
    recording.finish();

    let frames = recording.since(0, NEW_EAGLE.command);
    let counter = NEW_EAGLE.counter.unwrap();
    for (index, frame) in frames.iter().enumerate() {
        assert_eq!(usize::from(counter(&frame.data)), index % 16, "frame {index} of {}", frames.len());
    }
    let changes = NEW_EAGLE.runs(&frames).len() - 1;
    assert!(changes > 100, "only {changes} changes");
    println!("{} frames, {changes} changes", frames.len());
    // The gateway keeps its least distance by its own clock; what the machine holds up may come closer.
    let closer = frames.windows(2).filter(|pair| pair[1].at < pair[0].at + Duration::from_millis(1)).count();
    println!("measured: {closer} of them came within 1 ms after the one before, by the kernel's stamps");
    measured("10 ms, ten frames 1 ms apart after each change", &frames);
    bytes::check(&python, &folder, &NEW_EAGLE, &frames, &["off", "left", "right", "hazard"]);
}
