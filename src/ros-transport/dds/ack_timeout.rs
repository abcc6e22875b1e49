//! Detects readers that no longer acknowledge, because they have forgotten us while we still know them.
//!
//! This happens if an outage was longer than our lease but shorter than the peer's. The peer then restarts
//! its communication with us, and RustDDS regards its acknowledgements, which count from one again, as old.

use std::time::{Duration, Instant};

/// The lease that RustDDS announces for us is 50 s; no peer forgets us earlier.
const PATIENCE: Duration = Duration::from_secs(55);
/// Limits the cost of a reader that never acknowledges to one new participant an hour.
const MAX_PATIENCE: Duration = Duration::from_secs(3600);

/// Measures for how long an acknowledgement of some reader has been overdue.
#[derive(Debug)]
pub(super) struct AckTimeout {
    since: Option<Instant>,
    patience: Duration,
}

impl Default for AckTimeout {
    fn default() -> Self {
        Self { since: None, patience: PATIENCE }
    }
}

impl AckTimeout {
    /// Records whether everything is acknowledged now, and by how many readers. Returns true when a new
    /// participant is needed, and then starts over with twice the time.
    pub(super) fn observe(&mut self, acknowledged: bool, readers: usize, now: Instant) -> bool {
        if acknowledged {
            self.since = None;
            if readers > 0 {
                self.patience = PATIENCE;
            }
            return false;
        }
        let since = *self.since.get_or_insert(now);
        if now.saturating_duration_since(since) < self.patience {
            return false;
        }
        self.since = None;
        self.patience = (self.patience * 2).min(MAX_PATIENCE);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the seconds at which a new participant is requested, with these acknowledgements.
    fn rebuild_times(seconds: u64, acknowledged: impl Fn(u64) -> bool) -> Vec<u64> {
        let (start, mut ack_timeout) = (Instant::now(), AckTimeout::default());
        let mut observe = |second: &u64| {
            ack_timeout.observe(acknowledged(*second), 1, start + Duration::from_secs(*second))
        };
        (0..seconds).filter(|second| observe(second)).collect()
    }

    #[test]
    fn a_reader_that_acknowledges_now_and_then_needs_no_new_participant() {
        assert_eq!(rebuild_times(10_000, |second| second % 50 == 0), Vec::<u64>::new());
    }

    #[test]
    fn a_reader_that_never_acknowledges_is_given_more_time_after_every_new_participant() {
        assert_eq!(rebuild_times(500, |_| false), [55, 166, 387]);
        let hours = rebuild_times(100_000, |_| false);
        assert!(hours.len() < 35, "{hours:?}");
    }

    #[test]
    fn patience_is_as_before_once_a_reader_acknowledged() {
        assert_eq!(rebuild_times(200, |second| (56..100).contains(&second)), [55, 155]);
    }
}
