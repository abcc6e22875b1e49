//! The deadlines of a machine, each under the name of its timer.

use super::MonoTime;

/// The timers of one machine, named by the enum `T`; at first none of them runs.
///
/// A machine keeps its table up to date whenever its state changes, so that the caller can ask for the
/// next deadline at any time. After the first [`TimerTable::set`] of each timer nothing is allocated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimerTable<T> {
    timers: Vec<(T, Option<MonoTime>)>,
}

impl<T> Default for TimerTable<T> {
    fn default() -> Self {
        Self { timers: Vec::new() }
    }
}

impl<T: Copy + Eq> TimerTable<T> {
    /// Lets a timer expire at this time, whatever it was set to before; `None` stops it.
    pub fn set(&mut self, timer: T, expires: impl Into<Option<MonoTime>>) {
        let expires = expires.into();
        match self.timers.iter_mut().find(|(known, _)| *known == timer) {
            Some((_, at)) => *at = expires,
            None => self.timers.push((timer, expires)),
        }
    }

    /// Stops a timer.
    pub fn stop(&mut self, timer: T) {
        self.set(timer, None);
    }

    /// When the next timer expires; `None` while none is running.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        self.timers.iter().filter_map(|(_, at)| *at).min()
    }

    /// True if a timer is running and its time has come.
    pub fn is_expired(&self, timer: T, now: MonoTime) -> bool {
        self.expired(now).any(|expired| expired == timer)
    }

    /// The timers whose time has come, in the order in which they were first set. They stay expired until they
    /// are set anew or stopped.
    pub fn expired(&self, now: MonoTime) -> impl Iterator<Item = T> {
        self.timers.iter().filter(move |(_, at)| at.is_some_and(|at| at <= now)).map(|(timer, _)| *timer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    enum Timer {
        Frame,
        Silence,
    }

    fn at(millis: u64) -> MonoTime {
        MonoTime::from_millis(millis)
    }

    #[test]
    fn the_next_deadline_is_that_of_the_earliest_running_timer() {
        let mut timers = TimerTable::default();
        assert_eq!(timers.next_deadline(), None);
        timers.set(Timer::Silence, at(20));
        timers.set(Timer::Frame, at(10));
        assert_eq!(timers.next_deadline(), Some(at(10)));
        timers.set(Timer::Frame, at(30));
        assert_eq!(timers.next_deadline(), Some(at(20)), "a timer runs once");
        timers.stop(Timer::Silence);
        assert_eq!(timers.next_deadline(), Some(at(30)));
        timers.set(Timer::Frame, None);
        assert_eq!(timers.next_deadline(), None);
    }

    #[test]
    fn a_timer_expires_at_its_time_and_stays_expired() {
        let mut timers = TimerTable::default();
        timers.set(Timer::Silence, at(20));
        timers.set(Timer::Frame, at(10));
        assert!(timers.expired(MonoTime::from_nanos(9_999_999)).next().is_none());
        assert!(timers.is_expired(Timer::Frame, at(10)) && !timers.is_expired(Timer::Silence, at(10)));
        assert_eq!(timers.expired(at(20)).collect::<Vec<_>>(), [Timer::Silence, Timer::Frame]);
        timers.stop(Timer::Frame);
        assert!(!timers.is_expired(Timer::Frame, at(20)));
    }
}
