//! Commands while the wall clock is set, in a guest whose clock is nobody else's.

use std::time::Duration;

use super::step_clock;
use crate::support::json_process::Mark;
use crate::support::peer::Cyclone;
use crate::support::prerequisite::{Missing, require};
use crate::support::process::Process;
use crate::support::processor::waited;
use crate::support::vcan::Vcan;
use crate::support::waiting::{Bystander, let_pass};
use crate::vcan::vcan_commands::car::Car;
use crate::vcan::vcan_commands::commander::{Commander, Durability};
use crate::vcan::vcan_commands::recording::{BusTime, Recording};
use crate::vcan::vcan_commands::vehicles::{Change, PACMOD};

/// Together they lead back to the true time.
const STEPS_S: [i64; 8] = [-40, -20, -20, 80, -3600, -5, 1800, 1805];

/// Longest time until a command is on the bus, beside what the machine takes from everybody.
const LIMIT: Duration = Duration::from_secs(2);

/// What a busy machine may need between two commands, and a network process that does not answer to be ended.
const PAUSE: Duration = Duration::from_secs(5);
/// After the first steps, so that the next comes while a step is still being followed.
const SHORT_PAUSE: Duration = Duration::from_millis(100);

#[test]
fn commands_are_followed_and_no_process_is_ended_after_a_step_of_the_wall_clock() {
    let pauses = [SHORT_PAUSE; 2].into_iter().chain(std::iter::repeat(PAUSE));
    require!(follow_after(STEPS_S.into_iter().zip(pauses)));
}

mod slow {
    mod exhaustive {
        use std::time::Instant;

        use super::super::{Duration, follow_after, require};
        use crate::vcan::vcan_faults::Chance;

        /// Within two hours of the true time, for as long as is asked for.
        #[test]
        #[ignore = "exhaustive: tests/run --release"]
        fn commands_are_followed_while_the_wall_clock_steps_at_random() {
            let mut chance = Chance::default();
            let (mut offset_s, begin) = (0_i64, Instant::now());
            let steps = std::iter::from_fn(|| {
                let to_s = if begin.elapsed() < Chance::minutes() {
                    chance.below(14_400) - 7_200
                } else if offset_s != 0 {
                    0
                } else {
                    return None;
                };
                let step_s = to_s - offset_s;
                offset_s = to_s;
                Some((step_s, Duration::from_millis(chance.below(6_000).unsigned_abs())))
            });
            require!(follow_after(steps));
        }
    }
}

/// Follows a command after each of these steps, in seconds, and another one after a pause.
fn follow_after(steps: impl Iterator<Item = (i64, Duration)>) -> Result<(), Missing> {
    let vcan = Vcan::new("vcan-set-back")?;
    let cyclone = Cyclone::on_loopback()?;
    let (folder, domain) = PACMOD.patient_folder(vcan.name, &Change::NONE);
    let recording = Recording::of(vcan.name);
    let commander = Commander::start(&cyclone, domain, Durability::Volatile);
    let _car = Car::start(&folder, vcan.name, &[]);
    let gateway = Process::run(&folder);
    commander.wait_for_readers(Mark::START, true);
    commander.send("mode 1 10; turn 2 10; hazard 1 10");
    PACMOD.wait_for(&recording, BusTime::START, "left");
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
    for (step_s, pause) in steps {
        step_clock(step_s);
        follow(step_s, "turn 3 10", "right");
        let_pass(pause, "in which a network process that does not answer would be ended");
        follow(step_s, "turn 2 10", "left");
    }
    let ends: Vec<_> = gateway.log().into_iter().filter(|line| line.contains("network side")).collect();
    assert!(ends.is_empty(), "{ends:?}");
    Ok(())
}
