//! Compares a profile's reports over a session with the requests to the driver.

use std::fmt;
use std::time::Duration;

use derive_more::Display;

use super::findings::DiscoveryFindings;
use super::response::Followed;
use super::timeline::{ActionTimeline, DriverAction, EARLY, LATE, RequestWindow};
use can_signal::can::DriverMark;
use gateway_base::time::MonoTime;

/// State that the reports show together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub enum ReportedState {
    /// Nothing is reported, e.g. before the first frame.
    #[display("nothing")]
    Unknown,
    /// The turn indicators and the hazard lights are off.
    #[display("off")]
    Off,
    /// An action is reported.
    Action(DriverAction),
}

/// The first mark that the reports contradict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contradiction {
    /// Mark that was not met.
    pub mark: DriverMark,
    /// Time of the mark since the start of the session.
    pub at: Duration,
    /// The contradicting report.
    pub seen: ContradictingReport,
}

/// A report that contradicts a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
#[allow(missing_docs)] // the texts say it
pub enum ContradictingReport {
    #[display("{_0} was reported, although nothing was to be operated")]
    AtRest(DriverAction),
    #[display("{_0} was reported for a moment as well")]
    Moment(DriverAction),
    #[display("{_0} was reported")]
    Instead(ReportedState),
    #[display("{_0} was still reported before the next request")]
    Remained(DriverAction),
}

impl fmt::Display for Contradiction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mark = self.mark.to_string().to_uppercase();
        let mark = if self.mark == DriverMark::Quiet { "HANDS OFF" } else { &mark };
        write!(f, "at {mark} {:.1} s after the beginning, {}", self.at.as_secs_f64(), self.seen)
    }
}

/// Required reports over a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Requirements {
    /// Number of requests of each of [`DriverAction::ALL`] that must be met: those that the found signals
    /// followed.
    pub followed: [usize; 3],
    /// True if the hazard lights are reported.
    pub has_hazard: bool,
}

impl Requirements {
    /// Returns the requirements that follow from findings; `None` without a candidate for the turn
    /// indicators.
    pub fn of(findings: &DiscoveryFindings) -> Option<Self> {
        let turn = findings.turn.first()?.followed;
        let hazard = findings.sure_hazard().map(|hazard| hazard.followed);
        let followed = DriverAction::ALL.map(|action| {
            let Followed { count, of } = turn[action as usize];
            let missed = hazard.map_or(0, |hazard| of - hazard[action as usize].count);
            count.saturating_sub(missed)
        });
        Some(Self { followed, has_hazard: hazard.is_some() })
    }
}

/// A time with one reported action.
#[derive(Debug, Clone, Copy)]
struct ReportedRun {
    action: DriverAction,
    from: MonoTime,
    until: MonoTime,
}

/// Minimum time of a wrong side that a driver corrects. A shorter one is a mistake of the profile.
const MIN_CORRECTED: Duration = Duration::from_millis(500);
/// Time after the request to end an action by which its report must end, unless the next request is later.
/// Lamps that have gone out are still reported for about a second.
const LATE_END: Duration = Duration::from_secs(4);

/// Compares ascending changes of the reports until `end` with the requests of a session.
///
/// # Errors
/// Returns the first mark that the reports contradict.
pub fn compare(
    timeline: &ActionTimeline,
    changes: &[(MonoTime, ReportedState)],
    end: MonoTime,
    required: Requirements,
) -> Result<(), Contradiction> {
    let next = |index: usize| changes.get(index + 1).map_or(end, |(at, _)| *at);
    let runs = changes.iter().enumerate().filter_map(|(index, (from, state))| match state {
        ReportedState::Action(action) => {
            Some(ReportedRun { action: *action, from: *from, until: next(index) })
        }
        ReportedState::Off | ReportedState::Unknown => None,
    });
    let runs: Vec<_> = runs.collect();
    let start = timeline.quiet.first().map(|(from, _)| *from);
    let start = start.or(timeline.windows.first().map(|window| window.on)).unwrap_or_default();
    let contradiction = |mark, at: MonoTime, seen| Contradiction { mark, at: at.since(start), seen };
    for (from, until) in &timeline.quiet {
        if let Some(run) = runs.iter().find(|run| run.from < *until && *from < run.until) {
            let seen = ContradictingReport::AtRest(run.action);
            return Err(contradiction(DriverMark::Quiet, run.from.max(*from), seen));
        }
    }
    let mut unmet: [Vec<Contradiction>; 3] = [const { Vec::new() }; 3];
    for window in &timeline.windows {
        let is_reported = window.action != DriverAction::Hazard || required.has_hazard;
        let Err(seen) = meets(window, &runs, is_reported) else { continue };
        let (mark, at) = if matches!(seen, ContradictingReport::Remained(_)) {
            (DriverMark::Off, window.off)
        } else {
            (window.action.mark(), window.on)
        };
        let contradiction = contradiction(mark, at, seen);
        if matches!(seen, ContradictingReport::Moment(_)) {
            return Err(contradiction);
        }
        unmet[window.action as usize].push(contradiction);
    }
    for (action, unmet) in DriverAction::ALL.into_iter().zip(unmet) {
        let met = timeline.count(action) - unmet.len();
        if let Some(first) = unmet.first().filter(|_| met < required.followed[action as usize]) {
            return Err(*first);
        }
    }
    Ok(())
}

/// Checks one request: the last reported action is the requested one, and it has ended before the next
/// request. A driver may have corrected another action before.
fn meets(window: &RequestWindow, runs: &[ReportedRun], is_reported: bool) -> Result<(), ContradictingReport> {
    let (begin, latest) = (window.on.before(EARLY), window.off.after(LATE));
    let end = window.end.before(EARLY);
    let begun: Vec<_> = runs.iter().filter(|run| begin <= run.from && run.from < end).collect();
    let others = || begun.iter().filter(|run| run.action != window.action);
    if let Some(run) = others().find(|run| run.until.since(run.from) < MIN_CORRECTED || latest < run.from) {
        return Err(ContradictingReport::Moment(run.action));
    }
    if !is_reported {
        return match others().next() {
            Some(run) => Err(ContradictingReport::Instead(ReportedState::Action(run.action))),
            None => Ok(()),
        };
    }
    let last = begun.last().map_or(ReportedState::Off, |run| ReportedState::Action(run.action));
    if last != ReportedState::Action(window.action) {
        return Err(ContradictingReport::Instead(last));
    }
    let back = window.end.max(window.off.after(LATE_END));
    match begun.iter().find(|run| back < run.until) {
        Some(run) => Err(ContradictingReport::Remained(run.action)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use DriverAction::{Left, Right};
    use ReportedState::{Action, Off};

    const WINDOW: RequestWindow = RequestWindow {
        action: Right,
        on: MonoTime::from_millis(10_000),
        off: MonoTime::from_millis(15_000),
        end: MonoTime::from_millis(19_000),
    };

    /// Compares reports, as states from these times on in ms, with one request to the right after ten quiet
    /// seconds.
    fn contradiction(reports: &[(u64, ReportedState)]) -> Option<ContradictingReport> {
        let quiet = vec![(MonoTime::ZERO, MonoTime::from_millis(9_300))];
        let timeline = ActionTimeline { windows: vec![WINDOW], quiet };
        let changes: Vec<_> =
            reports.iter().map(|(at, state)| (MonoTime::from_millis(*at), *state)).collect();
        let required = Requirements { followed: [0, 1, 0], has_hazard: false };
        compare(&timeline, &changes, WINDOW.end, required).err().map(|contradiction| contradiction.seen)
    }

    #[test]
    fn a_request_is_met_by_its_action_alone() {
        let right = [(0, Off), (10_600, Action(Right)), (15_500, Off)];
        assert_eq!(contradiction(&right), None);
        let half_press_to_the_left = [(10_550, Action(Left)), (10_600, Action(Right)), (15_500, Off)];
        assert_eq!(contradiction(&half_press_to_the_left), Some(ContradictingReport::Moment(Left)));
        let corrected = [(10_600, Action(Left)), (11_600, Action(Right)), (15_500, Off)];
        assert_eq!(contradiction(&corrected), None, "the driver took the wrong side first");
        let left = [(10_600, Action(Left)), (14_000, Off)];
        assert_eq!(contradiction(&left), Some(ContradictingReport::Instead(Action(Left))));
        assert_eq!(contradiction(&[(0, Off)]), Some(ContradictingReport::Instead(Off)));
        let other_side_at_the_end = [(10_600, Action(Right)), (15_500, Action(Left)), (16_500, Off)];
        assert_eq!(contradiction(&other_side_at_the_end), Some(ContradictingReport::Moment(Left)));
    }

    #[test]
    fn an_action_ends_before_the_next_request_and_never_shows_at_rest() {
        let still_on = [(10_600, Action(Right)), (25_000, Off)];
        let timeline_end = contradiction(&still_on);
        assert_eq!(timeline_end, Some(ContradictingReport::Remained(Right)));
        let at_rest = [(5_000, Action(Right)), (5_200, Off), (10_600, Action(Right)), (15_500, Off)];
        assert_eq!(contradiction(&at_rest), Some(ContradictingReport::AtRest(Right)));
    }
}
