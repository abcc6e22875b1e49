//! Decisions in short words.

use crate::core::turn_signal::decision::{Basis, Decision};
use crate::core::turn_signal::resolve::{Case, Resolution, Source};

/// The candidates, if they were evaluated.
pub(super) const fn resolution(decision: &Decision) -> Option<&Resolution> {
    match &decision.basis {
        Basis::Candidates(resolution) => Some(resolution),
        Basis::NoInputs | Basis::Hazard | Basis::ManoeuvreAlone(_) | Basis::PathGenerator(_) => None,
    }
}

/// Who is signalled.
pub(super) fn winner(decision: &Decision) -> Option<Source> {
    resolution(decision)?.winner.map(|winner| winner.source)
}

/// The branch that decided last.
pub(super) fn case(decision: &Decision) -> Option<Case> {
    resolution(decision)?.case
}

/// What the decision rests on, in a word or two.
pub(super) fn basis(decision: &Decision) -> String {
    match &decision.basis {
        Basis::NoInputs => "no inputs".to_owned(),
        Basis::Hazard => "hazard lights".to_owned(),
        Basis::ManoeuvreAlone(_) => "manoeuvres alone".to_owned(),
        Basis::PathGenerator(tagged) => format!("path generator, {tagged}"),
        Basis::Candidates(resolution) => match (resolution.winner, resolution.case) {
            (Some(winner), Some(case)) => format!("{} by {case}", winner.source),
            (Some(winner), None) => format!("{}, alone", winner.source),
            (None, _) => "no candidate".to_owned(),
        },
    }
}
