//! Bits that may belong to an unknown checksum or to a number rather than to a signal.

use super::bits::QuietBits;
use super::response::Responses;
use super::timeline::{DriverAction, EARLY};

/// Number of responding bits from which a byte may be a checksum.
pub(super) const MIN_CHECKSUM_BITS: usize = 3;
/// Number of responding bits that the signals of one byte rarely have.
const MANY_BITS: usize = 5;

/// Returns the bytes that are probably an unknown checksum: they change whenever anything in the message
/// changes, while others do not or have fewer responding bits.
pub(super) fn like_checksum(quiet: &QuietBits<'_>, bits: &[(u16, Responses)]) -> Vec<u16> {
    let mut bytes: Vec<u16> = bits.iter().map(|(bit, _)| bit / 8).collect();
    bytes.dedup();
    let responding = |byte: u16| bits.iter().filter(|(bit, _)| bit / 8 == byte).count();
    let changes = |byte: u16| {
        let byte = usize::from(byte);
        quiet.contents.windows(2).filter(|pair| pair[0].1[byte] != pair[1].1[byte]).count()
    };
    let all = quiet.contents.len() - 1;
    let changes_always = |byte: u16| changes(byte) == all;
    let is_like = |byte: &u16| {
        let mut others = bytes.iter().filter(|other| *other != byte).peekable();
        let is_often = match responding(*byte) {
            0..MIN_CHECKSUM_BITS => false,
            MIN_CHECKSUM_BITS..MANY_BITS => changes_always(*byte),
            // Different contents have the same checksum at times.
            MANY_BITS.. => changes(*byte) * 2 > all,
        };
        is_often
            && others.peek().is_some()
            && others.all(|other| !changes_always(*other) || responding(*other) < responding(*byte))
    };
    bytes.iter().copied().filter(is_like).collect()
}

/// Returns the bits that change with most uses of the indicators but do not respond to them, like the lower
/// bits of a steering angle.
pub(super) fn restless(quiet: &QuietBits<'_>, bits: &[(u16, Responses)]) -> Vec<u16> {
    let turns = quiet.timeline.windows.iter().filter(|window| window.action != DriverAction::Hazard);
    let masks: Vec<_> = turns.map(|window| quiet.changed_in(window.on.before(EARLY), window.end)).collect();
    let changes = |bit: &u16| {
        let changes = masks.iter().filter(|mask| mask[usize::from(bit / 8)] >> (bit % 8) & 1 == 1);
        changes.count() * 2 > masks.len()
    };
    let responds = |bit: &u16| bits.iter().any(|(known, _)| known == bit);
    quiet.bits.iter().copied().filter(|bit| changes(bit) && !responds(bit)).collect()
}
