//! An invented vehicle that reports its status: its profile, its DBC, and a drive of six seconds.

use std::fmt::Write as _;

/// Speed with a sign bit, yaw rate, angle of the front wheels; gear, control mode and two doors; turn and
/// hazard lights.
pub(crate) const PROFILE: &str = r#"name = "Bench"
[bus.body]
dbc = "bench.dbc"
[message.MOTION]
timeout_ms = 500
[message.BODY]
timeout_ms = 500
[turn]
signal = "BODY.TURN"
off = [0]
left = [1]
right = [2]
[hazard]
from = "signal"
signal = "BODY.HAZARD"
on = [1]
off = [0]
[[velocity.source]]
name = "speedometer"
kind = "speed"
speed = { signal = "MOTION.SPEED", unit = "km/h", valid = ["0..=30000"], not_available = [65535] }
[[velocity.direction]]
from = "signal"
signal = "MOTION.BACKWARD"
forward = [0]
backward = [1]
[[velocity.heading_rate]]
kind = "yaw_rate"
zero = "none"
yaw_rate = { signal = "MOTION.YAW", unit = "deg/s", positive = "left", valid = ["-8000..=8000"] }
[steering]
tire = { signal = "MOTION.TIRE", unit = "deg", positive = "left", valid = ["-4000..=4000"], not_available = [32767] }
[gear]
signal = "BODY.GEAR"
park = [0]
drive = [1]
reverse = [2]
between = [15]
[control_mode]
signal = "BODY.MODE"
manual = [0]
autonomous = [1]
[[doors.door]]
name = "front left"
signal = "BODY.FRONT_LEFT"
closed = [0]
open = [1]
opening = [2]
not_available = [3]
exit = true
[[doors.door]]
name = "front right"
signal = "BODY.FRONT_RIGHT"
closed = [0]
open = [1]
entrance = true
exit = true
"#;

/// Messages of [`PROFILE`].
pub(crate) const DBC: &str = r#"BO_ 768 MOTION: 8 X
 SG_ SPEED : 0|16@1+ (0.01,0) [0|0] "km/h" X
 SG_ BACKWARD : 16|1@1+ (1,0) [0|1] "" X
 SG_ YAW : 24|16@1- (0.01,0) [0|0] "deg/s" X
 SG_ TIRE : 40|16@1- (0.01,0) [0|0] "deg" X
BO_ 769 BODY: 8 X
 SG_ GEAR : 0|4@1+ (1,0) [0|15] "" X
 SG_ MODE : 4|2@1+ (1,0) [0|3] "" X
 SG_ TURN : 6|2@1+ (1,0) [0|3] "" X
 SG_ FRONT_LEFT : 8|2@1+ (1,0) [0|3] "" X
 SG_ FRONT_RIGHT : 10|2@1+ (1,0) [0|3] "" X
 SG_ HAZARD : 12|1@1+ (1,0) [0|1] "" X
"#;

/// One phase of the drive, as raw values.
struct Phase {
    seconds: std::ops::Range<u32>,
    speed: u16,
    is_backward: bool,
    yaw: i16,
    tire: i16,
    gear: u8,
    mode: u8,
    doors: [u8; 2],
}

#[rustfmt::skip]
const PHASES: [Phase; 4] = [
    // 10 m/s in a bend to the left, Autoware drives.
    Phase { seconds: 0..2, speed: 3_600, is_backward: false, yaw: 500, tire: 200, gear: 1, mode: 1, doors: [0, 0] },
    // Speed, angle and a door are not available, the gearbox shifts, and the mode has no meaning.
    Phase { seconds: 2..3, speed: 65_535, is_backward: false, yaw: 0, tire: 32_767, gear: 15, mode: 3, doors: [3, 0] },
    // 2 m/s backward, the driver drives.
    Phase { seconds: 3..5, speed: 720, is_backward: true, yaw: -200, tire: -100, gear: 2, mode: 0, doors: [0, 0] },
    // Parked with open doors.
    Phase { seconds: 5..6, speed: 0, is_backward: false, yaw: 0, tire: 0, gear: 0, mode: 0, doors: [2, 1] },
];

/// The drive as candump writes it: the motion each 10 ms, the rest each 100 ms.
pub(crate) fn drive() -> String {
    let mut log = String::new();
    for Phase { seconds, speed, is_backward, yaw, tire, gear, mode, doors: [left, right] } in PHASES {
        for hundredth in seconds.start * 100..seconds.end * 100 {
            let at = format!("({}.{:02}0000) can0", 1_700_000_000 + hundredth / 100, hundredth % 100);
            let mut motion = [0; 8];
            motion[..2].copy_from_slice(&speed.to_le_bytes());
            motion[2] = u8::from(is_backward);
            motion[3..5].copy_from_slice(&yaw.to_le_bytes());
            motion[5..7].copy_from_slice(&tire.to_le_bytes());
            writeln!(log, "{at} 300#{}", hexadecimal(&motion)).unwrap();
            if hundredth % 10 == 0 {
                let body = [gear | mode << 4, left | right << 2, 0, 0, 0, 0, 0, 0];
                writeln!(log, "{at} 301#{}", hexadecimal(&body)).unwrap();
            }
        }
    }
    log
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect()
}
