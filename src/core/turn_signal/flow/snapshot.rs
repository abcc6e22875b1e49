//! The present state of the decider, for people and programs that watch the gateway.

use serde::{Deserialize, Serialize};

use super::{DeciderRole, TurnSignalFlow};
use crate::core::diagnostics::Level;
use crate::core::time::{MonoTime, millis};
use crate::core::turn_signal::decision::Decision;
use crate::core::turn_signal::manoeuvre::ManoeuvreOutcome;
use crate::core::turn_signal::resolve::EvaluatedCandidate;

/// The decider.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DeciderSnapshot {
    /// `command`, or `shadow` when its decisions are only compared.
    pub role: String,
    /// Level of its diagnostic status.
    pub level: Level,
    /// Message of its diagnostic status.
    pub message: String,
    /// The last decision; `None` before the first.
    pub decision: Option<DecisionSnapshot>,
    /// Route: its id as 32 hexadecimal digits, `none` or `refused`.
    pub route: String,
    /// Time since the last odometry, ms; `None` before the first.
    pub odometry_age_ms: Option<u64>,
    /// Cycles since start.
    pub cycles: u64,
    /// Decisions since start that differed from the one before in command or reason.
    pub changes: u64,
    /// Signals since start that waited until a junction was passed which offers their side and is not taken.
    pub shortened_signals: u64,
    /// Agreement of turn commands with Autoware's own, percent; `None` unless compared.
    pub turn_agreement_percent: Option<f64>,
    /// Agreement of hazard commands, likewise.
    pub hazard_agreement_percent: Option<f64>,
}

/// A decision with its reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DecisionSnapshot {
    /// `NO_COMMAND`, `DISABLE`, `LEFT` or `RIGHT`.
    pub turn: String,
    /// `NO_COMMAND`, `DISABLE` or `ENABLE`.
    pub hazard: String,
    /// The ground on which it was decided: `no_inputs`, `hazard`, `manoeuvres`, `path_generator` or `candidates`.
    pub basis: String,
    /// Source of the candidate that won: `intersection`, `roundabout` or `manoeuvre`; `None` without one.
    pub winner: Option<String>,
    /// Rule by which it won, e.g. `A2`; `None` when nothing was compared.
    pub rule: Option<String>,
    /// The minimum duration that keeps the command; `None` when none does.
    pub held: Option<String>,
    /// The junction before the next turn that offers its side and is not taken, and what becomes of the signal; `None` without one.
    pub junction: Option<String>,
    /// The candidates with their outcomes.
    pub candidates: Vec<CandidateSnapshot>,
    /// The outcome of each manoeuvre of the planner, in words.
    pub manoeuvres: Vec<String>,
    /// Everything wrong with the inputs, in words.
    pub findings: Vec<String>,
}

/// One candidate of a decision.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CandidateSnapshot {
    /// `intersection`, `roundabout` or `manoeuvre`.
    pub source: String,
    /// What it is about, e.g. `left turn on 111`; `None` where that has no name.
    pub subject: Option<String>,
    /// Command that it requests.
    pub turn: String,
    /// The outcome in words, e.g. `won` or `desired end passed`.
    pub outcome: String,
    /// Distances to its desired start, desired end, required start and required end, m to the millimetre, negative behind the vehicle;
    /// `None` without a record, or where one is not a number.
    pub distances_m: Option<[f64; 4]>,
}

impl TurnSignalFlow {
    /// The present state.
    pub fn snapshot(&self, now: MonoTime) -> DeciderSnapshot {
        let (level, message) = self.summary();
        let is_shadow = matches!(self.settings.role, DeciderRole::Shadow { .. });
        DeciderSnapshot {
            role: if is_shadow { "shadow" } else { "command" }.to_owned(),
            level,
            message,
            decision: self.decision.as_deref().map(DecisionSnapshot::of),
            route: self.route_text(),
            odometry_age_ms: self.latest.odometry.map(|odometry| millis(now.since(odometry.at))),
            cycles: self.cycles,
            changes: self.changes,
            shortened_signals: self.decider.shortened(),
            turn_agreement_percent: self.turn_comparison.percent().map(|percent| rounded(percent, 1e2)),
            hazard_agreement_percent: self.hazard_comparison.percent().map(|percent| rounded(percent, 1e2)),
        }
    }
}

impl DecisionSnapshot {
    /// The snapshot of a decision.
    pub fn of(decision: &Decision) -> Self {
        Self {
            turn: decision.turn.to_string(),
            hazard: decision.hazard.to_string(),
            basis: decision.basis.name().to_owned(),
            winner: decision.winner().map(|source| source.to_string()),
            rule: decision.case().map(|case| case.to_string()),
            held: decision.held.map(|held| held.to_string()),
            junction: decision.junction.as_ref().map(ToString::to_string),
            candidates: decision.evaluated().iter().map(CandidateSnapshot::of).collect(),
            manoeuvres: decision.remarks.iter().map(ManoeuvreOutcome::to_string).collect(),
            findings: decision.findings.iter().map(ToString::to_string).collect(),
        }
    }
}

impl CandidateSnapshot {
    fn of(candidate: &EvaluatedCandidate) -> Self {
        let distances = candidate.distances.map(|distances| {
            [
                distances.desired_start_m,
                distances.desired_end_m,
                distances.required_start_m,
                distances.required_end_m,
            ]
        });
        Self {
            source: candidate.source.to_string(),
            subject: candidate.subject.name(candidate.turn),
            turn: candidate.turn.to_string(),
            outcome: candidate.outcome.to_string(),
            // JSON has no other numbers.
            distances_m: distances
                .filter(|distances| distances.iter().all(|distance| distance.is_finite()))
                .map(|distances| distances.map(|metres| rounded(metres, 1e3))),
        }
    }
}

/// A number rounded to a part of one; zero has no sign.
fn rounded(number: f64, parts: f64) -> f64 {
    (number * parts).round() / parts + 0.0
}
