//! Bits of a message that rest while nothing is operated, and change at all.

use std::time::Duration;

use super::capture::Track;
use super::timeline::Timeline;
use crate::core::can::frame::MAX_DATA;
use crate::core::time::MonoTime;

/// Contents of a message, reduced to the bits that may belong to a signal of the indicators.
#[derive(Debug, Clone)]
pub(super) struct QuietBits<'a> {
    /// The bits, as numbered in a DBC, ascending.
    pub(super) bits: Vec<u16>,
    /// The contents at rest.
    pub(super) idle: [u8; MAX_DATA],
    /// Contents from each time on, other bits cleared.
    pub(super) contents: Vec<(MonoTime, [u8; MAX_DATA])>,
    /// End of the last contents.
    pub(super) end: MonoTime,
    /// The actions over time.
    pub(super) timeline: &'a Timeline,
    /// True for each bit that changed, for whatever reason.
    changed: Vec<bool>,
}

impl QuietBits<'_> {
    /// True if the bit changed, for whatever reason.
    pub(super) fn varies(&self, bit: u16) -> bool {
        self.changed.get(usize::from(bit)).copied().unwrap_or(false)
    }
}

/// The largest number of changes of a bit during quiet times.
const MAX_QUIET_CHANGES: u32 = 2;
/// Likewise within [`TOUCH`]: a driver touches something now and then.
const MAX_TOUCH_CHANGES: u32 = 12;
/// The longest time in which a driver touches something by mistake.
const TOUCH: Duration = Duration::from_secs(3);
/// The largest number of changes of a bit for each action: a lamp that flashes for ten seconds, and more.
const MAX_CHANGES: u32 = 60;
/// Smallest number of changes by which the upper bit of a number is known.
const MIN_CARRIES: u32 = 3;

/// Reduces a message to bits that do not change by themselves, without those in `excluded`; `None` when none are
/// left.
pub(super) fn quiet_bits<'a>(
    track: &Track,
    timeline: &'a Timeline,
    end: MonoTime,
    excluded: &[u16],
) -> Option<QuietBits<'a>> {
    let mut changes = vec![Changes::default(); track.shortest() * 8];
    let length = track.shortest();
    let bits = u16::try_from(length * 8).unwrap_or(0);
    let mut before: Option<&[u8; MAX_DATA]> = None;
    for (at, frame) in track.changes() {
        let data = frame.padded();
        let is_quiet = timeline.quiet.iter().any(|(from, until)| *from <= at && at <= *until);
        let before = before.replace(data).unwrap_or(data);
        for (byte, (old, new)) in before.iter().zip(data).take(length).enumerate() {
            let mut different = old ^ new;
            while different != 0 {
                let bit = byte * 8 + different.trailing_zeros() as usize;
                different &= different - 1;
                changes[bit].all += 1;
                if is_quiet {
                    changes[bit].quiet += 1;
                    let (first, _) = changes[bit].touched.unwrap_or((at, at));
                    changes[bit].touched = Some((first, at));
                }
                for (carries, below) in changes[bit].carries.iter_mut().zip(below(bit)) {
                    let fell = |below: usize| (before[below / 8] & !data[below / 8]) >> (below % 8) & 1 == 1;
                    *carries += u32::from(below.is_some_and(fell));
                }
            }
        }
    }
    let limit = MAX_CHANGES * u32::try_from(timeline.windows.len() + 1).unwrap_or(u32::MAX);
    let may_matter = |bit: &u16| {
        let below = below(usize::from(*bit)).map(|below| below.and_then(|at| changes.get(at).copied()));
        let changes = changes[usize::from(*bit)];
        changes.all > 0
            && !changes.is_carry(below)
            && changes.all <= limit
            && changes.is_quiet()
            && !excluded.contains(bit)
    };
    let bits: Vec<_> = (0..bits).filter(may_matter).collect();
    if bits.is_empty() {
        return None;
    }
    let mut mask = [0; MAX_DATA];
    for bit in &bits {
        mask[usize::from(bit / 8)] |= 1 << (bit % 8);
    }
    let mut contents: Vec<(MonoTime, [u8; MAX_DATA])> = Vec::new();
    for (at, frame) in track.changes() {
        let mut data = [0; MAX_DATA];
        let masked = frame.data().iter().zip(mask).map(|(byte, mask)| byte & mask);
        data.iter_mut().zip(masked).take(length).for_each(|(byte, masked)| *byte = masked);
        if contents.last().is_none_or(|(_, before)| *before != data) {
            contents.push((at, data));
        }
    }
    let idle = idle(&contents, &bits, timeline, end);
    let changed = changes.iter().map(|changes| changes.all > 0).collect();
    Some(QuietBits { bits, idle, contents, end, timeline, changed })
}

#[derive(Debug, Clone, Copy, Default)]
struct Changes {
    all: u32,
    quiet: u32,
    /// Times of the first and the last change during quiet times.
    touched: Option<(MonoTime, MonoTime)>,
    /// Changes at which the next lower bit fell, in the orders of Intel and Motorola.
    carries: [u32; 2],
}

impl Changes {
    /// True for a bit that does not change by itself.
    fn is_quiet(&self) -> bool {
        let is_touch = self.touched.is_none_or(|(first, last)| last.since(first) <= TOUCH);
        self.quiet <= MAX_QUIET_CHANGES || (self.quiet <= MAX_TOUCH_CHANGES && is_touch)
    }

    /// True for an upper bit of a number that counts or varies by itself: it changes when the bit below it falls, and
    /// less often than that.
    fn is_carry(&self, below: [Option<Self>; 2]) -> bool {
        self.all >= MIN_CARRIES
            && self.carries.into_iter().zip(below).any(|(carries, below)| {
                carries == self.all && below.is_some_and(|below| below.all >= self.all * 3 / 2)
            })
    }
}

/// Bits below a bit, where a number of several bytes continues: in the orders of Intel and Motorola.
fn below(bit: usize) -> [Option<usize>; 2] {
    match bit % 8 {
        0 => [bit.checked_sub(1), Some(bit + 15).filter(|bit| *bit < MAX_DATA * 8)],
        _ => [Some(bit - 1), Some(bit - 1)],
    }
}

/// The value that each bit has for most of the time at rest; of a message that is not sent then, the value it has for
/// most of the time.
fn idle(
    contents: &[(MonoTime, [u8; MAX_DATA])],
    bits: &[u16],
    timeline: &Timeline,
    end: MonoTime,
) -> [u8; MAX_DATA] {
    let mut weights = vec![0_i64; bits.len()];
    for (index, (from, data)) in contents.iter().enumerate() {
        let until = contents.get(index + 1).map_or(end, |(next, _)| *next);
        let rest: u128 =
            timeline.rests().map(|(start, stop)| until.min(stop).since((*from).max(start)).as_millis()).sum();
        let weight = i64::try_from(rest * 1000 + until.since(*from).as_millis()).unwrap_or(i64::MAX / 2);
        for (bit, sum) in bits.iter().zip(&mut weights) {
            let is_set = data[usize::from(bit / 8)] >> (bit % 8) & 1 == 1;
            *sum = sum.saturating_add(if is_set { weight } else { -weight });
        }
    }
    let mut idle = [0; MAX_DATA];
    for (bit, _) in bits.iter().zip(weights).filter(|(_, weight)| *weight > 0) {
        idle[usize::from(bit / 8)] |= 1 << (bit % 8);
    }
    idle
}
