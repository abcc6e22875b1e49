//! The sequence of requests to the driver, as a state machine without a clock.
//!
//! Call [`Session::poll`] with the current time until it returns `None`, then again at
//! [`Session::next_deadline`]. After [`SessionStep::Evaluate`] call [`Session::evaluated`] with the actions
//! to repeat.

use std::time::Duration;

use super::timeline::DriverAction;
use can_signal::can::DriverMark;
use gateway_base::time::MonoTime;

/// Times and numbers of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SessionSettings {
    /// Initial time in which nothing is operated.
    pub quiet: Duration,
    /// Time for which the driver keeps an action.
    pub hold: Duration,
    /// Time between two actions.
    pub rest: Duration,
    /// Number of times that each action is requested before the first evaluation.
    pub rounds: usize,
    /// The largest number of requests of one action.
    pub max_requests: usize,
}

impl Default for SessionSettings {
    fn default() -> Self {
        Self {
            quiet: Duration::from_secs(10),
            hold: Duration::from_secs(5),
            rest: Duration::from_secs(4),
            rounds: 2,
            max_requests: 8,
        }
    }
}

/// A request to the driver, which holds from the time of its step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DriverRequest {
    /// Action of the driver from now on.
    pub mark: DriverMark,
    /// The next action, after a rest; `None` if it is not known yet.
    pub next: Option<DriverAction>,
    /// Time of the next step.
    pub until: MonoTime,
}

/// A step of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SessionStep {
    /// The driver is asked to do something.
    Request(DriverRequest),
    /// The frames so far are to be evaluated.
    Evaluate,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SessionState {
    Start,
    Rest { until: MonoTime },
    Acting { until: MonoTime },
    Evaluating,
    Done,
}

/// The requests to the driver.
#[derive(Debug, Clone)]
pub struct Session {
    settings: SessionSettings,
    state: SessionState,
    /// Actions still to be requested, in order.
    queue: Vec<DriverAction>,
    requested: [usize; 3],
}

impl Session {
    /// Creates a session that begins with the first call of [`Self::poll`].
    pub fn new(settings: SessionSettings) -> Self {
        let queue = DriverAction::ALL.repeat(settings.rounds);
        Self { settings, state: SessionState::Start, queue, requested: [0; 3] }
    }

    /// Returns the next step that is due.
    pub fn poll(&mut self, now: MonoTime) -> Option<SessionStep> {
        match self.state {
            SessionState::Start => Some(self.rest(DriverMark::Quiet, now.after(self.settings.quiet))),
            SessionState::Rest { until } if until <= now => Some(match self.queue.first() {
                Some(_) => {
                    let action = self.queue.remove(0);
                    self.requested[action as usize] += 1;
                    let until = now.after(self.settings.hold);
                    self.state = SessionState::Acting { until };
                    SessionStep::Request(DriverRequest { mark: action.mark(), next: None, until })
                }
                None => {
                    self.state = SessionState::Evaluating;
                    SessionStep::Evaluate
                }
            }),
            SessionState::Acting { until } if until <= now => {
                Some(self.rest(DriverMark::Off, now.after(self.settings.rest)))
            }
            SessionState::Rest { .. }
            | SessionState::Acting { .. }
            | SessionState::Evaluating
            | SessionState::Done => None,
        }
    }

    fn rest(&mut self, mark: DriverMark, until: MonoTime) -> SessionStep {
        self.state = SessionState::Rest { until };
        SessionStep::Request(DriverRequest { mark, next: self.queue.first().copied(), until })
    }

    /// Ends an evaluation. The `unsure` actions are repeated as far as the settings allow, the first one
    /// after a rest. Returns the repeated actions.
    pub fn evaluated(&mut self, unsure: &[DriverAction], now: MonoTime) -> Vec<DriverAction> {
        let may_repeat =
            |action: &DriverAction| self.requested[*action as usize] < self.settings.max_requests;
        self.queue = unsure.iter().copied().filter(may_repeat).collect();
        self.state = if self.queue.is_empty() {
            SessionState::Done
        } else {
            SessionState::Rest { until: now.after(self.settings.rest) }
        };
        self.queue.clone()
    }

    /// Returns the time of the next step; `None` during an evaluation and at the end.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        match self.state {
            SessionState::Start => Some(MonoTime::ZERO),
            SessionState::Rest { until } | SessionState::Acting { until } => Some(until),
            SessionState::Evaluating | SessionState::Done => None,
        }
    }

    /// Returns the number of requests so far, and this number plus the scheduled requests.
    pub fn progress(&self) -> (usize, usize) {
        let done = self.requested.iter().sum();
        (done, done + self.queue.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marks(session: &mut Session, now: &mut MonoTime) -> Vec<(u64, DriverMark)> {
        let mut marks = Vec::new();
        loop {
            while let Some(step) = session.poll(*now) {
                match step {
                    SessionStep::Request(DriverRequest { mark, .. }) => {
                        marks.push((now.as_nanos() / 1_000_000_000, mark));
                    }
                    SessionStep::Evaluate => return marks,
                }
            }
            let Some(next) = session.next_deadline() else { return marks };
            *now = next;
        }
    }

    #[test]
    fn all_actions_are_requested_in_turn_and_unsure_ones_again() {
        use DriverMark::{Hazard, Left, Off, Quiet, Right};
        let settings = SessionSettings { rounds: 1, max_requests: 2, ..SessionSettings::default() };
        let (mut session, mut now) = (Session::new(settings), MonoTime::ZERO);
        let first = marks(&mut session, &mut now);
        let expected = [(0, Quiet), (10, Left), (15, Off), (19, Right), (24, Off), (28, Hazard), (33, Off)];
        assert_eq!(first, expected);
        assert_eq!(session.evaluated(&[DriverAction::Right], now), [DriverAction::Right]);
        assert_eq!(marks(&mut session, &mut now), [(41, Right), (46, Off)]);
        assert_eq!(session.evaluated(&[DriverAction::Right], now), [], "it was requested twice");
        assert!(session.next_deadline().is_none() && session.poll(now).is_none());
        assert_eq!(session.progress(), (4, 4));
    }
}
