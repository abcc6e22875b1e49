//! The driver's actions over time, from marks.

use std::ops::Range;
use std::time::Duration;

use derive_more::Display;

use can_signal::can::DriverMark;
use gateway_base::time::MonoTime;

/// An action of the driver that the lights show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Display)]
#[display("{}", self.mark())]
#[allow(missing_docs)] // their names say it
pub enum DriverAction {
    Left,
    Right,
    Hazard,
}

impl DriverAction {
    /// All actions in the order of their declaration.
    pub const ALL: [Self; 3] = [Self::Left, Self::Right, Self::Hazard];

    /// Returns the mark with which the action begins.
    pub fn mark(self) -> DriverMark {
        match self {
            Self::Left => DriverMark::Left,
            Self::Right => DriverMark::Right,
            Self::Hazard => DriverMark::Hazard,
        }
    }

    /// Returns the action that begins with a mark; `None` for a mark of rest.
    pub fn from_mark(mark: DriverMark) -> Option<Self> {
        Self::ALL.into_iter().find(|action| action.mark() == mark)
    }
}

/// One request of an action, and the rest after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RequestWindow {
    /// Action that was requested.
    pub action: DriverAction,
    /// Time of the request.
    pub on: MonoTime,
    /// Time of the request to end it.
    pub off: MonoTime,
    /// Time of the next request, or the end of the rest.
    pub end: MonoTime,
}

/// All requests of a session, and the times in which nothing was requested.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ActionTimeline {
    /// Requests in ascending order of time.
    pub windows: Vec<RequestWindow>,
    /// Times in which nothing is operated.
    pub quiet: Vec<(MonoTime, MonoTime)>,
}

/// Time by which the driver may be early, since a countdown precedes the request.
pub(super) const EARLY: Duration = Duration::from_millis(700);
/// Time after the request to end an action in which an action may still begin.
pub(super) const LATE: Duration = Duration::from_millis(200);
const MAX_REST: Duration = Duration::from_secs(8);

impl ActionTimeline {
    /// Builds the requests of ascending marks in a `session`. The time before the first
    /// request and after each [`DriverMark::Quiet`] is quiet.
    pub fn new(marks: &[(MonoTime, DriverMark)], session: Range<MonoTime>) -> Self {
        let mut timeline = Self::default();
        let next = |at: usize| marks.get(at).map_or(session.end, |(time, _)| *time);
        if let Some((first, DriverMark::Left | DriverMark::Right | DriverMark::Hazard)) = marks.first() {
            timeline.add_quiet(session.start, *first);
        }
        for (index, (on, mark)) in marks.iter().enumerate() {
            match DriverAction::from_mark(*mark) {
                Some(action) => {
                    let off = next(index + 1);
                    let is_off = marks.get(index + 1).is_some_and(|(_, mark)| *mark == DriverMark::Off);
                    let rest_end = if is_off { next(index + 2) } else { off };
                    let window =
                        RequestWindow { action, on: *on, off, end: rest_end.min(off.after(MAX_REST)) };
                    timeline.windows.push(window);
                }
                None if *mark == DriverMark::Quiet => timeline.add_quiet(*on, next(index + 1)),
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

    /// Returns the times in which a signal of the indicators is probably at rest: quiet times, and the second
    /// half of the rest after each action.
    pub(super) fn rests(&self) -> impl Iterator<Item = (MonoTime, MonoTime)> {
        let tails = self.windows.iter().map(|window| {
            let rest = window.end.since(window.off);
            (window.off.after(rest / 2), window.end)
        });
        self.quiet.iter().copied().chain(tails)
    }

    /// Returns true between the earliest beginning of an action and its latest end.
    pub(super) fn is_requested(&self, at: MonoTime) -> bool {
        self.windows.iter().any(|window| window.on.before(EARLY) <= at && at < window.end)
    }

    /// Returns the number of requests of an action.
    pub fn count(&self, action: DriverAction) -> usize {
        self.windows.iter().filter(|window| window.action == action).count()
    }
}
