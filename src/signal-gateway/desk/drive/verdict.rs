//! Expectations met and failed.

use super::simulation::{DriveCycle, DriveSimulation};
use crate::config::drive::{Expectation, ExpectedDecision};
use crate::report::drive::{Failed, Verdict};
use turn_signal::compat::DeciderCompat;
use turn_signal::decision::Decision;
use turn_signal::resolve::CandidateSource;

/// The results of all expectations for one `compat`, so far.
#[derive(Debug, Clone)]
pub struct DriveVerdicts<'a> {
    simulation: &'a DriveSimulation,
    compat: DeciderCompat,
    states: Vec<ExpectationState>,
}

#[derive(Debug, Clone, Default)]
struct ExpectationState {
    cycles: usize,
    has_finding: bool,
    first_failure: Option<String>,
}

impl<'a> DriveVerdicts<'a> {
    /// Creates the verdicts before the first cycle.
    pub fn new(simulation: &'a DriveSimulation, compat: DeciderCompat) -> Self {
        Self {
            simulation,
            compat,
            states: vec![ExpectationState::default(); simulation.file().expectations.len()],
        }
    }

    /// Compares the decision at a cycle with the expectations for it.
    pub fn take(&mut self, cycle: &DriveCycle, decision: &Decision) {
        for (index, expected) in self.simulation.expected(cycle, self.compat) {
            let Some(state) = self.states.get_mut(index) else { continue };
            state.cycles += 1;
            state.has_finding |= expected.decision.finding.as_ref().is_some_and(|part| {
                decision.findings.iter().any(|finding| finding.to_string().contains(part))
            });
            if state.first_failure.is_none() {
                let at = |mismatch| format!("{mismatch} at {:.2} m ({:.3} s)", cycle.at_m, cycle.at_s);
                state.first_failure = mismatch(&expected.decision, decision).map(at);
            }
        }
    }

    /// Returns the expectations that were met and the failed ones.
    pub fn verdict(&self) -> Verdict<'a> {
        let failed: Vec<_> = self
            .all()
            .filter_map(|(expectation, state)| {
                let reason = state.failure(&expectation.decision)?;
                Some(Failed { expectation, compat: self.compat, reason })
            })
            .collect();
        Verdict { compat: self.compat, met: self.all().count() - failed.len(), failed }
    }

    fn all(&self) -> impl Iterator<Item = (&'a Expectation, &ExpectationState)> {
        let compat = self.compat;
        let all = self.simulation.file().expectations.iter().zip(&self.states);
        all.filter(move |(expected, _)| expected.compats.contains(&compat))
    }
}

impl ExpectationState {
    fn failure(&self, expected: &ExpectedDecision) -> Option<String> {
        match &expected.finding {
            _ if self.cycles == 0 => Some("no cycle lies there".to_owned()),
            _ if self.first_failure.is_some() => self.first_failure.clone(),
            Some(finding) if !self.has_finding => Some(format!("no finding contains {finding:?}")),
            Some(_) | None => None,
        }
    }
}

fn mismatch(expected: &ExpectedDecision, decision: &Decision) -> Option<String> {
    let winner =
        |source: Option<CandidateSource>| source.map_or("none".to_owned(), |source| source.to_string());
    let case = decision.case().map_or("none".to_owned(), |case| case.to_string());
    let values = [
        ("", expected.command.map(|command| command.to_string()), decision.turn.to_string()),
        ("hazard ", expected.hazard.map(|hazard| hazard.to_string()), decision.hazard.to_string()),
        ("winner ", expected.winner.map(winner), winner(decision.winner())),
        ("case ", expected.case.map(|case| case.to_string()), case),
    ];
    values.into_iter().find_map(|(what, expected, found)| {
        let expected = expected.filter(|expected| *expected != found)?;
        Some(format!("expected {what}{expected}, found {found}"))
    })
}
