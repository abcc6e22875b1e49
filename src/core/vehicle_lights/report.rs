//! When a report goes out: at a change, in a rhythm, or not at all.

use std::time::Duration;

use crate::core::time::{MonoTime, WallStamp};

/// When reports are published.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Publish {
    /// Every period, and at once when the value changes or publishing resumes.
    Periodic(Duration),
    /// When the value changes or publishing resumes.
    OnChange,
}

/// What to do about a topic now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step<T> {
    /// Publish the value with the stamp of the frame that carried it.
    Publish(T, WallStamp),
    /// Publishing stops: nobody may be handed an older value as if it were current.
    Withdraw,
}

/// One report topic.
#[derive(Debug, Clone)]
pub struct ReportFlow<T> {
    publish: Publish,
    current: Option<(T, WallStamp)>,
    due: Option<MonoTime>,
}

impl<T: Copy + PartialEq> ReportFlow<T> {
    /// A topic on which nothing was published yet.
    pub fn new(publish: Publish) -> Self {
        Self { publish, current: None, due: None }
    }

    /// Takes what is true now (`None` = withheld) and says what to do.
    pub fn update(&mut self, state: Option<(T, WallStamp)>, now: MonoTime) -> Option<Step<T>> {
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
            // The rhythm is kept while it can be: a late wake-up doesn't shift it, a change does.
            let on_time =
                self.due.filter(|_| !changed).map(|due| due.after(period)).filter(|next| *next > now);
            self.due = Some(on_time.unwrap_or_else(|| now.after(period)));
        }
        Some(Step::Publish(value, stamp))
    }

    /// What is published at present.
    pub fn current(&self) -> Option<(T, WallStamp)> {
        self.current
    }

    /// When to publish again with nothing happening.
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

    #[test]
    fn a_rhythm_carries_the_newest_stamp_and_a_change_goes_out_at_once() {
        let mut flow = ReportFlow::new(Publish::Periodic(Duration::from_millis(100)));
        assert_eq!(flow.update(Some(('L', stamp(0))), at(0)), Some(Step::Publish('L', stamp(0))));
        assert_eq!(flow.update(Some(('L', stamp(60))), at(60)), None);
        assert_eq!(flow.next_deadline(), Some(at(100)));
        assert_eq!(flow.update(Some(('L', stamp(60))), at(104)), Some(Step::Publish('L', stamp(60))));
        assert_eq!(flow.next_deadline(), Some(at(200)), "a late wake-up doesn't shift the rhythm");
        assert_eq!(flow.update(Some(('R', stamp(130))), at(130)), Some(Step::Publish('R', stamp(130))));
        assert_eq!(flow.next_deadline(), Some(at(230)));
    }

    #[test]
    fn stopping_is_said_once_and_resuming_publishes_at_once() {
        for publish in [Publish::OnChange, Publish::Periodic(Duration::from_millis(100))] {
            let mut flow = ReportFlow::new(publish);
            assert_eq!(flow.update(None, at(0)), None, "nothing to withdraw yet");
            flow.update(Some(('L', stamp(1))), at(1));
            assert_eq!(flow.update(None, at(2)), Some(Step::Withdraw));
            assert_eq!(flow.update(None, at(3)), None);
            assert_eq!(flow.next_deadline(), None);
            assert_eq!(flow.update(Some(('L', stamp(4))), at(4)), Some(Step::Publish('L', stamp(4))));
        }
    }

    #[test]
    fn on_change_stays_quiet_while_nothing_changes() {
        let mut flow = ReportFlow::new(Publish::OnChange);
        flow.update(Some(('L', stamp(0))), at(0));
        assert_eq!(flow.update(Some(('L', stamp(500))), at(500)), None);
        assert_eq!(flow.next_deadline(), None);
    }
}
