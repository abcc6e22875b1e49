//! Manoeuvres of the planner, each with its record (docs/spec/turn-signal-decider.md, "Joining records").

use std::collections::BTreeSet;

use super::chain::ManoeuvreRecords;
use super::decision_context::DecisionContext;
use super::section::Section;
use super::subject::SignalSubject;

pub mod announced;
pub mod avoidance;
pub mod lane_change;
mod memory;
mod outcome;
pub mod pull_out;
pub mod pull_over;

pub use super::subject::ManoeuvreKind;
use avoidance::Avoidance;
use lane_change::LaneChange;
pub use memory::ManoeuvreMemory;
pub use outcome::{ManoeuvreOutcome, SignalReason};
use pull_out::PullOut;
use pull_over::PullOver;

/// A manoeuvre of a module of the planner.
#[derive(Debug, Clone, PartialEq)]
pub enum Manoeuvre {
    /// The module start planner.
    PullOut(PullOut),
    /// Avoidance of static obstacles.
    Avoidance(Avoidance),
    /// Lane change, left or right.
    LaneChange(LaneChange),
    /// The module goal planner.
    PullOver(PullOver),
    /// Side shift and the sampling planner: upstream discards all records before it.
    SideShift,
}

impl Manoeuvre {
    /// Returns the kind of the manoeuvre.
    pub const fn kind(&self) -> ManoeuvreKind {
        match self {
            Self::PullOut(_) => ManoeuvreKind::PullOut,
            Self::Avoidance(_) => ManoeuvreKind::Avoidance,
            Self::LaneChange(_) => ManoeuvreKind::LaneChange,
            Self::PullOver(_) => ManoeuvreKind::PullOver,
            Self::SideShift => ManoeuvreKind::SideShift,
        }
    }
}

impl ManoeuvreMemory {
    /// Returns the records of the chain, at most one for upstream, and the outcome of each manoeuvre.
    /// `manoeuvres` are in the order in which the planner runs them: approved ones first, then the waiting
    /// one.
    pub fn chain<'a>(
        &mut self,
        context: &DecisionContext<'_>,
        manoeuvres: impl IntoIterator<Item = &'a Manoeuvre>,
    ) -> (Vec<Section>, Vec<ManoeuvreOutcome>) {
        let mut records = ManoeuvreRecords::default();
        let mut remarks = Vec::new();
        let mut present = BTreeSet::new();
        for manoeuvre in manoeuvres {
            present.insert(manoeuvre.kind());
            records.begin(SignalSubject::Manoeuvre(manoeuvre.kind()));
            let why = match manoeuvre {
                Manoeuvre::PullOut(pull_out) => self.pull_out(context, pull_out, &mut records),
                Manoeuvre::Avoidance(avoidance) => self.avoidance(context, avoidance, &mut records),
                Manoeuvre::LaneChange(change) => self.lane_change(context, change, &mut records),
                Manoeuvre::PullOver(pull_over) => self.pull_over(context, pull_over, &mut records),
                Manoeuvre::SideShift => {
                    records.lose(context);
                    SignalReason::Idle
                }
            };
            remarks.push(ManoeuvreOutcome { kind: manoeuvre.kind(), why });
        }
        self.forget_absent(&present);
        (records.sections, remarks)
    }
}
