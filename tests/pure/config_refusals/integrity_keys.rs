//! What is refused of checksums, counters, E2E protection and windows. The message has the signals CRC with
//! eight bits, NIBBLE with four, COUNT with two, TILT with a sign, and PAGED, which is not in every frame.

use crate::pure::config_refusals::{assert_refused, sound};

#[test]
fn checksums_that_cannot_be_computed_are_refused() {
    let cases = r#"
+ checksum = { kind = "vw", signal = "CRC" }
> car.toml:6:12: message.BLINK.checksum: missing key: constants; see [message.*] checksum in config/gateway.toml
+ checksum = { kind = "psa", signal = "NIBBLE" }
> car.toml:6:12: message.BLINK.checksum: missing key: start; see [message.*] checksum in config/gateway.toml
+ checksum = { kind = "fca_giorgio", signal = "CRC" }
> car.toml:6:12: message.BLINK.checksum: missing key: xorout; see [message.*] checksum in config/gateway.toml
+ checksum = { kind = "crc8", signal = "CRC" }
> car.toml:6:12: message.BLINK.checksum: missing key: poly; see [message.*] checksum in config/gateway.toml
+ checksum = { kind = "crc16", signal = "CRC" }
> car.toml:6:12: message.BLINK.checksum: missing key: poly; see [message.*] checksum in config/gateway.toml
+ checksum = { kind = "vw", signal = "CRC", constants = [1, 2] }
> car.toml:6:55: message.BLINK.checksum.constants: expected 16 bytes, found 2; see [message.*] checksum in config/gateway.toml
+ checksum = { kind = "psa", signal = "NIBBLE", start = 16 }
> car.toml:6:55: message.BLINK.checksum.start: 16 is out of range; give 0 to 15
+ checksum = { kind = "j1850", signal = "CRC", start = 1 }
> car.toml:6:46: message.BLINK.checksum.start: unknown key "start" with this kind of checksum; valid keys: signal, kind
+ checksum = { kind = "crc8", signal = "CRC", poly = 0x11D }
> car.toml:6:52: message.BLINK.checksum.poly: 285 is out of range; give 0 to 255
+ checksum = { kind = "honda", signal = "NIBBLE", poly = 7 }
> car.toml:6:49: message.BLINK.checksum.poly: unknown key "poly" with this kind of checksum; valid keys: signal, kind
+ checksum = { kind = "sum8", signal = "CRC", reflected = true }
> car.toml:6:45: message.BLINK.checksum.reflected: unknown key "reflected" with this kind of checksum; valid keys: signal, kind, start, identifier, bytes
+ checksum = { kind = "hyundai_fd", signal = "CRC" }
> car.toml:6:21: message.BLINK.checksum.kind: Hyundai's CRC is not known for 4 bytes; see [message.*] checksum in config/gateway.toml
+ checksum = { kind = "crc32", signal = "CRC" }
> car.toml:6:21: message.BLINK.checksum.kind: unknown value "crc32"; give one of honda, toyota, j1850, fca_giorgio, subaru, tesla, mazda, psa, vw, vw_pq, hyundai_fd, sum8, xor8, crc8, crc16
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn signals_that_cannot_hold_the_checksum_are_refused() {
    let cases = r#"
+ checksum = { kind = "j1850", signal = "CRCS" }
> car.toml:6:39: message.BLINK.checksum.signal: BLINK has no signal CRCS; did you mean CRC?
+ checksum = { kind = "j1850", signal = "NIBBLE" }
> car.toml:6:39: message.BLINK.checksum.signal: the checksum has 8 bits, but its signal has 4; bind the signal that holds the checksum
+ checksum = { kind = "honda", signal = "TILT" }
> car.toml:6:39: message.BLINK.checksum.signal: a checksum signal must be unsigned; bind the signal that holds the checksum
+ checksum = { kind = "honda", signal = "PAGED" }
> car.toml:6:39: message.BLINK.checksum.signal: a checksum signal must be in every frame, but this one is multiplexed; bind the signal that holds the checksum
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn counters_that_cannot_run_are_refused() {
    let cases = r#"
+ counter = { signal = "COUNT", first = 2, last = 2 }
> car.toml:6:11: message.BLINK.counter: the counter runs from 2 to 2, but needs at least two values; see [message.*] counter in config/gateway.toml
+ counter = { signal = "COUNT", max_step = 4 }
> car.toml:6:11: message.BLINK.counter: the largest step is 4, but this range allows 1 to 3; see [message.*] counter in config/gateway.toml
+ counter = { signal = "COUNT", max_step = 0 }
> car.toml:6:11: message.BLINK.counter: the largest step is 0, but this range allows 1 to 3; see [message.*] counter in config/gateway.toml
+ counter = { signal = "COUNT", last = 14 }
> car.toml:6:11: message.BLINK.counter: the counter's signal holds only 0 to 3; see [message.*] counter in config/gateway.toml
+ counter = { signal = "PAGED" }
> car.toml:6:11: message.BLINK.counter: a counter signal must be in every frame, but this one is multiplexed; see [message.*] counter in config/gateway.toml
+ counter = { signal = "COUNTS" }
> car.toml:6:22: message.BLINK.counter.signal: BLINK has no signal COUNTS; did you mean COUNT?
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn e2e_protection_that_does_not_fit_is_refused() {
    let cases = r#"
+ counter = { signal = "COUNT" }
+ e2e = { profile = "1A", data_id = 1 }
> car.toml:7:7: message.BLINK.e2e: an E2E profile has its own checksum and counter; give `e2e`, or `checksum` and `counter`
+ e2e = { profile = "1A" }
> car.toml:6:7: message.BLINK.e2e: missing key: data_id; see [message.*] e2e in config/gateway.toml
+ e2e = { profile = "1C", data_id = 0x1000 }
> car.toml:6:7: message.BLINK.e2e: in low-nibble mode the Data ID is 0x000 to 0xFFF, not 0x1000; see [message.*] e2e in config/gateway.toml
+ e2e = { profile = "2" }
> car.toml:6:7: message.BLINK.e2e: missing key: data_ids; see [message.*] e2e in config/gateway.toml
+ e2e = { profile = "1A", data_id = 1, offset = 3 }
> car.toml:6:7: message.BLINK.e2e: the header takes bytes 3 to 4, but the message has 4 bytes; see [message.*] e2e in config/gateway.toml
+ e2e = { profile = "4", data_id = 1 }
> car.toml:6:7: message.BLINK.e2e: the header takes bytes 0 to 11, but the message has 4 bytes; see [message.*] e2e in config/gateway.toml
+ e2e = { profile = "1A", data_id = 1, max_step = 15 }
> car.toml:6:7: message.BLINK.e2e: the largest step is 15, but this range allows 1 to 14; see [message.*] e2e in config/gateway.toml
+ e2e = { profile = "5", data_id = 0x10000 }
> car.toml:6:34: message.BLINK.e2e.data_id: 65536 is out of range; give 0 to 65535
+ e2e = { profile = "2", data_ids = [0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15], data_id = 1, offset = 0 }
> car.toml:6:76: message.BLINK.e2e.data_id: unknown key "data_id" with this profile; valid keys: offset, max_step, profile, data_ids
+ e2e = { profile = "22", data_ids = [1, 2, 3] }
> car.toml:6:36: message.BLINK.e2e.data_ids: expected 16 bytes, found 3; see [message.*] e2e in config/gateway.toml
+ e2e = { profile = "1A", data_id = 1, data_ids = [1] }
> car.toml:6:38: message.BLINK.e2e.data_ids: unknown key "data_ids" with this profile; valid keys: offset, max_step, profile, data_id
"#;
    assert_refused(&sound(), "car.toml", cases);
}

#[test]
fn windows_and_lengths_without_sense_are_refused() {
    let cases = r#"
+ window = { init = { size = 1, min_ok = 1, max_error = 0 }, valid = { size = 1, min_ok = 1, max_error = 0 }, invalid = { size = 1, min_ok = 1, max_error = 0 } }
> car.toml:6:10: message.BLINK.window: a window needs checksum, counter or e2e; give one of them, or remove it
+ counter = { signal = "COUNT" }
+ window = { init = { size = 3, min_ok = 2, max_error = 0 }, valid = { size = 5, min_ok = 3, max_error = 0 }, invalid = { size = 4, min_ok = 3, max_error = 0 } }
> car.toml:7:10: message.BLINK.window: min_ok must be at least 1 and must not fall from valid to init to invalid; see [message.*] window in config/gateway.toml
+ counter = { signal = "COUNT" }
+ window = { init = { size = 6, min_ok = 2, max_error = 0 }, valid = { size = 5, min_ok = 1, max_error = 0 }, invalid = { size = 4, min_ok = 3, max_error = 0 } }
> car.toml:7:10: message.BLINK.window: the window of the valid state must be the longest; see [message.*] window in config/gateway.toml
+ counter = { signal = "COUNT" }
+ window = { init = { size = 3, min_ok = 2, max_error = 0 }, valid = { size = 65, min_ok = 1, max_error = 0 }, invalid = { size = 4, min_ok = 3, max_error = 0 } }
> car.toml:7:10: message.BLINK.window: a window holds 1 to 64 results, not 65; see [message.*] window in config/gateway.toml
+ length = 0
> car.toml:6:10: message.BLINK.length: 0 bytes is out of range; give 1 to 64 bytes
+ length = 65
> car.toml:6:10: message.BLINK.length: 65 bytes is out of range; give 1 to 64 bytes
"#;
    assert_refused(&sound(), "car.toml", cases);
}
