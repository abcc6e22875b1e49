//! The samples of the last seconds, which late readers receive as well.

use std::collections::VecDeque;
use std::time::Instant;

use crate::qos::{LOG_DEPTH, LOG_LIFESPAN};
use ros_messages::cdr::CdrBytes;

/// At most [`LOG_DEPTH`] samples of the last [`LOG_LIFESPAN`], oldest first.
#[derive(Debug, Default)]
pub(super) struct RecentSamples(VecDeque<(Instant, CdrBytes)>);

impl RecentSamples {
    pub(super) fn add(&mut self, now: Instant, samples: &[CdrBytes]) {
        self.0.extend(samples.iter().map(|sample| (now, sample.clone())));
        let surplus = self.0.len().saturating_sub(usize::try_from(LOG_DEPTH).unwrap_or_default());
        self.0.drain(..surplus);
    }

    pub(super) fn now(&mut self, now: Instant) -> Vec<CdrBytes> {
        while self.0.front().is_some_and(|(at, _)| now.saturating_duration_since(*at) >= LOG_LIFESPAN) {
            self.0.pop_front();
        }
        self.0.iter().map(|(_, sample)| sample.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn samples_are_kept_for_their_lifespan_and_up_to_the_depth() {
        let sample = |number: u8| CdrBytes::from(vec![number]);
        let (mut recent, start) = (RecentSamples::default(), Instant::now());
        recent.add(start, &[sample(1), sample(2)]);
        recent.add(start + Duration::from_secs(5), &[sample(3)]);
        assert_eq!(recent.now(start + Duration::from_millis(9_999)), [sample(1), sample(2), sample(3)]);
        assert_eq!(recent.now(start + Duration::from_secs(10)), [sample(3)]);
        assert_eq!(recent.now(start + Duration::from_secs(15)), []);
        (0..150).for_each(|number| recent.add(start, &[sample(number)]));
        assert_eq!(recent.now(start), (50..150).map(sample).collect::<Vec<_>>());
    }
}
