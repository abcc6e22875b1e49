//! Reads and writes one signal, compiled to a window, a shift and a mask.
//!
//! A raw value is the value on the wire: without factor and offset, sign-extended when the signal is signed.
//! [`SignalCodec::new`] refuses every invalid layout, so reading never fails, panics or allocates.

use std::ops::RangeInclusive;

use crate::can::MAX_DATA;

/// Number of bytes loaded at once; the longest signal (64 bits, unaligned) spans nine.
const WINDOW: usize = 16;

/// Byte order of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    /// `@1`: the start bit is the least significant bit, and significance grows with the bit number.
    Intel,
    /// `@0`: the start bit is the most significant bit; the value runs down through its byte and
    /// continues at bit 7 of the next.
    Motorola,
}

/// Position of a signal in the bit numbers of DBC (bit 0 is the least significant bit of byte 0).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Start bit, 0 to 511: the lowest bit of an Intel signal, the highest bit of a Motorola signal.
    pub start: u16,
    /// Length in bits, 1 to 64.
    pub length: u16,
    /// Byte order of the signal.
    pub order: ByteOrder,
    /// True if the raw value is signed (two's complement).
    pub signed: bool,
}

impl Layout {
    /// Returns the layout of an unsigned Intel signal.
    pub const fn unsigned(start: u16, length: u16) -> Self {
        Self { start, length, order: ByteOrder::Intel, signed: false }
    }
}

/// Reason why a layout is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum LayoutError {
    #[error("{0} bits long: a signal has 1 to 64")]
    Length(u16),
    #[error("needs {needed} bytes, the message has {available}")]
    OutsideMessage { needed: usize, available: usize },
}

/// The raw value lies outside [`SignalCodec::range`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the raw value does not fit in the signal's bits")]
pub struct OutOfRange;

/// Codec of one signal, which also evaluates its multiplexors.
///
/// ```
/// use can_signal::can::frame::MAX_DATA;
/// use can_signal::dbc::codec::{Layout, SignalCodec};
///
/// let codec = SignalCodec::new(Layout::unsigned(4, 8), 8).unwrap();
/// let mut data = [0; MAX_DATA];
/// codec.write(0xA5, &mut data).unwrap();
/// assert_eq!((data[0], data[1], codec.value(&data)), (0x50, 0x0A, 0xA5));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SignalCodec {
    bits: Bits,
    /// Conditions on all multiplexors above this signal, the outermost first.
    conditions: Box<[MultiplexorCondition]>,
    needed: usize,
}

/// Condition that a multiplexor has one of several values.
#[derive(Debug, Clone, PartialEq, Eq)]
struct MultiplexorCondition {
    multiplexor: Bits,
    values: Box<[RangeInclusive<i128>]>,
}

impl SignalCodec {
    /// Compiles a signal that is always present, in a message of `message_length` bytes.
    pub fn new(layout: Layout, message_length: usize) -> Result<Self, LayoutError> {
        let bits = Bits::compile(layout, message_length)?;
        Ok(Self { bits, conditions: Box::default(), needed: bits.needed })
    }

    /// Returns the same signal, present only while `multiplexor` is present and has one of `values`.
    pub fn multiplexed(self, multiplexor: &Self, values: &[RangeInclusive<u64>]) -> Self {
        let values = values.iter().map(|range| i128::from(*range.start())..=i128::from(*range.end()));
        let own = MultiplexorCondition { multiplexor: multiplexor.bits, values: values.collect() };
        let conditions = multiplexor.conditions.iter().cloned().chain([own]).collect();
        Self { bits: self.bits, conditions, needed: self.bits.needed.max(multiplexor.needed) }
    }

    /// Returns true if the multiplexors in `data` select this signal.
    pub fn is_present(&self, data: &[u8; MAX_DATA]) -> bool {
        self.conditions.iter().all(|condition| condition.holds(data))
    }

    /// Returns the smallest number of bytes in a frame that has the signal and all its multiplexors.
    pub fn needed_length(&self) -> usize {
        self.needed
    }

    /// Returns the raw value of the bits, whether or not the signal is present.
    pub fn value(&self, data: &[u8; MAX_DATA]) -> i128 {
        self.bits.read(data)
    }

    /// Returns the bits that encode `raw` in a frame, e.g. 0xF for -1 in four bits.
    pub fn wire_bits(&self, raw: i128) -> u128 {
        raw.cast_unsigned() & self.bits.mask()
    }

    /// Writes `raw` into the bits of the signal and leaves all other bits unchanged.
    pub fn write(&self, raw: i128, data: &mut [u8; MAX_DATA]) -> Result<(), OutOfRange> {
        let (lowest, highest) = self.range();
        if (lowest..=highest).contains(&raw) {
            self.bits.write(raw, data);
            Ok(())
        } else {
            Err(OutOfRange)
        }
    }

    /// Sets the multiplexors so that the signal is present, each to the lowest of its possible values.
    /// Fails when a multiplexor cannot hold that value.
    pub fn select(&self, data: &mut [u8; MAX_DATA]) -> Result<(), OutOfRange> {
        self.conditions.iter().try_for_each(|condition| {
            let (_, highest) = condition.multiplexor.range();
            let value = condition.values.iter().map(|range| *range.start()).min().ok_or(OutOfRange)?;
            (value <= highest).then(|| condition.multiplexor.write(value, data)).ok_or(OutOfRange)
        })
    }

    /// Returns the lowest and highest raw value of the signal.
    pub fn range(&self) -> (i128, i128) {
        self.bits.range()
    }

    /// Returns the length of the signal in bits, 1 to 64.
    pub fn bit_length(&self) -> u32 {
        self.bits.length
    }

    /// Returns true if the signal depends on a multiplexor.
    pub fn is_multiplexed(&self) -> bool {
        !self.conditions.is_empty()
    }

    /// Returns true if one frame may carry both signals in the same bits.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.bits.shares_bits(other.bits) && !self.excludes(other)
    }

    /// Returns true if a common multiplexor prevents both signals from being present.
    fn excludes(&self, other: &Self) -> bool {
        self.conditions.iter().any(|own| other.conditions.iter().any(|theirs| own.excludes(theirs)))
    }
}

impl MultiplexorCondition {
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

/// Compiled position: `WINDOW` bytes from `first`, read in `order`, shifted right, masked to `length`.
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
        #[allow(clippy::cast_possible_truncation)] // the bits cut off belong to other signals
        let bits = (self.window(data) >> self.shift) as u64;
        let unused = u64::BITS - self.length;
        if self.signed {
            ((bits << unused).cast_signed() >> unused).into()
        } else {
            (bits << unused >> unused).into()
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn codec(start: u16, length: u16, order: ByteOrder, signed: bool) -> SignalCodec {
        SignalCodec::new(Layout { start, length, order, signed }, 8).unwrap()
    }

    fn data(bytes: &[u8]) -> [u8; MAX_DATA] {
        let mut data = [0; MAX_DATA];
        data[..bytes.len()].copy_from_slice(bytes);
        data
    }

    /// DBC bit numbers of a signal, least significant first.
    fn positions(layout: Layout) -> Vec<usize> {
        let mut position = usize::from(layout.start);
        let mut positions = Vec::new();
        for _ in 0..layout.length {
            positions.push(position);
            position = match layout.order {
                ByteOrder::Intel => position + 1,
                ByteOrder::Motorola if position % 8 == 0 => position + 15,
                ByteOrder::Motorola => position - 1,
            };
        }
        if layout.order == ByteOrder::Motorola {
            positions.reverse();
        }
        positions
    }

    /// Reads bit by bit, independently of the compiled position.
    fn reference(layout: Layout, data: &[u8; MAX_DATA]) -> i128 {
        let mut value = 0;
        let mut weight = 1;
        for (bit, position) in positions(layout).into_iter().enumerate() {
            let is_sign = layout.signed && bit + 1 == usize::from(layout.length);
            if data[position / 8] & (1 << (position % 8)) != 0 {
                value += if is_sign { -weight } else { weight };
            }
            weight *= 2;
        }
        value
    }

    fn order() -> impl Strategy<Value = ByteOrder> {
        prop_oneof![Just(ByteOrder::Intel), Just(ByteOrder::Motorola)]
    }

    fn any_layout() -> impl Strategy<Value = Layout> {
        (0_u16..512, 1_u16..=64, order(), any::<bool>()).prop_map(|(start, length, order, signed)| Layout {
            start,
            length,
            order,
            signed,
        })
    }

    /// Returns a valid layout and the length of its message.
    fn layout_in_message() -> impl Strategy<Value = (Layout, usize)> {
        (any_layout(), 1_usize..=64).prop_filter("inside the message", |(layout, length)| {
            positions(*layout).iter().all(|position| position / 8 < *length)
        })
    }

    proptest! {
        #[test]
        fn decoding_agrees_with_reading_bit_by_bit(
            (layout, length) in layout_in_message(),
            data in prop::array::uniform32(any::<u16>()),
        ) {
            let mut bytes = [0; MAX_DATA];
            bytes.iter_mut().zip(data.iter().flat_map(|pair| pair.to_le_bytes())).for_each(|(to, from)| *to = from);
            let codec = SignalCodec::new(layout, length).unwrap();
            prop_assert_eq!(codec.value(&bytes), reference(layout, &bytes));
            let last = positions(layout).into_iter().map(|position| position / 8).max().unwrap();
            prop_assert_eq!(codec.needed_length(), last + 1);
        }

        #[test]
        fn written_value_is_read_back_and_other_bits_are_unchanged(
            (layout, length) in layout_in_message(),
            bits in any::<u64>(),
            background in any::<u8>(),
        ) {
            let codec = SignalCodec::new(layout, length).unwrap();
            let (lowest, highest) = codec.range();
            let raw = lowest + i128::from(bits) % (highest - lowest + 1);
            let before = [background; MAX_DATA];
            let mut after = before;
            codec.write(raw, &mut after).unwrap();
            prop_assert_eq!(codec.value(&after), raw);
            let own = positions(layout);
            for position in (0..MAX_DATA * 8).filter(|position| !own.contains(position)) {
                let bit = |data: &[u8; MAX_DATA]| data[position / 8] >> (position % 8) & 1;
                prop_assert_eq!(bit(&after), bit(&before), "bit {}", position);
            }
            for outside in [lowest - 1, highest + 1, i128::MIN, i128::MAX] {
                let unchanged = after;
                prop_assert_eq!(codec.write(outside, &mut after), Err(OutOfRange));
                prop_assert_eq!(unchanged, after);
            }
        }

        #[test]
        fn layout_is_refused_exactly_when_a_bit_lies_outside(layout in any_layout(), length in 0_usize..=80) {
            let fits = positions(layout).iter().all(|position| position / 8 < length.min(MAX_DATA));
            prop_assert_eq!(SignalCodec::new(layout, length).is_ok(), fits);
        }

        #[test]
        fn signals_overlap_exactly_when_they_share_a_bit(a in any_layout(), b in any_layout()) {
            let (Ok(one), Ok(other)) = (SignalCodec::new(a, 64), SignalCodec::new(b, 64)) else {
                return Ok(());
            };
            let common = positions(a).iter().any(|position| positions(b).contains(position));
            prop_assert_eq!(one.overlaps(&other), common);
        }
    }

    #[test]
    fn both_byte_orders_match_dbc_format() {
        let data = data(&[0x12, 0x34, 0x56, 0xF8]);
        assert_eq!(codec(4, 8, ByteOrder::Intel, false).value(&data), 0x41);
        assert_eq!(codec(3, 8, ByteOrder::Motorola, false).value(&data), 0x23);
        assert_eq!(codec(7, 32, ByteOrder::Motorola, false).value(&data), 0x1234_56F8);
        assert_eq!(codec(27, 5, ByteOrder::Intel, true).value(&data), -1);
        assert_eq!(
            codec(0, 64, ByteOrder::Intel, true).range(),
            (i128::from(i64::MIN), i128::from(i64::MAX))
        );
        assert_eq!(codec(0, 1, ByteOrder::Intel, false).range(), (0, 1));
    }

    #[test]
    fn lengths_outside_1_to_64_bits_are_refused() {
        for length in [0, 65, u16::MAX] {
            let layout = Layout::unsigned(0, length);
            assert_eq!(SignalCodec::new(layout, 64), Err(LayoutError::Length(length)));
        }
    }

    #[test]
    fn multiplexed_signal_requires_all_its_multiplexors() {
        let page = codec(0, 8, ByteOrder::Intel, false);
        let row = codec(56, 8, ByteOrder::Intel, false).multiplexed(&page, &[1..=3, 7..=7]);
        let cell = codec(16, 8, ByteOrder::Intel, false).multiplexed(&row, &[5..=5]);
        let present =
            |codec: &SignalCodec, page, row| codec.is_present(&data(&[page, 0, 9, 0, 0, 0, 0, row]));
        assert!(present(&page, 99, 0));
        assert!(present(&row, 2, 0) && present(&row, 7, 0) && !present(&row, 4, 0));
        assert!(present(&cell, 2, 5) && !present(&cell, 2, 6) && !present(&cell, 4, 5));
        assert_eq!(
            (cell.needed_length(), page.needed_length()),
            (8, 1),
            "a frame must have the multiplexors too"
        );
        let mut selected = data(&[]);
        cell.select(&mut selected).unwrap();
        assert_eq!((selected[0], selected[7], cell.is_present(&selected)), (1, 5, true));
        let unreachable = codec(16, 8, ByteOrder::Intel, false).multiplexed(&page, &[256..=300]);
        assert_eq!(unreachable.select(&mut selected), Err(OutOfRange));
    }

    #[test]
    fn alternatives_of_one_multiplexor_do_not_overlap() {
        let page = codec(0, 8, ByteOrder::Intel, false);
        let plain = codec(8, 8, ByteOrder::Intel, false);
        let [first, second, both] =
            [vec![0..=1], vec![2..=2], vec![1..=2]].map(|values| plain.clone().multiplexed(&page, &values));
        assert!(!first.overlaps(&second));
        assert!(first.overlaps(&both) && first.overlaps(&plain));
    }
}
