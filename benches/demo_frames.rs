//! Frames of the demo vehicle's lights by the work that they cause, and recordings of any length made of its
//! demo.

#![allow(dead_code)] // each benchmark uses its part

use std::fs::File;
use std::hint::black_box;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::Path;

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use flate2::read::MultiGzDecoder;
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::Input;
use signal_gateway::config::files::Disk;
use signal_gateway::config::load_profile;

/// The profile with the lights of the demo vehicle alone: a frame of another message is not decoded.
pub(crate) const LIGHTS_VEHICLE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/tests/support/lights_vehicle.toml");

/// An identifier of 11 bits with its data.
pub(crate) type Message = (u16, [u8; 8]);

/// The bound messages: left, right, and no hazard.
pub(crate) const LEFT: Message = (0x2A5, [1, 0, 0b0010, 0, 0, 0, 0x10, 0]);
pub(crate) const RIGHT: Message = (0x2A5, [2, 0, 0b0100, 0, 0, 0, 0x20, 0]);
const HAZARD: Message = (0x2C1, [0; 8]);
/// A message that keeps the bus alive and is not decoded.
const WHEEL_SPEEDS: Message = (0x0B2, [0x07, 0xA9, 0x07, 0xF9, 0x07, 0xBD, 0x07, 0xE5]);
/// A message that is not bound, should it pass the kernel's filter.
const UNBOUND: Message = (0x0F0, [0x3B, 0x11, 0x0A, 0, 0, 0, 0, 0]);

pub(crate) const NOW: Now = Now { mono: MonoTime::from_millis(1), wall: WallStamp::from_nanos(0) };

/// Two frames that are fed in turn, which cause the same work again and again.
pub(crate) struct FramePair {
    /// Name of the row.
    pub(crate) name: &'static str,
    frames: [Message; 2],
    /// Number of outputs that each leads to.
    outputs: u32,
}

pub(crate) const UNCHANGED: FramePair =
    FramePair { name: "frame, value unchanged", frames: [LEFT, LEFT], outputs: 0 };
pub(crate) const CHANGED: FramePair =
    FramePair { name: "frame, value changed", frames: [LEFT, RIGHT], outputs: 1 };
pub(crate) const SIGN_OF_LIFE: FramePair =
    FramePair { name: "frame, sign of life only", frames: [WHEEL_SPEEDS, WHEEL_SPEEDS], outputs: 0 };
pub(crate) const IRRELEVANT: FramePair =
    FramePair { name: "frame, not relevant", frames: [UNBOUND, UNBOUND], outputs: 0 };

impl FramePair {
    /// The gateway of the demo vehicle's lights, and the inputs; checks that they lead to as many outputs as
    /// they should.
    pub(crate) fn prepared(&self) -> (Gateway, [CanInput; 2]) {
        let (mut gateway, inputs) = (gateway(), self.frames.map(input));
        for input in [&inputs[1], &inputs[0], &inputs[1]].map(Clone::clone) {
            assert_eq!(take(&mut gateway, input, NOW), self.outputs, "{}", self.name);
        }
        (gateway, inputs)
    }
}

/// The whole handling of an input: in, and all resulting outputs out.
pub(crate) fn take(gateway: &mut Gateway, input: impl Into<Input>, now: Now) -> u32 {
    gateway.handle(black_box(input.into()), now);
    let mut outputs = 0;
    while let Some(output) = gateway.poll_output() {
        black_box(&output);
        outputs += 1;
    }
    outputs
}

/// The demo vehicle's, with all links up and every message received.
pub(crate) fn gateway() -> Gateway {
    let settings = load_profile(&Disk, Path::new(LIGHTS_VEHICLE)).unwrap();
    let mut gateway = Gateway::new(settings.gateway, LinkState::Up, NOW);
    for frame in [WHEEL_SPEEDS, HAZARD, LEFT] {
        take(&mut gateway, input(frame), NOW);
    }
    gateway
}

pub(crate) fn input((id, data): Message) -> CanInput {
    let frame = Frame::classic(CanId::Standard(id), &data).unwrap();
    CanInput::Frame { bus: BusIndex(0), frame, stamp: NOW.wall }
}

/// The time between the end of a recording and its next round, ns.
const PAUSE_NS: u64 = 100_000_000;

/// Writes so many frames of a candump log, again and again. Line by line: this process must stay smaller than
/// those it measures.
pub(crate) fn write_frames(out: &mut impl Write, source: &Path, frames: u32) -> io::Result<()> {
    let (mut left, mut shift_ns) = (frames, 0);
    loop {
        let file = File::open(source)?;
        let is_packed = source.extension().is_some_and(|extension| extension == "gz");
        let log: Box<dyn Read> = if is_packed { Box::new(MultiGzDecoder::new(file)) } else { Box::new(file) };
        let (mut first_ns, mut last_ns) = (None, 0);
        for line in BufReader::new(log).lines() {
            if left == 0 {
                return Ok(());
            }
            let line = line?;
            let (stamp, rest) = line[1..].split_once(')').unwrap();
            let (seconds, micros) = stamp.split_once('.').unwrap();
            let [seconds, micros] = [seconds, micros].map(|number| number.parse::<u64>().unwrap());
            last_ns = seconds * 1_000_000_000 + micros * 1000;
            first_ns.get_or_insert(last_ns);
            let now_us = (last_ns + shift_ns) / 1000;
            writeln!(out, "({}.{:06}){rest}", now_us / 1_000_000, now_us % 1_000_000)?;
            left -= 1;
        }
        shift_ns += last_ns - first_ns.unwrap() + PAUSE_NS;
    }
}
