//! A vehicle with a hazard button that springs back and a turn message that cannot express that nothing is
//! requested.

use can_signal::can::frame::CanId;
use can_signal::can::link::LinkState;
use gateway_base::diagnostics::Level;
use gateway_core::command::{Reported, Turn};

use crate::pure::command_model::bench::{Bench, config};
use crate::support::clock::MS;
use crate::support::command_vehicle::BUTTON;

/// The button toggles the lights when it goes down, 100 ms later; the driver may toggle them as well.
struct Day {
    bench: Bench,
    lit: bool,
    down: bool,
    toggles: Vec<u64>,
    /// When the button went down.
    presses: Vec<u64>,
    works: bool,
}

impl Day {
    fn new() -> Self {
        let profile = format!("name = \"Buttons\"\nbus.body.dbc = \"bench.dbc\"\n{BUTTON}");
        let bench = Bench::new(config("tx = \"on\"", &profile));
        Self { bench, lit: false, down: false, toggles: Vec::new(), presses: Vec::new(), works: true }
    }

    fn run(&mut self, from_ms: u64, until_ms: u64, hazard: u8) {
        for ms in (from_ms..until_ms).step_by(10) {
            self.bench.pass_until(ms * MS);
            if ms % 100 == 0 {
                self.bench.mode(1);
                self.bench.turn(2);
                self.bench.hazard(hazard);
            }
            self.lit ^= self.toggles.contains(&ms);
            self.bench.report(Reported { turn: Some(Turn::Off), hazard: Some(self.lit) });
            self.bench.settle();
            let button = |frame: &&(u64, can_signal::can::frame::Frame)| frame.1.id() == CanId::Standard(305);
            let down =
                self.bench.sent.iter().rev().find(button).is_some_and(|(_, frame)| frame.data() == [1]);
            if down && !self.down {
                self.presses.push(ms);
                self.toggles.extend(self.works.then_some(ms + 100));
            }
            self.down = down;
        }
    }
}

#[test]
fn a_button_is_pressed_once_for_each_request_and_never_against_the_driver() {
    let mut day = Day::new();
    day.run(0, 1_000, 1);
    assert!(day.presses.is_empty(), "off is off already");
    // A frame has just gone out: the next one is 10 ms behind it at the earliest.
    day.run(1_000, 2_000, 2);
    assert_eq!((day.presses.as_slice(), day.lit), ([1_010].as_slice(), true));
    // The driver switches them off and on again: nobody presses against him.
    day.toggles.extend([2_500, 2_900]);
    day.run(2_000, 3_000, 2);
    assert_eq!(day.presses.len(), 1);
    day.run(3_000, 5_000, 1);
    assert_eq!((day.presses.as_slice(), day.lit), ([1_010, 3_010].as_slice(), false));
    // The driver switches them on: nobody presses them off.
    day.toggles.push(5_500);
    day.run(5_000, 9_000, 1);
    assert_eq!((day.presses.len(), day.lit), (2, true));
    let (level, message) = day.bench.status_texts()[1].clone();
    assert_eq!((level, message.as_str()), (Level::Warn, "commanded off, left to the driver: on"));
}

#[test]
fn after_a_lost_link_the_attempts_begin_anew() {
    let mut day = Day::new();
    day.works = false;
    day.run(0, 1_000, 1);
    day.run(1_000, 4_000, 2);
    assert_eq!(day.presses.len(), 2);
    day.bench.buses[0].set_link(LinkState::Down);
    day.run(4_000, 4_100, 2);
    day.bench.buses[0].set_link(LinkState::Up);
    day.run(4_100, 7_000, 2);
    assert_eq!(day.presses.len(), 4);
}

#[test]
fn a_request_shorter_than_the_reports_delay_leaves_no_lights_on() {
    let mut day = Day::new();
    day.run(0, 1_000, 1);
    day.run(1_000, 1_100, 2);
    day.run(1_100, 5_000, 1);
    assert_eq!((day.presses.len(), day.lit), (2, false));
}

#[test]
fn a_button_that_works_at_the_last_attempt_has_not_failed() {
    let mut day = Day::new();
    day.works = false;
    day.run(0, 500, 2);
    day.works = true;
    day.run(500, 2_000, 2);
    assert_eq!((day.presses.as_slice(), day.lit), ([0, 800].as_slice(), true));
    assert_eq!(day.bench.status_texts()[1].0, Level::Ok);
}

#[test]
fn a_button_that_does_nothing_is_given_up_and_told() {
    let mut day = Day::new();
    day.works = false;
    day.run(0, 2_000, 2);
    let given_up = (Level::Error, "no response to the hazard button".to_owned());
    assert_eq!(day.bench.status_texts()[1], given_up);
    day.run(2_000, 5_000, 2);
    assert_eq!(day.presses, [0, 800]);
    let mismatch = "commanded on, but the vehicle reports off".to_owned();
    assert_eq!(day.bench.status_texts()[1], (Level::Error, mismatch));
    assert!(!day.down);
}

#[test]
fn a_message_that_can_request_nothing_is_sent_with_authority_only() {
    let mut day = Day::new();
    let turns = |day: &Day| {
        let frames = day.bench.sent.iter().filter(|(_, frame)| frame.id() == CanId::Standard(306));
        frames.map(|(at, frame)| (at / MS, frame.data()[0])).collect::<Vec<_>>()
    };
    day.bench.settle();
    day.bench.pass_until(500 * MS);
    assert!(turns(&day).is_empty(), "no control mode yet");
    day.run(500, 1_000, 1);
    assert!(turns(&day).iter().all(|(ms, turn)| *ms >= 500 && *turn == 1) && turns(&day).len() >= 9);
    day.bench.mode(4);
    day.bench.settle();
    let before = turns(&day).len();
    day.bench.pass_until(1_500 * MS);
    assert_eq!(turns(&day).len(), before);
}
