//! Publication of a report exactly once for each new frame that carries it.

use std::time::Duration;

use super::report_flow::Step;
use can_signal::can::ReceiveTime;
use gateway_base::time::MonoTime;

/// State of one report topic whose values are published as they are received.
#[derive(Debug, Clone)]
pub struct StreamFlow<T> {
    min_period: Duration,
    current: Option<(T, ReceiveTime)>,
    /// Receive time of the last published value.
    published: Option<MonoTime>,
    /// Earliest time of the next publication.
    due: MonoTime,
}

impl<T: Copy> StreamFlow<T> {
    /// Creates a topic on which nothing has been published. On average, reports are at least `min_period`
    /// apart.
    pub fn new(min_period: Duration) -> Self {
        Self { min_period, current: None, published: None, due: MonoTime::ZERO }
    }

    /// Changes the minimum average interval between two reports.
    pub fn reconfigure(&mut self, min_period: Duration) {
        self.min_period = min_period;
        self.due = MonoTime::ZERO;
    }

    /// Updates the current value and its receive time (`None` = withheld) and returns the action; `None` = no
    /// action.
    pub fn update(&mut self, state: Option<(T, ReceiveTime)>, now: MonoTime) -> Option<Step<T>> {
        let before = std::mem::replace(&mut self.current, state);
        let Some((value, received)) = state else {
            return before.map(|_| Step::Withdraw);
        };
        // A frame that arrived too early is not published later, when it is older.
        if received.at != now || self.published == Some(received.at) || now < self.due {
            return None;
        }
        self.published = Some(received.at);
        // A value that comes somewhat early or late does not shift the period.
        self.due = self.due.after(self.min_period).max(now);
        Some(Step::Publish(value, received.stamp))
    }

    /// Returns the current value and receive time; `None` = withheld.
    pub fn current(&self) -> Option<(T, ReceiveTime)> {
        self.current
    }

    /// Returns the current value; `None` = withheld.
    pub fn value(&self) -> Option<T> {
        self.current.map(|(value, _)| value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gateway_base::time::WallStamp;

    fn received(micros: u64) -> ReceiveTime {
        let nanos = i64::try_from(micros).unwrap() * 1000;
        ReceiveTime { at: MonoTime::from_nanos(micros * 1000), stamp: WallStamp::from_nanos(nanos) }
    }

    #[test]
    fn each_frame_is_published_once_and_its_stamp_is_kept() {
        let mut flow = StreamFlow::new(Duration::from_millis(20));
        let frame = received(100_000);
        assert_eq!(flow.update(Some((1.5, frame)), frame.at), Some(Step::Publish(1.5, frame.stamp)));
        assert_eq!(flow.update(Some((1.5, frame)), MonoTime::from_millis(200)), None, "never repeated");
        assert_eq!(flow.update(None, MonoTime::from_millis(300)), Some(Step::Withdraw));
        assert_eq!(flow.update(None, MonoTime::from_millis(400)), None);
        assert_eq!(flow.update(Some((1.5, frame)), MonoTime::from_millis(500)), None, "an old frame");
        let next = received(600_000);
        assert_eq!(flow.update(Some((1.5, next)), next.at), Some(Step::Publish(1.5, next.stamp)));
    }

    #[test]
    fn a_jittering_cycle_keeps_the_greatest_rate_on_average() {
        let mut flow = StreamFlow::new(Duration::from_millis(20));
        let mut published = 0;
        for frame in 0..1000_u64 {
            let received = received(frame * 10_000 + frame % 7 * 300);
            published += u32::from(flow.update(Some((frame, received)), received.at).is_some());
        }
        assert!((495..=501).contains(&published), "{published} in 10 s");
    }
}
