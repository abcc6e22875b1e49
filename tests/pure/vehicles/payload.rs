//! Frames written bit by bit, as a second opinion on what the gateway's own decoder reads.

use can_signal::can::frame::{CanId, Frame};

/// The frame of `ID LENGTH start|length@order=value…`, e.g. `614 8 29|2@0=3`: three hexadecimal
/// digits make a standard identifier, eight an extended one; bits as in a DBC.
pub(crate) fn frame(text: &str) -> Frame {
    let mut words = text.split_whitespace();
    let (id, length) = (words.next().unwrap(), words.next().unwrap().parse().unwrap());
    let mut data = vec![0; length];
    for word in words {
        put(&mut data, word);
    }
    let number = u32::from_str_radix(id, 16).unwrap();
    let can_id = if id.len() == 3 { CanId::standard(number) } else { CanId::extended(number) };
    let id = can_id.unwrap();
    let frame = if length > 8 { Frame::fd(id, &data) } else { Frame::classic(id, &data) };
    frame.unwrap()
}

/// Puts `start|length@order=value` in its place. Intel counts up from the least significant bit. Motorola
/// begins with the most significant one, goes down in its byte and on at bit 7 of the next.
pub(crate) fn put(data: &mut [u8], word: &str) {
    let numbers: Vec<u64> = word.split(['|', '@', '=']).map(|part| part.parse().unwrap()).collect();
    let [mut bit, length, order, value] = numbers[..] else { panic!("{word}") };
    assert!(value < 1 << length, "{value} does not fit in {length} bits");
    for step in 0..length {
        let weight = if order == 1 { step } else { length - 1 - step };
        let byte = &mut data[usize::try_from(bit / 8).unwrap()];
        *byte = *byte & !(1 << (bit % 8)) | u8::from(value >> weight & 1 == 1) << (bit % 8);
        bit = if order == 1 {
            bit + 1
        } else if bit.is_multiple_of(8) {
            bit + 15
        } else {
            bit - 1
        };
    }
}

#[test]
fn bits_are_set_where_a_dbc_counts_them() {
    assert_eq!(frame("123 2 4|6@1=33").to_string(), "123#1002");
    assert_eq!(frame("123 2 3|6@0=33").to_string(), "123#0840");
    assert_eq!(frame("0CFDCC27 1").to_string(), "0CFDCC27#00");
}
