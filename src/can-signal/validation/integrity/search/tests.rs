use super::*;
use crate::can::{CanId, Frame, MAX_DATA};
use crate::dbc::codec::{Layout, SignalCodec};
use crate::validation::integrity::checksum::{Checksum, ChecksumRule, CrcParameters, CrcRule, Extra, Sum};

const ID: CanId = CanId::Standard(0x2A5);

fn layout(start: u16, length: u16) -> Layout {
    Layout::unsigned(start, length)
}

/// Frames with a counter in the low half of byte 1, contents that change occasionally, and a checksum.
fn frames(
    count: u32,
    length: usize,
    rule: Option<(&ChecksumRule, Layout)>,
    counter: Option<Layout>,
) -> Vec<Frame> {
    (0..count)
        .map(|at| {
            let mut data = [0; MAX_DATA];
            data[2] = if at / 7 % 2 == 0 { 0x10 } else { 0x20 };
            data[3] = u8::try_from(at / 5 % 3).unwrap();
            data[4] = 0x5A;
            if let Some(counter) = counter {
                let codec = SignalCodec::new(counter, length).unwrap();
                codec.write(i128::from(at % (1 << counter.length)), &mut data).unwrap();
            }
            let data = &mut data[..length];
            if let Some((rule, field)) = rule {
                let codec = SignalCodec::new(field, length).unwrap();
                assert!(Checksum::new(rule.clone(), codec).unwrap().protect(ID, data));
            }
            Frame::with_format(ID, None, data).unwrap()
        })
        .collect()
}

fn crc8(poly: u8, init: u8, xorout: u8, reflected: bool, extra: Extra) -> ChecksumRule {
    let parameters = CrcParameters::crc8(poly, init, xorout).with_reflection(reflected);
    ChecksumRule::Crc(CrcRule::new(parameters, extra, None))
}

#[test]
fn every_kind_of_checksum_is_found_where_it_is() {
    let constants = [3, 99, 200, 1, 0, 44, 7, 18, 201, 54, 90, 33, 2, 250, 128, 77];
    let cases = [
        ("toyota", ChecksumRule::Sum(Sum::TOYOTA), layout(56, 8)),
        ("tesla", ChecksumRule::Sum(Sum::IDENTIFIER), layout(56, 8)),
        ("sum8", ChecksumRule::Sum(Sum::PLAIN), layout(56, 8)),
        ("sum8", ChecksumRule::Sum(Sum { start: 0x33, ..Sum::PLAIN }), layout(0, 8)),
        ("mazda", ChecksumRule::Sum(Sum::MAZDA), layout(56, 8)),
        ("xor8", ChecksumRule::Xor { start: 0 }, layout(56, 8)),
        ("xor8", ChecksumRule::Xor { start: 0x5F }, layout(48, 8)),
        ("honda", ChecksumRule::Honda, layout(56, 4)),
        ("psa", ChecksumRule::Psa { start: 9 }, layout(60, 4)),
        ("j1850", ChecksumRule::Crc(CrcRule::j1850()), layout(56, 8)),
        ("crc8", ChecksumRule::Crc(CrcRule::giorgio(0x0B)), layout(56, 8)),
        ("crc8", crc8(0x2F, 0xFF, 0xFF, false, Extra::IdentifierBefore), layout(0, 8)),
        ("crc8", crc8(0x97, 0x12, 0x55, false, Extra::Nothing), layout(56, 8)),
        ("crc8", crc8(0xA7, 0, 0x01, true, Extra::IdentifierAfter), layout(40, 8)),
        ("hyundai_fd", ChecksumRule::Crc(CrcRule::hyundai_fd(16).unwrap()), layout(0, 16)),
        ("vw", ChecksumRule::Crc(CrcRule::volkswagen(constants)), layout(0, 8)),
    ];
    for (kind, rule, field) in cases {
        let (length, counter) = if kind == "hyundai_fd" { (16, 20) } else { (8, 8) };
        let frames = frames(400, length, Some((&rule, field)), Some(layout(counter, 4)));
        let found = find_checksum(&frames).unwrap_or_else(|| panic!("{kind} was not found"));
        assert_eq!((found.kind, found.layout), (kind, field));
        let codec = SignalCodec::new(found.layout, length).unwrap();
        let checksum = Checksum::new(found.rule, codec).unwrap();
        let holds = |frame: &Frame| checksum.compare(frame).is_some_and(|(stored, sum)| stored == sum);
        assert!(frames.iter().all(holds), "{kind}: the found rule holds");
        assert_eq!(find_counter(&frames).map(|found| found.layout), Some(layout(counter, 4)), "{kind}");
    }
}

#[test]
fn nothing_is_found_where_chance_would_do() {
    assert_eq!(find_checksum(&frames(400, 8, None, Some(layout(8, 4)))), None, "no checksum");
    let rule = crc8(0x97, 0x12, 0x55, false, Extra::Nothing);
    let few = frames(3, 8, Some((&rule, layout(56, 8))), Some(layout(8, 4)));
    assert_eq!(find_checksum(&few), None, "three frames");
    let mut broken =
        frames(400, 8, Some((&ChecksumRule::Xor { start: 0 }, layout(56, 8))), Some(layout(8, 4)));
    broken[200] = Frame::classic(ID, &[1, 2, 3, 4, 5, 6, 7, 8]).unwrap();
    assert_eq!(find_checksum(&broken), None, "a rule that does not hold once");
    assert_eq!(find_counter(&frames(400, 8, None, None)), None, "no counter");
}

#[test]
fn counters_are_found_in_their_whole_width_and_range() {
    for (start, length) in [(8, 4), (12, 4), (48, 8), (62, 2), (37, 3)] {
        let frames = frames(600, 8, None, Some(layout(start, length)));
        let found = find_counter(&frames).unwrap();
        assert_eq!((found.layout, found.first, found.last), (layout(start, length), 0, (1 << length) - 1));
    }
    let to_14: Vec<_> = (0..100_u8).map(|at| Frame::classic(ID, &[0, at % 15]).unwrap()).collect();
    let found = find_counter(&to_14).unwrap();
    assert_eq!((found.layout, found.first, found.last, found.max_step), (layout(8, 4), 0, 14, 1));
    let lossy: Vec<_> = (0..100).filter(|at| at % 23 != 7).map(|at: usize| to_14[at]).collect();
    assert_eq!(find_counter(&lossy).unwrap().max_step, 2);
}
