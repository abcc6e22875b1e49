//! Several sources of one state.

use gateway_base::diagnostics::Level;

use crate::pure::lamp_reports::car::{
    BODY, BOTH, DARK, LAMPS, LEFT, PANEL, STALK, STALK_KEYS, STATE_KEYS, car, lamp_keys,
};
use crate::support::clock::millis;
use crate::support::virtual_gateway::VirtualGateway;

const MESSAGES: &str = "[message.LAMPS]\ntimeout_ms = 500\n[message.BODY]\ntimeout_ms = 500\n";
const BY_LAMPS: &str = "[hazard]\nfrom = \"both_sides\"\n";

fn state_and_lamps(fallback: bool) -> String {
    let lamps = lamp_keys("hazard", "period_ms = 50");
    format!(
        "{MESSAGES}[turn]\ndisagreement_ms = 1500\n[[turn.source]]\nname = \"state\"\n{STATE_KEYS}\
         [[turn.source]]\nname = \"lamps\"\nfallback = {fallback}\n{lamps}{BY_LAMPS}"
    )
}

/// Both messages every 50 ms.
fn drive(
    car: &mut VirtualGateway,
    span: std::ops::Range<u64>,
    body: impl Fn(u64) -> u8,
    lamps: impl Fn(u64) -> u8,
) {
    for ms in span.step_by(50) {
        car.frame(BODY, body(ms), ms);
        car.frame(LAMPS, lamps(ms), ms);
    }
}

fn flashing(lamps: u8) -> impl Fn(u64) -> u8 {
    move |ms| if ms % 700 < 350 { lamps } else { DARK }
}

#[test]
fn sources_that_agree_are_silent_about_each_other() {
    let mut car = car(&state_and_lamps(false));
    drive(&mut car, 0..2100, |_| 0, |_| DARK);
    drive(&mut car, 2100..6000, |_| 1, flashing(LEFT));
    drive(&mut car, 6000..10_000, |_| 0, |_| DARK);
    assert_eq!(car.turn_states(), ["DISABLE", "ENABLE_LEFT", "DISABLE"]);
    assert_eq!(car.warnings().count(), 0, "{:?}", car.changes);
}

#[test]
fn a_lasting_disagreement_is_a_warning_that_names_both() {
    let mut car = car(&state_and_lamps(false));
    drive(&mut car, 0..2100, |_| 0, |_| DARK);
    drive(&mut car, 2100..5000, |_| 2, flashing(LEFT));
    assert_eq!(car.turn_states(), ["DISABLE", "ENABLE_RIGHT"], "the first source counts");
    assert_eq!(car.turn_status(), "WARN sources disagree: state = right is used, but lamps = left");
    let warned = car.warnings().next().unwrap();
    assert_eq!(millis(warned.at), 3600, "later than 1500 ms after the first different frame");
    drive(&mut car, 5000..8000, |_| 2, |ms| flashing(LEFT)(ms) << 2);
    assert_eq!(car.turn_status(), "OK publishing");
}

#[test]
fn a_fallback_replaces_an_unavailable_source() {
    for (fallback, outcome) in [(true, "ENABLE_LEFT"), (false, "stops")] {
        let mut car = car(&state_and_lamps(fallback));
        drive(&mut car, 0..2100, |_| 0, |_| DARK);
        drive(&mut car, 2100..4000, |_| 7, flashing(LEFT));
        assert_eq!(car.turn_reports().last().unwrap().1, outcome);
        let unknown = "unknown: BODY.STATE = 7 means not available";
        assert_eq!(car.was_reported("turn_indicators", Level::Error, unknown), !fallback);
        let fallback_text = format!("fallback lamps: {unknown}");
        assert_eq!(car.was_reported("turn_indicators", Level::Warn, &fallback_text), fallback);
        assert_eq!(car.value("turn_indicators", "source"), if fallback { "lamps" } else { "state" });
        drive(&mut car, 4000..5000, |_| 2, |_| DARK);
        assert_eq!(car.turn_reports().last().unwrap().1, "ENABLE_RIGHT", "back to the first");
    }
}

#[test]
fn lamps_below_a_stalk_show_hazard() {
    let lamps = lamp_keys("hazard", "period_ms = 50");
    let mut car = car(&format!(
        "[message.LAMPS]\ntimeout_ms = 500\n[message.STALK]\ntimeout_ms = 500\n[turn]\n\
         [[turn.source]]\nname = \"stalk\"\n{STALK_KEYS}[[turn.source]]\nname = \"lamps\"\n{lamps}{BY_LAMPS}"
    ));
    let mut both = |span: std::ops::Range<u64>, stalk: u8, lamps: &dyn Fn(u64) -> u8| {
        for ms in span.step_by(50) {
            car.frame(STALK, stalk, ms);
            car.frame(LAMPS, lamps(ms), ms);
        }
    };
    both(0..5000, 0, &|_| DARK);
    both(5000..5500, 2, &flashing(LEFT));
    both(5500..8400, 0, &flashing(LEFT));
    both(8400..12_000, 0, &flashing(BOTH));
    assert_eq!(
        car.turn_states(),
        ["DISABLE", "ENABLE_LEFT", "DISABLE"],
        "hazard overlays the request of the stalk"
    );
    assert_eq!(car.hazard_states(), ["DISABLE", "ENABLE"]);
    assert_eq!(car.warnings().count(), 0, "{:?}", car.changes);
}

#[test]
fn hazard_sources_are_fused_as_well() {
    let lamps = lamp_keys("hazard", "period_ms = 50");
    let mut car = car(&format!(
        "[message.LAMPS]\ntimeout_ms = 500\n[message.PANEL]\ntimeout_ms = 500\n[turn]\n{lamps}\
         [hazard]\n[[hazard.source]]\nname = \"lamps\"\nfrom = \"both_sides\"\n\
         [[hazard.source]]\nname = \"button\"\nfallback = true\nfrom = \"button\"\n\
         signal = \"PANEL.BUTTON\"\non = [1]\noff = [0]\n"
    ));
    for ms in (0..3000).step_by(50) {
        car.frame(LAMPS, DARK, ms);
        car.frame(PANEL, u8::from(ms == 2000), ms);
    }
    assert_eq!(car.hazard_states(), ["DISABLE"]);
    for ms in (3000..4000).step_by(50) {
        car.frame(LAMPS, DARK, ms);
        car.frame(PANEL, 0, ms);
    }
    assert_eq!(car.hazard_status(), "WARN sources disagree: lamps = off is used, but button = on");
    // Without lamps the button stands in.
    car.frames(PANEL, 50, 4000..5000, |_| 0);
    assert_eq!(car.hazard_states(), ["DISABLE", "ENABLE"]);
    assert_eq!(
        car.hazard_status(),
        "WARN fallback button: unknown: LAMPS is stale, silent for more than 500 ms"
    );
}
