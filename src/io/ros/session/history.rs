//! What RustDDS may still hold of what a writer said.
//!
//! It tidies every 6 s, up to what all readers have acknowledged, and cannot be asked.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// What is older, and acknowledged, is gone for sure.
const KEPT: Duration = Duration::from_secs(7);

/// Sizes of what was said, oldest first.
#[derive(Debug, Default)]
pub(super) struct History {
    said: VecDeque<(Instant, usize)>,
    bytes: usize,
}

impl History {
    /// Something was said.
    pub(super) fn add(&mut self, now: Instant, bytes: usize) {
        self.said.push_back((now, bytes));
        self.bytes += bytes;
    }

    /// All that was said is acknowledged.
    pub(super) fn acknowledged(&mut self, now: Instant) {
        while let Some((at, bytes)) = self.said.front()
            && now.saturating_duration_since(*at) > KEPT
        {
            self.bytes -= bytes;
            self.said.pop_front();
        }
    }

    /// How much that may be.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
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
        assert_eq!(history.bytes(), 200, "nobody acknowledged");
        history.acknowledged(after(10));
        assert_eq!(history.bytes(), 170);
        history.acknowledged(after(100));
        assert_eq!(history.bytes(), 0);
    }
}
