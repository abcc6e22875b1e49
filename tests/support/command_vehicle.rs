//! An invented vehicle that takes commands: its profile, its DBC, and the request of a frame.

use std::sync::atomic::{AtomicI64, Ordering};

use gateway_core::command::origin::{CommandOrigin, SampleId, WriterId};

/// The next message of one and the same writer of a topic.
pub(crate) fn next_sample() -> SampleId {
    static SEQUENCE: AtomicI64 = AtomicI64::new(1);
    SampleId { writer: WriterId::default(), sequence: SEQUENCE.fetch_add(1, Ordering::Relaxed) }
}

/// The next command of one and the same writer of a topic.
pub(crate) fn next_origin() -> CommandOrigin {
    CommandOrigin::Topic(next_sample())
}

/// Lights of which the hazard lights are requested by a button, without the vehicle's name and bus.
pub(crate) const BUTTON: &str = r#"message.STATE.timeout_ms = 500
turn = { signal = "STATE.TURN", off = [0], left = [1], right = [2] }
hazard = { from = "signal", signal = "STATE.HAZARD", on = [1], off = [0] }
[[command.message]]
name = "TURN_ONLY"
period_ms = 50
turn = { off = { TURN_ONLY_REQ = 0 }, left = { TURN_ONLY_REQ = 1 }, right = { TURN_ONLY_REQ = 2 } }
[[command.message]]
name = "BUTTON"
period_ms = 50
hazard = { off = { PRESSED = 0 }, on = { PRESSED = 1 }, button = { press_ms = 200, wait_ms = 600, attempts = 2 } }
"#;

/// Sent every 100 ms, three times 20 ms apart after a change, never closer than 10 ms.
pub(crate) const PROFILE: &str = r#"name = "Bench"
bus.body.dbc = "bench.dbc"
message.STATE.timeout_ms = 500
[turn]
signal = "STATE.TURN"
off = [0]
left = [1]
right = [2]
[hazard]
from = "signal"
signal = "STATE.HAZARD"
on = [1]
off = [0]
[[command.message]]
name = "CMD"
period_ms = 100
burst = 3
burst_gap_ms = 20
unused_bits = 1
constants = { DOOR = 2 }
enable = { on = { ENABLE = 1 }, off = { ENABLE = 0 } }
turn.none = { TURN_REQ = 7 }
turn.off = { TURN_REQ = 0 }
turn.left = { TURN_REQ = 1 }
turn.right = { TURN_REQ = 2 }
hazard.none = { HAZARD_REQ = -1 }
hazard.off = { HAZARD_REQ = 0 }
hazard.on = { HAZARD_REQ = 1 }
counter = { signal = "COUNT" }
checksum = { kind = "j1850", signal = "CRC" }
[[command.driver]]
signal = "STATE.OVERRIDE"
on = [1]
off = [0]
overrides = "turn"
"#;

/// The control mode by a signal, which a profile may have beside it.
pub(crate) const MODE: &str = r#"[control_mode]
signal = "STATE.MODE"
autonomous = [1]
velocity_only = [2]
manual = [0]
"#;

pub(crate) const DBC: &str = r#"BO_ 304 CMD: 8 X
 SG_ ENABLE : 0|1@1+ (1,0) [0|1] "" X
 SG_ DOOR : 1|2@1+ (1,0) [0|3] "" X
 SG_ TURN_REQ : 10|3@0+ (1,0) [0|7] "" X
 SG_ HAZARD_REQ : 12|2@1- (1,0) [-2|1] "" X
 SG_ COUNT : 48|4@1+ (1,0) [0|15] "" X
 SG_ CRC : 56|8@1+ (1,0) [0|255] "" X
BO_ 560 STATE: 4 X
 SG_ TURN : 0|2@1+ (1,0) [0|3] "" X
 SG_ HAZARD : 2|2@1+ (1,0) [0|3] "" X
 SG_ OVERRIDE : 4|1@1+ (1,0) [0|1] "" X
 SG_ MODE : 5|2@1+ (1,0) [0|3] "" X
BO_ 305 BUTTON: 1 X
 SG_ PRESSED : 0|1@1+ (1,0) [0|1] "" X
BO_ 307 SEALED: 8 X
 SG_ SEALED_CRC : 0|8@1+ (1,0) [0|255] "" X
 SG_ SEALED_COUNT : 8|4@1+ (1,0) [0|15] "" X
 SG_ SEALED_REQ : 16|3@1+ (1,0) [0|7] "" X
BO_ 306 TURN_ONLY: 1 X
 SG_ TURN_ONLY_REQ : 0|2@1+ (1,0) [0|3] "" X
"#;

/// The request of a frame of `CMD`, decoded by hand: `-` = it has no authority.
pub(crate) fn request_text(data: &[u8]) -> &'static str {
    assert_eq!((data[0] & 0xFE, data[2], data[6] >> 4), (0xFC, 0xFF, 0xF), "background and constants");
    match (data[0] & 1, data[1] & 7, data[1] >> 4 & 3) {
        (0, 7, 3) => "-",
        (1, 0, 1) => "hazard",
        (1, 7, 1) => "hazard, any turn",
        (1, 0, 0) => "off",
        (1, 1, 0) => "left",
        (1, 2, 0) => "right",
        (1, 7, 0) => "any turn",
        (1, 0, 3) => "off, any hazard",
        (1, 1, 3) => "left, any hazard",
        (1, 2, 3) => "right, any hazard",
        other => panic!("{other:?}"),
    }
}
