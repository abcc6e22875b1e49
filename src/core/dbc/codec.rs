//! One signal's bits, compiled: a window, a shift and a mask.
//!
//! A raw value is what the wire carries: no factor, no offset, sign-extended when the signal is
//! signed. Everything a layout can get wrong is refused in [`SignalCodec::new`], so reading can
//! neither fail nor panic nor allocate.

use std::ops::RangeInclusive;

use crate::core::frame::MAX_DATA;

/// Bytes loaded at once: the longest signal (64 bits, unaligned) spans nine.
const WINDOW: usize = 16;

/// Order of a signal's bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    /// `@1`: the start bit is the least significant one, significance grows with the bit number.
    Intel,
    /// `@0`: the start bit is the most significant one; the value goes down through its byte and
    /// on from bit 7 of the next.
    Motorola,
}

/// Where a signal lies, in DBC's numbers (bit 0 is the least significant bit of byte 0).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Start bit, 0 to 511; which end of the signal it is depends on the order.
    pub start: u16,
    /// Length in bits, 1 to 64.
    pub length: u16,
    /// Order of the bits.
    pub order: ByteOrder,
    /// Whether the raw value is two's complement.
    pub signed: bool,
}

/// Why a layout cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LayoutError {
    /// Not 1 to 64 bits.
    #[error("{0} bits long: a signal has 1 to 64")]
    Length(u16),
    /// Bits beyond the message's last byte.
    #[error("needs {needed} bytes, the message has {available}")]
    OutsideMessage {
        /// Bytes needed for all bits.
        needed: usize,
        /// Bytes there are.
        available: usize,
    },
}

/// A raw value that the signal's bits cannot hold; see [`SignalCodec::range`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the raw value does not fit in the signal's bits")]
pub struct OutOfRange;

/// Reads and writes one signal, and tells whether the multiplexer has it in the frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SignalCodec {
    bits: Bits,
    /// Every multiplexor above this signal, the outermost first. All must agree.
    conditions: Box<[Condition]>,
}

/// "This multiplexor has one of these values."
#[derive(Debug, Clone, PartialEq, Eq)]
struct Condition {
    multiplexor: Bits,
    values: Box<[RangeInclusive<i128>]>,
}

impl SignalCodec {
    /// Compiles a signal that is always present, in a message of `message_length` bytes.
    pub fn new(layout: Layout, message_length: usize) -> Result<Self, LayoutError> {
        Ok(Self { bits: Bits::compile(layout, message_length)?, conditions: Box::default() })
    }

    /// The same signal, present only while `multiplexor` is present itself and has one of `values`.
    pub fn multiplexed(self, multiplexor: &Self, values: &[RangeInclusive<u64>]) -> Self {
        let values = values.iter().map(|range| i128::from(*range.start())..=i128::from(*range.end()));
        let own = Condition { multiplexor: multiplexor.bits, values: values.collect() };
        let conditions = multiplexor.conditions.iter().cloned().chain([own]).collect();
        Self { bits: self.bits, conditions }
    }

    /// Whether the multiplexors in `data` say that this signal is in the frame.
    pub fn is_present(&self, data: &[u8; MAX_DATA]) -> bool {
        self.conditions.iter().all(|condition| condition.holds(data))
    }

    /// Bytes a frame must have so that the signal and all its multiplexors can be read.
    pub fn needed_length(&self) -> usize {
        let multiplexors = self.conditions.iter().map(|condition| condition.multiplexor.needed);
        multiplexors.fold(self.bits.needed, usize::max)
    }

    /// The raw value, whether or not the signal is present.
    pub fn value(&self, data: &[u8; MAX_DATA]) -> i128 {
        self.bits.read(data)
    }

    /// Puts `raw` into the signal's bits and leaves all others alone.
    pub fn write(&self, raw: i128, data: &mut [u8; MAX_DATA]) -> Result<(), OutOfRange> {
        let (lowest, highest) = self.range();
        if (lowest..=highest).contains(&raw) {
            self.bits.write(raw, data);
            Ok(())
        } else {
            Err(OutOfRange)
        }
    }

    /// Sets the multiplexors so that the signal is present; of several values the lowest counts.
    ///
    /// Refuses when a multiplexor cannot hold the value that selects this signal.
    pub fn select(&self, data: &mut [u8; MAX_DATA]) -> Result<(), OutOfRange> {
        self.conditions.iter().try_for_each(|condition| {
            let (_, highest) = condition.multiplexor.range();
            let value = condition.values.iter().map(|range| *range.start()).min().ok_or(OutOfRange)?;
            (value <= highest).then(|| condition.multiplexor.write(value, data)).ok_or(OutOfRange)
        })
    }

    /// Lowest and highest raw value.
    pub fn range(&self) -> (i128, i128) {
        self.bits.range()
    }

    /// Length in bits, 1 to 64.
    pub fn bit_length(&self) -> u32 {
        self.bits.length
    }

    /// Whether a multiplexor decides about this signal.
    pub fn is_multiplexed(&self) -> bool {
        !self.conditions.is_empty()
    }

    /// Whether a frame may carry both signals in the same bits.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.bits.shares_bits(other.bits) && !self.excludes(other)
    }

    /// Whether a common multiplexor never lets both be present.
    fn excludes(&self, other: &Self) -> bool {
        self.conditions.iter().any(|mine| other.conditions.iter().any(|theirs| mine.excludes(theirs)))
    }
}

impl Condition {
    fn holds(&self, data: &[u8; MAX_DATA]) -> bool {
        let value = self.multiplexor.read(data);
        self.values.iter().any(|range| range.contains(&value))
    }

    fn excludes(&self, other: &Self) -> bool {
        let disjoint =
            |a: &RangeInclusive<i128>, b: &RangeInclusive<i128>| a.end() < b.start() || b.end() < a.start();
        self.multiplexor == other.multiplexor
            && self.values.iter().all(|a| other.values.iter().all(|b| disjoint(a, b)))
    }
}

/// The compiled position: `WINDOW` bytes from `first`, read in `order`, shifted right, cut to length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Bits {
    first: usize,
    order: ByteOrder,
    shift: u32,
    length: u32,
    signed: bool,
    needed: usize,
}

impl Bits {
    fn compile(layout: Layout, message_length: usize) -> Result<Self, LayoutError> {
        let Layout { start, length, order, signed } = layout;
        if !(1..=64).contains(&length) {
            return Err(LayoutError::Length(length));
        }
        // Positions count in the order of the value's bits: from a byte's bit 0 up for Intel,
        // from its bit 7 down for Motorola.
        let begin = match order {
            ByteOrder::Intel => usize::from(start),
            ByteOrder::Motorola => usize::from(start ^ 7),
        };
        let end = begin + usize::from(length);
        let needed = end.div_ceil(8);
        let available = message_length.min(MAX_DATA);
        if needed > available {
            return Err(LayoutError::OutsideMessage { needed, available });
        }
        let first = (begin / 8).min(MAX_DATA - WINDOW);
        let shift = match order {
            ByteOrder::Intel => begin - first * 8,
            ByteOrder::Motorola => (first + WINDOW) * 8 - end,
        };
        // Below 128: the window starts at the signal's first byte, or ends with the frame.
        let shift = u32::try_from(shift).unwrap_or(0);
        Ok(Self { first, order, shift, length: u32::from(length), signed, needed })
    }

    fn read(self, data: &[u8; MAX_DATA]) -> i128 {
        let unsigned = (self.window(data) >> self.shift) & self.mask();
        if self.signed {
            let unused = u128::BITS - self.length;
            (unsigned << unused).cast_signed() >> unused
        } else {
            unsigned.cast_signed()
        }
    }

    fn write(self, raw: i128, data: &mut [u8; MAX_DATA]) {
        let others = self.window(data) & !(self.mask() << self.shift);
        let window = others | ((raw.cast_unsigned() & self.mask()) << self.shift);
        let bytes = match self.order {
            ByteOrder::Intel => window.to_le_bytes(),
            ByteOrder::Motorola => window.to_be_bytes(),
        };
        data[self.first..self.first + WINDOW].copy_from_slice(&bytes);
    }

    fn window(self, data: &[u8; MAX_DATA]) -> u128 {
        let mut bytes = [0; WINDOW];
        bytes.copy_from_slice(&data[self.first..self.first + WINDOW]);
        match self.order {
            ByteOrder::Intel => u128::from_le_bytes(bytes),
            ByteOrder::Motorola => u128::from_be_bytes(bytes),
        }
    }

    fn mask(self) -> u128 {
        u128::MAX >> (u128::BITS - self.length)
    }

    fn range(self) -> (i128, i128) {
        if self.signed {
            let half = 1_i128 << (self.length - 1);
            (-half, half - 1)
        } else {
            (0, self.mask().cast_signed())
        }
    }

    fn shares_bits(self, other: Self) -> bool {
        let (mut mine, mut theirs) = ([0; MAX_DATA], [0; MAX_DATA]);
        self.write(-1, &mut mine);
        other.write(-1, &mut theirs);
        mine.iter().zip(theirs).any(|(a, b)| a & b != 0)
    }
}
