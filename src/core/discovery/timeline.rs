//! The driver's actions over time, from marks.

use std::time::Duration;

use crate::core::can::mark::Mark;
use crate::core::time::MonoTime;

/// A driver's action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Action {
    /// The turn indicators of the left side are on.
    Left,
    /// The turn indicators of the right side are on.
    Right,
    /// The hazard lights are on.
    Hazard,
}

impl Action {
    /// All actions.
    pub const ALL: [Self; 3] = [Self::Left, Self::Right, Self::Hazard];

    /// The mark with which the action begins.
    pub fn mark(self) -> Mark {
        match self {
            Self::Left => Mark::Left,
            Self::Right => Mark::Right,
            Self::Hazard => Mark::Hazard,
        }
    }

    /// The action that begins with a mark; `None` for a mark of rest.
    pub fn from_mark(mark: Mark) -> Option<Self> {
        Self::ALL.into_iter().find(|action| action.mark() == mark)
    }
}

/// One request of an action, and the rest after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// The requested action.
    pub action: Action,
    /// Time of the request.
    pub on: MonoTime,
    /// Time of the request to end it.
    pub off: MonoTime,
    /// Time of the next request, or the end of the rest.
    pub end: MonoTime,
}

/// All requests of a session, and the times in which nothing was requested.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Timeline {
    /// The requests, ascending.
    pub windows: Vec<Window>,
    /// Times in which nothing is operated.
    pub quiet: Vec<(MonoTime, MonoTime)>,
}

/// The driver may begin this much before the request, since a countdown leads to it.
pub(super) const EARLY: Duration = Duration::from_millis(700);
/// Longest rest after an action.
const MAX_REST: Duration = Duration::from_secs(8);

impl Timeline {
    /// The requests that ascending marks note, in a session from `start` to `end`. Time before the first request is
    /// quiet, and so is what follows a mark [`Mark::Quiet`].
    pub fn new(marks: &[(MonoTime, Mark)], (start, end): (MonoTime, MonoTime)) -> Self {
        let mut timeline = Self::default();
        let next = |at: usize| marks.get(at).map_or(end, |(time, _)| *time);
        if let Some((first, Mark::Left | Mark::Right | Mark::Hazard)) = marks.first() {
            timeline.add_quiet(start, *first);
        }
        for (index, (on, mark)) in marks.iter().enumerate() {
            match Action::from_mark(*mark) {
                Some(action) => {
                    let off = next(index + 1);
                    let is_off = marks.get(index + 1).is_some_and(|(_, mark)| *mark == Mark::Off);
                    let rest_end = if is_off { next(index + 2) } else { off };
                    let window = Window { action, on: *on, off, end: rest_end.min(off.after(MAX_REST)) };
                    timeline.windows.push(window);
                }
                None if *mark == Mark::Quiet => timeline.add_quiet(*on, next(index + 1)),
                None => {}
            }
        }
        timeline
    }

    fn add_quiet(&mut self, from: MonoTime, until: MonoTime) {
        let until = until.before(EARLY);
        if from < until {
            self.quiet.push((from, until));
        }
    }

    /// The times in which a signal of the indicators is most likely at rest: quiet times, and the second half of
    /// the rest after each action.
    pub(super) fn rests(&self) -> impl Iterator<Item = (MonoTime, MonoTime)> {
        let tails = self.windows.iter().map(|window| {
            let rest = window.end.since(window.off);
            (window.off.after(rest / 2), window.end)
        });
        self.quiet.iter().copied().chain(tails)
    }

    /// True from the beginning of an action to its end, as the driver may take both.
    pub(super) fn is_requested(&self, at: MonoTime) -> bool {
        self.windows.iter().any(|window| window.on.before(EARLY) <= at && at < window.end)
    }

    /// Number of requests of an action.
    pub fn count(&self, action: Action) -> usize {
        self.windows.iter().filter(|window| window.action == action).count()
    }
}
