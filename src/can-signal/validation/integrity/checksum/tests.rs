use super::*;
use crate::dbc::codec::{ByteOrder, Layout};
use proptest::prelude::*;

const ID: CanId = CanId::Standard(0x326);

fn field(start: u16, length: u16, order: ByteOrder) -> SignalCodec {
    SignalCodec::new(Layout { start, length, order, signed: false }, 64).unwrap()
}

fn byte(index: u16) -> SignalCodec {
    field(index * 8, 8, ByteOrder::Intel)
}

fn checksum(rule: ChecksumRule, field: SignalCodec) -> Checksum {
    Checksum::new(rule, field).unwrap()
}

/// One checksum of each kind, with its field in the first eight bytes.
fn kinds() -> Vec<Checksum> {
    let constants = std::array::from_fn(|i| u8::try_from(i).unwrap() * 7 + 3);
    let wide = CrcParameters::crc16(0x8005, 0xFFFF, 1).with_reflection(true);
    let narrow = CrcParameters::crc8(0x07, 0, 0x55);
    vec![
        checksum(ChecksumRule::Honda, field(59, 4, ByteOrder::Motorola)),
        checksum(ChecksumRule::Psa { start: 0xB }, field(43, 4, ByteOrder::Motorola)),
        checksum(ChecksumRule::Sum(Sum::TOYOTA), byte(7)),
        checksum(ChecksumRule::Sum(Sum::IDENTIFIER), byte(0)),
        checksum(ChecksumRule::Sum(Sum { start: 9, inverted: true, ..Sum::PLAIN }), byte(3)),
        checksum(ChecksumRule::Xor { start: 0xA5 }, byte(0)),
        checksum(ChecksumRule::Crc(CrcRule::j1850()), byte(7)),
        checksum(ChecksumRule::Crc(CrcRule::giorgio(0x0A)), byte(7)),
        checksum(ChecksumRule::Crc(CrcRule::volkswagen(constants)), byte(0)),
        checksum(ChecksumRule::Crc(CrcRule::new(narrow, Extra::IdentifierBefore, None)), byte(5)),
        checksum(ChecksumRule::Crc(CrcRule::hyundai_fd(8).unwrap()), field(0, 16, ByteOrder::Intel)),
        checksum(
            ChecksumRule::Crc(CrcRule::new(wide, Extra::Nothing, None)),
            field(23, 16, ByteOrder::Motorola),
        ),
    ]
}

fn nibble(sum: i32) -> u16 {
    u16::try_from(sum.rem_euclid(16)).unwrap()
}

fn holds(checksum: &Checksum, data: &[u8]) -> bool {
    checksum.compare(&Frame::fd(ID, data).unwrap()).is_some_and(|(stored, expected)| stored == expected)
}

proptest! {
    #[test]
    fn protected_frame_passes_check_and_only_its_field_changes(data in prop::array::uniform8(any::<u8>())) {
        for checksum in kinds() {
            let mut protected = data;
            prop_assert!(checksum.protect(ID, &mut protected));
            prop_assert!(holds(&checksum, &protected), "{:?}", checksum);
            let other = |index: &usize| !checksum.field_bytes.contains(index);
            prop_assert!((0..8).filter(other).all(|index| protected[index] == data[index]), "{:?}", checksum);
        }
    }

    #[test]
    fn any_changed_bit_fails_check(data in prop::array::uniform8(any::<u8>()), bit in 0_usize..64) {
        for checksum in kinds() {
            // Another counter selects another VW constant, which the CRC alone does not reveal.
            let by_counter = format!("{:?}", checksum.rule).contains("ByCounter");
            let counter = by_counter && (8..12).contains(&bit);
            let mut protected = data;
            checksum.protect(ID, &mut protected);
            protected[bit / 8] ^= 1 << (bit % 8);
            prop_assert!(counter || !holds(&checksum, &protected), "{:?} {}", checksum, bit);
        }
    }

    #[test]
    fn any_length_is_checked_without_panic(data in prop::collection::vec(any::<u8>(), 0..=80)) {
        for checksum in kinds() {
            let mut protected = data.clone();
            let fits = (checksum.field_bytes.end..=MAX_DATA).contains(&data.len());
            prop_assert_eq!(checksum.protect(ID, &mut protected), fits);
            prop_assert!(fits || protected == data);
            if let Some(frame) = Frame::fd(ID, &data) {
                prop_assert_eq!(checksum.compare(&frame).is_some(), fits);
            }
        }
    }
}

#[test]
fn crcs_match_catalogue_check_values() {
    let mut text = *b"123456789\0\0";
    let arc = CrcParameters::crc16(0x8005, 0, 0).with_reflection(true);
    let h2f = CrcParameters::crc8(0x2F, 0xFF, 0xFF);
    let last = |rule| checksum(rule, byte(9)).expected(ID, &text[..10]);
    assert_eq!(last(ChecksumRule::Crc(CrcRule::j1850())), Some(0x4B));
    assert_eq!(last(ChecksumRule::Crc(CrcRule::new(h2f, Extra::Nothing, None))), Some(0xDF));
    let arc = |bytes, field| checksum(ChecksumRule::Crc(CrcRule::new(arc, Extra::Nothing, bytes)), field);
    assert_eq!(arc(None, field(72, 16, ByteOrder::Intel)).expected(ID, &text), Some(0xBB3D));
    // The same nine bytes on both sides of the checksum, and further bytes after them.
    text = *b"12\0\x003456789";
    assert_eq!(arc(None, field(16, 16, ByteOrder::Intel)).expected(ID, &text), Some(0xBB3D));
    let longer = *b"12\0\x003456789and more";
    assert_eq!(arc(Some(11), field(16, 16, ByteOrder::Intel)).expected(ID, &longer), Some(0xBB3D));
    let after = *b"123456789no\0\0";
    assert_eq!(arc(Some(9), field(88, 16, ByteOrder::Intel)).expected(ID, &after), Some(0xBB3D));
}

#[test]
fn identifier_enters_crc_low_byte_first() {
    let xmodem = CrcParameters::crc16(0x1021, 0, 0);
    let of = |extra, id, data: &[u8]| {
        let rule = ChecksumRule::Crc(CrcRule::new(xmodem, extra, None));
        checksum(rule, field(0, 16, ByteOrder::Intel)).expected(id, data)
    };
    let plain = |data: &[u8]| of(Extra::Nothing, ID, &[&[0, 0], data].concat());
    assert_eq!(plain(b"123456789"), Some(0x31C3), "XMODEM's check value");
    let id = CanId::Standard(0x1A2);
    assert_eq!(of(Extra::IdentifierAfter, id, b"\0\0data"), plain(b"data\xA2\x01"));
    assert_eq!(of(Extra::IdentifierBefore, id, b"\0\0data"), plain(b"\xA2\x01data"));
    let id = CanId::Extended(0x0102_0304);
    assert_eq!(of(Extra::IdentifierAfter, id, b"\0\0data"), plain(b"data\x04\x03\x02\x01"));
}

#[test]
fn hyundai_xorout_depends_on_length() {
    for (length, last_xor) in [(8, 0x5F29), (16, 0x041D), (24, 0x819D), (32, 0x9F5B)] {
        let hyundai =
            checksum(ChecksumRule::Crc(CrcRule::hyundai_fd(length).unwrap()), field(0, 16, ByteOrder::Intel));
        // All zero, identifier included: the CRC itself is zero.
        assert_eq!(hyundai.expected(CanId::Standard(0), &vec![0; length]), Some(last_xor));
    }
    assert_eq!(CrcRule::hyundai_fd(12), None);
}

#[test]
fn manufacturer_sums_match_hand_calculation() {
    let data = [0x00, 0x10, 0x20, 0x03, 0xFF, 0x01, 0x02, 0x00];
    let sum = |sum, index| checksum(ChecksumRule::Sum(sum), byte(index)).expected(ID, &data).unwrap();
    assert_eq!(sum(Sum::PLAIN, 0), 0x35);
    assert_eq!(sum(Sum::IDENTIFIER, 0), 0x35 + 0x26 + 0x03);
    assert_eq!(sum(Sum::TOYOTA, 7), 0x35 + 0x26 + 0x03 + 8);
    assert_eq!(sum(Sum::MAZDA, 4), 0xFF - 0x33);
    assert_eq!(
        checksum(ChecksumRule::Xor { start: 0 }, byte(0)).expected(ID, &data),
        Some(0x10 ^ 0x20 ^ 0x03 ^ 0xFF ^ 3)
    );
    // PSA: the nibbles, the checksum and the start value add up to 15.
    let psa = checksum(ChecksumRule::Psa { start: 0xB }, field(43, 4, ByteOrder::Motorola));
    assert_eq!(psa.expected(ID, &[0x10, 0x20, 0, 0, 0, 0xF1]), Some(nibble(15 - 0xB - (1 + 2 + 15))));
    let honda = checksum(ChecksumRule::Honda, field(59, 4, ByteOrder::Motorola));
    let nibbles = 1 + 2 + 3 + 15 + 15 + 1 + 2;
    assert_eq!(honda.expected(ID, &data), Some(nibble(8 - (3 + 2 + 6) - nibbles)));
    let extended = CanId::Extended(0x326);
    assert_eq!(honda.expected(extended, &data), honda.expected(ID, &data).map(|sum| (sum + 3) % 16));
}

#[test]
fn unsuitable_checksum_fields_are_refused() {
    let j1850 = || ChecksumRule::Crc(CrcRule::j1850());
    let refused = |rule, field| Checksum::new(rule, field).unwrap_err();
    assert_eq!(refused(j1850(), field(0, 4, ByteOrder::Intel)), ChecksumError::Width { rule: 8, signal: 4 });
    assert_eq!(refused(ChecksumRule::Honda, byte(0)), ChecksumError::Width { rule: 4, signal: 8 });
    assert_eq!(refused(j1850(), field(4, 8, ByteOrder::Intel)), ChecksumError::NotWholeBytes);
    let signed = Layout { start: 0, length: 8, order: ByteOrder::Intel, signed: true };
    assert_eq!(refused(j1850(), SignalCodec::new(signed, 8).unwrap()), ChecksumError::Signed);
    let multiplexed = byte(7).multiplexed(&byte(0), &[1..=1]);
    assert_eq!(refused(j1850(), multiplexed), ChecksumError::Multiplexed);
}

#[test]
fn rules_are_equal_when_they_compute_the_same() {
    let plain = || CrcRule::new(CrcParameters::crc8(0x1D, 0, 0), Extra::Nothing, None);
    assert_eq!(plain(), plain());
    assert_ne!(plain(), CrcRule::j1850(), "other parameters");
    assert_ne!(plain(), CrcRule::new(CrcParameters::crc8(0x1D, 0, 0), Extra::IdentifierBefore, None));
}
