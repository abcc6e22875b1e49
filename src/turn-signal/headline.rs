//! The parts of a decision that are compared with the previous one: command, winner, reasons; no distances.

use std::mem::{Discriminant, discriminant};

use crate::decision::{Basis, Decision};
use crate::inputs::InputFinding;
use crate::junction::{JunctionRemark, OfferedWay};
use crate::light_command::{HazardCommand, TurnCommand};
use crate::manoeuvre::ManoeuvreOutcome;
use crate::min_duration::Held;
use crate::path_generator::TaggedLanelet;
use crate::resolve::{CandidateOutcome, Case, EvaluatedCandidate};

/// A decision without its distances and ages.
#[derive(Debug, Clone, PartialEq)]
pub struct Headline {
    turn: TurnCommand,
    hazard: HazardCommand,
    basis: Discriminant<Basis>,
    case: Option<Case>,
    candidates: Vec<(TurnCommand, CandidateOutcome)>,
    tagged: Option<TaggedLanelet>,
    held: Option<Held>,
    /// The junction before the next turn, with the verdict on the signal.
    junction: Option<(OfferedWay, &'static str)>,
    remarks: Vec<ManoeuvreOutcome>,
    findings: Vec<Discriminant<InputFinding>>,
}

impl Headline {
    /// Creates the headline of a decision.
    pub fn of(decision: &Decision) -> Self {
        let outcome = |evaluated: &EvaluatedCandidate| (evaluated.turn, evaluated.outcome);
        let tagged = match decision.basis {
            Basis::PathGenerator(tagged) => Some(tagged),
            Basis::NoInputs | Basis::Hazard | Basis::ManoeuvreAlone(_) | Basis::Candidates(_) => None,
        };
        Self {
            turn: decision.turn,
            hazard: decision.hazard,
            basis: discriminant(&decision.basis),
            case: decision.case(),
            candidates: decision.evaluated().iter().map(outcome).collect(),
            tagged,
            held: decision.held,
            junction: decision
                .junction
                .as_ref()
                .map(|junction: &JunctionRemark| (junction.ahead.way, junction.key())),
            remarks: decision.remarks.clone(),
            findings: decision.findings.iter().map(discriminant).collect(),
        }
    }
}
