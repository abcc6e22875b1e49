//! What is refused of checksums, counters, E2E protection and windows.

use crate::pure::config_refusals::{Spoilt, assert_refused, row};

const SECTION: &str = "timeout_ms = 500\n";
const CHECKSUM: &str = "see [message.*] checksum in config/gateway.toml";
const COUNTER: &str = "see [message.*] counter in config/gateway.toml";
const E2E: &str = "see [message.*] e2e in config/gateway.toml";
const WINDOW: &str = "see [message.*] window in config/gateway.toml";

/// What stands below `[message.BLINK]`: signals CRC with eight bits, NIBBLE with four, COUNT with two,
/// TILT with a sign, and PAGED, which is not in every frame.
fn refused(key: &'static str, rows: &[(&'static str, &'static str, &'static str)]) {
    let rows: Vec<Spoilt> =
        rows.iter().map(|(new, reason, remedy)| row(SECTION, new, key, reason, remedy)).collect();
    assert_refused("car.toml", &rows);
}

#[test]
fn checksums_that_cannot_be_computed_are_refused() {
    refused(
        "message.BLINK.checksum",
        &[
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"vw\", signal = \"CRC\" }\n",
                "a key is missing: constants",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"psa\", signal = \"NIBBLE\" }\n",
                "a key is missing: start",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"fca_giorgio\", signal = \"CRC\" }\n",
                "a key is missing: xorout",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"crc8\", signal = \"CRC\" }\n",
                "a key is missing: poly",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"crc16\", signal = \"CRC\" }\n",
                "a key is missing: poly",
                CHECKSUM,
            ),
        ],
    );
    refused(
        "message.BLINK.checksum.constants",
        &[(
            "timeout_ms = 500\nchecksum = { kind = \"vw\", signal = \"CRC\", constants = @@[1, 2] }\n",
            "expected 16 bytes, found 2",
            CHECKSUM,
        )],
    );
    refused(
        "message.BLINK.checksum.start",
        &[
            (
                "timeout_ms = 500\nchecksum = { kind = \"psa\", signal = \"NIBBLE\", start = @@16 }\n",
                "16 is out of range",
                "0 to 15",
            ),
            (
                "timeout_ms = 500\nchecksum = { kind = \"j1850\", signal = \"CRC\", @@start = 1 }\n",
                "unknown key \"start\" with this kind",
                "known here are signal, kind",
            ),
        ],
    );
    refused(
        "message.BLINK.checksum.poly",
        &[
            (
                "timeout_ms = 500\nchecksum = { kind = \"crc8\", signal = \"CRC\", poly = @@0x11D }\n",
                "285 is out of range",
                "0 to 255",
            ),
            (
                "timeout_ms = 500\nchecksum = { kind = \"honda\", signal = \"NIBBLE\", @@poly = 7 }\n",
                "unknown key \"poly\" with this kind",
                "known here are signal, kind",
            ),
        ],
    );
    refused(
        "message.BLINK.checksum.reflected",
        &[(
            "timeout_ms = 500\nchecksum = { kind = \"sum8\", signal = \"CRC\", @@reflected = true }\n",
            "unknown key \"reflected\" with this kind",
            "start, identifier, bytes",
        )],
    );
    refused(
        "message.BLINK.checksum.kind",
        &[
            (
                "timeout_ms = 500\nchecksum = { kind = @@\"hyundai_fd\", signal = \"CRC\" }\n",
                "Hyundai's CRC is not known for 4 bytes",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = { kind = @@\"crc32\", signal = \"CRC\" }\n",
                "unknown value \"crc32\"",
                "honda, toyota, j1850",
            ),
        ],
    );
}

#[test]
fn signals_that_cannot_hold_the_checksum_are_refused() {
    refused(
        "message.BLINK.checksum.signal",
        &[
            (
                "timeout_ms = 500\nchecksum = { kind = \"j1850\", signal = @@\"CRCS\" }\n",
                "BLINK has no signal CRCS",
                "it has TURN, HAZARD",
            ),
            (
                "timeout_ms = 500\nchecksum = { kind = \"j1850\", signal = @@\"NIBBLE\" }\n",
                "8 bits",
                "bind the signal that holds the checksum",
            ),
            (
                "timeout_ms = 500\nchecksum = { kind = \"honda\", signal = @@\"TILT\" }\n",
                "sign",
                "bind the signal that holds the checksum",
            ),
            (
                "timeout_ms = 500\nchecksum = { kind = \"honda\", signal = @@\"PAGED\" }\n",
                "multiplexed",
                "bind the signal that holds the checksum",
            ),
        ],
    );
}

#[test]
fn counters_that_cannot_run_are_refused() {
    refused(
        "message.BLINK.counter",
        &[
            (
                "timeout_ms = 500\ncounter = @@{ signal = \"COUNT\", first = 2, last = 2 }\n",
                "from 2 to 2: it needs two values",
                COUNTER,
            ),
            (
                "timeout_ms = 500\ncounter = @@{ signal = \"COUNT\", max_step = 4 }\n",
                "the largest step is 4: 1 to 3",
                COUNTER,
            ),
            (
                "timeout_ms = 500\ncounter = @@{ signal = \"COUNT\", max_step = 0 }\n",
                "the largest step is 0: 1 to 3",
                COUNTER,
            ),
            (
                "timeout_ms = 500\ncounter = @@{ signal = \"COUNT\", last = 14 }\n",
                "holds 0 to 3 only",
                COUNTER,
            ),
            ("timeout_ms = 500\ncounter = @@{ signal = \"PAGED\" }\n", "multiplexed", COUNTER),
        ],
    );
    refused(
        "message.BLINK.counter.signal",
        &[(
            "timeout_ms = 500\ncounter = { signal = @@\"COUNTS\" }\n",
            "BLINK has no signal COUNTS",
            "it has TURN, HAZARD",
        )],
    );
}

#[test]
fn e2e_protection_that_does_not_fit_is_refused() {
    refused(
        "message.BLINK.e2e",
        &[
            (
                "timeout_ms = 500\ncounter = { signal = \"COUNT\" }\ne2e = @@{ profile = \"1A\", data_id = 1 }\n",
                "an E2E profile has its own checksum and counter",
                "or `checksum` and `counter`",
            ),
            ("timeout_ms = 500\ne2e = @@{ profile = \"1A\" }\n", "a key is missing: data_id", E2E),
            ("timeout_ms = 500\ne2e = @@{ profile = \"1C\", data_id = 0x1000 }\n", "0x000 to 0xFFF", E2E),
            ("timeout_ms = 500\ne2e = @@{ profile = \"2\" }\n", "a key is missing: data_ids", E2E),
            (
                "timeout_ms = 500\ne2e = @@{ profile = \"1A\", data_id = 1, offset = 3 }\n",
                "the header takes bytes 3 to 4, the message has 4 bytes",
                E2E,
            ),
            (
                "timeout_ms = 500\ne2e = @@{ profile = \"4\", data_id = 1 }\n",
                "the header takes bytes 0 to 11",
                E2E,
            ),
            (
                "timeout_ms = 500\ne2e = @@{ profile = \"1A\", data_id = 1, max_step = 15 }\n",
                "the largest step is 15: 1 to 14",
                E2E,
            ),
        ],
    );
    refused(
        "message.BLINK.e2e.data_id",
        &[
            (
                "timeout_ms = 500\ne2e = { profile = \"5\", data_id = @@0x10000 }\n",
                "65536 is out of range",
                "0 to 65535",
            ),
            (
                "timeout_ms = 500\ne2e = { profile = \"2\", data_ids = [0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15], @@data_id = 1, offset = 0 }\n",
                "unknown key \"data_id\" with this profile",
                "data_ids",
            ),
        ],
    );
    refused(
        "message.BLINK.e2e.data_ids",
        &[
            (
                "timeout_ms = 500\ne2e = { profile = \"22\", data_ids = @@[1, 2, 3] }\n",
                "expected 16 bytes, found 3",
                E2E,
            ),
            (
                "timeout_ms = 500\ne2e = { profile = \"1A\", data_id = 1, @@data_ids = [1] }\n",
                "unknown key \"data_ids\" with this profile",
                "data_id",
            ),
        ],
    );
}

#[test]
fn windows_and_lengths_without_sense_are_refused() {
    refused(
        "message.BLINK.window",
        &[
            (
                "timeout_ms = 500\nwindow = @@{ init = { size = 1, min_ok = 1, max_error = 0 }, valid = { size = 1, min_ok = 1, max_error = 0 }, invalid = { size = 1, min_ok = 1, max_error = 0 } }\n",
                "a window judges what checksum, counter or e2e found",
                "remove it",
            ),
            (
                "timeout_ms = 500\ncounter = { signal = \"COUNT\" }\nwindow = @@{ init = { size = 3, min_ok = 2, max_error = 0 }, valid = { size = 5, min_ok = 3, max_error = 0 }, invalid = { size = 4, min_ok = 3, max_error = 0 } }\n",
                "must not fall from valid to init",
                WINDOW,
            ),
            (
                "timeout_ms = 500\ncounter = { signal = \"COUNT\" }\nwindow = @@{ init = { size = 6, min_ok = 2, max_error = 0 }, valid = { size = 5, min_ok = 1, max_error = 0 }, invalid = { size = 4, min_ok = 3, max_error = 0 } }\n",
                "valid state must be the longest",
                WINDOW,
            ),
            (
                "timeout_ms = 500\ncounter = { signal = \"COUNT\" }\nwindow = @@{ init = { size = 3, min_ok = 2, max_error = 0 }, valid = { size = 65, min_ok = 1, max_error = 0 }, invalid = { size = 4, min_ok = 3, max_error = 0 } }\n",
                "holds 1 to 64 results, not 65",
                WINDOW,
            ),
        ],
    );
    refused(
        "message.BLINK.length",
        &[
            ("timeout_ms = 500\nlength = @@0\n", "0 bytes is out of range", "give 1 to 64"),
            ("timeout_ms = 500\nlength = @@65\n", "65 bytes is out of range", "give 1 to 64"),
        ],
    );
}
