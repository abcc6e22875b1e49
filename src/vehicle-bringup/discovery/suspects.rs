//! Bits that may belong to an unknown checksum or to a number rather than to a signal.

use super::bits::{QuietBits, is_set};
use super::response::{ResponseShape, Responses};
use super::timeline::{DriverAction, EARLY};

/// Minimum number of responding bits for a byte that may be a checksum.
pub(super) const MIN_CHECKSUM_BITS: usize = 3;
/// Number of responding bits that the signals of one byte rarely reach.
const MANY_BITS: usize = 5;

/// Returns the bytes that are probably an unknown checksum: they change whenever anything in the message
/// changes, while other bytes do not or have fewer responding bits.
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
            // Different contents occasionally have the same checksum.
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
        let changes = masks.iter().filter(|mask| is_set(mask, *bit));
        changes.count() * 2 > masks.len()
    };
    let responds = |bit: &u16| bits.iter().any(|(known, _)| known == bit);
    quiet.bits.iter().copied().filter(|bit| changes(bit) && !responds(bit)).collect()
}

/// Returns the bits that are on only while an action is requested, and at some presses of a momentary switch:
/// a half press directly followed by the full press does not appear in each of them.
pub(super) fn companions(quiet: &QuietBits<'_>, bits: &[(u16, Responses)]) -> Vec<u16> {
    let timeline = quiet.timeline;
    let is_momentary = |(_, responses): &&(u16, Responses)| {
        responses.has_shape(timeline, &DriverAction::ALL[..2], ResponseShape::Momentary)
    };
    let presses: Vec<_> = bits.iter().filter(is_momentary).map(|(bit, _)| *bit).collect();
    let is_pressed = |at: Option<usize>| {
        let content = at.and_then(|at| quiet.contents.get(at));
        content.is_some_and(|(_, data)| presses.iter().any(|press| quiet.is_on(data, *press)))
    };
    let is_companion = |bit: &u16| {
        let on: Vec<_> =
            (0..quiet.contents.len()).filter(|at| quiet.is_on(&quiet.contents[*at].1, *bit)).collect();
        let adjoins =
            |at: &usize| is_pressed(at.checked_sub(1)) || is_pressed(Some(*at)) || is_pressed(Some(at + 1));
        // "Not available" sets all bits.
        let is_explained = |at: &usize| {
            let (time, data) = &quiet.contents[*at];
            timeline.is_requested(*time) || presses.iter().all(|press| quiet.is_on(data, *press))
        };
        on.iter().any(adjoins) && on.iter().all(is_explained)
    };
    let responds = |bit: &u16| bits.iter().any(|(known, _)| known == bit);
    quiet.bits.iter().copied().filter(|bit| !responds(bit) && is_companion(bit)).collect()
}
