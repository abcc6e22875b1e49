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
                "timeout_ms = 500\nchecksum = @@{ kind = \"j1850\", signal = \"CRC\", start = 1 }\n",
                "`start` has no meaning with this kind",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"honda\", signal = \"NIBBLE\", poly = 7 }\n",
                "`poly` has no meaning",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"sum8\", signal = \"CRC\", reflected = true }\n",
                "`reflected` has no meaning",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"vw\", signal = \"CRC\" }\n",
                "VW needs `constants`, sixteen",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"vw\", signal = \"CRC\", constants = [1, 2] }\n",
                "VW needs `constants`, sixteen",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"psa\", signal = \"NIBBLE\" }\n",
                "PSA needs `start`",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"psa\", signal = \"NIBBLE\", start = 16 }\n",
                "`start` of PSA is 0 to 15",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"fca_giorgio\", signal = \"CRC\" }\n",
                "Giorgio needs `xorout`",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"crc8\", signal = \"CRC\" }\n",
                "a CRC needs `poly`",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"crc16\", signal = \"CRC\" }\n",
                "a CRC needs `poly`",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"crc8\", signal = \"CRC\", poly = 0x11D }\n",
                "`poly` of a CRC-8 has 8 bits",
                CHECKSUM,
            ),
            (
                "timeout_ms = 500\nchecksum = @@{ kind = \"hyundai_fd\", signal = \"CRC\" }\n",
                "Hyundai's CRC is not known for 4 bytes",
                CHECKSUM,
            ),
        ],
    );
    refused(
        "message.BLINK.checksum.kind",
        &[(
            "timeout_ms = 500\nchecksum = { kind = @@\"crc32\", signal = \"CRC\" }\n",
            "unknown variant `crc32`",
            "config/gateway.toml",
        )],
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
            ("timeout_ms = 500\ne2e = @@{ profile = \"1A\" }\n", "needs `data_id`", E2E),
            (
                "timeout_ms = 500\ne2e = @@{ profile = \"5\", data_id = 0x10000 }\n",
                "`data_id` of this profile has 16 bits",
                E2E,
            ),
            ("timeout_ms = 500\ne2e = @@{ profile = \"1C\", data_id = 0x1000 }\n", "0x000 to 0xFFF", E2E),
            ("timeout_ms = 500\ne2e = @@{ profile = \"2\" }\n", "needs `data_ids`, sixteen", E2E),
            (
                "timeout_ms = 500\ne2e = @@{ profile = \"22\", data_ids = [1, 2, 3] }\n",
                "needs `data_ids`, sixteen",
                E2E,
            ),
            (
                "timeout_ms = 500\ne2e = @@{ profile = \"2\", data_id = 1 }\n",
                "profiles 2 and 22 have `data_ids`",
                E2E,
            ),
            (
                "timeout_ms = 500\ne2e = @@{ profile = \"1A\", data_ids = [1] }\n",
                "profiles 2 and 22 have `data_ids`",
                E2E,
            ),
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
            ("timeout_ms = 500\nlength = @@0\n", "no frame has 0 bytes", "give 1 to 64"),
            ("timeout_ms = 500\nlength = @@65\n", "no frame has 65 bytes", "give 1 to 64"),
        ],
    );
}
