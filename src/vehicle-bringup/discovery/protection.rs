//! Counter and checksum of a message.

use super::candidate::bits_of;
use super::capture::FrameTrack;
use can_signal::validation::integrity::search::{FoundChecksum, FoundCounter, find_checksum, find_counter};

/// Counter and checksum that hold for all captured frames of a message.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FoundProtection {
    /// The counter; `None` without one.
    pub counter: Option<FoundCounter>,
    /// The checksum; `None` without one, or with an unknown one.
    pub checksum: Option<FoundChecksum>,
}

const MAX_FRAMES: usize = 2_000;

impl FoundProtection {
    /// Finds counter and checksum in the frames of a message.
    pub(super) fn find(track: &FrameTrack) -> Self {
        let frames = track.different_frames(MAX_FRAMES);
        let (counter, checksum) = (find_counter(&frames), find_checksum(&frames));
        // Some bits of a sum also count up, as long as little else in the message changes.
        let of_sum: Vec<_> = checksum.iter().flat_map(|checksum| bits_of(checksum.layout)).collect();
        let is_apart =
            |counter: &FoundCounter| !bits_of(counter.layout).iter().any(|bit| of_sum.contains(bit));
        Self { counter: counter.filter(is_apart), checksum }
    }

    /// Returns the bits of both, as numbered in a DBC.
    pub(super) fn bits(&self) -> Vec<u16> {
        let layouts =
            [self.counter.map(|counter| counter.layout), self.checksum.as_ref().map(|sum| sum.layout)];
        layouts.into_iter().flatten().flat_map(bits_of).collect()
    }
}
