//! What is refused of lamps, stalks, buttons and several sources.

use crate::pure::config_refusals::{TURN, assert_refused, sound, with};

/// Two flashing lamps instead of a signal for the turn state.
const LAMPS: &str = r#"kind = "lamp"
left_signal = { signal = "BLINK.LEFT", on = [1], off = [0] }
right_signal = { signal = "BLINK.RIGHT", on = [1], off = [0] }
both_on = "hazard"
lamp = { period_ms = 50 }
"#;

/// A stalk instead of a signal for the turn state.
const STALK: &str = r#"kind = "stalk"
signal = "BLINK.TURN"
idle = [0]
left_full = [2]
right_full = [4]
"#;

#[test]
fn lamps_that_frames_cannot_resolve_are_refused() {
    let cases = r#"
- lamp = { period_ms = 50 }
> car.toml:9:15: turn.left_signal: no period for BLINK: the DBC has no GenMsgCycleTime for it; add lamp = { period_ms = … }
- lamp = { period_ms = 50 }
+ lamp = { period_ms = 201 }
> car.toml:12:22: turn.lamp.period_ms: BLINK: a flashing lamp in a message sent every 201ms cannot be distinguished from a dark one; the limit is 200ms; bind a logical or request signal, or a message sent at each change (lamp.sent)
- lamp = { period_ms = 50 }
+ lamp = { period_ms = 50, hold_ms = 500 }
> car.toml:12:36: turn.lamp.hold_ms: BLINK: a hold of 500ms is shorter than the dark time frames may show: at least 810ms; remove hold_ms: the default is long enough
- lamp = { period_ms = 50 }
+ lamp = { period_ms = 50, latency_ms = 20 }
> car.toml:12:26: turn.lamp.latency_ms: unknown key "latency_ms" with sent = "cyclic"; valid keys: sent, period_ms, jitter_ms, hold_ms, confirm_ms, stuck_on_ms, fast_period_ms
- both_on = "hazard"
- lamp = { period_ms = 50 }
+ both_on = "hazzard"
+ lamp = { period_ms = 201 }
> car.toml:11:11: turn.both_on: unknown value "hazzard"; did you mean hazard?
> car.toml:12:22: turn.lamp.period_ms: BLINK: a flashing lamp in a message sent every 201ms cannot be distinguished from a dark one; the limit is 200ms; bind a logical or request signal, or a message sent at each change (lamp.sent)
- lamp = { period_ms = 50 }
+ lamp = { sent = "on_chnge", latency_ms = 20, hold_ms = 0 }
> car.toml:12:17: turn.lamp.sent: unknown value "on_chnge"; did you mean on_change?
> car.toml:12:56: turn.lamp.hold_ms: 0 ms is out of range; give 1 to 3600000 ms
- right_signal = { signal = "BLINK.RIGHT", on = [1], off = [0] }
+ right_signal = { signal = "OTHER.LAMP", on = [1], off = [0] }
  both_on = "hazard"
  lamp = { period_ms = 50 }
+ [message.OTHER]
+ timeout_ms = 100
> car.toml:10:16: turn.right_signal: the lamps are in different messages, so they are not received at the same time; bind two lamps of one message
"#;
    assert_refused(&with("car.toml", TURN, LAMPS), "car.toml", cases);
    let cases = r#"
  right = [2]
+ lamp = { hold_ms = 2000 }
> car.toml:12:1: turn.lamp: unknown key "lamp" without `kind`; valid keys: fitted, disagreement_ms, kind, signal, off, left, right, both, not_available, fault, tap_hold_ms, while_hazard, fault_signal, on_fault
  right = [2]
+ tap_hold_ms = 0
> car.toml:12:15: turn.tap_hold_ms: 0 ms is out of range; give 1 to 3600000 ms
"#;
    assert_refused(&sound(), "car.toml", cases);
    let cases = r#"
- lamp = { period_ms = 50 }
+ lamp = { period_ms = 50 }
+ tap_hold_ms = 2000
> car.toml:13:1: turn.tap_hold_ms: unknown key "tap_hold_ms" with kind = "lamp"; valid keys: …
"#;
    assert_refused(&with("car.toml", TURN, LAMPS), "car.toml", cases);
}

#[test]
fn stalks_and_buttons_that_make_no_sense_are_refused() {
    let cases = r#"
- left_full = [2]
- right_full = [4]
+ left_half = [1]
> car.toml:7:1: turn: missing keys: left_full, right_full; a stalk needs signal, idle, left_full and right_full; left_half and right_half if it has them
- right_full = [4]
+ right_full = [2]
> car.toml:12:15: turn.right_full[1]: 2 is given twice; give each raw value one meaning
  right_full = [4]
+ off = [1]
> car.toml:13:1: turn.off: unknown key "off" with kind = "stalk"; valid keys: fitted, disagreement_ms, kind, signal, idle, left_full, right_full, left_half, right_half, not_available, fault, stalk, while_hazard, fault_signal, on_fault
  right_full = [4]
+ stalk = { comfort_flashes = 3, comfort_ms = 2000 }
> car.toml:13:45: turn.stalk.comfort_ms: comfort_flashes and comfort_ms cannot be combined; keep one of them
"#;
    assert_refused(&with("car.toml", TURN, STALK), "car.toml", cases);
    let cases = r#"
  on = [1]
  off = [0]
+ startup_delay_ms = 100
> car.toml:17:1: hazard.startup_delay_ms: unknown key "startup_delay_ms" with from = "signal"; valid keys: disagreement_ms, from, signal, on, off, not_available, fault, fault_signal, on_fault
- from = "signal"
+ from = "button"
  signal = "BLINK.HAZARD"
  on = [1]
  off = [0]
+ max_gap_ms = 0
> car.toml:17:14: hazard.max_gap_ms: 0 ms is out of range; give 1 to 3600000 ms
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn conditions_that_make_no_sense_are_refused() {
    let cases = r#"
  right = [2]
+ when = { signal = "BLINK.LEFT", on = [1], off = [0] }
> car.toml:12:1: turn.when: unknown key "when" without `kind`; valid keys: …
  [turn]
+ [[turn.source]]
+ name = "a"
+ when = { signal = "BLINK.LEFT", on = [1] }
> car.toml:10:8: turn.source[1].when: missing key: off; a condition needs signal, on and off, so that no value of the signal is guessed
  [turn]
+ [[turn.source]]
+ name = "a"
+ when = { signal = "BLINK.LEFT", on = [1], off = [1] }
> car.toml:10:50: turn.source[1].when.off[1]: 1 is given twice; give each raw value one meaning
  [turn]
+ [[turn.source]]
+ name = "a"
+ when = { signal = "BLINK.LEFT", on = [2], off = [0] }
> car.toml:10:39: turn.source[1].when.on[1]: LEFT cannot hold 2; its raw values are 0 to 1
  [turn]
+ [[turn.source]]
+ name = "a"
+ when = { signal = "BLINK.FLAG", on = [1], off = [0] }
> car.toml:10:19: turn.source[1].when.signal: BLINK has no signal FLAG; it has …
  [turn]
+ [[turn.source]]
+ name = "a"
+ when = { signal = "BLINK.LEFT", on = [1], off = [0], left = [1] }
> car.toml:10:54: turn.source[1].when.left: unknown key "left"; valid keys: signal, on, off, not_available, fault
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn sources_that_contradict_their_list_are_refused() {
    let cases = r#"
  right = [2]
+ disagreement_ms = 100
> car.toml:12:19: turn.disagreement_ms: `disagreement_ms` needs several sources; remove it, or describe the sources in `source`
  right = [2]
+ name = "state"
> car.toml:12:1: turn.name: unknown key "name" without `kind`; valid keys: fitted, disagreement_ms, kind, signal, off, left, right, both, not_available, fault, tap_hold_ms, while_hazard, fault_signal, on_fault
  [turn]
+ [[turn.source]]
+ name = "a"
+ while_hazard = "keep"
> car.toml:10:1: turn.source[1].while_hazard: unknown key "while_hazard" without `kind`; valid keys: name, fallback, when, kind, signal, off, left, right, both, not_available, fault, tap_hold_ms
  [turn]
+ [[turn.source]]
+ name = "a"
+ signal = "BLINK.TURN"
+ off = [0]
+ left = [1]
+ right = [2]
+ [[turn.source]]
+ name = "a"
> car.toml:15:8: turn.source[2].name: another source of the section has this name; give each source a name of its own
- from = "signal"
- signal = "BLINK.HAZARD"
- on = [1]
- off = [0]
+ [[hazard.source]]
+ name = "a"
+ from = "unbound"
> car.toml:15:8: hazard.source[1].from: this is not a source; remove the source, or give this `from` to [hazard] alone
  [hazard]
+ from = "unbound"
+ [[hazard.source]]
+ name = "a"
> car.toml:13:1: hazard.from: unknown key "from" beside `source`; valid keys: disagreement_ms, source, fault_signal, on_fault
"#;
    assert_refused(&sound(), "car.toml", cases);
}
