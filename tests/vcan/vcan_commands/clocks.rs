//! Two senders of commands, one of them with its clock 11 days ahead: neither locks the other out.

use super::car::Car;
use super::commander::{Commander, Durability};
use super::recording::{BusTime, Recording};
use super::vehicles::{Change, PACMOD};
use crate::support::json_process::Mark;
use crate::support::peer::Cyclone;
use crate::support::prerequisite::require;
use crate::support::process::Process;
use crate::support::vcan::Vcan;

#[test]
fn a_sender_whose_clock_is_ahead_does_not_lock_out_the_true_one() {
    let vcan = require!(Vcan::new("vcan-clocks"));
    let cyclone = require!(Cyclone::on_loopback());
    let (folder, domain) = PACMOD.patient_folder(vcan.name, &Change::NONE);
    let recording = Recording::of(vcan.name);
    let [ahead, sender] = [(); 2].map(|()| Commander::start(&cyclone, domain, Durability::Volatile));
    let _car = Car::start(&folder, vcan.name, &[]);
    let _gateway = Process::run(&folder);
    for commander in [&ahead, &sender] {
        commander.wait_for_readers(Mark::START, true);
    }
    let wait = |mark: BusTime, lights: &str| {
        recording.wait(mark, PACMOD.command(), lights, |frames| {
            frames.iter().any(|frame| PACMOD.request(&frame.data) == lights)
        });
    };
    ahead.send("hazard stamps 950400; hazard 1 1.25; mode 1 10; turn 1 10");
    wait(BusTime::START, "off");
    let mut mark = BusTime::now();
    sender.send("hazard 2 10");
    for _ in 0..3 {
        // Each sender has its turn.
        for lights in ["hazard", "off"] {
            wait(mark, lights);
            mark = BusTime::now();
        }
    }
}
