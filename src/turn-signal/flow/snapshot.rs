//! The present state of the decider, for people and programs that monitor the gateway.

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::decision::{BasisKind, Decision};
use crate::light_command::{HazardCommand, TurnCommand};
use crate::manoeuvre::ManoeuvreOutcome;
use crate::min_duration::Held;
use crate::resolve::{CandidateOutcome, CandidateSource, Case, EvaluatedCandidate};
use crate::signal_judge::{JudgedManoeuvre, SignalVerdict, VerdictCounts};
use gateway_base::diagnostics::Level;
use gateway_base::names::display_by_name;

/// The decider.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DeciderSnapshot {
    /// The use of its decisions.
    pub role: DeciderUse,
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
    /// Agreement of hazard commands with Autoware's own, percent; `None` unless compared.
    pub hazard_agreement_percent: Option<f64>,
    /// Verdicts on the turn signals of another planner, by the rules of the decider; all zero unless in
    /// shadow.
    pub signal_verdicts: VerdictCounts,
    /// Share of these signals that agree with the rules, percent; `None` when none was judged.
    pub signal_agreement_percent: Option<f64>,
    /// The last signal that does not agree with them; `None` without one.
    pub last_wrong_signal: Option<WrongSignal>,
}

/// A signal that does not agree with the rules.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema, Display)]
#[display("{subject}: {verdict}, at ({x_m:.1}, {y_m:.1})")]
pub struct WrongSignal {
    /// What is wrong with it.
    pub verdict: SignalVerdict,
    /// What it was asked for, e.g. `lane change to the left`; of a needless signal, `left`.
    pub subject: String,
    /// Where the vehicle was when it was asked for, or when the needless signal began: x on the map, m to the
    /// millimetre.
    pub x_m: f64,
    /// The same: y on the map.
    pub y_m: f64,
}

/// The use of the decider's decisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DeciderUse {
    /// They are commanded.
    Command,
    /// They are compared with Autoware's own commands.
    Shadow,
}

display_by_name!(DeciderUse);

/// A decision with its reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DecisionSnapshot {
    /// Command of the turn indicators.
    pub turn: TurnCommand,
    /// Command of the hazard lights.
    pub hazard: HazardCommand,
    /// The ground on which it was decided.
    pub basis: BasisKind,
    /// Source of the candidate that won; `None` without one.
    pub winner: Option<CandidateSource>,
    /// Rule by which it won; `None` when nothing was compared.
    pub rule: Option<Case>,
    /// The minimum duration that keeps the command; `None` when none does.
    pub held: Option<Held>,
    /// The junction before the next turn that offers its side and is not taken, and what becomes of the
    /// signal; `None` without one.
    pub junction: Option<String>,
    /// The candidates with their outcomes.
    pub candidates: Vec<CandidateSnapshot>,
    /// The outcome of each manoeuvre of the planner.
    pub manoeuvres: Vec<ManoeuvreOutcome>,
    /// Everything wrong with the inputs, in words.
    pub findings: Vec<String>,
}

/// One candidate of a decision.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CandidateSnapshot {
    /// Where its record comes from.
    pub source: CandidateSource,
    /// What it is about, e.g. `left turn on 111`; `None` where that has no name.
    pub subject: Option<String>,
    /// Command that it requests.
    pub turn: TurnCommand,
    /// What became of it.
    pub outcome: CandidateOutcome,
    /// Distances to its desired start, desired end, required start and required end, m to the millimetre,
    /// negative behind the vehicle; `None` without a record, or where one is not a number.
    pub distances_m: Option<[f64; 4]>,
}

impl WrongSignal {
    /// Returns the displayed values of a judged signal.
    pub(super) fn of(judged: &JudgedManoeuvre) -> Self {
        let subject = judged.subject.and_then(|subject| subject.name(judged.side.into()));
        let position = judged.odometry.pose.position;
        Self {
            verdict: judged.verdict,
            subject: subject.unwrap_or_else(|| judged.side.name().to_owned()),
            x_m: rounded(position.x_m, 1e3),
            y_m: rounded(position.y_m, 1e3),
        }
    }
}

impl DecisionSnapshot {
    /// Returns the snapshot of a decision.
    pub fn of(decision: &Decision) -> Self {
        Self {
            turn: decision.turn,
            hazard: decision.hazard,
            basis: decision.basis.kind(),
            winner: decision.winner(),
            rule: decision.case(),
            held: decision.held,
            junction: decision.junction.as_ref().map(ToString::to_string),
            candidates: decision.evaluated().iter().map(CandidateSnapshot::of).collect(),
            manoeuvres: decision.remarks.clone(),
            findings: decision.findings.iter().map(ToString::to_string).collect(),
        }
    }
}

impl CandidateSnapshot {
    fn of(candidate: &EvaluatedCandidate) -> Self {
        let distances = candidate.distances.map(|distances| distances.values());
        Self {
            source: candidate.source,
            subject: candidate.subject.name(candidate.turn),
            turn: candidate.turn,
            outcome: candidate.outcome,
            // JSON can represent only finite numbers.
            distances_m: distances
                .filter(|distances| distances.iter().all(|distance| distance.is_finite()))
                .map(|distances| distances.map(|metres| rounded(metres, 1e3))),
        }
    }
}

/// Rounds a number to a fraction of one; removes the sign of zero.
pub(super) fn rounded(number: f64, parts: f64) -> f64 {
    (number * parts).round() / parts + 0.0
}
