//! The requests to the driver, one after the other, as a state machine without a clock.
//!
//! The order of calls: [`Session::poll`] with the present time until it gives nothing more, then again at
//! [`Session::next_deadline`]. When it gives [`Step::Evaluate`], [`Session::evaluated`] says which actions are to be
//! repeated.

use std::time::Duration;

use super::timeline::Action;
use crate::core::can::mark::Mark;
use crate::core::time::MonoTime;

/// Times and numbers of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SessionSettings {
    /// Time in which nothing is operated, at the beginning.
    pub quiet: Duration,
    /// Time for which an action is kept.
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

/// A step of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// The driver is to do something from now on, until a time.
    Request {
        /// What to do.
        mark: Mark,
        /// The action that comes next, after a rest; `None` when it is not known yet.
        next: Option<Action>,
        /// Time of the next step.
        until: MonoTime,
    },
    /// The frames so far are to be evaluated.
    Evaluate,
}

/// The present state of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Start,
    /// At rest until a time, the next action is that at `next`.
    Rest {
        until: MonoTime,
    },
    Acting {
        until: MonoTime,
    },
    Evaluating,
    Done,
}

/// The requests to the driver.
#[derive(Debug, Clone)]
pub struct Session {
    settings: SessionSettings,
    state: State,
    /// Actions that are still to be requested, the next one first.
    queue: Vec<Action>,
    requested: [usize; 3],
}

impl Session {
    /// A session that begins with the first call of [`Self::poll`].
    pub fn new(settings: SessionSettings) -> Self {
        let queue = Action::ALL.repeat(settings.rounds);
        Self { settings, state: State::Start, queue, requested: [0; 3] }
    }

    /// The next step that is due.
    pub fn poll(&mut self, now: MonoTime) -> Option<Step> {
        match self.state {
            State::Start => Some(self.rest(Mark::Quiet, now.after(self.settings.quiet))),
            State::Rest { until } if until <= now => Some(match self.queue.first() {
                Some(_) => {
                    let action = self.queue.remove(0);
                    self.requested[action as usize] += 1;
                    let until = now.after(self.settings.hold);
                    self.state = State::Acting { until };
                    Step::Request { mark: action.mark(), next: None, until }
                }
                None => {
                    self.state = State::Evaluating;
                    Step::Evaluate
                }
            }),
            State::Acting { until } if until <= now => {
                Some(self.rest(Mark::Off, now.after(self.settings.rest)))
            }
            State::Rest { .. } | State::Acting { .. } | State::Evaluating | State::Done => None,
        }
    }

    fn rest(&mut self, mark: Mark, until: MonoTime) -> Step {
        self.state = State::Rest { until };
        Step::Request { mark, next: self.queue.first().copied(), until }
    }

    /// Ends an evaluation; `unsure` are the actions that are to be repeated as far as the settings allow it. The next
    /// one is requested after a rest. Returns those that are repeated.
    pub fn evaluated(&mut self, unsure: &[Action], now: MonoTime) -> Vec<Action> {
        let may_repeat = |action: &Action| self.requested[*action as usize] < self.settings.max_requests;
        self.queue = unsure.iter().copied().filter(may_repeat).collect();
        self.state = if self.queue.is_empty() {
            State::Done
        } else {
            State::Rest { until: now.after(self.settings.rest) }
        };
        self.queue.clone()
    }

    /// Time of the next step; `None` while an evaluation is waited for and at the end.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        match self.state {
            State::Start => Some(MonoTime::ZERO),
            State::Rest { until } | State::Acting { until } => Some(until),
            State::Evaluating | State::Done => None,
        }
    }

    /// True after the last evaluation.
    pub fn is_done(&self) -> bool {
        self.state == State::Done
    }

    /// Number of requests so far, and of those known to follow.
    pub fn progress(&self) -> (usize, usize) {
        let done = self.requested.iter().sum();
        (done, done + self.queue.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marks(session: &mut Session, now: &mut MonoTime) -> Vec<(u64, Mark)> {
        let mut marks = Vec::new();
        loop {
            while let Some(step) = session.poll(*now) {
                match step {
                    Step::Request { mark, .. } => marks.push((now.as_nanos() / 1_000_000_000, mark)),
                    Step::Evaluate => return marks,
                }
            }
            let Some(next) = session.next_deadline() else { return marks };
            *now = next;
        }
    }

    #[test]
    fn all_actions_are_requested_in_turn_and_unsure_ones_again() {
        use Mark::{Hazard, Left, Off, Quiet, Right};
        let settings = SessionSettings { rounds: 1, max_requests: 2, ..SessionSettings::default() };
        let (mut session, mut now) = (Session::new(settings), MonoTime::ZERO);
        let first = marks(&mut session, &mut now);
        let expected = [(0, Quiet), (10, Left), (15, Off), (19, Right), (24, Off), (28, Hazard), (33, Off)];
        assert_eq!(first, expected);
        assert_eq!(session.evaluated(&[Action::Right], now), [Action::Right]);
        assert_eq!(marks(&mut session, &mut now), [(41, Right), (46, Off)]);
        assert_eq!(session.evaluated(&[Action::Right], now), [], "it was requested twice");
        assert!(session.is_done() && session.poll(now).is_none());
        assert_eq!(session.progress(), (4, 4));
    }
}
