//! The gateway is killed in the middle of a turn and restarted, as its service does: its effects on the bus
//! and the vehicle, printed as a table.

use std::time::Duration;

use super::car::Car;
use super::commander::{Commander, Durability, HAZARD, OK, TRANSMISSION, TURN, WARN};
use super::recording::{BusTime, RecordedFrame, Recording};
use super::rhythm::ms;
use super::vehicles::{Change, NEW_EAGLE, PACMOD, Vehicle};
use crate::support::json_process::Mark;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::process::{self, Process};
use crate::support::vcan::Vcan;
use crate::support::waiting::{let_pass, wait_until};

#[test]
fn killed_in_a_turn_it_is_silent_then_requests_nothing_then_the_turn_again() {
    let vcan = require!(Vcan::new("vcan-kill"));
    kill_once(&NEW_EAGLE, &vcan, &require!(Cyclone::on_loopback()));
}

mod slow {
    use super::{Cyclone, PACMOD, Vcan, kill_once, require};

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn killed_in_a_turn_with_the_other_vehicle_it_is_silent_then_requests_nothing_then_the_turn_again() {
        let vcan = require!(Vcan::new("vcan-kills"));
        kill_once(&PACMOD, &vcan, &require!(Cyclone::on_loopback()));
    }
}

/// Samples that Autoware's gate keeps for late readers were meant for another time.
/// Hazard lights on alone would be carried out.
#[test]
fn a_command_that_its_sender_keeps_is_not_carried_out_by_a_gateway_that_starts_later() {
    let vcan = require!(Vcan::new("vcan-kept"));
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let ros = process::ros_in(domain);
    let folder = PACMOD.folder(vcan.name, &format!("[command]\ntx = \"on\"\n{ros}"), &Change::NONE);
    let recording = Recording::of(vcan.name);
    let commander = Commander::start(&cyclone, domain, Durability::TransientLocal);
    commander.send("turn once 2; hazard once 1; mode 1 10");
    let _gateway = Process::run(&folder);
    commander.wait_for_readers(Mark::START, true);
    let since = commander.mark();
    commander.status(since, TRANSMISSION, OK, "control mode AUTONOMOUS");
    // A second of diagnostics later whatever was kept would have come.
    for _ in 0..2 {
        let since = commander.mark();
        commander.status(since, TURN, WARN, "no command received");
        commander.status(since, HAZARD, WARN, "no command received");
    }
    let frames = recording.since(BusTime::START, PACMOD.command());
    assert_eq!(PACMOD.runs(&frames), ["none"]);
    let mark = BusTime::now();
    commander.send("turn 2 10");
    PACMOD.wait_for(&recording, mark, "left");
}

fn kill_once(vehicle: &Vehicle, vcan: &Vcan, cyclone: &Cyclone) {
    let (folder, domain) = vehicle.patient_folder(vcan.name, &Change::NONE);
    let mut recording = Recording::of(vcan.name);
    let car = Car::start(&folder, vcan.name, &[]);
    let commander = Commander::start(cyclone, domain, Durability::Volatile);
    let gateway = Process::run(&folder);
    commander.wait_for_readers(Mark::START, true);
    commander.send("mode 1 10; turn 2 10; hazard 1 10");
    car.wait_for_lights(Mark::START, "left", "command");

    let lights = car.mark();
    drop(gateway); // SIGKILL
    let before = BusTime::now();
    let_pass(pause_of_the_service(), "in which nobody sends anything");
    // Long over on a machine that is not busy.
    wait_until("a command that is no longer received", || car.has_dropped_a_command(lights));
    let mut gateway = Process::run(&folder);
    vehicle.wait_for(&recording, before, "left");
    let states = car.wait_for_lights(lights, "left", "command");
    let dark = car.seconds_of_lights(lights);
    gateway.stop("TERM");
    recording.finish();

    let frames = recording.since(BusTime::START, vehicle.command());
    let after = recording.since(before, vehicle.command());
    let before = &frames[..frames.len() - after.len()];
    let first_left = after.iter().position(|frame| vehicle.request(&frame.data) == "left").unwrap();
    let (last, first, back) = (&before[before.len() - 1], &after[0], &after[first_left]);
    println!("| {} | ms | requests | counter |\n|---|---|---|---|", vehicle.name);
    let row = |what: &str, frame: &RecordedFrame| {
        let counter = vehicle.counter(&frame.data).map_or("–".to_owned(), |counter| counter.to_string());
        let at = ms(frame.at.saturating_sub(last.at));
        println!("| {what} | {at} | {} | {counter} |", vehicle.request(&frame.data));
    };
    row("last frame before", last);
    println!("| silence | {} | – | – |", ms(first.at.saturating_sub(last.at)));
    row("first frame after", first);
    println!(
        "| frames that request nothing | {} | {first_left} of them | |",
        ms(back.at.saturating_sub(first.at))
    );
    row("authority is back", back);
    println!("| lamps off at the vehicle | {} | – | – |", ms(Duration::from_secs_f64(dark[1] - dark[0])));

    assert_eq!(vehicle.request(&last.data), "left");
    assert_eq!(
        vehicle.request(&first.data),
        vehicle.nothing(),
        "nobody has requested anything of the new one"
    );
    assert_eq!(vehicle.runs(&after[..=first_left]), [vehicle.nothing(), "left"]);
    if vehicle.counter(&last.data).is_some() {
        let counted = |frames: &[RecordedFrame]| {
            frames.iter().map(|frame| vehicle.counter(&frame.data)).collect::<Vec<_>>()
        };
        let from_0 = |count: usize| (0..=15).cycle().map(Some).take(count).collect::<Vec<_>>();
        assert_eq!(counted(before), from_0(before.len()), "before");
        assert_eq!(counted(&after), from_0(after.len()), "the counter restarts");
    }
    let state = |lights: &str, who: &str| (lights.to_owned(), who.to_owned());
    assert_eq!(states, [state("off", "nobody"), state("left", "command")], "what the lamps did");
}

/// What the supervisor waits before it starts the gateway again; that it does, after a SIGKILL.
fn pause_of_the_service() -> Duration {
    let unit = include_str!("../../../systemd/signal-gateway.service");
    let value = |key: &str| unit.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('=')).unwrap();
    assert_eq!(value("Restart"), "always");
    let pause_s = value("RestartSec").strip_suffix('s').unwrap();
    Duration::from_secs(pause_s.parse().unwrap())
}
