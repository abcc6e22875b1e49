//! What is refused in a vehicle profile.

use crate::pure::config_refusals::{HAZARD, TURN, assert_refused, sound, with};

/// A left and a right signal instead of one for the turn state.
const PAIR: &str = r#"left_signal = { signal = "BLINK.LEFT", on = [1], off = [0] }
right_signal = { signal = "BLINK.RIGHT", on = [1], off = [0] }
both_on = "undefined"
"#;

/// A hazard signal that gives reasons.
const REASON: &str = r#"from = "reason"
signal = "BLINK.HAZARD"
off = [0]
reasons = { a = [1] }
"#;

#[test]
fn broken_keys_and_files_are_refused() {
    let cases = r#"
- name = "Car"
> car.toml:1:1: missing key: name; see config/gateway.toml
  left = [1]
+ lefts = [1]
> car.toml:11:1: turn.lefts: unknown key "lefts" without `kind`; valid keys: fitted, disagreement_ms, kind, signal, off, left, right, both, not_available, fault, tap_hold_ms, while_hazard, fault_signal, on_fault
- left = [1]
+ left = 1
> car.toml:10:8: turn.left: expected a list, found 1; give a list of raw values, e.g. [0, "4..=7"]
- left = [1]
+ left = [1.5]
> car.toml:10:9: turn.left[1]: expected a raw value such as 3, or a range such as "4..=7", found 1.5; see config/gateway.toml
- left = [1]
+ left = ["7..=4"]
> car.toml:10:9: turn.left[1]: expected a raw value such as 3, or a range such as "4..=7", found the text "7..=4"; see config/gateway.toml
- dbc = "car.dbc"
+ dbc = "cart.dbc"
> car.toml:3:7: bus.body.dbc: cart.dbc: there is no such file; give the DBC's path relative to this file
  dbc = "car.dbc"
+ alive_timeout_ms = 0
> car.toml:4:20: bus.body.alive_timeout_ms: 0 ms is out of range; give 1 to 3600000 ms
  dbc = "car.dbc"
+ heartbeat_messages = ["ENGINE"]
> car.toml:4:23: bus.body.heartbeat_messages[1]: car.dbc has no message ENGINE; name a message of the DBC
- timeout_ms = 500
+ timeout_ms = 3600001
> car.toml:5:14: message.BLINK.timeout_ms: 3600001 ms is out of range; give 1 to 3600000 ms
- timeout_ms = 500
+ timing = "often"
> car.toml:5:10: message.BLINK.timing: unknown value "often"; give one of cyclic, event, event_cyclic
- [message.BLINK]
- timeout_ms = 500
> car.toml:1:1: no timeout for BLINK: the DBC has no GenMsgCycleTime for it; add [message.BLINK] timeout_ms; `check LOG --fix` proposes one from a recording
- timeout_ms = 500
> car.toml:4:10: message.BLINK: no timeout for BLINK: the DBC has no GenMsgCycleTime for it; add [message.BLINK] timeout_ms; `check LOG --fix` proposes one from a recording
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn messages_without_a_usable_timing_are_refused() {
    let cases = r#"
- timeout_ms = 500
+ timing = "event"
> car.toml:4:10: message.BLINK: an event message is valid while its bus is alive, and no message proves this bus alive; name cyclic messages of the DBC in heartbeat_messages of the bus
+ heartbeat_messages = ["CLIMATE"]
  [message.BLINK]
+ timing = "event"
> car.toml:7:14: message.BLINK.timeout_ms: an event message has no timeout; remove it, or use timing = "event_cyclic" for one that is slowly repeated
  dbc = "car.dbc"
+ [message.CLIMATE]
+ timeout_ms = 100
> car.toml:4:10: message.CLIMATE: no signal of this message is bound; remove the section, or bind one
  [message.BLINK]
+ bus = "boot"
> car.toml:5:7: message.BLINK.bus: the profile has no bus boot; it has body
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn signals_that_cannot_be_bound_are_refused() {
    let cases = r#"
- signal = "BLINK.TURN"
+ signal = "BLINK"
> car.toml:8:10: turn.signal: "BLINK" is not a signal; write MESSAGE.SIGNAL
- signal = "BLINK.TURN"
+ signal = "WINK.TURN"
> car.toml:8:10: turn.signal: car.dbc has no message WINK; name a message of the DBC
- signal = "BLINK.TURN"
+ signal = "BLINK.TURNS"
> car.toml:8:10: turn.signal: BLINK has no signal TURNS; did you mean TURN?
- signal = "BLINK.TURN"
+ signal = "boot:BLINK.TURN"
> car.toml:8:10: turn.signal: the profile has no bus boot; it has body
- signal = "BLINK.TURN"
+ signal = "BLINK.TORN"
> car.toml:8:10: turn.signal: BLINK has no signal TORN; rejected at car.dbc:6: needs 5 bytes, the message has 4; mend that line of the DBC, or bind another signal
- signal = "BLINK.TURN"
+ signal = "LAMPS.TURN"
> car.toml:8:10: turn.signal: car.dbc has no message LAMPS; rejected at car.dbc:15: …; mend that line of the DBC, or name another message
- signal = "BLINK.TURN"
+ signal = "CLIMATE.HEAT"
> car.toml:8:10: turn.signal: HEAT is a floating-point signal; bind a signal with integer raw values
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn values_that_contradict_are_refused() {
    let cases = r#"
- left = [1]
+ left = [0]
> car.toml:10:9: turn.left[1]: 0 is given twice; give each raw value one meaning
- right = [2]
+ right = ["1..=3"]
> car.toml:11:10: turn.right[1]: 1..=3 overlaps 1; give each raw value one meaning
- left = [1]
+ left = [1, 1]
> car.toml:10:12: turn.left[2]: 1 is given twice; give each raw value one meaning
- left = [1]
+ left = [1, 16]
> car.toml:10:12: turn.left[2]: TURN cannot hold 16; its raw values are 0 to 15
- left = [1]
+ left = [-1]
> car.toml:10:9: turn.left[1]: TURN cannot hold -1; its raw values are 0 to 15
- left = [1]
+ left = []
> car.toml:10:8: turn.left: no value is given; give at least one raw value
  right = [2]
+ fault = [2]
> car.toml:12:10: turn.fault[1]: 2 is given twice; give each raw value one meaning
  on = [1]
+ not_available = [1]
> car.toml:16:18: hazard.not_available[1]: 1 is given twice; give each raw value one meaning
- on = [1]
+ on = [1, "3..=4"]
> car.toml:15:10: hazard.on[2]: HAZARD cannot hold 3..=4; its raw values are 0 to 3
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn turn_forms_that_do_not_fit_together_are_refused() {
    let cases = r#"
- left_signal = { signal = "BLINK.LEFT", on = [1], off = [0] }
- right_signal = { signal = "BLINK.RIGHT", on = [1], off = [0] }
- both_on = "undefined"
> car.toml:7:1: turn: no signal is bound for the turn state; give `signal` with off, left and right, or `left_signal`, `right_signal` and `both_on`, or `kind`, or [[turn.source]], or `fitted = false`
- right_signal = { signal = "BLINK.RIGHT", on = [1], off = [0] }
- both_on = "undefined"
> car.toml:7:1: turn: missing keys: right_signal, both_on; a pair of turn signals needs left_signal, right_signal and both_on
- right_signal = { signal = "BLINK.RIGHT", on = [1], off = [0] }
+ right_signal = { signal = "BLINK.LEFT", on = [1], off = [0] }
> car.toml:9:16: turn.right_signal: left and right are the same signal; bind one signal for each side
- both_on = "undefined"
+ both_on = "off"
> car.toml:10:11: turn.both_on: unknown value "off"; give one of hazard, undefined
"#;
    assert_refused(&with("car.toml", TURN, PAIR), "car.toml", cases);
    let cases = r#"
  right = [2]
+ left_signal = { signal = "BLINK.LEFT", on = [1], off = [0] }
> car.toml:12:15: turn.left_signal: an enumerated signal cannot be combined with a pair of signals; give `signal` with off, left and right, or `left_signal`, `right_signal` and `both_on`, or `kind`, or [[turn.source]], or `fitted = false`
- off = [0]
- left = [1]
- right = [2]
> car.toml:7:1: turn: missing keys: off, left, right; an enumerated turn signal needs signal, off, left and right
"#;
    assert_refused(&sound(), "car.toml", cases);
    let cases = r#"
  left = [1]
+ fitted = false
> car.toml:8:1: turn.signal: unknown key "signal" with fitted = false; valid keys: fitted, while_hazard, fault_signal, on_fault
> car.toml:9:1: turn.off: unknown key "off" with fitted = false; valid keys: fitted, while_hazard, fault_signal, on_fault
> car.toml:10:1: turn.left: unknown key "left" with fitted = false; valid keys: fitted, while_hazard, fault_signal, on_fault
> car.toml:12:1: turn.right: unknown key "right" with fitted = false; valid keys: fitted, while_hazard, fault_signal, on_fault
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn hazard_forms_that_do_not_fit_together_are_refused() {
    let cases = r#"
- from = "signal"
+ from = "lamps"
> car.toml:13:8: hazard.from: unknown value "lamps"; give one of signal, reason, both_sides, button, not_fitted, unbound
- from = "signal"
> car.toml:12:1: hazard: missing key: from; see config/gateway.toml
- on = [1]
> car.toml:12:1: hazard: missing key: on; a hazard signal needs signal, on and off
- from = "signal"
- signal = "BLINK.HAZARD"
- on = [1]
- off = [0]
+ from = "both_sides"
> car.toml:13:8: hazard.from: the turn binding cannot show both sides on; give [turn] `both` values or `both_on = "hazard"`, or change `from`
- from = "signal"
+ from = "unbound"
  signal = "BLINK.HAZARD"
- on = [1]
- off = [0]
> car.toml:14:1: hazard.signal: unknown key "signal" without a source; valid keys: from, fault_signal, on_fault
- from = "signal"
- signal = "BLINK.HAZARD"
- on = [1]
- off = [0]
+ from = "not_fitted"
+ reasons = { button = [1] }
> car.toml:14:1: hazard.reasons: unknown key "reasons" without a source; valid keys: from, fault_signal, on_fault
+ both = [3]
+ while_hazard = "keep"
  [hazard]
- from = "signal"
- signal = "BLINK.HAZARD"
- on = [1]
- off = [0]
+ from = "both_sides"
> car.toml:13:16: turn.while_hazard: hazard comes from both sides, so there is no turn state to keep; use while_hazard = "disable"
  on = [1]
+ on_fault = "stop"
> car.toml:16:12: hazard.on_fault: unknown value "stop"; give one of report, withhold
  on = [1]
  off = [0]
+ [[hazard.fault_signal]]
+ signal = "BLINK.BULB"
+ on = [1]
+ off = [0]
+ text = ""
> car.toml:18:10: hazard.fault_signal[1].signal: BLINK has no signal BULB; it has TURN, HAZARD, LEFT, RIGHT, TILT, COUNT, CRC, NIBBLE, PAGE, PAGED
"#;
    assert_refused(&sound(), "car.toml", cases);
    let cases = r#"
  signal = "BLINK.HAZARD"
+ on = [1]
> car.toml:15:1: hazard.on: unknown key "on" with from = "reason"; valid keys: disagreement_ms, from, signal, off, reasons, not_available, fault, fault_signal, on_fault
- signal = "BLINK.HAZARD"
  off = [0]
- reasons = { a = [1] }
> car.toml:12:1: hazard: missing keys: signal, reasons; a hazard reason needs signal, off and [hazard.reasons]
- reasons = { a = [1] }
+ reasons = {}
> car.toml:16:11: hazard.reasons: expected 1 to 255 reasons, found 0; name them in [hazard.reasons]
- reasons = { a = [1] }
+ reasons = { a = [1], b = [1] }
> car.toml:16:27: hazard.reasons.b[1]: 1 is given twice; give each raw value one meaning
"#;
    assert_refused(&with("car.toml", HAZARD, REASON), "car.toml", cases);
}
