//! Commands that are carried out, refused, silent, or the driver's; and frames that are not sent.

use std::cell::Cell;
use std::time::Duration;

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::LinkState;
use gateway_base::time::MonoTime;
use gateway_core::command::input::CommandInput;

use super::{BUS, Desk, Reported};
use crate::support::clock::at_ms;
use crate::support::command_vehicle::{BUTTON, DBC, MODE, PROFILE, next_origin, next_sample};

const STATE: u16 = 560;
const AUTONOMOUS: u8 = 1;
/// Of the vehicle's `STATE` message.
const REPORTS_LEFT: u8 = 1;
const REPORTS_OVERRIDE: u8 = 1 << 4;

pub(super) fn drive(reported: &mut Reported) {
    obedience(reported);
    oscillation(reported);
    button(reported);
    modes_of_signals(reported);
    transmission(reported);
    cut_off(reported);
    clock_step(reported);
}

fn vehicle<'a>(tx: &str, reported: &'a mut Reported) -> Desk<'a> {
    let profile = PROFILE.split_once("bench.dbc\"\n").unwrap().1;
    Desk::vehicle(&format!("[command]\ntx = \"{tx}\"\n"), profile, DBC, reported)
}

/// The same every 50 ms for so long: what the vehicle reports, if anything, and what is commanded.
fn command(desk: &mut Desk<'_>, ms: u64, state: Option<u8>, commands: &[fn(u64) -> CommandInput]) {
    let from = desk.gateway.ms();
    desk.each_50_ms(ms, |desk, at| {
        if let Some(state) = state {
            desk.frame(STATE, &[state, 0, 0, 0]);
        }
        for command in commands {
            desk.input(command(from + at));
        }
    });
}

fn mode_is(number: u8, ms: u64) -> CommandInput {
    CommandInput::ControlMode { sample: next_sample(), mode: number.into(), stamp: at_ms(ms).wall }
}

fn turn(number: u8, ms: u64) -> CommandInput {
    CommandInput::Turn { origin: next_origin(), command: number.into(), stamp: at_ms(ms).wall }
}

fn mode(ms: u64) -> CommandInput {
    mode_is(AUTONOMOUS, ms)
}

fn undefined_mode(ms: u64) -> CommandInput {
    mode_is(9, ms)
}

fn off(ms: u64) -> CommandInput {
    turn(1, ms)
}

fn left(ms: u64) -> CommandInput {
    turn(2, ms)
}

fn undefined(ms: u64) -> CommandInput {
    turn(7, ms)
}

fn hazard_on(ms: u64) -> CommandInput {
    CommandInput::Hazard { origin: next_origin(), command: 2.into(), stamp: at_ms(ms).wall }
}

fn obedience(reported: &mut Reported) {
    let mut desk = vehicle("on", reported);
    command(&mut desk, 200, Some(0), &[]);
    command(&mut desk, 200, Some(0), &[undefined_mode]);
    command(&mut desk, 200, Some(0), &[mode]);
    command(&mut desk, 500, Some(0), &[mode, off]);
    command(&mut desk, 5_000, Some(0), &[mode, left]);
    command(&mut desk, 1_000, Some(REPORTS_LEFT), &[mode, left]);
    command(&mut desk, 500, Some(REPORTS_LEFT | REPORTS_OVERRIDE), &[mode, left]);
    command(&mut desk, 500, Some(REPORTS_LEFT), &[mode, left]);
    command(&mut desk, 100, Some(REPORTS_LEFT), &[mode, undefined]);
    command(&mut desk, 1_500, Some(REPORTS_LEFT), &[mode, left]);
    command(&mut desk, 5_000, None, &[mode, left]);
    command(&mut desk, 3_000, Some(0), &[mode]);
}

fn oscillation(reported: &mut Reported) {
    let mut desk = vehicle("off", reported);
    for _ in 0..10 {
        command(&mut desk, 50, Some(0), &[mode, left]);
        command(&mut desk, 50, Some(0), &[mode, off]);
    }
}

/// A button that nothing comes of.
fn button(reported: &mut Reported) {
    let mut desk = Desk::vehicle("[command]\ntx = \"on\"\n", BUTTON, DBC, reported);
    command(&mut desk, 5_000, Some(0), &[mode, off, hazard_on]);
}

/// None yet, undefined, AUTONOMOUS, late.
fn modes_of_signals(reported: &mut Reported) {
    let profile = format!("{}{MODE}", PROFILE.split_once("bench.dbc\"\n").unwrap().1);
    let keys = "[command]\ntx = \"on\"\ncontrol_mode = \"signal\"\n";
    let mut desk = Desk::vehicle(keys, &profile, DBC, reported);
    for state in [None, Some(3 << 5), Some(AUTONOMOUS << 5), None] {
        command(&mut desk, 1_500, state, &[off]);
    }
}

fn transmission(reported: &mut Reported) {
    let mut desk = vehicle("on", reported);
    command(&mut desk, 500, Some(0), &[mode, left]);
    // A full queue for a while, then for longer.
    for ms in [60, 3_000] {
        desk.gateway.queue_full_until = MonoTime::from_millis(desk.gateway.ms() + ms);
        command(&mut desk, ms + 500, Some(0), &[mode, left]);
    }
    let stranger = Frame::classic(CanId::Standard(304), &[0; 8]).unwrap();
    let stamp = Cell::new(at_ms(desk.gateway.ms()).wall).get();
    desk.input(CanInput::Frame { bus: BUS, frame: stranger, stamp });
    desk.link(LinkState::Down);
}

/// The link goes before the vehicle can show a command.
fn cut_off(reported: &mut Reported) {
    let mut desk = vehicle("on", reported);
    command(&mut desk, 300, Some(0), &[mode, left]);
    desk.link(LinkState::Down);
}

fn clock_step(reported: &mut Reported) {
    let mut desk = vehicle("off", reported);
    for ahead in [0, 2] {
        desk.gateway.now.wall = desk.gateway.now.wall.after(Duration::from_secs(ahead));
        desk.gateway.gateway.read_wall_clock(desk.gateway.now);
        desk.look();
    }
}
