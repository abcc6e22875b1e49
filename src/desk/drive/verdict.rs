//! Expectations met and failed.

use super::course::{Course, Cycle};
use crate::config::drive::{Expectation, Wanted};
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::decision::Decision;
use crate::report::decision::{case, winner};
use crate::report::drive::{Failed, Verdict};

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

impl<'a> Verdicts<'a> {
    /// Verdicts before the first cycle.
    pub fn new(course: &'a Course, mode: DeciderCompat) -> Self {
        Self { course, mode, states: vec![State::default(); course.file().expectations.len()] }
    }

    /// Compares the decision at a cycle with what is expected there.
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

    /// The expectations that held and those that did not.
    pub fn verdict(&self) -> Verdict<'a> {
        let failed: Vec<_> = self
            .all()
            .filter_map(|(expectation, state)| {
                let reason = state.complaint(&expectation.wanted)?;
                Some(Failed { expectation, compat: self.mode, reason })
            })
            .collect();
        Verdict { compat: self.mode, met: self.all().count() - failed.len(), failed }
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

/// The first difference between what is wanted and what was decided.
fn objection(wanted: &Wanted, decision: &Decision) -> Option<String> {
    let name = |source: Option<_>| source.map_or_else(|| "none".to_owned(), |source| format!("{source}"));
    if let Some(command) = wanted.command.filter(|command| *command != decision.turn) {
        return Some(format!("{command} wanted, {}", decision.turn));
    }
    if let Some(hazard) = wanted.hazard.filter(|hazard| *hazard != decision.hazard) {
        return Some(format!("hazard {hazard} wanted, {}", decision.hazard));
    }
    let actual = winner(decision);
    if let Some(wanted) = wanted.winner.filter(|wanted| *wanted != actual) {
        return Some(format!("winner {} wanted, {}", name(wanted), name(actual)));
    }
    let actual = case(decision);
    wanted.case.filter(|wanted| Some(*wanted) != actual).map(|wanted| {
        let is = actual.map_or_else(|| "none".to_owned(), |case| case.to_string());
        format!("case {wanted} wanted, {is}")
    })
}
