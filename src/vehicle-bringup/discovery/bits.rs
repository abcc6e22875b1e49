//! Bits of a message that change, but are at rest while nothing is operated.

use std::time::Duration;

use super::capture::FrameTrack;
use super::timeline::ActionTimeline;
use can_signal::can::MAX_DATA;
use gateway_base::time::MonoTime;

/// Bits of a frame, numbered as in a DBC, or a mask of them.
pub(super) type FrameBits = [u8; MAX_DATA];

pub(super) fn is_set(data: &FrameBits, bit: impl Into<usize>) -> bool {
    let bit = bit.into();
    data[bit / 8] >> (bit % 8) & 1 == 1
}

fn set(mask: &mut FrameBits, bit: impl Into<usize>) {
    let bit = bit.into();
    mask[bit / 8] |= 1 << (bit % 8);
}

/// Contents of a message, reduced to the bits that may belong to an indicator signal.
#[derive(Debug, Clone)]
pub(super) struct QuietBits<'a> {
    /// Numbers of the bits as in a DBC, ascending.
    pub(super) bits: Vec<u16>,
    pub(super) idle: FrameBits,
    /// Contents from each time on, with all other bits cleared unless they are constant.
    pub(super) contents: Vec<(MonoTime, FrameBits)>,
    pub(super) end: MonoTime,
    pub(super) timeline: &'a ActionTimeline,
    /// Mask of the bits that change by themselves.
    pub(super) noise: FrameBits,
    changed: Vec<bool>,
}

impl QuietBits<'_> {
    /// Returns true if the bit changed for any reason.
    pub(super) fn varies(&self, bit: u16) -> bool {
        self.changed.get(usize::from(bit)).copied().unwrap_or(false)
    }

    /// Returns true if `data` has another value of the bit than at rest.
    pub(super) fn is_on(&self, data: &FrameBits, bit: u16) -> bool {
        is_set(data, bit) != is_set(&self.idle, bit)
    }

    /// Returns true if two bits are at rest at the same times.
    pub(super) fn change_together(&self, bit: u16, other: u16) -> bool {
        self.contents.iter().all(|(_, data)| self.is_on(data, bit) == self.is_on(data, other))
    }

    /// Returns a mask of the bits that changed between two times.
    pub(super) fn changed_in(&self, from: MonoTime, until: MonoTime) -> FrameBits {
        let mut mask = [0; MAX_DATA];
        for pair in self.contents.windows(2).filter(|pair| from <= pair[1].0 && pair[1].0 < until) {
            let different = pair[0].1.iter().zip(pair[1].1).map(|(before, after)| before ^ after);
            mask.iter_mut().zip(different).for_each(|(mask, different)| *mask |= different);
        }
        mask
    }
}

/// Maximum number of changes of a bit during quiet times.
const MAX_QUIET_CHANGES: u32 = 2;
/// Maximum number of changes within [`TOUCH`], since a driver touches a control now and then.
const MAX_TOUCH_CHANGES: u32 = 12;
/// Maximum time for which a driver touches a control by mistake.
const TOUCH: Duration = Duration::from_secs(3);
/// Maximum number of changes of a bit for each action: more than a lamp that flashes for ten seconds.
const MAX_CHANGES: u32 = 60;
/// Minimum number of changes for recognising the upper bit of a number.
const MIN_CARRIES: u32 = 3;

/// Reduces a message to bits that do not change by themselves, without those in `excluded`; `None` when none
/// are left.
pub(super) fn quiet_bits<'a>(
    track: &FrameTrack,
    timeline: &'a ActionTimeline,
    end: MonoTime,
    excluded: &[u16],
) -> Option<QuietBits<'a>> {
    let length = track.shortest();
    let noise = noise(track, timeline, length);
    let mut mask = noise.map(|noise| !noise);
    mask[length..].fill(0);
    for bit in excluded {
        mask[usize::from(bit / 8)] &= !(1 << (bit % 8));
    }
    let mut changes = vec![BitChanges::default(); length * 8];
    let mut contents: Vec<(MonoTime, FrameBits)> = Vec::new();
    let mut before: Option<&FrameBits> = None;
    for (at, frame) in track.changes() {
        let data = frame.padded();
        let last = before.replace(data);
        if last.is_some_and(|last| !differs(last, data, &mask, length)) {
            continue;
        }
        if let Some(last) = last {
            count_changes(&mut changes, last, data, &mask);
        }
        contents.push((at, masked(data, &mask)));
    }
    let limit = MAX_CHANGES * u32::try_from(timeline.windows.len() + 1).unwrap_or(u32::MAX);
    let bits = u16::try_from(length * 8).unwrap_or(0);
    let may_matter = |bit: &u16| {
        let changed = changes[usize::from(*bit)];
        let is_often = |below: usize| {
            is_set(&noise, below) || changes.get(below).is_some_and(|below| below.all >= changed.all * 3 / 2)
        };
        changed.all > 0 && changed.all <= limit && !changed.is_carry(below(usize::from(*bit)), is_often)
    };
    let bits: Vec<_> = (0..bits).filter(may_matter).collect();
    if bits.is_empty() {
        return None;
    }
    let changed = (0..length * 8).map(|bit| is_set(&noise, bit) || changes[bit].all > 0).collect();
    // A bit that is always set counts in the values of a signal around it, as in the DBC. Noise and excluded
    // bits are 0 in the contents.
    let mut constant = [0; MAX_DATA];
    for bit in (0..length * 8).filter(|bit| changes[*bit].all == 0) {
        set(&mut constant, bit);
    }
    let mut mask = constant;
    for bit in &bits {
        set(&mut mask, *bit);
    }
    for (_, data) in &mut contents {
        *data = masked(data, &mask);
    }
    contents.dedup_by_key(|(_, data)| *data);
    let mut idle = idle(&contents, &bits, timeline, end);
    if let Some((_, first)) = contents.first() {
        idle.iter_mut().zip(masked(first, &constant)).for_each(|(byte, constant)| *byte |= constant);
    }
    Some(QuietBits { bits, idle, contents, end, timeline, noise, changed })
}

/// Returns a mask of the bits that change by themselves.
fn noise(track: &FrameTrack, timeline: &ActionTimeline, length: usize) -> FrameBits {
    let mut quiet = vec![QuietChanges::default(); length * 8];
    for (from, until) in &timeline.quiet {
        let mut before: Option<&FrameBits> = None;
        for (at, frame) in track.changes_from(*from).take_while(|(at, _)| at <= until) {
            let data = frame.padded();
            let last = before.replace(data).filter(|_| at >= *from).unwrap_or(data);
            for bit in different_bits(last, data, length) {
                quiet[bit].add(at);
            }
        }
    }
    let mut noise = [0; MAX_DATA];
    for (bit, _) in quiet.iter().enumerate().filter(|(_, changes)| !changes.is_quiet()) {
        set(&mut noise, bit);
    }
    noise
}

fn different_bits<'a>(
    before: &'a FrameBits,
    data: &'a FrameBits,
    length: usize,
) -> impl Iterator<Item = usize> + 'a {
    let bytes = before.iter().zip(data).take(length).enumerate().filter(|(_, (old, new))| old != new);
    bytes.flat_map(|(byte, (old, new))| {
        (0..8).filter(move |bit| (old ^ new) >> bit & 1 == 1).map(move |bit| byte * 8 + bit)
    })
}

/// Returns true if two contents differ in the bits of a mask.
fn differs(a: &FrameBits, b: &FrameBits, mask: &FrameBits, length: usize) -> bool {
    let word = |data: &FrameBits, at: usize| {
        data.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |chunk| u64::from_le_bytes(*chunk))
    };
    (0..length).step_by(8).any(|at| (word(a, at) ^ word(b, at)) & word(mask, at) != 0)
}

fn masked(data: &FrameBits, mask: &FrameBits) -> FrameBits {
    let mut masked = *data;
    masked.iter_mut().zip(mask).for_each(|(byte, mask)| *byte &= mask);
    masked
}

fn count_changes(changes: &mut [BitChanges], before: &FrameBits, data: &FrameBits, mask: &FrameBits) {
    let length = changes.len() / 8;
    for bit in different_bits(before, data, length).filter(|bit| is_set(mask, *bit)) {
        changes[bit].all += 1;
        for (carries, below) in changes[bit].carries.iter_mut().zip(below(bit)) {
            let fell = |bit: usize| is_set(before, bit) && !is_set(data, bit);
            let rose = |bit: usize| is_set(data, bit) && !is_set(before, bit);
            *carries += u32::from(below.is_some_and(|below| fell(below) || (fell(bit) && rose(below))));
        }
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct QuietChanges {
    count: u32,
    span: Option<(MonoTime, MonoTime)>,
}

impl QuietChanges {
    fn add(&mut self, at: MonoTime) {
        self.count += 1;
        let (first, _) = self.span.unwrap_or((at, at));
        self.span = Some((first, at));
    }

    /// Returns true for a bit that does not change by itself.
    fn is_quiet(&self) -> bool {
        let is_touch = self.span.is_none_or(|(first, last)| last.since(first) <= TOUCH);
        self.count <= MAX_QUIET_CHANGES || (self.count <= MAX_TOUCH_CHANGES && is_touch)
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct BitChanges {
    all: u32,
    /// Changes at which the next lower bit fell, or rose when this bit fell, as when a number is incremented
    /// or decremented; in Intel and Motorola order.
    carries: [u32; 2],
}

impl BitChanges {
    /// Returns true for an upper bit of a number that counts or varies by itself: each of its changes is a
    /// carry of the bit below it, which changes more often.
    fn is_carry(&self, below: [Option<usize>; 2], is_often: impl Fn(usize) -> bool) -> bool {
        let mut carries = self.carries.into_iter().zip(below);
        let is_carried =
            |(carries, below): (u32, Option<usize>)| carries == self.all && below.is_some_and(&is_often);
        self.all >= MIN_CARRIES && carries.any(is_carried)
    }
}

/// Returns the bits below a bit, where a number of several bytes continues, in Intel and Motorola order.
fn below(bit: usize) -> [Option<usize>; 2] {
    match bit % 8 {
        0 => [bit.checked_sub(1), Some(bit + 15).filter(|bit| *bit < MAX_DATA * 8)],
        _ => [Some(bit - 1), Some(bit - 1)],
    }
}

/// Returns the value that each bit has for most of the time at rest, or for most of the whole time if the
/// message is not sent at rest.
fn idle(
    contents: &[(MonoTime, FrameBits)],
    bits: &[u16],
    timeline: &ActionTimeline,
    end: MonoTime,
) -> FrameBits {
    let mut weights = vec![0_i64; bits.len()];
    for (index, (from, data)) in contents.iter().enumerate() {
        let until = contents.get(index + 1).map_or(end, |(next, _)| *next);
        let rest: u128 =
            timeline.rests().map(|(start, stop)| until.min(stop).since((*from).max(start)).as_millis()).sum();
        let weight = i64::try_from(rest * 1000 + until.since(*from).as_millis()).unwrap_or(i64::MAX / 2);
        for (bit, sum) in bits.iter().zip(&mut weights) {
            *sum = sum.saturating_add(if is_set(data, *bit) { weight } else { -weight });
        }
    }
    let mut idle = [0; MAX_DATA];
    for (bit, _) in bits.iter().zip(weights).filter(|(_, weight)| *weight > 0) {
        set(&mut idle, *bit);
    }
    idle
}
