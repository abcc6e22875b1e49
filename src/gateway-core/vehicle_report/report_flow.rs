//! Publication of a report: on change, periodically, or not at all.

use std::time::Duration;

use can_signal::can::ReceiveTime;
use gateway_base::time::{MonoTime, WallStamp};

/// Publication scheme of reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Publish {
    /// Every period, and immediately when the value changes or publishing resumes.
    Periodic(Duration),
    /// Only when the value changes or publishing resumes.
    OnChange,
}

/// Action on a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step<T> {
    /// Publish the value with the stamp of the frame that carried it; of several frames, the newest.
    Publish(T, WallStamp),
    /// Stop publishing, so that no reader mistakes an old value for a current one.
    Withdraw,
}

impl<T: Copy> Step<T> {
    /// Returns the value to publish; `None` if the report is withdrawn.
    pub fn value(self) -> Option<T> {
        if let Self::Publish(value, _) = self { Some(value) } else { None }
    }
}

/// State of one report topic.
#[derive(Debug, Clone)]
pub struct ReportFlow<T> {
    publish: Publish,
    current: Option<(T, WallStamp)>,
    due: Option<MonoTime>,
}

impl<T: Copy + PartialEq> ReportFlow<T> {
    /// Creates a topic on which nothing has been published.
    pub fn new(publish: Publish) -> Self {
        Self { publish, current: None, due: None }
    }

    /// Changes the publication scheme. The published value is kept; a periodic report is due at most one new
    /// period from now.
    pub fn reconfigure(&mut self, publish: Publish, now: MonoTime) {
        if self.publish == publish {
            return;
        }
        self.publish = publish;
        self.due = match publish {
            Publish::OnChange => None,
            Publish::Periodic(period) => self.current.map(|_| {
                let latest = now.after(period);
                self.due.map_or(latest, |due| due.min(latest))
            }),
        };
    }

    /// Updates the current value and its receive time (`None` = withheld) and returns the action; `None` = no
    /// action.
    pub fn update(&mut self, state: Option<(T, ReceiveTime)>, now: MonoTime) -> Option<Step<T>> {
        let state = state.map(|(value, received)| (value, received.stamp));
        let before = std::mem::replace(&mut self.current, state);
        let Some((value, stamp)) = state else {
            self.due = None;
            return before.map(|_| Step::Withdraw);
        };
        let changed = before.is_none_or(|(previous, _)| previous != value);
        let due = self.due.is_some_and(|due| due <= now);
        if !changed && !due {
            return None;
        }
        if let Publish::Periodic(period) = self.publish {
            // A late call does not shift the period, but a change does.
            let on_time =
                self.due.filter(|_| !changed).map(|due| due.after(period)).filter(|next| *next > now);
            self.due = Some(on_time.unwrap_or_else(|| now.after(period)));
        }
        Some(Step::Publish(value, stamp))
    }

    /// Returns the currently published value and stamp; `None` = withheld.
    pub fn current(&self) -> Option<(T, WallStamp)> {
        self.current
    }

    /// Returns the currently published value; `None` = withheld.
    pub fn value(&self) -> Option<T> {
        self.current.map(|(value, _)| value)
    }

    /// Returns the next instant at which a periodic report is due; `None` if no report is due.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        self.due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> MonoTime {
        MonoTime::from_millis(millis)
    }
    fn stamp(millis: i64) -> WallStamp {
        WallStamp::from_nanos(millis * 1_000_000)
    }
    fn received(value: char, millis: i64) -> (char, ReceiveTime) {
        (value, ReceiveTime { at: MonoTime::ZERO, stamp: stamp(millis) })
    }

    #[test]
    fn periodic_report_has_newest_stamp_and_change_is_published_immediately() {
        let mut flow = ReportFlow::new(Publish::Periodic(Duration::from_millis(100)));
        assert_eq!(flow.update(Some(received('L', 0)), at(0)), Some(Step::Publish('L', stamp(0))));
        assert_eq!(flow.update(Some(received('L', 60)), at(60)), None);
        assert_eq!(flow.next_deadline(), Some(at(100)));
        assert_eq!(flow.update(Some(received('L', 60)), at(104)), Some(Step::Publish('L', stamp(60))));
        assert_eq!(flow.next_deadline(), Some(at(200)), "a late call does not shift the period");
        assert_eq!(flow.update(Some(received('R', 130)), at(130)), Some(Step::Publish('R', stamp(130))));
        assert_eq!(flow.next_deadline(), Some(at(230)));
    }

    #[test]
    fn report_is_withdrawn_once_and_published_immediately_on_resume() {
        for publish in [Publish::OnChange, Publish::Periodic(Duration::from_millis(100))] {
            let mut flow = ReportFlow::new(publish);
            assert_eq!(flow.update(None, at(0)), None, "nothing to withdraw yet");
            flow.update(Some(received('L', 1)), at(1));
            assert_eq!(flow.update(None, at(2)), Some(Step::Withdraw));
            assert_eq!(flow.update(None, at(3)), None);
            assert_eq!(flow.next_deadline(), None);
            assert_eq!(flow.update(Some(received('L', 4)), at(4)), Some(Step::Publish('L', stamp(4))));
        }
    }

    #[test]
    fn another_scheme_keeps_what_is_published_and_takes_up_its_period() {
        let [fast, slow] = [100, 500].map(|millis| Publish::Periodic(Duration::from_millis(millis)));
        let mut flow = ReportFlow::new(slow);
        flow.update(Some(received('L', 0)), at(0));
        flow.reconfigure(slow, at(10));
        assert_eq!(flow.next_deadline(), Some(at(500)), "the same");
        flow.reconfigure(fast, at(20));
        assert_eq!((flow.current(), flow.next_deadline()), (Some(('L', stamp(0))), Some(at(120))));
        assert_eq!(flow.update(Some(received('L', 0)), at(120)), Some(Step::Publish('L', stamp(0))));
        flow.reconfigure(Publish::OnChange, at(130));
        assert_eq!(flow.next_deadline(), None);
        flow.reconfigure(slow, at(140));
        assert_eq!(flow.next_deadline(), Some(at(640)));
        flow.update(None, at(150));
        flow.reconfigure(fast, at(160));
        assert_eq!(flow.next_deadline(), None, "nothing is published");
    }

    #[test]
    fn on_change_publishes_nothing_without_change() {
        let mut flow = ReportFlow::new(Publish::OnChange);
        flow.update(Some(received('L', 0)), at(0));
        assert_eq!(flow.update(Some(received('L', 500)), at(500)), None);
        assert_eq!(flow.next_deadline(), None);
    }
}
