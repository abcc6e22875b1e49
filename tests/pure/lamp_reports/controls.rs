//! Stalks and buttons that spring back.

use crate::pure::lamp_reports::car::{BODY, NOT_VISIBLE, PANEL, STALK, STALK_KEYS, STATE_KEYS, car};
use crate::support::virtual_gateway::VirtualGateway;

const IDLE: u8 = 0;
const LEFT_HALF: u8 = 1;
const LEFT_FULL: u8 = 2;
const RIGHT_HALF: u8 = 3;
const RIGHT_FULL: u8 = 4;

fn stalk_car(options: &str) -> VirtualGateway {
    let lights = format!(
        "[message.STALK]\ntimeout_ms = 500\n[turn]\n{STALK_KEYS}stalk = {{ {options} }}\n{NOT_VISIBLE}"
    );
    let mut car = car(&lights);
    car.frames(STALK, 50, 0..5000, |_| IDLE);
    assert_eq!(car.turn_reports(), [(4000, "DISABLE")], "settled");
    car
}

/// Holds the stalk there from `ms` for 200 ms, then waits until `until`.
fn press(car: &mut VirtualGateway, position: u8, ms: u64, until: u64) {
    car.frames(STALK, 50, ms..ms + 200, |_| position);
    car.frames(STALK, 50, ms + 200..until, |_| IDLE);
}

#[test]
fn a_stalk_is_unknown_until_it_was_observed() {
    let mut car = car(&format!("[message.STALK]\ntimeout_ms = 500\n[turn]\n{STALK_KEYS}{NOT_VISIBLE}"));
    car.frame(STALK, IDLE, 0);
    assert_eq!(
        car.turn_status(),
        "WARN starting: observing STALK.POSITION, which may have been pressed before"
    );
}

#[test]
fn a_tap_blinks_for_the_comfort_time_and_ends_by_itself() {
    let mut car = stalk_car("comfort_flashes = 3");
    press(&mut car, LEFT_HALF, 5000, 8000);
    assert_eq!(
        car.turn_reports()[1..],
        [(5000, "ENABLE_LEFT"), (7000, "DISABLE")],
        "three flashes at 90 a minute"
    );
    let mut car = stalk_car("comfort_ms = 2500");
    press(&mut car, RIGHT_HALF, 5000, 8000);
    assert_eq!(car.turn_reports()[1..], [(5000, "ENABLE_RIGHT"), (7500, "DISABLE")]);
}

#[test]
fn a_full_press_lasts_until_a_tap_against_it_or_again() {
    for cancel in [RIGHT_HALF, LEFT_FULL] {
        let mut car = stalk_car("");
        press(&mut car, LEFT_FULL, 5000, 20_000);
        press(&mut car, cancel, 20_000, 25_000);
        assert_eq!(car.turn_reports()[1..], [(5000, "ENABLE_LEFT"), (20_000, "DISABLE")], "{cancel}");
    }
}

#[test]
fn the_profile_decides_what_presses_against_and_again_do() {
    let mut car = stalk_car("opposite_half = \"switches\", opposite_full = \"cancels\", repeat = \"keeps\"");
    press(&mut car, LEFT_FULL, 5000, 6000);
    press(&mut car, LEFT_FULL, 6000, 7000);
    press(&mut car, RIGHT_FULL, 7000, 8000);
    press(&mut car, LEFT_FULL, 8000, 9000);
    press(&mut car, RIGHT_HALF, 9000, 12_000);
    let changes = [
        (5000, "ENABLE_LEFT"),
        (7000, "DISABLE"),
        (8000, "ENABLE_LEFT"),
        (9000, "ENABLE_RIGHT"),
        (11_000, "DISABLE"),
    ];
    assert_eq!(car.turn_reports()[1..], changes);
}

#[test]
fn a_full_press_ends_after_its_longest_time() {
    let mut car = stalk_car("max_on_ms = 30000");
    press(&mut car, RIGHT_FULL, 5000, 40_000);
    assert_eq!(
        car.turn_reports()[1..],
        [(5000, "ENABLE_RIGHT"), (35_200, "DISABLE")],
        "30 s after the release"
    );
}

#[test]
fn a_silent_stalk_is_unknown_and_then_observed_again() {
    let mut car = stalk_car("");
    press(&mut car, LEFT_FULL, 5000, 6000);
    car.frames(STALK, 50, 7000..12_000, |_| IDLE);
    assert_eq!(car.turn_reports()[1..], [(5000, "ENABLE_LEFT"), (6450, "stops"), (11_000, "DISABLE")]);
}

#[test]
fn each_press_of_the_button_toggles_the_hazard_lights() {
    let button = "signal = \"PANEL.BUTTON\"\non = [1]\noff = [0]\nnot_available = [3]\n";
    let lights = format!(
        "[message.PANEL]\ntimeout_ms = 500\n[turn]\nfitted = false\n[hazard]\nfrom = \"button\"\n{button}"
    );
    let mut seldom = car(&lights);
    seldom.frames(PANEL, 300, 0..1500, |_| 0);
    assert_eq!(seldom.hazard_reports(), [(1000, "DISABLE")], "observed for a second, between two frames");
    let mut car = car(&lights);
    car.frame(PANEL, 0, 0);
    assert_eq!(
        car.hazard_status(),
        "WARN starting: observing PANEL.BUTTON, which may have been pressed before"
    );
    let pressed = |ms| u8::from((2000..2500).contains(&ms) || (4000..4300).contains(&ms));
    car.frames(PANEL, 100, 100..6000, pressed);
    assert_eq!(car.hazard_reports(), [(1000, "DISABLE"), (2000, "ENABLE"), (4000, "DISABLE")]);
    car.frame(PANEL, 3, 6000);
    assert_eq!(car.hazard_status(), "ERROR unknown: PANEL.BUTTON = 3 means not available");
}

#[test]
fn a_tap_of_a_lever_is_held_where_the_profile_says_so() {
    for (key, states) in [
        ("", ["DISABLE", "ENABLE_LEFT", "DISABLE", "ENABLE_RIGHT", "DISABLE"]),
        ("tap_hold_ms = 2000\n", ["DISABLE", "ENABLE_LEFT", "DISABLE", "ENABLE_RIGHT", "DISABLE"]),
    ] {
        let mut car =
            car(&format!("[message.BODY]\ntimeout_ms = 500\n[turn]\n{STATE_KEYS}{key}{NOT_VISIBLE}"));
        // Left for 300 ms, and right for 3000 ms.
        car.frames(BODY, 50, 0..12_000, |ms| match ms {
            1000..1300 => 1,
            5000..8000 => 2,
            _ => 0,
        });
        assert_eq!(car.turn_states(), states);
        let times: Vec<_> = car.turn_reports().into_iter().map(|(ms, _)| ms).collect();
        let left_ends = if key.is_empty() { 1300 } else { 3000 };
        assert_eq!(times, [0, 1000, left_ends, 5000, 8000], "{key}");
    }
}
