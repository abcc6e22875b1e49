//! An upper bound of the samples that RustDDS still holds for a writer.
//!
//! RustDDS removes samples acknowledged by all readers every 6 s, and does not report how many remain.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Age at which an acknowledged sample is certainly gone.
const KEPT: Duration = Duration::from_secs(7);

/// A sample that may still be held.
#[derive(Debug)]
struct Held {
    at: Instant,
    bytes: usize,
    publication: u64,
}

/// The samples that may still be held, oldest first.
#[derive(Debug, Default)]
pub(super) struct History {
    samples: VecDeque<Held>,
    /// Total size of the samples, bytes.
    pub(super) bytes: usize,
}

impl History {
    /// Records a written sample of `bytes` bytes. The samples of one publication, and their repetitions,
    /// share its number.
    pub(super) fn add(&mut self, now: Instant, bytes: usize, publication: u64) {
        self.samples.push_back(Held { at: now, bytes, publication });
        self.bytes += bytes;
    }

    /// Removes old samples, when all are acknowledged.
    pub(super) fn acknowledged(&mut self, now: Instant) {
        while let Some(Held { at, bytes, .. }) = self.samples.front()
            && now.saturating_duration_since(*at) > KEPT
        {
            self.bytes -= bytes;
            self.samples.pop_front();
        }
    }

    /// Returns the maximum number of publications that a late reader may receive.
    pub(super) fn publications(&self) -> usize {
        let (oldest, newest) = (self.samples.front(), self.samples.back());
        let count = oldest.zip(newest).map(|(oldest, newest)| newest.publication - oldest.publication + 1);
        count.map_or(0, |count| usize::try_from(count).unwrap_or(usize::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_old_and_acknowledged_is_forgotten_and_nothing_else() {
        let start = Instant::now();
        let after = |seconds| start + Duration::from_secs(seconds);
        let mut history = History::default();
        assert_eq!(history.publications(), 0);
        (0..20).for_each(|second| history.add(after(second), 10, second / 2));
        assert_eq!((history.bytes, history.publications()), (200, 10), "nobody acknowledged");
        history.acknowledged(after(10));
        assert_eq!((history.bytes, history.publications()), (170, 9));
        history.acknowledged(after(100));
        assert_eq!((history.bytes, history.publications()), (0, 0));
    }
}
