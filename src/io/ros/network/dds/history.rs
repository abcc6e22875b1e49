//! An upper bound of the samples that RustDDS still holds for a writer.
//!
//! RustDDS removes what all readers have acknowledged every 6 s and does not report what is left.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Age at which an acknowledged sample is certainly gone.
const KEPT: Duration = Duration::from_secs(7);

/// Times and sizes of the samples, oldest first.
#[derive(Debug, Default)]
pub(super) struct History {
    samples: VecDeque<(Instant, usize)>,
    /// Bytes that may still be held.
    pub(super) bytes: usize,
}

impl History {
    /// Records a written sample of that many bytes.
    pub(super) fn add(&mut self, now: Instant, bytes: usize) {
        self.samples.push_back((now, bytes));
        self.bytes += bytes;
    }

    /// Forgets old samples, when all are acknowledged.
    pub(super) fn acknowledged(&mut self, now: Instant) {
        while let Some((at, bytes)) = self.samples.front()
            && now.saturating_duration_since(*at) > KEPT
        {
            self.bytes -= bytes;
            self.samples.pop_front();
        }
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
        (0..20).for_each(|second| history.add(after(second), 10));
        assert_eq!(history.bytes, 200, "nobody acknowledged");
        history.acknowledged(after(10));
        assert_eq!(history.bytes, 170);
        history.acknowledged(after(100));
        assert_eq!(history.bytes, 0);
    }
}
