//! Two senders of commands, one of them with its clock 11 days ahead: neither locks the other out.

use super::car::Car;
use super::commander::{Commander, Durability};
use super::recording::{BusTime, RecordedFrame, Recording};
use super::vehicles::{Change, PACMOD, PATIENT};
use crate::support::json_process::Mark;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::process::{self, Process};
use crate::support::vcan::Vcan;

#[test]
fn a_sender_whose_clock_is_ahead_does_not_lock_out_the_true_one() {
    let vcan = require!(Vcan::new("vcan-clocks"));
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let folder = PACMOD.folder(vcan.name, &format!("{PATIENT}{}", process::ros_in(domain)), &Change::NONE);
    let recording = Recording::of(vcan.name);
    let [ahead, sender] = [(); 2].map(|()| Commander::start(&cyclone, domain, Durability::Volatile));
    let _car = Car::start(&folder, vcan.name, &[]);
    let _gateway = Process::run(&folder);
    for commander in [&ahead, &sender] {
        commander.wait_for_readers(Mark::START, true);
    }
    let requests = |frames: &[&RecordedFrame], lights: &str| {
        frames.iter().any(|frame| PACMOD.request(&frame.data) == lights)
    };
    ahead.send("hazard stamps 950400; hazard 1 1.25; mode 1 10; turn 1 10");
    recording.wait(BusTime::START, PACMOD.command(), "off", |frames| requests(frames, "off"));
    let mut mark = BusTime::now();
    sender.send("hazard 2 10");
    for _ in 0..3 {
        // Each sender has its turn.
        for lights in ["hazard", "off"] {
            recording.wait(mark, PACMOD.command(), lights, |frames| requests(frames, lights));
            mark = BusTime::now();
        }
    }
}
