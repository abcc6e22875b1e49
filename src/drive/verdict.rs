//! Expectations met and failed.

use std::fmt;

use super::course::{Course, Cycle};
use super::display;
use crate::config::drive::{Expectation, Interval, Wanted};
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::decision::Decision;

/// How each expectation of one behaviour fares.
#[derive(Debug, Clone)]
pub struct Verdicts<'a> {
    course: &'a Course,
    mode: DeciderCompat,
    states: Vec<State>,
}

/// How one expectation fares.
#[derive(Debug, Clone, Default)]
struct State {
    cycles: usize,
    finding_seen: bool,
    /// What was wrong first, and where.
    first_failure: Option<String>,
}

/// An expectation that failed.
#[derive(Debug, Clone)]
pub struct Failed<'a> {
    /// Which.
    pub expectation: &'a Expectation,
    /// In which behaviour.
    pub mode: DeciderCompat,
    /// What came out instead, and where.
    pub what: String,
}

impl<'a> Verdicts<'a> {
    /// Nothing was seen yet.
    pub fn new(course: &'a Course, mode: DeciderCompat) -> Self {
        Self { course, mode, states: vec![State::default(); course.file().expectations.len()] }
    }

    /// Looks at a cycle and what was decided.
    pub fn take(&mut self, cycle: &Cycle, decision: &Decision) {
        for (index, expected) in self.course.expected(cycle, self.mode) {
            let Some(state) = self.states.get_mut(index) else { continue };
            state.cycles += 1;
            state.finding_seen |= expected.wanted.finding.as_ref().is_some_and(|words| {
                decision.findings.iter().any(|finding| finding.to_string().contains(words))
            });
            if state.first_failure.is_none() {
                let objection = objection(&expected.wanted, decision);
                let at = |what| format!("{what} at {:.2} m ({:.3} s)", cycle.at_m, cycle.at_s);
                state.first_failure = objection.map(at);
            }
        }
    }

    /// How many held.
    pub fn met(&self) -> usize {
        self.all().filter(|(expected, state)| state.complaint(&expected.wanted).is_none()).count()
    }

    /// Those that did not.
    pub fn failed(&self) -> Vec<Failed<'a>> {
        self.all()
            .filter_map(|(expectation, state)| {
                let what = state.complaint(&expectation.wanted)?;
                Some(Failed { expectation, mode: self.mode, what })
            })
            .collect()
    }

    fn all(&self) -> impl Iterator<Item = (&'a Expectation, &State)> {
        let mode = self.mode;
        let all = self.course.file().expectations.iter().zip(&self.states);
        all.filter(move |(expected, _)| expected.modes.contains(&mode))
    }
}

impl State {
    fn complaint(&self, wanted: &Wanted) -> Option<String> {
        match &wanted.finding {
            _ if self.cycles == 0 => Some("no cycle lies there".to_owned()),
            _ if self.first_failure.is_some() => self.first_failure.clone(),
            Some(finding) if !self.finding_seen => Some(format!("no finding says {finding:?}")),
            Some(_) | None => None,
        }
    }
}

/// What speaks against it.
fn objection(wanted: &Wanted, decision: &Decision) -> Option<String> {
    let name = |source: Option<_>| source.map_or_else(|| "none".to_owned(), |source| format!("{source}"));
    if let Some(command) = wanted.command.filter(|command| *command != decision.turn) {
        return Some(format!("{command} wanted, {}", decision.turn));
    }
    if let Some(hazard) = wanted.hazard.filter(|hazard| *hazard != decision.hazard) {
        return Some(format!("hazard {hazard} wanted, {}", decision.hazard));
    }
    let winner = display::winner(decision);
    if let Some(wanted) = wanted.winner.filter(|wanted| *wanted != winner) {
        return Some(format!("winner {} wanted, {}", name(wanted), name(winner)));
    }
    let case = display::case(decision);
    wanted.case.filter(|wanted| Some(*wanted) != case).map(|wanted| {
        let is = case.map_or_else(|| "none".to_owned(), |case| case.to_string());
        format!("case {wanted} wanted, {is}")
    })
}

/// `file:line:column: key: from 37 to 116 m, improved: LEFT wanted, DISABLE at 40.00 m (4.000 s)`
impl fmt::Display for Failed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (from, to, unit) = match self.expectation.interval {
            Interval::Metres { from, to, .. } => (from, to, "m"),
            Interval::Seconds { from, to, .. } => (from, to, "s"),
        };
        let (place, mode) = (&self.expectation.location, self.mode.name());
        write!(f, "{place}: from {from} to {to} {unit}, {mode}: {}", self.what)
    }
}
