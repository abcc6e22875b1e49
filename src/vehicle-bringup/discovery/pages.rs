//! Bits on one page of a multiplexed message, whose selector determines the meaning of the other bits.
//! Without this check they would look like lamps that flash with the pages.

use super::bits::{FrameBits, QuietBits};
use super::capture::FrameTrack;

/// Minimum share of frames with the bit that are followed by a frame of another page, in quarters.
const MOST: usize = 3;

/// Returns true if a bit is on only in frames of one page. These frames share a selector that changes by
/// itself and that the following frames do not have.
pub(super) fn is_on_a_page(track: &FrameTrack, quiet: &QuietBits<'_>, bit: u16) -> bool {
    let is_on = |data: &FrameBits| quiet.is_on(data, bit);
    let frames: Vec<_> = track.changes().map(|(_, frame)| frame.padded()).collect();
    let pairs = || frames.windows(2).map(|pair| (pair[0], pair[1])).filter(|(data, _)| is_on(data));
    let all = pairs().count();
    let left = pairs().filter(|(_, next)| !is_on(next));
    if all < 2 || left.count() * 4 < all * MOST {
        return false;
    }
    let mut selector = quiet.noise;
    let Some((first, _)) = pairs().next() else { return false };
    for (data, _) in pairs() {
        let same = data.iter().zip(first).map(|(byte, first)| !(byte ^ first));
        selector.iter_mut().zip(same).for_each(|(selector, same)| *selector &= same);
    }
    let turned = pairs().filter(|(data, next)| {
        data.iter().zip(*next).zip(selector).any(|((byte, next), selector)| (byte ^ next) & selector != 0)
    });
    turned.count() * 4 >= all * MOST
}
