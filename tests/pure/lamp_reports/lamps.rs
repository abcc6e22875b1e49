//! Lamps that blink, in messages of every speed.

use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};

use crate::pure::lamp_reports::car::{
    ALIVE, BOTH, DARK, LAMPS, LEFT, NOT_VISIBLE, RIGHT, car, lamp_keys, settings,
};
use crate::support::virtual_gateway::VirtualGateway;

const OBSERVING: &str = "ERROR unknown: observing the lamps LAMPS.LEFT and LAMPS.RIGHT";
const STARTING: &str = "WARN starting: observing the lamps LAMPS.LEFT and LAMPS.RIGHT";
const BY_LAMPS: &str = "[hazard]\nfrom = \"both_sides\"\n";

fn lights(period: u64, both_on: &str, hazard: &str) -> String {
    let turn = lamp_keys(both_on, &format!("period_ms = {period}"));
    format!("[message.LAMPS]\ntimeout_ms = {}\n[turn]\n{turn}{hazard}", 5 * period)
}

/// A 50 ms message; hazard from both lamps. Dark lamps were observed until 2 s.
fn observed() -> VirtualGateway {
    let mut car = car(&lights(50, "hazard", BY_LAMPS));
    car.frames(LAMPS, 50, 0..2000, |_| DARK);
    assert_eq!((car.turn_states(), car.hazard_states()), (vec!["DISABLE"], vec!["DISABLE"]));
    car
}

/// Whether a lamp is lit that flashes since `start` in cycles of `cycle` ms, `share` per cent lit.
fn flash(ms: u64, start: u64, cycle: u64, share: u64) -> bool {
    ms >= start && (ms - start) % cycle < cycle * share / 100
}

/// Repeatable disorder: 0 to `bound` - 1.
fn dice(seed: u64, bound: u64) -> u64 {
    let mixed = (seed ^ 0x9E37_79B9_7F4A_7C15).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((mixed ^ (mixed >> 29)).wrapping_mul(0x94D0_49BB_1331_11EB) >> 33) % bound
}

/// At every legal rate and frame period, flashing beginning in these phases of 5.
fn flashing_lamps_are_one_activation(phases: std::ops::Range<u64>) {
    for period in [20, 30, 50, 70, 100, 120, 150, 200] {
        let settings = settings(&lights(period, "hazard", BY_LAMPS));
        for per_minute in [60, 90, 120] {
            for share in [30, 50, 75] {
                // Shorter flashes than the frames' distance can stay undetected: `check` warns of it.
                let cycle = 60_000 / per_minute;
                if period > 136 && cycle * share / 100 <= period * 11 / 10 {
                    continue;
                }
                for phase in phases.clone() {
                    let name = format!("{per_minute}/min {share} %, {period} ms, phase {phase}");
                    let mut car = VirtualGateway::new(settings.clone());
                    let start = 4000 + phase * cycle / 5;
                    let end = 24_000;
                    let lit = |ms| ms < end && flash(ms, start, cycle, share);
                    let mut nominal = 0;
                    while nominal < 30_000 {
                        // Each frame up to a tenth of a period late.
                        let ms = nominal + dice(nominal ^ phase, period / 10 + 1);
                        car.frame(LAMPS, if lit(ms) { LEFT } else { DARK }, ms);
                        nominal += period;
                    }
                    assert_eq!(
                        car.turn_states(),
                        ["DISABLE", "ENABLE_LEFT", "DISABLE"],
                        "{name}: {:?}",
                        car.turn_reports()
                    );
                    assert_eq!(car.hazard_states(), ["DISABLE"], "{name}");
                    let (on, off) = (car.turn_reports()[1].0, car.turn_reports()[2].0);
                    assert!(on < start + cycle + 2 * period, "{name}: on at {on}");
                    assert!((end - cycle..end + 2000).contains(&off), "{name}: off at {off}");
                }
            }
        }
    }
}

#[test]
fn flashing_lamps_are_one_activation_at_every_legal_rate_and_frame_period() {
    flashing_lamps_are_one_activation(2..3);
}

mod slow {
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn flashing_lamps_are_one_activation_in_every_phase() {
        super::flashing_lamps_are_one_activation(0..5);
    }
}

#[test]
fn dark_lamps_are_unknown_until_they_were_observed_for_a_hold() {
    let mut car = car(&lights(50, "hazard", BY_LAMPS));
    car.frame(LAMPS, DARK, 10);
    for task in ["turn_indicators", "hazard_lights"] {
        assert_eq!(car.status_text(task), STARTING);
    }
    car.frames(LAMPS, 50, 60..1000, |_| DARK);
    // 700 ms of legal darkness and three times 55 ms.
    assert_eq!((car.turn_reports(), car.hazard_reports()), (vec![(875, "DISABLE")], vec![(875, "DISABLE")]));
}

#[test]
fn a_tap_of_three_flashes_is_one_activation() {
    let mut car = observed();
    car.frames(LAMPS, 50, 2000..6000, |ms| if ms < 4000 && flash(ms, 2000, 667, 50) { RIGHT } else { DARK });
    assert_eq!(car.turn_states(), ["DISABLE", "ENABLE_RIGHT", "DISABLE"]);
    assert_eq!(car.turn_reports()[1].0, 2000, "with the first lit frame");
}

#[test]
fn other_messages_do_not_extend_the_hold_of_a_lamp() {
    let mut car = observed();
    car.frame(LAMPS, LEFT, 2000);
    car.frame(ALIVE, 0, 2049);
    car.frames(LAMPS, 50, 2050..4000, |_| DARK);
    assert_eq!(
        car.turn_reports()[1..],
        [(2000, "ENABLE_LEFT"), (2865, "DISABLE")],
        "a hold after the lit frame"
    );
}

#[test]
fn a_change_of_sides_is_not_hazard() {
    let mut car = observed();
    car.frames(LAMPS, 50, 2000..6000, |ms| match flash(ms, 2000, 667, 50) {
        true if ms < 4000 => LEFT,
        true if ms < 4050 => BOTH,
        true => RIGHT,
        false => DARK,
    });
    car.frames(LAMPS, 50, 6000..8000, |_| DARK);
    assert_eq!(car.turn_states(), ["DISABLE", "ENABLE_LEFT", "ENABLE_RIGHT", "DISABLE"]);
    assert_eq!(car.hazard_states(), ["DISABLE"]);
}

#[test]
fn both_lamps_are_hazard_and_not_a_direction() {
    let mut car = observed();
    car.frames(LAMPS, 50, 2000..6000, |ms| if flash(ms, 2000, 667, 50) { BOTH } else { DARK });
    car.frames(LAMPS, 50, 6000..8000, |_| DARK);
    assert_eq!(car.turn_states(), ["DISABLE"]);
    assert_eq!(car.hazard_states(), ["DISABLE", "ENABLE", "DISABLE"]);
    assert_eq!(car.hazard_reports()[1].0, 2100, "confirmed");
}

#[test]
fn both_lamps_are_invalid_where_the_vehicle_never_shows_them() {
    let mut car = car(&lights(50, "undefined", NOT_VISIBLE));
    car.frames(LAMPS, 50, 0..2000, |_| DARK);
    car.frames(LAMPS, 50, 2000..2200, |_| BOTH);
    assert_eq!(car.turn_states(), ["DISABLE", "stops"]);
    assert_eq!(car.turn_status(), "ERROR invalid: LAMPS.LEFT = 1 and LAMPS.RIGHT = 1 at once is not defined");
}

#[test]
fn a_doubled_rate_is_a_warning_and_the_report_continues() {
    let mut car = observed();
    car.frames(LAMPS, 50, 2000..6000, |ms| if flash(ms, 2000, 350, 50) { LEFT } else { DARK });
    assert_eq!(car.turn_status(), "WARN bulb failure: LAMPS.LEFT flashes too fast");
    assert_eq!(car.turn_states(), ["DISABLE", "ENABLE_LEFT"]);
    assert_eq!(car.value("turn_indicators", "invalid_count"), "0");
    assert_eq!(car.value("turn_indicators", "hardware_fault_count"), "0");
    let warnings = car.warnings().count();
    assert_eq!(warnings, 1, "reported once: {:?}", car.changes);
}

#[test]
fn a_lamp_that_does_not_flash_is_a_warning_until_it_does() {
    let mut car = observed();
    car.frames(LAMPS, 50, 2000..4000, |_| RIGHT);
    assert_eq!(car.turn_status(), "WARN LAMPS.RIGHT is lit and does not flash");
    car.frame(LAMPS, DARK, 4000);
    assert_eq!(car.turn_status(), "OK publishing");
    assert_eq!(car.turn_states(), ["DISABLE", "ENABLE_RIGHT"]);
}

#[test]
fn emergency_flashing_is_hazard_with_a_warning() {
    let mut car = car(&lights(20, "hazard", BY_LAMPS));
    car.frames(LAMPS, 20, 0..2000, |_| DARK);
    car.frames(LAMPS, 20, 2000..5000, |ms| if flash(ms, 2000, 250, 50) { BOTH } else { DARK });
    assert_eq!(car.hazard_states(), ["DISABLE", "ENABLE"]);
    assert_eq!(car.turn_status(), "WARN emergency flashing: LAMPS.LEFT and LAMPS.RIGHT flash too fast");
}

#[test]
fn values_without_a_lamp_state_and_silence_stop_the_report() {
    for (byte, text) in [
        (0b1100, "ERROR unknown: LAMPS.RIGHT = 3 means not available"),
        (0b0010, "ERROR hardware fault: LAMPS.LEFT = 2 means fault"),
    ] {
        let mut car = observed();
        car.frame(LAMPS, byte, 2000);
        assert_eq!(car.turn_status(), text);
        assert_eq!(car.turn_states(), ["DISABLE", "stops"]);
        car.frame(LAMPS, DARK, 2050);
        assert_eq!(car.turn_status(), OBSERVING, "blind meanwhile");
    }
    let mut car = observed();
    car.frames(LAMPS, 50, 2000..2200, |_| LEFT);
    car.pass_until(3000);
    assert_eq!(car.turn_status(), "ERROR unknown: LAMPS is stale, silent for more than 250 ms");
    assert_eq!(car.turn_reports().last(), Some(&(2400, "stops")));
    car.frame(LAMPS, DARK, 3500);
    assert_eq!(car.turn_status(), OBSERVING);
}

#[test]
fn lamps_that_were_lit_before_a_lost_link_do_not_count_after_it() {
    for lit in [LEFT, BOTH] {
        let mut car = observed();
        car.frames(LAMPS, 50, 2000..2200, |_| lit);
        for state in [LinkState::Down, LinkState::Up] {
            car.handle(CanInput::Link { bus: BusIndex(0), state });
        }
        // Within the hold of the last light.
        car.frames(LAMPS, 50, 2250..2900, |_| DARK);
        assert_eq!(car.turn_states().last(), Some(&"stops"), "{:?}", car.turn_reports());
        assert_eq!(car.turn_status(), OBSERVING);
        car.frames(LAMPS, 50, 2900..3300, |_| DARK);
        assert_eq!(car.turn_reports().last(), Some(&(2250 + 865, "DISABLE")));
    }
}

#[test]
fn lamps_sent_on_change_only_stay_as_they_are() {
    let turn = lamp_keys("hazard", "sent = \"on_change\", latency_ms = 20");
    let mut car = car(&format!("[message.LAMPS]\ntiming = \"event\"\n[turn]\n{turn}{BY_LAMPS}"));
    let alive = |car: &mut VirtualGateway, span: std::ops::Range<u64>| car.frames(ALIVE, 100, span, |_| 0);
    alive(&mut car, 0..10);
    car.frame(LAMPS, DARK, 10);
    alive(&mut car, 100..2000);
    for flash in 0..6 {
        let start = 2000 + flash * 1000;
        car.frame(LAMPS, LEFT, start);
        alive(&mut car, start + 50..start + 300);
        car.frame(LAMPS, DARK, start + 300);
        alive(&mut car, start + 350..start + 1000);
    }
    alive(&mut car, 8000..9000);
    assert_eq!(car.turn_states(), ["DISABLE", "ENABLE_LEFT", "DISABLE"], "{:?}", car.turn_reports());
    assert_eq!(car.turn_reports()[2].0, 7300 + 740, "a hold after the last light");
}
