//! Search for a checksum: a field calculated from the rest of the frame.

use std::collections::BTreeSet;

use crate::can::{CanId, Frame};
use crate::dbc::codec::{Layout, SignalCodec};
use crate::validation::integrity::checksum::{Checksum, ChecksumRule, CrcParameters, CrcRule, Extra, Sum};

/// A checksum that matches in all frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundChecksum {
    /// Position of the checksum.
    pub layout: Layout,
    /// Name of the rule in a vehicle profile.
    pub kind: &'static str,
    /// Keys of the rule in a vehicle profile.
    pub parameters: Vec<(&'static str, RuleParameter)>,
    /// Rule with its parameters.
    pub rule: ChecksumRule,
}

/// Value of a key of a rule.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RuleParameter {
    /// A number, e.g. a polynomial.
    Number(u16),
    /// A flag, `true` or `false`.
    Flag(bool),
    /// A keyword of the profile.
    Text(&'static str),
    /// Sixteen bytes, one for each counter value.
    Bytes([u8; 16]),
}

/// Smallest number of different frames for a rule without free parameters.
const MIN_FRAMES: usize = 4;
/// Smallest number of different frames for a rule with one free byte.
const MIN_FRAMES_SOLVED: usize = 6;
/// Smallest number of different frames for an arbitrary polynomial, so that three differences are
/// independent.
const MIN_FRAMES_GENERAL: usize = 9;
/// Smallest number of different frames for each of sixteen constants.
const MIN_FRAMES_A_CONSTANT: usize = 3;
/// Smallest number of different values of a checksum byte; fewer prove nothing, see [`proven`].
const MIN_VALUES: usize = 4;
/// Largest number of different frames examined.
const MAX_FRAMES: usize = 400;
/// Polynomials that vehicles use, tried before all others.
const KNOWN_POLYNOMIALS: [u8; 4] = [0x1D, 0x2F, 0x07, 0x31];

/// Finds the checksum of the frames of one message, all of the same length; `None` if there is none.
pub fn find_checksum(frames: &[Frame]) -> Option<FoundChecksum> {
    let mut seen = BTreeSet::new();
    let distinct: Vec<Frame> =
        frames.iter().filter(|frame| seen.insert(frame.data())).take(MAX_FRAMES).copied().collect();
    let length = distinct.first()?.data().len();
    if distinct.len() < MIN_FRAMES || distinct.iter().any(|frame| frame.data().len() != length) {
        return None;
    }
    let varies = |byte: &usize| values(&distinct, *byte) >= MIN_VALUES;
    let mut varying: Vec<_> = last_first(length).filter(varies).collect();
    // With an exclusive or, each byte follows from all others, so any byte might be the checksum; the
    // checksum has many values.
    let most = varying.iter().map(|byte| values(&distinct, *byte)).max().unwrap_or(0);
    varying.sort_by_key(|byte| values(&distinct, *byte) * 2 < most);
    let bytes = || varying.iter().map(|byte| (*byte, field(byte * 8, 8)));
    let fixed = bytes().find_map(|(_, field)| fixed_bytes(&distinct, field));
    fixed
        .or_else(|| solved(&distinct, &varying))
        .or_else(|| nibbles(&distinct, &varying))
        .or_else(|| words(&distinct, length))
        .or_else(|| bytes().find_map(|(byte, field)| crc8(&distinct, byte, field)))
        .or_else(|| volkswagen(&distinct))
}

/// Returns the bytes in the order of likely checksums: the last, the first, then the rest from the end.
fn last_first(length: usize) -> impl Iterator<Item = usize> {
    let rest = (1..length.saturating_sub(1)).rev();
    [length.checked_sub(1), (length > 1).then_some(0)].into_iter().flatten().chain(rest)
}

/// Returns the number of different values of a byte.
fn values(frames: &[Frame], byte: usize) -> usize {
    frames.iter().filter_map(|frame| frame.data().get(byte)).collect::<BTreeSet<_>>().len()
}

fn field(start: usize, length: u16) -> Layout {
    let start = u16::try_from(start).unwrap_or(u16::MAX);
    Layout::unsigned(start, length)
}

/// Returns the checksum if the rule holds for every frame and its field has enough different values.
fn proven(
    frames: &[Frame],
    layout: Layout,
    (kind, parameters): (&'static str, Vec<(&'static str, RuleParameter)>),
    rule: ChecksumRule,
) -> Option<FoundChecksum> {
    let length = frames.first()?.data().len();
    let codec = SignalCodec::new(layout, length).ok()?;
    let checksum = Checksum::new(rule.clone(), codec.clone()).ok()?;
    let holds = |frame: &Frame| checksum.compare(frame).is_some_and(|(stored, expected)| stored == expected);
    if !frames.iter().all(holds) {
        return None;
    }
    // Evidence in bits: each different value of the checksum after the first matches by chance once in
    // 2^width.
    let values: BTreeSet<_> = frames.iter().map(|frame| codec.value(frame.padded())).collect();
    let evidence = (values.len() - 1) * usize::from(layout.length);
    (evidence >= 20).then_some(FoundChecksum { layout, kind, parameters, rule })
}

/// Tries the eight-bit rules without a free parameter.
fn fixed_bytes(frames: &[Frame], field: Layout) -> Option<FoundChecksum> {
    let sums = [("toyota", Sum::TOYOTA), ("tesla", Sum::IDENTIFIER), ("mazda", Sum::MAZDA)];
    let plain = [("sum8", ChecksumRule::Sum(Sum::PLAIN)), ("xor8", ChecksumRule::Xor { start: 0 })];
    let rules = sums.map(|(kind, sum)| (kind, ChecksumRule::Sum(sum))).into_iter().chain(plain);
    let found = rules.into_iter().find_map(|(kind, rule)| proven(frames, field, (kind, Vec::new()), rule));
    found.or_else(|| {
        let byte = usize::from(field.start / 8);
        let solved = constant(frames, byte, |data| Crc8::new(0x1D, false).of(0xFF, data) ^ 0xFF)?;
        let rule = || ChecksumRule::Crc(CrcRule::j1850());
        (solved == 0).then(rule).and_then(|rule| proven(frames, field, ("j1850", Vec::new()), rule))
    })
}

/// Tries sums with an unknown start value, which follows from the first frame.
fn solved(frames: &[Frame], varying: &[usize]) -> Option<FoundChecksum> {
    if frames.len() < MIN_FRAMES_SOLVED {
        return None;
    }
    varying.iter().find_map(|byte| {
        let field = field(byte * 8, 8);
        let data = frames.first()?.data();
        let stored = *data.get(*byte)?;
        let others = || data.iter().enumerate().filter(|(at, _)| at != byte).map(|(_, value)| *value);
        let start = stored.wrapping_sub(others().fold(0, u8::wrapping_add));
        let sum = ChecksumRule::Sum(Sum { start, ..Sum::PLAIN });
        let parameters = |start: u8| vec![("start", RuleParameter::Number(start.into()))];
        proven(frames, field, ("sum8", parameters(start)), sum).or_else(|| {
            let start = others().fold(stored, |sum, byte| sum ^ byte);
            proven(frames, field, ("xor8", parameters(start)), ChecksumRule::Xor { start })
        })
    })
}

/// Tries the four-bit rules.
fn nibbles(frames: &[Frame], varying: &[usize]) -> Option<FoundChecksum> {
    if frames.len() < MIN_FRAMES_SOLVED {
        return None;
    }
    varying.iter().flat_map(|byte| [field(byte * 8, 4), field(byte * 8 + 4, 4)]).find_map(|field| {
        let honda = proven(frames, field, ("honda", Vec::new()), ChecksumRule::Honda);
        honda.or_else(|| {
            (0..=15).find_map(|start| {
                let parameters = vec![("start", RuleParameter::Number(u16::from(start)))];
                proven(frames, field, ("psa", parameters), ChecksumRule::Psa { start })
            })
        })
    })
}

/// Tries the sixteen-bit rule. It is created only once, because creating it leaks memory.
fn words(frames: &[Frame], length: usize) -> Option<FoundChecksum> {
    if !matches!(length, 8 | 16 | 24 | 32) {
        return None;
    }
    let rule = ChecksumRule::Crc(CrcRule::hyundai_fd(length)?);
    proven(frames, field(0, 16), ("hyundai_fd", Vec::new()), rule)
}

/// Tries an eight-bit CRC in one byte over all other bytes, with any polynomial.
fn crc8(frames: &[Frame], byte: usize, field: Layout) -> Option<FoundChecksum> {
    let all = (frames.len() >= MIN_FRAMES_GENERAL).then_some(1..=u8::MAX).into_iter().flatten();
    let polynomials = KNOWN_POLYNOMIALS.into_iter().chain(all);
    let variants = [(false, false), (true, false), (false, true), (true, true)];
    let candidates = polynomials.flat_map(|poly| variants.map(|variant| (poly, variant)));
    let identifier = identifier(frames.first()?.id());
    candidates.into_iter().find_map(|(poly, (reflected, with_identifier))| {
        let crc = Crc8::new(poly, reflected);
        // An identifier before the data is a constant; an identifier after the data is not.
        let behind = if with_identifier { identifier.as_slice() } else { &[] };
        let xorout = constant(frames, byte, |data| crc.of(crc.of(0, data), behind))?;
        let parameters = CrcParameters::crc8(poly, 0, xorout).with_reflection(reflected);
        let mut keys = vec![("poly", RuleParameter::Number(poly.into()))];
        keys.extend((xorout != 0).then_some(("xorout", RuleParameter::Number(xorout.into()))));
        keys.extend(reflected.then_some(("reflected", RuleParameter::Flag(true))));
        keys.extend(with_identifier.then_some(("identifier", RuleParameter::Text("after"))));
        let extra = if with_identifier { Extra::IdentifierAfter } else { Extra::Nothing };
        let rule = ChecksumRule::Crc(CrcRule::new(parameters, extra, None));
        proven(frames, field, ("crc8", keys), rule)
    })
}

/// Returns the identifier as it enters CRCs, the low byte first.
fn identifier(id: CanId) -> Vec<u8> {
    let bytes = id.number().to_le_bytes();
    match id {
        CanId::Standard(_) => bytes[..2].to_vec(),
        CanId::Extended(_) => bytes.to_vec(),
    }
}

/// Returns the exclusive or of a sum and its stored byte, if it is the same in all frames.
fn constant(frames: &[Frame], byte: usize, sum: impl Fn(&[u8]) -> u8) -> Option<u8> {
    let mut rest = Vec::new();
    let mut constants = frames.iter().map(|frame| {
        let data = frame.data();
        rest.clear();
        rest.extend(data.iter().enumerate().filter(|(at, _)| *at != byte).map(|(_, value)| *value));
        sum(&rest) ^ data[byte]
    });
    let first = constants.next()?;
    constants.all(|constant| constant == first).then_some(first)
}

/// Tries CRC-8 "2F" with a constant for each value of the counter in the low half of byte 1.
fn volkswagen(frames: &[Frame]) -> Option<FoundChecksum> {
    let crc = Crc8::new(0x2F, false);
    let mut constants = [None; 16];
    let mut counts = [0; 16];
    for frame in frames {
        let [stored, rest @ ..] = frame.data() else { return None };
        let counter = usize::from(rest.first()? & 0xF);
        let before = crc.of(0xFF, rest);
        let constant = (0..=u8::MAX).find(|constant| crc.of(before, &[*constant]) ^ 0xFF == *stored)?;
        if *constants[counter].get_or_insert(constant) != constant {
            return None;
        }
        counts[counter] += 1;
    }
    if counts.iter().any(|count| *count < MIN_FRAMES_A_CONSTANT) {
        return None;
    }
    let constants = constants.map(Option::unwrap_or_default);
    let parameters = vec![("constants", RuleParameter::Bytes(constants))];
    proven(frames, field(0, 8), ("vw", parameters), ChecksumRule::Crc(CrcRule::volkswagen(constants)))
}

/// An eight-bit CRC, computed without a table because the first two frames exclude most polynomials.
struct Crc8 {
    /// Polynomial in the bit order of the shifts.
    poly: u8,
    reflected: bool,
}

impl Crc8 {
    fn new(poly: u8, reflected: bool) -> Self {
        Self { poly: if reflected { poly.reverse_bits() } else { poly }, reflected }
    }

    fn of(&self, init: u8, data: &[u8]) -> u8 {
        let Self { poly, reflected } = *self;
        let mut crc = init;
        for byte in data {
            crc ^= byte;
            for _ in 0..8 {
                crc = if reflected {
                    (crc >> 1) ^ (poly & 0_u8.wrapping_sub(crc & 1))
                } else {
                    (crc << 1) ^ (poly & 0_u8.wrapping_sub(crc >> 7))
                };
            }
        }
        crc
    }
}
