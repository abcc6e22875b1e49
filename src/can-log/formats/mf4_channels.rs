//! Channels of an MF4 file: the position of a value in a record, and its conversion; and the channels of a
//! CAN frame.

use std::io;

use super::mf4_blocks::{Block, Blocks};
use crate::clock::nanos_of_seconds;
use crate::entry::BadLine;
use crate::format::damaged;
use crate::little_endian::{f64_at, u16_at, u32_at, u64_at};

/// Kinds of a channel.
const VARIABLE_LENGTH: u8 = 1;
const MASTER: u8 = 2;
const VIRTUAL_MASTER: u8 = 3;
const VIRTUAL_DATA: u8 = 6;

/// Quantity that a master channel measures.
const TIME: u8 = 1;

/// Conversion of a stored number to a value.
#[derive(Debug, Clone, PartialEq)]
enum Conversion {
    None,
    Linear {
        offset: f64,
        factor: f64,
    },
    /// Coefficients of two parabolas, whose quotient is the value.
    Rational([f64; 6]),
    /// Pairs of numbers and values.
    Table(Vec<(f64, f64)>),
}

impl Conversion {
    fn of(file: &Blocks, link: Option<u64>) -> io::Result<Self> {
        let Some(link) = link else { return Ok(Self::None) };
        let data = file.block_of_kind(link, *b"CC")?.data;
        let pairs = usize::from(u16_at(data, 6)).min(data.len() / 8) / 2;
        let value = |index: usize| f64_at(data, 24 + index * 8);
        Ok(match data.first() {
            Some(1) => Self::Linear { offset: value(0), factor: value(1) },
            Some(2) => Self::Rational(std::array::from_fn(value)),
            Some(4 | 5) => {
                Self::Table((0..pairs).map(|pair| (value(2 * pair), value(2 * pair + 1))).collect())
            }
            // For values converted to text, such as Rx, the number is used.
            Some(0 | 7 | 8) => Self::None,
            _ => return Err(damaged("MF4: a conversion of numbers is not supported")),
        })
    }

    /// Returns the number of pairs of a table, all of which a conversion visits.
    fn pairs(&self) -> usize {
        if let Self::Table(pairs) = self { pairs.len() } else { 0 }
    }

    fn value(&self, number: f64) -> Option<f64> {
        match self {
            Self::None => Some(number),
            Self::Linear { offset, factor } => Some(offset + factor * number),
            Self::Rational(coefficients) => {
                let parabola = |part: &[f64]| part.iter().fold(0.0, |sum, factor| sum * number + factor);
                let (above, below) = coefficients.split_at(3);
                Some(parabola(above) / parabola(below))
            }
            Self::Table(pairs) => {
                pairs.iter().find(|(key, _)| (key - number).abs() < 0.5).map(|(_, value)| *value)
            }
        }
    }
}

#[derive(Debug, Clone)]
pub(super) struct Channel {
    kind: u8,
    data_type: u8,
    bit_offset: u32,
    byte_offset: usize,
    bit_count: u32,
    conversion: Conversion,
    /// Location of values with variable length: data blocks or a group.
    pub(super) values: Option<u64>,
}

impl Channel {
    fn of(file: &Blocks, block: &Block<'_>) -> io::Result<Self> {
        let data = block.data;
        let byte = |at: usize| data.get(at).copied().unwrap_or(0);
        Ok(Self {
            kind: byte(0),
            data_type: byte(2),
            bit_offset: byte(3).into(),
            byte_offset: usize::try_from(u32_at(data, 4)).unwrap_or(usize::MAX),
            bit_count: u32_at(data, 8),
            conversion: Conversion::of(file, block.link(4))?,
            values: block.link(5).filter(|_| byte(0) == VARIABLE_LENGTH),
        })
    }

    /// Returns the value in the record at position `index` of its group.
    pub(super) fn value(&self, record: &[u8], index: u64) -> Option<f64> {
        let is_virtual = matches!(self.kind, VIRTUAL_MASTER | VIRTUAL_DATA);
        #[allow(clippy::cast_precision_loss)] // 2^53 records are more than a file has
        let number = if is_virtual { index as f64 } else { self.stored(record)? };
        self.conversion.value(number).filter(|value| value.is_finite())
    }

    /// Returns the value as a number without sign.
    pub(super) fn number(&self, record: &[u8], index: u64) -> Option<u32> {
        let value = self.value(record, index).filter(|value| (0.0..4_294_967_296.0).contains(value))?;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // in range
        let number = value as u32;
        Some(number)
    }

    #[allow(clippy::cast_precision_loss, clippy::cast_possible_wrap)] // more than 53 bits have no meaning here
    fn stored(&self, record: &[u8]) -> Option<f64> {
        let bits = self.bit_offset.checked_add(self.bit_count).filter(|bits| (1..=64).contains(bits))?;
        let length = usize::try_from(bits.div_ceil(8)).ok()?;
        let stored = record.get(self.byte_offset..)?.get(..length)?;
        let mut bytes = [0; 8];
        bytes[..length].copy_from_slice(stored);
        if self.data_type % 2 == 1 {
            bytes[..length].reverse();
        }
        let number = u64_at(&bytes, 0) >> self.bit_offset;
        let unused = 64 - self.bit_count;
        Some(match (self.data_type, self.bit_count) {
            (0 | 1, 1..) => (number << unused >> unused) as f64,
            (2 | 3, 1..) => ((number << unused) as i64 >> unused) as f64,
            (4 | 5, 32) => f32::from_bits(u32_at(&number.to_le_bytes(), 0)).into(),
            (4 | 5, 64) => f64::from_bits(number),
            _ => return None,
        })
    }

    /// Returns the bytes of an array or, from `values`, a value of variable length.
    pub(super) fn bytes<'a>(&self, record: &'a [u8], values: &'a [u8]) -> Option<&'a [u8]> {
        let at = |bytes: &'a [u8], start, length| bytes.get(start..)?.get(..length);
        if self.kind != VARIABLE_LENGTH {
            return at(record, self.byte_offset, usize::try_from(self.bit_count / 8).ok()?);
        }
        let offset = record.get(self.byte_offset..)?;
        let offset = match self.bit_count {
            32 => u32_at(offset, 0).into(),
            _ => u64_at(offset, 0),
        };
        let start = usize::try_from(offset).ok()?;
        let length = u32_at(at(values, start, 4)?, 0);
        at(values, start + 4, usize::try_from(length).ok()?)
    }
}

/// Content of the records of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrameKind {
    Data,
    Remote,
    Error,
}

/// Channels of frames, by their names in the bus logging standard.
#[derive(Debug, Clone)]
pub(super) struct FrameChannels {
    pub(super) kind: FrameKind,
    /// Seconds since the start of the measurement.
    pub(super) time: Option<Channel>,
    pub(super) parts: [Option<Channel>; PARTS.len()],
}

/// Ends of the names of channels: bus, identifier, whether it has 29 bits, whether the frame is CAN FD, DLC,
/// length and data.
const PARTS: [&str; 7] = [".BusChannel", ".ID", ".IDE", ".EDL", ".DLC", ".DataLength", ".DataBytes"];

const KINDS: [(&str, FrameKind); 3] = [
    ("CAN_DataFrame", FrameKind::Data),
    ("CAN_RemoteFrame", FrameKind::Remote),
    ("CAN_ErrorFrame", FrameKind::Error),
];

impl FrameChannels {
    /// Reads the channels of a group, starting at `first`; `None` if its records are not CAN frames.
    pub(super) fn of(file: &Blocks, first: Option<u64>) -> io::Result<Option<Self>> {
        let mut found = Self { kind: FrameKind::Data, time: None, parts: [const { None }; PARTS.len()] };
        let mut is_frame = false;
        let mut links = Vec::from_iter(first);
        while let Some(link) = links.pop() {
            let block = file.block(link)?;
            // A channel may also consist of an array, which no part of a frame does.
            if block.kind != *b"CN" {
                continue;
            }
            links.extend(block.link(0).into_iter().chain(block.link(1)));
            let is_time = block.data.get(1) == Some(&TIME);
            if matches!(block.data.first(), Some(&MASTER | &VIRTUAL_MASTER)) && is_time {
                found.time = Some(Channel::of(file, &block)?);
                continue;
            }
            let name = file.text(block.link(2))?;
            let part = KINDS.into_iter().find_map(|(frame, kind)| Some((name.strip_prefix(frame)?, kind)));
            let Some((part, kind)) = part else { continue };
            if part.is_empty() {
                (found.kind, is_frame) = (kind, true);
            }
            if let Some(index) = PARTS.iter().position(|known| *known == part) {
                found.parts[index] = Some(Channel::of(file, &block)?);
            }
        }
        Ok(is_frame.then_some(found))
    }

    pub(super) fn data(&self) -> Option<&Channel> {
        self.parts.last()?.as_ref()
    }

    /// Returns the number of pairs in conversion tables.
    pub(super) fn pairs(&self) -> u64 {
        let channels = self.parts.iter().chain([&self.time]).flatten();
        channels.map(|channel| channel.conversion.pairs() as u64).sum()
    }

    /// Returns the time of a record in ns since the start of the measurement.
    pub(super) fn nanos(&self, record: &[u8], index: u64) -> Result<i64, BadLine> {
        let Some(time) = &self.time else { return Ok(0) };
        time.value(record, index).and_then(nanos_of_seconds).ok_or(BadLine::NoTime)
    }
}
