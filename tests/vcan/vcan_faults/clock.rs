//! Commands while the wall clock is set, in a guest whose clock is nobody else's.

use std::time::{Duration, Instant};

use super::step_clock;
use crate::support::json_process::Mark;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::process::{self, Process};
use crate::support::processor::waited;
use crate::support::vcan::Vcan;
use crate::support::waiting::{Bystander, let_pass};
use crate::vcan::vcan_commands::car::Car;
use crate::vcan::vcan_commands::commander::{Commander, Durability};
use crate::vcan::vcan_commands::recording::{BusTime, Recording};
use crate::vcan::vcan_commands::vehicles::{Change, PACMOD, PATIENT};

/// Together they lead back to the true time.
const STEPS_S: [i64; 6] = [-40, 40, -3600, -5, 1800, 1805];

/// Longest time until a command is on the bus, beside what the machine takes from everybody.
const LIMIT: Duration = Duration::from_secs(2);

#[test]
fn commands_are_followed_and_no_process_is_ended_after_a_step_of_the_wall_clock() {
    let vcan = require!(Vcan::new("vcan-set-back"));
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let folder = PACMOD.folder(vcan.name, &format!("{PATIENT}{}", process::ros_in(domain)), &Change::NONE);
    let recording = Recording::of(vcan.name);
    let commander = Commander::start(&cyclone, domain, Durability::Volatile);
    let _car = Car::start(&folder, vcan.name, &[]);
    let gateway = Process::run(&folder);
    commander.wait_for_readers(Mark::START, true);
    commander.send("mode 1 10; turn 2 10; hazard 1 10");
    recording.wait(BusTime::START, PACMOD.command(), "left", |frames| {
        frames.iter().any(|frame| PACMOD.request(&frame.data) == "left")
    });
    // Frames have times of the clock that is set, so their number tells which are new.
    let followed = |command: &str, lights: &str| {
        let (before, begun) = (recording.count(PACMOD.command()), Instant::now());
        commander.send(command);
        recording.wait(BusTime::START, PACMOD.command(), lights, |frames| {
            frames.iter().skip(before).any(|frame| PACMOD.request(&frame.data) == lights)
        });
        begun.elapsed()
    };
    for step_s in STEPS_S {
        let (beside, before) = (Bystander::start(), waited(gateway.id()));
        step_clock(step_s);
        let at_once = followed("turn 3 10", "right");
        let_pass(Duration::from_secs(5), "in which a network process that does not answer would be ended");
        let later = followed("turn 2 10", "left");
        println!("{step_s} s: {at_once:?}, later {later:?}");
        let waited = waited(gateway.id()).saturating_sub(before);
        let what = format!("a command after {step_s} s");
        beside.finish().assert_gap(what, at_once.max(later), LIMIT + waited);
    }
    let ends: Vec<_> = gateway.log().into_iter().filter(|line| line.contains("network side")).collect();
    assert!(ends.is_empty(), "{ends:?}");
}
