//! Helpers shared by the tests of message bytes.

use serde::Serialize;

use gateway_base::time::WallStamp;

/// Encodes a message as RustDDS does: little-endian CDR, without the four-byte encapsulation header.
pub(super) fn cdr(message: &impl Serialize) -> Vec<u8> {
    cdr_encoding::to_vec::<_, byteorder::LittleEndian>(message).unwrap()
}

pub(super) const STAMP: WallStamp = WallStamp::from_nanos(1_700_000_000_123_456_789);
// 1 700 000 000 = 0x6553F100, 123 456 789 = 0x075BCD15.
pub(super) const STAMP_BYTES: [u8; 8] = [0x00, 0xF1, 0x53, 0x65, 0x15, 0xCD, 0x5B, 0x07];

pub(super) fn with_stamp(rest: &[u8]) -> Vec<u8> {
    [&STAMP_BYTES, rest].concat()
}

/// Builds a CDR string by hand: length including the terminating zero, text, zero, and if `padded` the
/// padding to the next multiple of four.
pub(super) fn string(text: &str, padded: bool) -> Vec<u8> {
    let length = u8::try_from(text.len() + 1).unwrap();
    let mut bytes = vec![length, 0, 0, 0];
    bytes.extend(text.as_bytes());
    bytes.push(0);
    while padded && bytes.len() % 4 != 0 {
        bytes.push(0);
    }
    bytes
}

/// Builds a message by hand: little-endian CDR, each number aligned to its own size.
#[derive(Default)]
pub(super) struct Wire(Vec<u8>);

impl Wire {
    /// Begins with [`STAMP`] and the frame `map`: a `std_msgs/msg/Header`.
    pub(super) fn with_header() -> Self {
        Self::default().stamp().text("map")
    }

    /// Appends [`STAMP`].
    pub(super) fn stamp(self) -> Self {
        self.aligned(4).bytes(&STAMP_BYTES)
    }

    fn aligned(mut self, to: usize) -> Self {
        self.0.resize(self.0.len().next_multiple_of(to), 0);
        self
    }

    /// Appends bytes unchanged: `bool`, `uint8`, and arrays of them.
    pub(super) fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend(bytes);
        self
    }

    /// Appends a `uint16`.
    pub(super) fn short(self, value: u16) -> Self {
        self.aligned(2).bytes(&value.to_le_bytes())
    }

    /// Appends a `uint32`, also the length of a sequence.
    pub(super) fn count(self, value: u32) -> Self {
        self.aligned(4).bytes(&value.to_le_bytes())
    }

    /// Appends an `int64`.
    pub(super) fn id(self, value: i64) -> Self {
        self.aligned(8).bytes(&value.to_le_bytes())
    }

    /// Appends several `float32`.
    pub(super) fn singles(self, values: &[f32]) -> Self {
        values.iter().fold(self, |wire, value| wire.aligned(4).bytes(&value.to_le_bytes()))
    }

    /// Appends several `float64`.
    pub(super) fn doubles(self, values: &[f64]) -> Self {
        values.iter().fold(self, |wire, value| wire.aligned(8).bytes(&value.to_le_bytes()))
    }

    /// Appends a `string`.
    pub(super) fn text(self, text: &str) -> Self {
        let length = u32::try_from(text.len() + 1).unwrap();
        self.count(length).bytes(text.as_bytes()).bytes(&[0])
    }

    /// Returns the bytes.
    pub(super) fn done(self) -> Vec<u8> {
        self.0
    }
}
