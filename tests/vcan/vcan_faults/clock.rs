//! Commands while the wall clock is set, in a guest whose clock is nobody else's.

use std::time::Duration;

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
    let follow = |step_s: i64, command: &str, lights: &str| {
        let (before, waited_before) = (recording.count(PACMOD.command()), waited(gateway.id()));
        let beside = Bystander::start();
        commander.send(command);
        recording.wait(BusTime::START, PACMOD.command(), lights, |frames| {
            frames.iter().skip(before).any(|frame| PACMOD.request(&frame.data) == lights)
        });
        let waited = waited(gateway.id()).saturating_sub(waited_before);
        let took = beside.assert_in_time(format_args!("{command} after {step_s} s"), LIMIT + waited);
        println!("{step_s} s, {command}: {took:?}");
    };
    for step_s in STEPS_S {
        step_clock(step_s);
        follow(step_s, "turn 3 10", "right");
        let_pass(Duration::from_secs(5), "in which a network process that does not answer would be ended");
        follow(step_s, "turn 2 10", "left");
    }
    let ends: Vec<_> = gateway.log().into_iter().filter(|line| line.contains("network side")).collect();
    assert!(ends.is_empty(), "{ends:?}");
}
