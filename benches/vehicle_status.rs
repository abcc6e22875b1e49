//! The cost of the whole status of a vehicle beside that of its lights alone: processor time of the daemon,
//! bus and ROS 2 included.
//!
//! It needs an interface `vcan0`, which the guest of `tests/with-vcan` has:
//!
//! ```sh
//! cargo --config 'target."cfg(unix)".runner="tests/with-vcan"' bench --bench vehicle_status
//! ```
//!
//! Two daemons hear the same 2,000 frames a second. One has a profile with the lights, the other one with
//! velocity and steering, which it publishes at 50 Hz, gear and doors as well. They run side by side, so that
//! other work on the machine concerns both.

#![allow(clippy::unwrap_used)] // a program for developers

#[path = "comparison.rs"]
mod comparison;

use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use comparison::{Gateway, Row, processor_time_of};
use socketcan::{CanDataFrame, CanSocket, EmbeddedFrame as _, Socket as _, StandardId};

const INTERFACE: &str = "vcan0";
/// One frame each so often: 2,000 a second.
const PERIOD: Duration = Duration::from_micros(500);
/// Frames of a round, so that each has 100 a second.
const ROUND: u32 = 20;
const SETTLING: Duration = Duration::from_secs(5);
const WINDOW: Duration = Duration::from_secs(30);

const LIGHTS: &str = r#"
name = "Car"
[bus.body]
dbc = "DBC"
heartbeat_messages = ["BODY_CONTROL_STATE"]
[turn]
signal = "BLINKERS_STATE.TURN_SIGNALS"
off = [3]
left = [1]
right = [2]
[hazard]
from = "signal"
signal = "BLINKERS_STATE.HAZARD_LIGHT"
on = [1]
off = [0]
[message]
BLINKERS_STATE = { timeout_ms = 500 }
"#;

const STATUS: &str = r#"
WHEEL_SPEEDS = { timeout_ms = 500 }
KINEMATICS = { timeout_ms = 500 }
STEER_ANGLE_SENSOR = { timeout_ms = 500 }
GEAR_PACKET = { timeout_ms = 500 }
BODY_CONTROL_STATE = { timeout_ms = 500 }
[[velocity.source]]
name = "wheels"
kind = "wheels"
rear_left = { signal = "WHEEL_SPEEDS.WHEEL_SPEED_RL", unit = "km/h", valid = ["6767..=30000"] }
rear_right = { signal = "WHEEL_SPEEDS.WHEEL_SPEED_RR", unit = "km/h", valid = ["6767..=30000"] }
[[velocity.direction]]
from = "gear"
[[velocity.heading_rate]]
kind = "yaw_rate"
zero = "none"
yaw_rate = { signal = "KINEMATICS.YAW_RATE", unit = "deg/s", valid = ["1..=1022"], positive = "left" }
[steering]
wheel = { signal = "STEER_ANGLE_SENSOR.STEER_ANGLE", unit = "deg", positive = "left", valid = ["-500..=500"] }
[gear]
signal = "GEAR_PACKET.GEAR"
drive = [0]
park = [32]
[[doors.door]]
name = "front left"
signal = "BODY_CONTROL_STATE.DOOR_OPEN_FL"
open = [1]
closed = [0]
"#;

/// The two do not find each other.
const DOMAINS: [u8; 2] = [77, 78];

const CONFIGURATION: &str = r#"
profile = "car.toml"
[can.body]
interface = "vcan0"
[reports]
publish = "periodic"
max_rate_hz = 50
[vehicle_geometry]
steering_ratio = 16.0
wheel_base_m = 2.7
[ros]
only_networks = ["127.0.0.1"]
domain_id = "#;

fn main() -> ExitCode {
    let Ok(socket) = CanSocket::open(INTERFACE) else {
        println!("skipped: no {INTERFACE}; run it under tests/with-vcan");
        return ExitCode::SUCCESS;
    };
    let folder = tempfile::tempdir().unwrap();
    let [lights, status] = [LIGHTS.to_owned(), format!("{LIGHTS}{STATUS}")];
    let daemons = [
        Gateway::start(&folder.path().join("lights"), &lights, DOMAINS[0]),
        Gateway::start(&folder.path().join("status"), &status, DOMAINS[1]),
    ];
    send(&socket, SETTLING);
    let before = daemons.each_ref().map(Gateway::processor_time);
    send(&socket, WINDOW);
    let after = daemons.each_ref().map(Gateway::processor_time);
    let [lights, status] = [0, 1].map(|index| {
        let spent: Duration = after[index].checked_sub(before[index]).unwrap();
        spent.div_duration_f64(WINDOW) * 100.0
    });
    let row = Row {
        what: "2,000 frames a second, the whole status at 50 Hz",
        ours: status,
        peer: "the lights alone",
        theirs: lights,
        unit: "% of a core",
        aim: Some(1.5),
        limit: 3.0,
    };
    if row.print() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Sends rounds of frames for a while: each message of the profile, and as many that nobody reads.
fn send(socket: &CanSocket, duration: Duration) {
    let (start, mut sent) = (Instant::now(), 0);
    while start.elapsed() < duration {
        let change = u8::try_from(sent / ROUND % 100).unwrap();
        let (id, data) = match sent % ROUND {
            0 => (0x0AA, [0x1A, 0x6F, 0x1A, 0x6F, 0x2A, change, 0x2A, change]),
            1 => (0x024, [0x02, change, 0, 0, 0, 0, 0, 0]),
            2 => (0x025, [0x00, change, 0, 0, 0, 0, 0, 0]),
            3 => (0x3BC, [0; 8]),
            4 => (0x614, [0, 0, 0, 0x30, 0, 0, 0, 0]),
            5 => (0x620, [0; 8]),
            other => (0x400 + u16::try_from(other).unwrap(), [change; 8]),
        };
        socket.write_frame(&CanDataFrame::new(StandardId::new(id).unwrap(), &data).unwrap()).unwrap();
        sent += 1;
        let due = start + PERIOD * sent;
        thread::sleep(due.saturating_duration_since(Instant::now()));
    }
}

impl Gateway {
    fn start(folder: &Path, profile: &str, domain: u8) -> Self {
        fs::create_dir(folder).unwrap();
        let dbc = Path::new(env!("CARGO_MANIFEST_DIR")).join("dbc/toyota_nodsu.dbc");
        fs::write(folder.join("car.toml"), profile.replace("DBC", dbc.to_str().unwrap())).unwrap();
        fs::write(folder.join("gateway.toml"), format!("{CONFIGURATION}{domain}\n")).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
        command.args(["--quiet", "run", "--config", "gateway.toml"]).current_dir(folder);
        Self(command.stdout(Stdio::null()).spawn().unwrap())
    }

    /// Processor time of the daemon and of the process that speaks ROS 2 for it.
    fn processor_time(&self) -> Duration {
        let own = self.0.id();
        let threads = fs::read_dir(format!("/proc/{own}/task")).unwrap();
        let children =
            threads.map(|thread| fs::read_to_string(thread.unwrap().path().join("children")).unwrap());
        let children: String = children.map(|children| children + " ").collect();
        let children: Vec<_> = children.split_whitespace().map(|child| child.parse().unwrap()).collect();
        assert_eq!(children.len(), 1, "one process speaks ROS 2");
        let processes = children.into_iter().chain([libc::pid_t::try_from(own).unwrap()]);
        processes.map(processor_time_of).sum()
    }
}
