//! Search for a counter: bits that increase by one from frame to frame.

use crate::can::Frame;
use crate::dbc::codec::{Layout, SignalCodec};

/// A counter that matches in all frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FoundCounter {
    /// Position of the counter.
    pub layout: Layout,
    /// Lowest value of the counter.
    pub first: u32,
    /// Highest value, after which the counter wraps.
    pub last: u32,
    /// Largest step found: 1, or more where frames were lost.
    pub max_step: u32,
}

/// Widths of counters in bits, the longest first: the low bits of a longer counter also count.
const WIDTHS: [u16; 7] = [8, 7, 6, 5, 4, 3, 2];
const MIN_FRAMES: usize = 12;
/// Smallest number of wraps of a counter.
const MIN_WRAPS: u32 = 2;
/// Smallest number of steps of a long counter that has not wrapped twice; its range then follows from its
/// bits.
const MIN_STEPS: usize = 24;
/// Largest accepted step between two frames: at most three lost frames.
const MAX_STEP: u32 = 4;

/// Finds the counter of successive frames; `None` if there is none. A frame equal to the previous frame is
/// skipped.
pub fn find_counter(frames: &[Frame]) -> Option<FoundCounter> {
    let length = frames.iter().map(|frame| frame.data().len()).min()?;
    let mut distinct = frames.to_vec();
    distinct.dedup();
    if distinct.len() < MIN_FRAMES {
        return None;
    }
    WIDTHS.iter().find_map(|width| {
        (0..length).find_map(|byte| (0..=8 - width).find_map(|bit| counter_at(&distinct, byte, bit, *width)))
    })
}

fn counter_at(frames: &[Frame], byte: usize, bit: u16, width: u16) -> Option<FoundCounter> {
    let start = u16::try_from(byte * 8).ok()? + bit;
    let layout = Layout::unsigned(start, width);
    let codec = SignalCodec::new(layout, byte + 1).ok()?;
    let value = |frame: &Frame| u32::try_from(codec.value(frame.padded())).unwrap_or(0);
    let values = || frames.iter().map(value);
    let (mut first, mut last) = (values().min()?, values().max()?);
    // A range that does not fill its bits may lack single values at either end: 0 to 14, 1 to 15.
    let is_long = width >= 6 && frames.len() > MIN_STEPS && last - first + 3 < 1 << width;
    if is_long {
        (first, last) = (0, (1 << width) - 1);
    }
    let size = last - first + 1;
    if size + 2 < 1 << width || size < 3 {
        return None;
    }
    let (mut wraps, mut max_step) = (0, 1);
    for (before, after) in values().zip(values().skip(1)) {
        let step = (after + size - before) % size;
        if step == 0 || step > MAX_STEP.min(size / 3).max(1) {
            return None;
        }
        wraps += u32::from(after < before);
        max_step = max_step.max(step);
    }
    // Lost frames are rare. A value that always increases by two, or by varying steps, is not a frame
    // counter.
    let single = values().zip(values().skip(1)).filter(|(before, after)| (after + size - before) % size == 1);
    let is_rare = single.count() * 10 >= (frames.len() - 1) * 9;
    let is_proven = wraps >= MIN_WRAPS || (width >= 6 && frames.len() > MIN_STEPS);
    (is_proven && is_rare).then_some(FoundCounter { layout, first, last, max_step })
}
