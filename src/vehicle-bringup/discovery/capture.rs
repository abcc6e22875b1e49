//! The frames of a session, by message.

use std::collections::BTreeMap;
use std::time::Duration;

use can_signal::can::{BusIndex, CanId, Frame};
use gateway_base::time::MonoTime;

/// A message of a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct MessageKey {
    /// Bus that carries its frames.
    pub bus: BusIndex,
    /// Identifier of its frames.
    pub id: CanId,
}

/// All frames of a session; a repeated frame is kept only as a time.
#[derive(Debug, Clone, Default)]
pub struct Capture {
    tracks: BTreeMap<MessageKey, FrameTrack>,
    frames: usize,
    span: Option<(MonoTime, MonoTime)>,
}

/// The frames of one message.
#[derive(Debug, Clone, Default)]
pub struct FrameTrack {
    times: Vec<MonoTime>,
    /// Frames that differ from the previous one, with their positions in `times`.
    changes: Vec<(usize, Frame)>,
}

/// Minimum number of gaps for distinguishing a pause from a message sent on change.
const MANY_GAPS: usize = 40;
/// Maximum number of frames, half an hour of a busy bus; further frames are left out.
const MAX_FRAMES: usize = 4_000_000;

impl Capture {
    /// Adds a frame. Times must not run backwards.
    pub fn add(&mut self, bus: BusIndex, frame: &Frame, at: MonoTime) {
        let (first, _) = *self.span.get_or_insert((at, at));
        self.span = Some((first, at));
        if self.frames == MAX_FRAMES {
            return;
        }
        self.frames += 1;
        let track = self.tracks.entry(MessageKey { bus, id: frame.id() }).or_default();
        if track.changes.last().is_none_or(|(_, before)| before != frame) {
            track.changes.push((track.times.len(), *frame));
        }
        track.times.push(at);
    }

    /// Returns the messages with their frames, ascending.
    pub fn tracks(&self) -> impl Iterator<Item = (MessageKey, &FrameTrack)> {
        self.tracks.iter().map(|(key, track)| (*key, track))
    }

    /// Returns the frames of one message.
    pub fn track(&self, key: MessageKey) -> Option<&FrameTrack> {
        self.tracks.get(&key)
    }

    /// Returns the number of frames.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Returns the number of messages.
    pub fn messages(&self) -> usize {
        self.tracks.len()
    }

    /// Returns the times of the first and the last frame; `None` without a frame.
    pub fn span(&self) -> Option<(MonoTime, MonoTime)> {
        self.span
    }
}

impl FrameTrack {
    /// Returns the time of each frame.
    pub fn times(&self) -> &[MonoTime] {
        &self.times
    }

    /// Returns all frames with their times.
    pub fn frames(&self) -> impl Iterator<Item = (MonoTime, &Frame)> {
        self.changes.iter().enumerate().flat_map(|(index, (from, frame))| {
            let until = self.changes.get(index + 1).map_or(self.times.len(), |(next, _)| *next);
            self.times.get(*from..until).unwrap_or_default().iter().map(move |at| (*at, frame))
        })
    }

    /// Returns the frames that differ from the previous one, with their times.
    pub fn changes(&self) -> impl Iterator<Item = (MonoTime, &Frame)> {
        self.changes_from(MonoTime::ZERO)
    }

    /// Returns the frames that differ from the previous one, starting with the last before `from`.
    pub fn changes_from(&self, from: MonoTime) -> impl Iterator<Item = (MonoTime, &Frame)> {
        let is_before = |(at, _): &(usize, Frame)| self.times.get(*at).is_some_and(|at| *at < from);
        let first = self.changes.partition_point(is_before).saturating_sub(1);
        let changes = self.changes.get(first..).unwrap_or_default();
        changes.iter().filter_map(|(at, frame)| Some((*self.times.get(*at)?, frame)))
    }

    /// Returns the first frames that differ from the previous one, at most `limit`.
    pub fn different_frames(&self, limit: usize) -> Vec<Frame> {
        self.changes.iter().take(limit).map(|(_, frame)| *frame).collect()
    }

    /// Returns the length of all frames in bytes; `None` when it varies.
    pub fn length(&self) -> Option<usize> {
        let length = self.changes.first()?.1.data().len();
        self.changes.iter().all(|(_, frame)| frame.data().len() == length).then_some(length)
    }

    /// Returns the length of the shortest frame in bytes.
    pub fn shortest(&self) -> usize {
        self.changes.iter().map(|(_, frame)| frame.data().len()).min().unwrap_or(0)
    }

    /// Returns the median and the longest time between two frames; `None` for fewer than three frames.
    pub fn gaps(&self) -> Option<MessageGaps> {
        let mut gaps: Vec<_> = self.times.windows(2).map(|pair| pair[1].since(pair[0])).collect();
        gaps.sort_unstable();
        let median = *gaps.get(gaps.len() / 2)?;
        // If there are many gaps, the two longest may be pauses.
        let pauses = if gaps.len() >= MANY_GAPS { 2 } else { 0 };
        let usual = *gaps.get(gaps.len().checked_sub(1 + pauses)?)?;
        (gaps.len() >= 2).then_some(MessageGaps { median, usual, longest: *gaps.last()? })
    }
}

/// Times between frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MessageGaps {
    /// Median of the times between frames.
    pub median: Duration,
    /// Longest time, except up to two pauses.
    pub usual: Duration,
    /// Longest time between two frames.
    pub longest: Duration,
}
