//! Deadlines of a state machine, each in a named timer.

use super::MonoTime;

/// Timers of one state machine, named by the enum `T`; initially none is running.
///
/// The machine updates the table whenever its state changes, so the caller can query the next deadline at any
/// time. Nothing is allocated after the first [`TimerTable::set`] of each timer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimerTable<T> {
    timers: Vec<(T, Option<MonoTime>)>,
    /// The earliest time, cached because it is read for every frame while timers are set only for a few.
    next: Option<MonoTime>,
}

impl<T> Default for TimerTable<T> {
    fn default() -> Self {
        Self { timers: Vec::new(), next: None }
    }
}

impl<T: Copy + Eq> TimerTable<T> {
    /// Sets the time at which a timer expires, replacing an earlier time; `None` stops the timer.
    pub fn set(&mut self, timer: T, expires: impl Into<Option<MonoTime>>) {
        let expires = expires.into();
        match self.timers.iter_mut().find(|(known, _)| *known == timer) {
            Some((_, at)) => *at = expires,
            None => self.timers.push((timer, expires)),
        }
        self.next = self.timers.iter().filter_map(|(_, at)| *at).min();
    }

    /// Returns the time at which the next timer expires; `None` while none is running.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        self.next
    }

    /// Returns true if a running timer has reached its time. It stays expired until it is set again.
    pub fn is_expired(&self, timer: T, now: MonoTime) -> bool {
        self.timers.iter().any(|(known, at)| *known == timer && at.is_some_and(|at| at <= now))
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
        timers.set(Timer::Silence, None);
        assert_eq!(timers.next_deadline(), Some(at(30)));
        timers.set(Timer::Frame, None);
        assert_eq!(timers.next_deadline(), None);
    }

    #[test]
    fn a_timer_expires_at_its_time_and_stays_expired() {
        let mut timers = TimerTable::default();
        timers.set(Timer::Silence, at(20));
        timers.set(Timer::Frame, at(10));
        let before = MonoTime::from_nanos(9_999_999);
        assert!(!timers.is_expired(Timer::Frame, before) && !timers.is_expired(Timer::Silence, before));
        assert!(timers.is_expired(Timer::Frame, at(10)) && !timers.is_expired(Timer::Silence, at(10)));
        assert!(timers.is_expired(Timer::Frame, at(20)) && timers.is_expired(Timer::Silence, at(20)));
        timers.set(Timer::Frame, None);
        assert!(!timers.is_expired(Timer::Frame, at(20)));
    }
}
