//! What the tests of message bytes share.

use serde::Serialize;

use crate::core::time::WallStamp;

/// Little-endian CDR as RustDDS writes it, without the four bytes of encapsulation header.
pub(super) fn cdr(message: &impl Serialize) -> Vec<u8> {
    cdr_encoding::to_vec::<_, byteorder::LittleEndian>(message).unwrap()
}

pub(super) const STAMP: WallStamp = WallStamp::from_nanos(1_700_000_000_123_456_789);
// 1 700 000 000 = 0x6553F100, 123 456 789 = 0x075BCD15.
pub(super) const STAMP_BYTES: [u8; 8] = [0x00, 0xF1, 0x53, 0x65, 0x15, 0xCD, 0x5B, 0x07];

pub(super) fn with_stamp(rest: &[u8]) -> Vec<u8> {
    [&STAMP_BYTES, rest].concat()
}

/// A CDR string by hand: length with the terminating zero, text, zero, and what fills up to
/// the next multiple of four when `padded`.
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
