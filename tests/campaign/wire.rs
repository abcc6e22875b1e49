//! Bits, checksums and counters of frames, in the campaign's own hand.

/// A field of a frame: its bits from the lowest to the highest, each as byte and bit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    bits: Vec<(usize, u32)>,
    signed: bool,
}

impl Field {
    /// A field by the numbers of the DBC, `START|LENGTH@ORDER SIGN`: in Intel order (1) the start is the
    /// lowest bit, in Motorola order (0) the highest one, and the bits go on downwards into the next byte.
    pub(crate) fn new(start: usize, length: usize, intel: bool, signed: bool) -> Self {
        let place = |number: usize| (number / 8, u32::try_from(number % 8).unwrap());
        let motorola = |step: usize| place((start / 8 * 8 + 7 - start % 8 + step) ^ 7);
        let bits: Vec<_> = (0..length)
            .map(|step| if intel { place(start + step) } else { motorola(length - 1 - step) })
            .collect();
        Self { bits, signed }
    }

    /// The bytes that a frame must have for the field.
    pub(crate) fn needed_bytes(&self) -> usize {
        self.bits.iter().map(|(byte, _)| byte + 1).max().unwrap()
    }

    pub(crate) fn width(&self) -> usize {
        self.bits.len()
    }

    pub(crate) fn get(&self, data: &[u8]) -> i64 {
        let bit = |(byte, bit): &(usize, u32)| i64::from(data[*byte] >> bit & 1);
        let raw = self.bits.iter().rev().fold(0, |raw, place| raw << 1 | bit(place));
        let negative = self.signed && self.bits.last().is_some_and(|highest| bit(highest) == 1);
        if negative { raw - (1 << self.width()) } else { raw }
    }

    pub(crate) fn set(&self, data: &mut [u8], raw: i64) {
        for (step, (byte, bit)) in self.bits.iter().enumerate() {
            data[*byte] = data[*byte] & !(1 << bit) | u8::from(raw >> step & 1 == 1) << bit;
        }
    }
}

/// A vehicle maker's checksum, as the comments of openpilot's DBC files describe it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sum {
    /// 8 minus all nibbles of identifier and data, in four bits.
    Honda,
    /// 15 minus a start value and all nibbles of the data, in four bits.
    Psa(u32),
    /// Identifier and data, byte by byte.
    Identifier,
    /// 255 minus the first four bytes.
    Mazda,
}

impl Sum {
    /// The checksum of a frame whose checksum field is zero.
    pub(crate) fn of(self, id: u32, data: &[u8]) -> i64 {
        let nibbles =
            |bytes: &[u8]| bytes.iter().map(|byte| u32::from(byte >> 4) + u32::from(byte & 15)).sum::<u32>();
        let bytes = |bytes: &[u8]| bytes.iter().map(|byte| u32::from(*byte)).sum::<u32>();
        let id = id.to_be_bytes();
        let (sum, mask) = match self {
            Self::Honda => (8_u32.wrapping_sub(nibbles(&id) + nibbles(data)), 0xF),
            Self::Psa(start) => (15_u32.wrapping_sub(start + nibbles(data)), 0xF),
            Self::Identifier => (bytes(&id) + bytes(data), 0xFF),
            Self::Mazda => (255_u32.wrapping_sub(bytes(&data[..4])), 0xFF),
        };
        i64::from(sum & mask)
    }
}
