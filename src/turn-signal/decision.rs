//! A decision with its reasons (docs/spec/turn-signal-decider.md, "Decision with reasons").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::inputs::InputFinding;
use super::intersection::TurnAhead;
use super::junction::JunctionRemark;
use super::manoeuvre::ManoeuvreOutcome;
use super::min_duration::Held;
use super::path_generator::TaggedLanelet;
use super::resolve::{CandidateOutcome, CandidateSource, Candidates, Case, EvaluatedCandidate, Resolution};
use crate::light_command::{HazardCommand, TurnCommand};
use gateway_base::time::MonoTime;

/// The commands of one cycle with their reasons.
#[derive(Debug, Clone, PartialEq, Default)]
#[allow(missing_docs)] // their names say it
pub struct Decision {
    pub turn: TurnCommand,
    pub hazard: HazardCommand,
    pub basis: Basis,
    /// The minimum duration that keeps the turn command different from the basis.
    pub held: Option<Held>,
    /// The records of the candidates; none unless they were evaluated.
    pub sections: Candidates,
    /// The next turn, when that is what is signalled.
    pub intersection: Option<TurnAhead>,
    /// The junction before the next turn that offers its side and is not taken, while it is ahead.
    pub junction: Option<JunctionRemark>,
    /// The outcome of each manoeuvre of the planner, in the order of the chain.
    pub remarks: Vec<ManoeuvreOutcome>,
    /// Everything wrong with the inputs.
    pub findings: Vec<InputFinding>,
    /// The next time at which it may change without a new input.
    pub next_deadline: Option<MonoTime>,
}

/// The basis of a decision.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Basis {
    /// An indispensable input is missing: no command. Upstream publishes nothing at all.
    #[default]
    NoInputs,
    /// A manoeuvre requests the hazard lights.
    Hazard,
    /// Without a path to measure on, the command of the manoeuvres alone.
    ManoeuvreAlone(TurnCommand),
    /// The rule of the path generator, by this lanelet.
    PathGenerator(TaggedLanelet),
    /// The candidates were evaluated.
    Candidates(Box<Resolution>),
}

/// A [`Basis`] without its content.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // as those of `Basis`
pub enum BasisKind {
    NoInputs,
    Hazard,
    Manoeuvres,
    PathGenerator,
    Candidates,
}

impl Basis {
    /// Returns the basis without its content.
    pub const fn kind(&self) -> BasisKind {
        match self {
            Self::NoInputs => BasisKind::NoInputs,
            Self::Hazard => BasisKind::Hazard,
            Self::ManoeuvreAlone(_) => BasisKind::Manoeuvres,
            Self::PathGenerator(_) => BasisKind::PathGenerator,
            Self::Candidates(_) => BasisKind::Candidates,
        }
    }
}

impl Decision {
    /// Returns the resolution of the candidates, if they were evaluated.
    pub const fn resolution(&self) -> Option<&Resolution> {
        if let Basis::Candidates(resolution) = &self.basis { Some(resolution) } else { None }
    }

    /// Returns each candidate with its outcome, in the order that settles equal starts; empty unless
    /// candidates were evaluated.
    pub fn evaluated(&self) -> &[EvaluatedCandidate] {
        self.resolution().map(|resolution| &resolution.evaluated[..]).unwrap_or_default()
    }

    /// Returns the candidate that won; `None` when nothing is signalled, or not by a candidate.
    pub fn won(&self) -> Option<&EvaluatedCandidate> {
        self.evaluated().iter().find(|candidate| candidate.outcome == CandidateOutcome::Won)
    }

    /// Returns the source of the candidate that is signalled.
    pub fn winner(&self) -> Option<CandidateSource> {
        self.resolution()?.winner.map(|winner| winner.source)
    }

    /// Returns the branch of the pairwise rule that decided last; `None` when nothing was compared.
    pub fn case(&self) -> Option<Case> {
        self.resolution()?.case
    }
}
