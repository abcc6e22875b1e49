//! What makes a decision another one: command, winner, reasons; not how far things are.

use std::mem::{Discriminant, discriminant};

use crate::core::turn_signal::decision::{Basis, Decision};
use crate::core::turn_signal::inputs::Finding;
use crate::core::turn_signal::manoeuvre::ManoeuvreOutcome;
use crate::core::turn_signal::min_duration::Held;
use crate::core::turn_signal::path_generator::TaggedLanelet;
use crate::core::turn_signal::resolve::{CandidateOutcome, Case};
use crate::core::turn_signal::signal::{Hazard, Signal};

/// A decision without its distances and ages.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Headline {
    turn: Signal,
    hazard: Hazard,
    basis: Discriminant<Basis>,
    case: Option<Case>,
    /// What each candidate asks for, and what became of it.
    candidates: Vec<(Signal, CandidateOutcome)>,
    /// The lanelet by which the path generator decided.
    tagged: Option<TaggedLanelet>,
    held: Option<Held>,
    remarks: Vec<ManoeuvreOutcome>,
    findings: Vec<Discriminant<Finding>>,
}

impl Headline {
    pub(super) fn of(decision: &Decision) -> Self {
        let (case, candidates) = match &decision.basis {
            Basis::Candidates(resolution) => {
                let candidates =
                    resolution.evaluated.iter().map(|evaluated| (evaluated.turn, evaluated.outcome));
                (resolution.case, candidates.collect())
            }
            Basis::NoInputs | Basis::Hazard | Basis::ManoeuvreAlone(_) | Basis::PathGenerator(_) => {
                (None, Vec::new())
            }
        };
        let tagged = match decision.basis {
            Basis::PathGenerator(tagged) => Some(tagged),
            Basis::NoInputs | Basis::Hazard | Basis::ManoeuvreAlone(_) | Basis::Candidates(_) => None,
        };
        Self {
            turn: decision.turn,
            hazard: decision.hazard,
            basis: discriminant(&decision.basis),
            case,
            candidates,
            tagged,
            held: decision.held,
            remarks: decision.remarks.clone(),
            findings: decision.findings.iter().map(discriminant).collect(),
        }
    }
}
