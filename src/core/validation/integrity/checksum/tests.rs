use super::*;
use crate::core::dbc::codec::{ByteOrder, Layout};
use proptest::prelude::*;

const ID: CanId = CanId::Standard(0x326);

fn field(start: u16, length: u16, order: ByteOrder) -> SignalCodec {
    SignalCodec::new(Layout { start, length, order, signed: false }, 64).unwrap()
}

fn byte(index: u16) -> SignalCodec {
    field(index * 8, 8, ByteOrder::Intel)
}

fn checksum(rule: Rule, field: SignalCodec) -> Checksum {
    Checksum::new(rule, field).unwrap()
}

/// Every kind, with its field somewhere in the first eight bytes.
fn kinds() -> Vec<Checksum> {
    let constants = std::array::from_fn(|i| u8::try_from(i).unwrap() * 7 + 3);
    let wide = Parameters { poly: 0x8005, init: 0xFFFF, xorout: 1, refin: true, refout: true };
    let narrow = Parameters { poly: 0x07, init: 0, xorout: 0x55, refin: false, refout: false };
    vec![
        checksum(Rule::Honda, field(59, 4, ByteOrder::Motorola)),
        checksum(Rule::Psa { start: 0xB }, field(43, 4, ByteOrder::Motorola)),
        checksum(Rule::Sum(Sum::TOYOTA), byte(7)),
        checksum(Rule::Sum(Sum::IDENTIFIER), byte(0)),
        checksum(Rule::Sum(Sum { start: 9, inverted: true, ..Sum::PLAIN }), byte(3)),
        checksum(Rule::Xor { start: 0xA5 }, byte(0)),
        checksum(Rule::Crc8(Crc8::j1850()), byte(7)),
        checksum(Rule::Crc8(Crc8::giorgio(0x0A)), byte(7)),
        checksum(Rule::Crc8(Crc8::volkswagen(constants)), byte(0)),
        checksum(Rule::Crc8(Crc8::new(narrow, Extra::IdentifierBefore, None)), byte(5)),
        checksum(Rule::Crc16(Crc16::hyundai_fd(8).unwrap()), field(0, 16, ByteOrder::Intel)),
        checksum(Rule::Crc16(Crc16::new(wide, Extra::Nothing, None)), field(23, 16, ByteOrder::Motorola)),
    ]
}

fn nibble(sum: i32) -> u16 {
    u16::try_from(sum.rem_euclid(16)).unwrap()
}

fn frame(id: CanId, data: &[u8]) -> Frame {
    Frame::fd(id, data).unwrap()
}

proptest! {
    #[test]
    fn a_protected_frame_passes_the_check_and_only_its_field_was_written(data in prop::array::uniform8(any::<u8>())) {
        for checksum in kinds() {
            let mut sealed = data;
            prop_assert!(checksum.protect(ID, &mut sealed));
            prop_assert!(checksum.holds(ID, &frame(ID, &sealed)), "{:?}", checksum);
            let other = |index: &usize| !(checksum.field_bytes.0..checksum.field_bytes.1).contains(index);
            prop_assert!((0..8).filter(other).all(|index| sealed[index] == data[index]), "{:?}", checksum);
        }
    }

    #[test]
    fn a_changed_bit_is_found(data in prop::array::uniform8(any::<u8>()), bit in 0_usize..64) {
        for checksum in kinds() {
            // VW's other counter means another constant: that a CRC alone does not rule out.
            let by_counter = format!("{:?}", checksum.rule).contains("ByCounter");
            let counter = by_counter && (8..12).contains(&bit);
            let mut sealed = data;
            checksum.protect(ID, &mut sealed);
            sealed[bit / 8] ^= 1 << (bit % 8);
            prop_assert!(counter || !checksum.holds(ID, &frame(ID, &sealed)), "{:?} {}", checksum, bit);
        }
    }

    #[test]
    fn no_length_is_a_panic(data in prop::collection::vec(any::<u8>(), 0..=80)) {
        for checksum in kinds() {
            let mut sealed = data.clone();
            let fits = (checksum.needed_length()..=MAX_DATA).contains(&data.len());
            prop_assert_eq!(checksum.protect(ID, &mut sealed), fits);
            prop_assert!(fits || sealed == data);
            if let Some(frame) = Frame::fd(ID, &data) {
                prop_assert_eq!(checksum.compare(ID, &frame).is_some(), fits);
            }
        }
    }
}

#[test]
fn crcs_have_their_catalogues_check_values() {
    let mut text = *b"123456789\0\0";
    let arc = Parameters { poly: 0x8005, init: 0, xorout: 0, refin: true, refout: true };
    let h2f = Parameters { poly: 0x2F, init: 0xFF, xorout: 0xFF, refin: false, refout: false };
    let last = |rule| checksum(rule, byte(9)).expected(ID, &text[..10]);
    assert_eq!(last(Rule::Crc8(Crc8::j1850())), Some(0x4B));
    assert_eq!(last(Rule::Crc8(Crc8::new(h2f, Extra::Nothing, None))), Some(0xDF));
    let arc = |bytes, field| checksum(Rule::Crc16(Crc16::new(arc, Extra::Nothing, bytes)), field);
    assert_eq!(arc(None, field(72, 16, ByteOrder::Intel)).expected(ID, &text), Some(0xBB3D));
    // The same nine bytes on both sides of the checksum, and others behind them.
    text = *b"12\0\x003456789";
    assert_eq!(arc(None, field(16, 16, ByteOrder::Intel)).expected(ID, &text), Some(0xBB3D));
    let longer = *b"12\0\x003456789and more";
    assert_eq!(arc(Some(11), field(16, 16, ByteOrder::Intel)).expected(ID, &longer), Some(0xBB3D));
    let behind = *b"123456789no\0\0";
    assert_eq!(arc(Some(9), field(88, 16, ByteOrder::Intel)).expected(ID, &behind), Some(0xBB3D));
}

#[test]
fn the_identifier_goes_into_a_crc_low_byte_first() {
    let xmodem = Parameters { poly: 0x1021, init: 0, xorout: 0, refin: false, refout: false };
    let of = |extra, id, data: &[u8]| {
        let rule = Rule::Crc16(Crc16::new(xmodem, extra, None));
        checksum(rule, field(0, 16, ByteOrder::Intel)).expected(id, data)
    };
    let plain = |data: &[u8]| of(Extra::Nothing, ID, &[&[0, 0], data].concat());
    assert_eq!(plain(b"123456789"), Some(0x31C3), "XMODEM's check value");
    let id = CanId::Standard(0x1A2);
    assert_eq!(of(Extra::IdentifierBehind, id, b"\0\0data"), plain(b"data\xA2\x01"));
    assert_eq!(of(Extra::IdentifierBefore, id, b"\0\0data"), plain(b"\xA2\x01data"));
    let id = CanId::Extended(0x0102_0304);
    assert_eq!(of(Extra::IdentifierBehind, id, b"\0\0data"), plain(b"data\x04\x03\x02\x01"));
}

#[test]
fn hyundai_is_xmodem_with_an_exclusive_or_by_length() {
    for (length, last_xor) in [(8, 0x5F29), (16, 0x041D), (24, 0x819D), (32, 0x9F5B)] {
        let hyundai =
            checksum(Rule::Crc16(Crc16::hyundai_fd(length).unwrap()), field(0, 16, ByteOrder::Intel));
        // All zero, identifier included: the CRC itself is zero.
        assert_eq!(hyundai.expected(CanId::Standard(0), &vec![0; length]), Some(last_xor));
    }
    assert_eq!(Crc16::hyundai_fd(12), None);
}

#[test]
fn sums_are_those_of_their_makers() {
    let data = [0x00, 0x10, 0x20, 0x03, 0xFF, 0x01, 0x02, 0x00];
    let sum = |sum, index| checksum(Rule::Sum(sum), byte(index)).expected(ID, &data).unwrap();
    assert_eq!(sum(Sum::PLAIN, 0), 0x35);
    assert_eq!(sum(Sum::IDENTIFIER, 0), 0x35 + 0x26 + 0x03);
    assert_eq!(sum(Sum::TOYOTA, 7), 0x35 + 0x26 + 0x03 + 8);
    assert_eq!(sum(Sum::MAZDA, 4), 0xFF - 0x33);
    assert_eq!(
        checksum(Rule::Xor { start: 0 }, byte(0)).expected(ID, &data),
        Some(0x10 ^ 0x20 ^ 0x03 ^ 0xFF ^ 3)
    );
    // PSA: the nibbles, the checksum and the start value make 15.
    let psa = checksum(Rule::Psa { start: 0xB }, field(43, 4, ByteOrder::Motorola));
    assert_eq!(psa.expected(ID, &[0x10, 0x20, 0, 0, 0, 0xF1]), Some(nibble(15 - 0xB - (1 + 2 + 15))));
    let honda = checksum(Rule::Honda, field(59, 4, ByteOrder::Motorola));
    let nibbles = 1 + 2 + 3 + 15 + 15 + 1 + 2;
    assert_eq!(honda.expected(ID, &data), Some(nibble(8 - (3 + 2 + 6) - nibbles)));
    let extended = CanId::Extended(0x326);
    assert_eq!(honda.expected(extended, &data), honda.expected(ID, &data).map(|sum| (sum + 3) % 16));
}

#[test]
fn a_constant_is_found_from_a_good_frame() {
    let constants = std::array::from_fn(|i| u8::try_from(i).unwrap() * 13 + 1);
    let vw = checksum(Rule::Crc8(Crc8::volkswagen(constants)), byte(0));
    for counter in 0..16_u8 {
        let mut data = [0, 0x50 | counter, 1, 2, 3, 4, 5, 6];
        vw.protect(ID, &mut data);
        assert_eq!(Crc8::volkswagen_constant(&data), Some((counter, constants[usize::from(counter)])));
    }
    assert_eq!(Crc8::volkswagen_constant(&[1]), None);
}

#[test]
fn fields_that_cannot_hold_the_checksum_are_refused() {
    let j1850 = || Rule::Crc8(Crc8::j1850());
    let refused = |rule, field| Checksum::new(rule, field).unwrap_err();
    assert_eq!(refused(j1850(), field(0, 4, ByteOrder::Intel)), ChecksumError::Width { rule: 8, signal: 4 });
    assert_eq!(refused(Rule::Honda, byte(0)), ChecksumError::Width { rule: 4, signal: 8 });
    assert_eq!(refused(j1850(), field(4, 8, ByteOrder::Intel)), ChecksumError::NotWholeBytes);
    let signed = Layout { start: 0, length: 8, order: ByteOrder::Intel, signed: true };
    assert_eq!(refused(j1850(), SignalCodec::new(signed, 8).unwrap()), ChecksumError::Signed);
    let multiplexed = byte(7).multiplexed(&byte(0), &[1..=1]);
    assert_eq!(refused(j1850(), multiplexed), ChecksumError::Multiplexed);
}
