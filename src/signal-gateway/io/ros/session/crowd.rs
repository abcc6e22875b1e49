//! Decides when so many participants were announced to a network side that it should be replaced.

use std::time::{Duration, Instant};

/// Limit for the sum of other participants and their matched endpoints, more than any ROS network has: DDS
/// has ports for 120 participants per host, and each topic of a gateway has a few readers. RustDDS sends to
/// all of them, and removes none before its lease expires, which may take 68 years.
pub(super) const MAX_PEERS: u32 = 1000;
/// Time without many new peers after which a flood is over; RustDDS processes waiting announcements one by
/// one.
const CALM: Duration = Duration::from_millis(1500);
/// Number of new peers that counts as many.
const MANY: u32 = 100;
/// Time after which a network side is replaced even though the crowd still grows.
const PATIENCE: Duration = Duration::from_secs(8);
/// Minimum time between two replacements, which doubles with each.
const MIN_INTERVAL: Duration = Duration::from_secs(5);
/// Maximum time between two replacements: if the peers are real, replacing the network side does not reduce
/// them.
const MAX_INTERVAL: Duration = Duration::from_secs(3600);
/// Time without a crowd after which the interval starts again at its minimum.
const FORGOTTEN: Duration = Duration::from_secs(600);

/// Watches the number of peers of a network side.
#[derive(Debug)]
pub(super) struct Crowd {
    /// Number of peers and time at the last large increase.
    grown: (u32, Instant),
    /// Time since which there have been too many peers.
    since: Option<Instant>,
    /// Last time at which there were too many peers.
    seen: Option<Instant>,
    /// Time of the last replacement because of too many peers.
    replaced: Option<Instant>,
    interval: Duration,
}

impl Crowd {
    /// Creates a watch that has seen no peer yet.
    pub(super) fn new(now: Instant) -> Self {
        Self { grown: (0, now), since: None, seen: None, replaced: None, interval: MIN_INTERVAL }
    }

    /// Records the number of peers. Returns true if the network side should be replaced.
    pub(super) fn look(&mut self, peers: u32, now: Instant) -> bool {
        let since = |then: Instant| now.saturating_duration_since(then);
        if peers >= self.grown.0 + MANY {
            self.grown = (peers, now);
        }
        self.grown.0 = self.grown.0.min(peers);
        if self.seen.is_some_and(|seen| since(seen) >= FORGOTTEN) {
            (self.seen, self.interval) = (None, MIN_INTERVAL);
        }
        if peers < MAX_PEERS {
            self.since = None;
            return false;
        }
        self.seen = Some(now);
        let lasts = since(*self.since.get_or_insert(now));
        let is_over = since(self.grown.1) >= CALM || lasts >= PATIENCE;
        let is_due = is_over && self.replaced.is_none_or(|then| since(then) >= self.interval);
        if is_due {
            self.interval = if self.replaced.is_some() { self.interval * 2 } else { self.interval };
            self.interval = self.interval.min(MAX_INTERVAL);
            (self.replaced, self.since) = (Some(now), None);
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the seconds at which a network side is replaced; `peers` gives the number of peers at each
    /// tenth of a second.
    fn replaced(seconds: u32, peers: impl Fn(u32) -> u32) -> Vec<u32> {
        let start = Instant::now();
        let mut crowd = Crowd::new(start);
        let mut look = |tenth: &u32| crowd.look(peers(*tenth), start + Duration::from_millis(100) * *tenth);
        (0..seconds * 10).filter(|tenth| look(tenth)).map(|tenth| tenth / 10).collect()
    }

    #[test]
    fn a_flood_costs_one_network_side_once_it_is_over() {
        let peers = |tenth: u32| if tenth < 80 { 55 * tenth.min(60) } else { 3 };
        assert_eq!(replaced(100, peers), [7]);
        assert_eq!(replaced(1_000, |_| MAX_PEERS - 1), Vec::<u32>::new());
        assert_eq!(replaced(8, |tenth| 2_000 + 20 * tenth), Vec::<u32>::new(), "while it lasts");
        assert_eq!(replaced(20, |tenth| 2_000 + 20 * tenth), [8, 16], "unless it lasts for long");
        let slowly = |tenth: u32| 2_000 + 100 * tenth.min(50) + 5 * tenth;
        assert_eq!(replaced(8, slowly), [6], "some still come");
    }

    #[test]
    fn a_crowd_that_is_real_costs_fewer_and_fewer() {
        let times = replaced(40_000, |_| 2_000);
        assert_eq!(times[..5], [1, 6, 16, 36, 76]);
        assert!(times.len() < 25, "{times:?}");
        let twice = |tenth| if (20..8_000).contains(&tenth) { 0 } else { 2_000 };
        assert_eq!(replaced(807, twice)[..2], [1, 801]);
    }
}
