//! Sources that apply while a flag says so: two banks of lamps in one message.

use proptest::prelude::*;

use crate::pure::lamp_reports::car::{BANKS, FLAG, LEFT, NOT_VISIBLE, STALK, STALK_KEYS, car};
use crate::support::property::for_all;
use crate::support::virtual_gateway::VirtualGateway;

const MESSAGES: &str = "[message.BANKS]\ntimeout_ms = 500\n[message.FLAG]\ntimeout_ms = 500\n";

/// A source of steady signals in one bank, used while the flag is `on` of `on` and `off`.
fn bank(name: &str, prefix: &str, [on, off]: [u8; 2]) -> String {
    let side = |side: &str| format!("{{ signal = \"BANKS.{prefix}{side}\", on = [1], off = [0] }}");
    format!(
        "[[turn.source]]\nname = \"{name}\"\n\
         when = {{ signal = \"FLAG.ALT\", on = [{on}], off = [{off}], not_available = [3] }}\n\
         left_signal = {}\nright_signal = {}\nboth_on = \"hazard\"\n",
        side("LEFT"),
        side("RIGHT")
    )
}

fn two_banks(hazard: &str) -> String {
    let (first, second) = (bank("main", "", [0, 1]), bank("alternative", "ALT_", [1, 0]));
    format!("{MESSAGES}[turn]\n{first}{second}{hazard}")
}

/// Bits of the first and of the second bank, and the flag, every 50 ms.
fn drive(car: &mut VirtualGateway, span: std::ops::Range<u64>, [main, alternative, flag]: [u8; 3]) {
    for ms in span.step_by(50) {
        car.frame(FLAG, flag, ms);
        car.frame(BANKS, main | alternative << 4, ms);
    }
}

#[test]
fn the_flag_chooses_the_bank_and_the_other_one_is_not_looked_at() {
    let mut car = car(&two_banks("[hazard]\nfrom = \"both_sides\"\n"));
    drive(&mut car, 0..1000, [LEFT, 0b0100, 0]);
    assert_eq!(car.turn_states(), ["ENABLE_LEFT"]);
    assert_eq!(car.value("turn_indicators", "source"), "main");
    drive(&mut car, 1000..3000, [LEFT, 0b0100, 1]);
    assert_eq!(car.turn_states(), ["ENABLE_LEFT", "ENABLE_RIGHT"]);
    assert_eq!(car.value("turn_indicators", "source"), "alternative");
    drive(&mut car, 3000..4000, [LEFT, 0b0101, 1]);
    assert_eq!(car.hazard_states(), ["DISABLE", "ENABLE"]);
    assert_eq!(car.hazard_status(), "OK publishing");
}

#[test]
fn an_unknown_flag_makes_the_state_unknown_whatever_the_banks_show() {
    for (flag, text) in [
        (2, "ERROR invalid: FLAG.ALT = 2 is not a defined value"),
        (3, "ERROR unknown: FLAG.ALT = 3 means not available"),
    ] {
        let mut car = car(&two_banks(NOT_VISIBLE));
        drive(&mut car, 0..1000, [LEFT, LEFT, 0]);
        drive(&mut car, 1000..2000, [LEFT, LEFT, flag]);
        assert_eq!(car.turn_reports().last().unwrap().1, "stops", "{text}");
        assert_eq!(car.turn_status(), text);
    }
    let mut car = car(&two_banks(NOT_VISIBLE));
    drive(&mut car, 0..1000, [LEFT, LEFT, 0]);
    car.frames(BANKS, 50, 1000..2000, |_| LEFT);
    assert_eq!(car.turn_reports().last().unwrap().1, "stops");
    assert_eq!(car.turn_status(), "ERROR unknown: FLAG is stale, silent for more than 500 ms");
}

#[test]
fn no_source_applies_when_every_condition_is_off() {
    let mut car = car(&format!("{MESSAGES}[turn]\n{}{NOT_VISIBLE}", bank("main", "", [0, 1])));
    drive(&mut car, 0..1000, [LEFT, 0, 1]);
    assert!(car.turn_states().is_empty(), "{:?}", car.turn_states());
    assert_eq!(car.turn_status(), "ERROR unknown: no source applies while FLAG.ALT = 1");
}

#[test]
fn a_source_that_does_not_apply_needs_no_fallback_and_contradicts_nobody() {
    let mut car = car(&format!(
        "{MESSAGES}[message.STALK]\ntimeout_ms = 500\n[turn]\ndisagreement_ms = 500\n{}\
         [[turn.source]]\nname = \"stalk\"\n{STALK_KEYS}{NOT_VISIBLE}",
        bank("main", "", [0, 1])
    ));
    for ms in (0..6000).step_by(50) {
        car.frame(STALK, 0, ms);
        car.frame(FLAG, 1, ms);
        car.frame(BANKS, LEFT, ms);
    }
    assert_eq!(car.turn_states(), ["DISABLE"], "by the stalk, which is no fallback");
    assert_eq!(car.turn_status(), "OK publishing");
    drive(&mut car, 6000..6400, [LEFT, 0, 0]);
    assert_eq!(car.turn_states(), ["DISABLE", "ENABLE_LEFT"]);
}

#[test]
fn the_report_is_that_of_the_bank_that_the_flag_names_or_none() {
    let step =
        (0..4_u8, prop::sample::select(vec![0, 1, 4, 5_u8]), prop::sample::select(vec![0, 1, 4, 5_u8]));
    for_all(60, prop::collection::vec(step, 1..20), |steps| {
        let mut car = car(&two_banks(NOT_VISIBLE));
        for (index, (flag, main, alternative)) in (0_u64..).zip(steps) {
            let ms = 1000 + index * 300;
            drive(&mut car, ms..ms + 200, [main, alternative, flag]);
            let bits = [main, alternative].get(usize::from(flag)).copied();
            let expected = bits.map_or("stops", |bits| match bits {
                1 => "ENABLE_LEFT",
                4 => "ENABLE_RIGHT",
                _ => "DISABLE",
            });
            let reported = car.turn_reports().last().map_or("stops", |(_, report)| *report);
            prop_assert_eq!(reported, expected, "flag {}, {:04b} {:04b}", flag, main, alternative);
        }
        Ok(())
    });
}
