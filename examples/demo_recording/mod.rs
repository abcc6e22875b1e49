//! The recording of the demo vehicle: a drive with its faults on a busy bus.
//!
//! Integers, one seed and no clock: the same bytes on every machine. The layout of the payloads is
//! `dbc/demo_vehicle.dbc`; ids that are not in it are there to be ignored, as on a real bus.

pub(crate) mod motion;
pub(crate) mod story;

use std::io::{self, Write};

use motion::{Motion, drive, motion_at};
use story::{AUTONOMOUS, DRIVE, LEFT, LENGTH_MS, OFF, RIGHT, STORY, Scene, scene_at};

/// Stamp of the start, seconds since the epoch: 2026-01-01 00:00 UTC.
pub(crate) const START_S: u64 = 1_767_225_600;

/// Writes the story as text, one line a scene: seconds after the start, what happens.
pub(crate) fn write_story(out: &mut impl Write) -> io::Result<()> {
    for scene in &STORY {
        writeln!(out, "{:>4}.{} s  {}", scene.from_ms / 1000, scene.from_ms % 1000 / 100, scene.text)?;
    }
    Ok(())
}

/// Writes the recording in the format of `candump -L`.
pub(crate) fn write_recording(out: &mut impl Write) -> io::Result<()> {
    let mut frames = all_frames();
    frames.sort_by_key(|frame| (frame.due_us, frame.id));
    let mut bus_free_us = 0;
    for frame in frames {
        let stamp_us = frame.due_us.max(bus_free_us);
        bus_free_us = stamp_us + FRAME_TIME_US;
        let (sec, usec) = (START_S + stamp_us / 1_000_000, stamp_us % 1_000_000);
        let width = if frame.id > 0x7FF { 8 } else { 3 };
        write!(out, "({sec}.{usec:06}) can0 {:0width$X}#", frame.id)?;
        frame.data.iter().try_for_each(|byte| write!(out, "{byte:02X}"))?;
        writeln!(out)?;
    }
    Ok(())
}

/// Eight bytes at 500 kbit/s, with some stuff bits.
const FRAME_TIME_US: u64 = 240;

struct Message {
    id: u32,
    period_ms: u64,
    /// Eight bytes, the first one lowest.
    payload: fn(Moment) -> u64,
}

struct DueFrame {
    due_us: u64,
    id: u32,
    data: [u8; 8],
}

/// The state on which a payload depends.
#[derive(Clone, Copy)]
struct Moment {
    id: u32,
    ms: u64,
    /// Number of times that the message was due before.
    count: u64,
    scene: Scene,
    motion: Motion,
}

const TURN_INDICATORS: u32 = 0x2A5;

const MESSAGES: [Message; 30] = [
    every(10, 0x0A4, other),
    every(10, 0x0B2, wheel_speeds),
    every(10, 0x0B8, other),
    every(10, 0x0C6, steering),
    every(10, 0x0D0, inertial),
    every(10, 0x0D8, other),
    every(10, 0x0E4, other),
    every(10, 0x0F0, engine),
    every(10, 0x0FA, other),
    every(10, 0x104, other),
    every(20, 0x110, brake),
    every(20, 0x120, other),
    every(20, 0x13C, other),
    every(20, 0x158, gearbox_speed),
    every(20, 0x1A0, gear),
    every(20, 0x1C2, other),
    every(20, 0x1E6, control_mode),
    every(20, 0x1F4, cruise_control),
    every(50, 0x24A, other),
    every(50, TURN_INDICATORS, turn_indicators),
    every(100, 0x2C1, hazard_lights),
    every(100, 0x2E0, doors),
    every(50, 0x310, stalk),
    every(100, 0x350, other),
    every(100, 0x36E, other),
    every(100, 0x3A0, climate),
    every(1000, 0x3F0, odometer),
    every(200, 0x3F8, cluster_pages),
    every(1000, 0x6F0, other),
    every(100, 0x18FF_5A21, position),
];

const fn every(period_ms: u64, id: u32, payload: fn(Moment) -> u64) -> Message {
    Message { id, period_ms, payload }
}

fn all_frames() -> Vec<DueFrame> {
    let (mut noise, drive) = (Noise(0x5EED), drive());
    let mut frames = Vec::new();
    for Message { id, period_ms, payload } in MESSAGES {
        // Each unit started at a moment of its own and sends a little late now and then.
        let phase_us = noise.below(period_ms * 1000);
        for count in 0..LENGTH_MS / period_ms {
            let due_us = phase_us + count * period_ms * 1000 + noise.below(20 * period_ms.min(20));
            let ms = due_us / 1000;
            let scene = scene_at(ms);
            let silent = id == TURN_INDICATORS && scene.turn.is_none();
            if ms < LENGTH_MS && !silent {
                let motion = motion_at(&drive, ms);
                let data = payload(Moment { id, ms, count, scene, motion }).to_le_bytes();
                frames.push(DueFrame { due_us, id, data });
            }
        }
    }
    frames
}

impl Moment {
    /// A value that goes up from `low` to `high` and back down within each `period_ms`.
    fn wave(self, period_ms: u64, low: i64, high: i64) -> i64 {
        let phase = (2 * (self.ms % period_ms)).cast_signed();
        let full = period_ms.cast_signed();
        let up = if phase < full { phase } else { 2 * full - phase };
        low + (high - low) * up / full
    }

    fn counter(self) -> u64 {
        (self.count % 16) << 52
    }

    /// Time since the begin of the scene, ms.
    fn into_scene_ms(self) -> u64 {
        self.ms - self.scene.from_ms
    }

    /// Lit half of the time, 90 times a minute.
    fn flash(self) -> bool {
        self.into_scene_ms() % 667 < 333
    }
}

/// Converts mm/s to 0.01 km/h.
fn centi_kmph(mmps: i64) -> i64 {
    mmps * 36 / 100
}

/// `value` as `length` bits from bit `start` on, Intel numbering.
fn bits(value: i64, start: u32, length: u32) -> u64 {
    (value.cast_unsigned() & ((1 << length) - 1)) << start
}

fn flag(on: bool, start: u32) -> u64 {
    u64::from(on) << start
}

/// `value` in the two bytes from `byte` on, high byte first.
fn big_endian(value: i64, byte: u32) -> u64 {
    let [.., high, low] = value.to_be_bytes();
    (u64::from(high) | u64::from(low) << 8) << (8 * byte)
}

fn turn_indicators(at: Moment) -> u64 {
    let state = at.scene.turn.unwrap_or(OFF);
    let lit = |side| at.flash() && (state == side || at.scene.hazard);
    flag(lit(LEFT), 0)
        | flag(lit(RIGHT), 1)
        | bits(state.into(), 17, 3)
        | flag(at.scene.lamp_fault, 24)
        | at.counter()
}

fn hazard_lights(at: Moment) -> u64 {
    let pressed = at.scene.hazard && at.into_scene_ms() < 300;
    flag(pressed, 0) | flag(at.scene.hazard, 8) | at.counter()
}

/// The lever is pushed through at the start of a turn and springs back.
fn stalk(at: Moment) -> u64 {
    let pushed = at.into_scene_ms() < 400;
    let lever = match at.scene.turn {
        Some(LEFT) if pushed => 2,
        Some(RIGHT) if pushed => 4,
        _ => 0,
    };
    bits(lever, 0, 3) | at.counter()
}

fn wheel_speeds(at: Moment) -> u64 {
    let wheels = at.motion.wheels_mmps().map(centi_kmph);
    let payload = (0..).zip(wheels).map(|(wheel, speed)| big_endian(speed, 2 * wheel));
    payload.fold(0, |sum, wheel| sum | wheel)
}

fn steering(at: Moment) -> u64 {
    // From µrad to 0.1 degrees.
    let angle = at.motion.wheel_urad() * 1_800 / 3_141_593;
    let torque = at.motion.lateral_mmps2() / 10;
    let payload = big_endian(angle, 0) | bits(torque, 16, 12) | at.counter();
    let checksum = payload.to_le_bytes().into_iter().fold(0, u8::wrapping_add);
    payload | u64::from(checksum) << 56
}

fn inertial(at: Moment) -> u64 {
    let [lateral, longitudinal] = [at.motion.lateral_mmps2(), at.motion.acceleration_mmps2];
    // From µrad/s to 0.1 degrees/s.
    let yaw_rate = at.motion.yaw_rate_uradps * 1_800 / 3_141_593;
    bits(lateral / 10, 0, 12) | bits(longitudinal / 10, 12, 12) | bits(yaw_rate, 24, 12) | at.counter()
}

/// The speed of the output shaft, which the sensors of the wheels do not influence.
fn gearbox_speed(at: Moment) -> u64 {
    let speed = centi_kmph(at.motion.speed_mmps.abs());
    bits(if at.scene.half_speed { speed / 2 } else { speed }, 0, 16) | at.counter()
}

fn engine(at: Moment) -> u64 {
    let [speed, acceleration] = [at.motion.speed_mmps.abs(), at.motion.acceleration_mmps2];
    let pedal = if acceleration > 0 { 20 + acceleration / 40 } else { speed / 500 };
    bits(3_200 + speed / 4, 0, 16) | bits(pedal, 16, 8) | at.counter()
}

fn brake(at: Moment) -> u64 {
    // 1 bar for each 0.05 m/s², and 20 bar by which the driver holds the car.
    let is_standing = at.motion.speed_mmps == 0;
    let pressure = if is_standing { 200 } else { (-at.motion.acceleration_mmps2 / 5).max(0) };
    big_endian(pressure << 4, 0) | flag(pressure > 0, 11) | at.counter()
}

fn gear(at: Moment) -> u64 {
    let engaged = if at.scene.gear == DRIVE { at.motion.speed_mmps / 3_000 + 1 } else { 0 };
    bits(at.scene.gear.into(), 0, 4) | bits(engaged, 4, 4) | at.counter()
}

fn cruise_control(at: Moment) -> u64 {
    bits(if at.scene.mode == AUTONOMOUS { 2 } else { 1 }, 0, 3) | bits(36, 8, 8) | at.counter()
}

fn control_mode(at: Moment) -> u64 {
    bits(at.scene.mode.into(), 0, 3) | at.counter()
}

fn doors(at: Moment) -> u64 {
    bits(at.scene.doors.into(), 0, 5) | bits((8 + 40) * 2, 8, 8)
}

fn climate(at: Moment) -> u64 {
    bits(at.wave(90_000, 116, 122), 0, 8) | bits(4, 8, 4)
}

fn odometer(at: Moment) -> u64 {
    bits(412_300 + at.motion.distance_mm / 100_000, 0, 24)
}

fn cluster_pages(at: Moment) -> u64 {
    if at.count.is_multiple_of(2) { bits(124, 8, 8) } else { bits(1, 0, 2) | bits(431, 8, 16) }
}

fn position(at: Moment) -> u64 {
    // 1e-7 degrees are 11.1 mm to the north, and at this latitude 9.0 mm to the east.
    let [east, north] = at.motion.place_um;
    bits(356_800_000 + north / 11_100, 0, 32) | bits(1_397_700_000 + east / 9_040, 32, 32)
}

/// A message nobody has described: a slow value, a constant of its own and a counter.
fn other(at: Moment) -> u64 {
    let period_ms = 5_000 + u64::from(at.id) * 7;
    let payload = bits(at.wave(period_ms, 0, 900), 0, 12) | bits(i64::from(at.id) * 31, 16, 24);
    payload | at.counter()
}

/// `SplitMix64`: small, well mixed, the same everywhere.
struct Noise(u64);

impl Noise {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (bits ^ (bits >> 31)) % limit
    }
}
