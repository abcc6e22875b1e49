//! A car whose whole status is on the bus: a bicycle model, the frames that it sends, and a gateway that
//! listens.

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::diagnostics::{Level, Status};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use signal_gateway::config::Settings;
use signal_gateway::process_status::snapshot::Snapshot;

use crate::support::clock::{at, millis};
use crate::support::files::MemoryFiles;
use crate::support::virtual_gateway::StatusChange;

pub(crate) const DBC: &str = r#"
BO_ 256 WHEELS: 8 X
 SG_ FL : 0|16@1+ (0.01,0) [0|0] "km/h" X
 SG_ FR : 16|16@1+ (0.01,0) [0|0] "km/h" X
 SG_ RL : 32|16@1+ (0.01,0) [0|0] "km/h" X
 SG_ RR : 48|16@1+ (0.01,0) [0|0] "km/h" X
BO_ 257 SPEED: 8 X
 SG_ SPEED : 0|16@1+ (0.01,0) [0|0] "mph" X
BO_ 258 YAW: 8 X
 SG_ RATE : 0|16@1- (0.01,0) [0|0] "" X
 SG_ QUALITY : 16|2@1+ (1,0) [0|3] "" X
BO_ 259 STEER: 8 X
 SG_ ANGLE : 0|16@1- (0.1,0) [0|0] "deg" X
 SG_ FINE : 16|4@1- (0.01,0) [0|0] "deg" X
 SG_ CALIBRATED : 24|2@1+ (1,0) [0|3] "" X
BO_ 260 GEAR: 8 X
 SG_ GEAR : 0|4@1+ (1,0) [0|15] "" X
BO_ 261 DOORS: 8 X
 SG_ FL : 0|2@1+ (1,0) [0|3] "" X
 SG_ FR : 2|2@1+ (1,0) [0|3] "" X
BO_ 262 WIRE: 8 X
 SG_ STEERING : 0|2@1+ (1,0) [0|3] "" X
 SG_ ACCELERATOR : 2|2@1+ (1,0) [0|3] "" X
 SG_ BRAKE : 4|2@1+ (1,0) [0|3] "" X
 SG_ READY : 6|2@1+ (1,0) [0|3] "" X
 SG_ OVERRIDE : 8|2@1+ (1,0) [0|3] "" X
 SG_ FAULT : 10|2@1+ (1,0) [0|3] "" X
BO_ 263 LIGHTS: 8 X
 SG_ TURN : 0|2@1+ (1,0) [0|3] "" X
 SG_ HAZARD : 2|1@1+ (1,0) [0|1] "" X

BA_DEF_ BO_ "GenMsgCycleTime" INT 0 65535;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_ "GenMsgCycleTime" BO_ 256 10;
BA_ "GenMsgCycleTime" BO_ 257 20;
BA_ "GenMsgCycleTime" BO_ 258 10;
BA_ "GenMsgCycleTime" BO_ 259 10;
BA_ "GenMsgCycleTime" BO_ 260 100;
BA_ "GenMsgCycleTime" BO_ 261 200;
BA_ "GenMsgCycleTime" BO_ 262 50;
BA_ "GenMsgCycleTime" BO_ 263 100;
"#;

pub(crate) const PROFILE: &str = r#"
name = "test car"
[bus.body]
dbc = "car.dbc"

[turn]
signal = "LIGHTS.TURN"
off = [0]
left = [1]
right = [2]
[hazard]
from = "signal"
signal = "LIGHTS.HAZARD"
on = [1]
off = [0]

[velocity]
[[velocity.source]]
name = "wheels"
kind = "wheels"
front_left = { signal = "WHEELS.FL", unit = "km/h", valid = ["0..=30000"] }
front_right = { signal = "WHEELS.FR", unit = "km/h", valid = ["0..=30000"] }
rear_left = { signal = "WHEELS.RL", unit = "km/h", valid = ["0..=30000"], not_available = [65535] }
rear_right = { signal = "WHEELS.RR", unit = "km/h", valid = ["0..=30000"], fault = [65534] }
[[velocity.source]]
name = "speedometer"
kind = "speed"
speed = { signal = "SPEED.SPEED", unit = "km/h", valid = ["0..=30000"] }
[[velocity.direction]]
from = "gear"
[[velocity.heading_rate]]
kind = "yaw_rate"
yaw_rate = { signal = "YAW.RATE", unit = "deg/s", positive = "left", valid = ["-20000..=20000"], flags = [{ signal = "YAW.QUALITY", good = [3], bad = [0], not_available = [1], text = "yaw rate sensor" }] }
[[velocity.heading_rate]]
kind = "steering"

[steering]
wheel = { signal = "STEER.ANGLE", plus = "STEER.FINE", unit = "deg", positive = "left", valid = ["-8000..=8000"], flags = [{ signal = "STEER.CALIBRATED", good = [1], bad = [2], not_available = [0], text = "steering sensor" }] }

[gear]
signal = "GEAR.GEAR"
park = [0]
reverse = [1]
neutral = [2]
drive = [3]
between = [14]
not_available = [15]

[[doors.door]]
name = "front left"
signal = "DOORS.FL"
open = [1]
closed = [0]
not_available = [3]
exit = true
[[doors.door]]
name = "front right"
signal = "DOORS.FR"
open = [1]
closed = [0]
fault = [3]

[control_mode]
steering = { signal = "WIRE.STEERING", on = [1], off = [0] }
accelerator = { signal = "WIRE.ACCELERATOR", on = [1], off = [0] }
brake = { signal = "WIRE.BRAKE", on = [1], off = [0] }
ready = { signal = "WIRE.READY", on = [1], off = [0] }
[[control_mode.override]]
signal = "WIRE.OVERRIDE"
on = [1]
off = [0]
[[control_mode.fault]]
signal = "WIRE.FAULT"
on = [1]
off = [0]
"#;

pub(crate) const GATEWAY: &str = r#"
profile = "car.toml"
[can.body]
interface = "can0"
[vehicle_geometry]
wheel_base_m = 2.7
wheel_tread_m = 1.6
steering_ratio = 16.0
"#;

pub(crate) const WHEEL_BASE_M: f64 = 2.7;
pub(crate) const TREAD_M: f64 = 1.6;
pub(crate) const RATIO: f64 = 16.0;

/// The settings after edits of the profile and of the gateway's file.
pub(crate) fn settings(profile: &[(&str, &str)], gateway: &[(&str, &str)]) -> Settings {
    files(profile, gateway).settings()
}

/// The files after edits of the profile and of the gateway's file.
pub(crate) fn files(profile: &[(&str, &str)], gateway: &[(&str, &str)]) -> MemoryFiles {
    let edited = |text: &str, edits: &[(&str, &str)]| {
        edits.iter().fold(text.to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        })
    };
    let files = MemoryFiles::vehicle(&edited(PROFILE, profile), DBC);
    files.with("gateway.toml", edited(GATEWAY, gateway))
}

/// The motion and the switches of the car, which its frames show.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Car {
    /// m/s, forward positive.
    pub(crate) speed_mps: f64,
    /// rad, left positive.
    pub(crate) tire_rad: f64,
    /// Raw value of the gear: park, reverse, neutral, drive.
    pub(crate) gear: u8,
    /// rad/s, what the sensor of the yaw rate adds.
    pub(crate) yaw_zero_radps: f64,
    pub(crate) yaw_quality: u8,
    pub(crate) calibrated: u8,
    pub(crate) doors: [u8; 2],
    /// Steering, accelerator, brake, ready, override, fault.
    pub(crate) wire: [u8; 6],
}

impl Default for Car {
    fn default() -> Self {
        Self {
            speed_mps: 0.0,
            tire_rad: 0.0,
            gear: 0,
            yaw_zero_radps: 0.0,
            yaw_quality: 3,
            calibrated: 1,
            doors: [0, 0],
            wire: [0, 0, 0, 1, 0, 0],
        }
    }
}

/// The raw values of a frame: message by identifier and signals.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RawFrame {
    pub(crate) id: u16,
    pub(crate) data: [u8; 8],
}

impl RawFrame {
    /// A frame of four numbers of 16 bits.
    pub(crate) fn words(id: u16, words: [i64; 4]) -> Self {
        let mut data = [0; 8];
        for (bytes, word) in data.chunks_exact_mut(2).zip(words) {
            bytes.copy_from_slice(&(word as u16).to_le_bytes());
        }
        Self { id, data }
    }

    pub(crate) fn word(&self, index: usize) -> u16 {
        u16::from_le_bytes([self.data[2 * index], self.data[2 * index + 1]])
    }

    pub(crate) fn set_word(&mut self, index: usize, word: u16) {
        self.data[2 * index..2 * index + 2].copy_from_slice(&word.to_le_bytes());
    }
}

/// Identifiers with the cycles of their messages, ms.
pub(crate) const CYCLES: [(u16, u64); 8] =
    [(256, 10), (257, 20), (258, 10), (259, 10), (260, 100), (261, 200), (262, 50), (263, 100)];

impl Car {
    /// The heading rate by the bicycle model, rad/s.
    pub(crate) fn heading_rate_radps(&self) -> f64 {
        self.speed_mps * self.tire_rad.tan() / WHEEL_BASE_M
    }

    /// The speeds of the wheels without signs, m/s: front left, front right, rear left, rear right.
    pub(crate) fn wheels_mps(&self) -> [f64; 4] {
        let rate = self.heading_rate_radps();
        let sides = [-TREAD_M / 2.0, TREAD_M / 2.0].map(|side| self.speed_mps + side * rate);
        let front = sides.map(|along| along.hypot(WHEEL_BASE_M * rate));
        [front[0], front[1], sides[0].abs(), sides[1].abs()]
    }

    /// The frame of a message as it is now.
    pub(crate) fn frame(&self, id: u16) -> RawFrame {
        let kmh = |mps: f64| (mps * 3.6 / 0.01).round() as i64;
        match id {
            256 => RawFrame::words(id, self.wheels_mps().map(kmh)),
            257 => RawFrame::words(id, [kmh(self.speed_mps.abs()), 0, 0, 0]),
            258 => {
                let rate = (self.heading_rate_radps() + self.yaw_zero_radps).to_degrees() / 0.01;
                RawFrame::words(id, [rate.round() as i64, self.yaw_quality.into(), 0, 0])
            }
            259 => {
                let angle = (self.tire_rad * RATIO).to_degrees() / 0.01;
                let (coarse, fine) =
                    ((angle / 10.0).round(), (angle - (angle / 10.0).round() * 10.0).round());
                let fine = (fine as i64) & 0xF;
                RawFrame::words(id, [coarse as i64, fine + (i64::from(self.calibrated) << 8), 0, 0])
            }
            260 => RawFrame::words(id, [self.gear.into(), 0, 0, 0]),
            261 => RawFrame::words(id, [i64::from(self.doors[0] | self.doors[1] << 2), 0, 0, 0]),
            262 => {
                let bits =
                    (0..).zip(self.wire).fold(0, |bits, (index, bit)| bits | i64::from(bit) << (2 * index));
                RawFrame::words(id, [bits, 0, 0, 0])
            }
            263 => RawFrame::words(id, [0; 4]),
            _ => panic!("no message {id}"),
        }
    }
}

/// A frame as a real sensor of the yaw rate sends it, which never says the same for long.
fn with_noise(mut frame: RawFrame, now_ms: u64) -> RawFrame {
    if frame.id == 258 {
        frame.set_word(0, frame.word(0).wrapping_add((now_ms / 10 % 3) as u16).wrapping_sub(1));
    }
    frame
}

/// A gateway on virtual time, and what it gave out on the vehicle's status.
pub(crate) struct Listener {
    pub(crate) gateway: Gateway,
    pub(crate) now: Now,
    pub(crate) outputs: Vec<(MonoTime, VehicleStatusOutput)>,
    /// Every status whose level or message changed.
    pub(crate) changes: Vec<StatusChange>,
}

impl Listener {
    pub(crate) fn new(settings: Settings) -> Self {
        let now = at(MonoTime::ZERO);
        let gateway = Gateway::new(settings.gateway, LinkState::Up, now);
        let mut listener = Self { gateway, now, outputs: Vec::new(), changes: Vec::new() };
        listener.take();
        listener
    }

    fn take(&mut self) {
        while let Some(output) = self.gateway.poll_output() {
            match output {
                Output::VehicleStatus(output) => self.outputs.push((self.now.mono, output)),
                Output::Diagnostics { diagnostics, .. } => {
                    self.changes.extend(StatusChange::all(diagnostics, self.now.mono));
                }
                _ => {}
            }
        }
    }

    /// Lets time pass, from deadline to deadline.
    pub(crate) fn pass_until(&mut self, millis: u64) {
        let end = MonoTime::from_millis(millis);
        while self.gateway.next_deadline() <= end {
            self.now = at(self.gateway.next_deadline());
            self.gateway.handle(Input::Tick, self.now);
            self.take();
        }
        self.now = at(end);
    }

    /// Receives a frame now.
    pub(crate) fn receive(&mut self, frame: RawFrame) {
        let stamp = self.now.wall;
        let frame = Frame::classic(CanId::Standard(frame.id), &frame.data).unwrap();
        self.gateway.handle(CanInput::Frame { bus: BusIndex(0), frame, stamp }, self.now);
        self.take();
    }

    /// Drives for a while: `step` changes the car each 10 ms, `mutate` its frames; `None` = the frame is not
    /// sent.
    pub(crate) fn drive(
        &mut self,
        car: &mut Car,
        duration_ms: u64,
        mut step: impl FnMut(&mut Car, u64),
        mut mutate: impl FnMut(RawFrame, u64) -> Option<RawFrame>,
    ) {
        let start = millis(self.now.mono);
        for now_ms in (start..start + duration_ms).step_by(10) {
            self.pass_until(now_ms);
            step(car, now_ms - start);
            for (id, cycle) in CYCLES {
                if now_ms % cycle == 0
                    && let Some(frame) = mutate(with_noise(car.frame(id), now_ms), now_ms)
                {
                    self.receive(frame);
                }
            }
        }
        self.pass_until(start + duration_ms);
    }

    /// Drives without a change.
    pub(crate) fn hold(&mut self, car: &mut Car, duration_ms: u64) {
        self.drive(car, duration_ms, |_, _| {}, |frame, _| Some(frame));
    }

    /// Level and message of a report's status.
    pub(crate) fn status(&self, report: StatusReport) -> (Level, String) {
        let status = self.full_status(report);
        (status.level, status.message)
    }

    pub(crate) fn full_status(&self, report: StatusReport) -> Status {
        let status = self.gateway.statuses(self.now.mono);
        status.into_iter().find(|status| status.task == report.name()).unwrap()
    }

    pub(crate) fn snapshot(&self) -> Snapshot {
        self.gateway.snapshot(self.now)
    }

    /// The last velocity: speed, heading rate; `None` while it is withheld.
    pub(crate) fn velocity(&self) -> Option<(f64, f64)> {
        let snapshot = self.snapshot().vehicle_status.velocity.unwrap().published?;
        Some((snapshot.longitudinal_mps, snapshot.heading_rate_radps))
    }

    /// The last angle of the front wheels; `None` while it is withheld.
    pub(crate) fn tire(&self) -> Option<f64> {
        self.snapshot().vehicle_status.steering.unwrap().published
    }

    /// Stamp of each velocity that was published since the beginning.
    pub(crate) fn velocity_stamps(&self) -> Vec<WallStamp> {
        let stamp = |(_, output): &(MonoTime, VehicleStatusOutput)| match output {
            VehicleStatusOutput::Velocity(gateway_core::vehicle_report::Step::Publish(_, stamp)) => {
                Some(*stamp)
            }
            _ => None,
        };
        self.outputs.iter().filter_map(stamp).collect()
    }
}
