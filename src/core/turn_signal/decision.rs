//! A decision with its reasons (docs/spec/turn-signal-decider.md, "Decision with reasons").

use std::fmt;

use super::inputs::Finding;
use super::intersection::IntersectionInfo;
use super::manoeuvre::{ManoeuvreKind, ManoeuvreOutcome, SignalReason};
use super::min_duration::Held;
use super::path_generator::TaggedLanelet;
use super::resolve::Resolution;
use super::signal::{Hazard, Signal};
use crate::core::time::MonoTime;

/// What is commanded, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// Turn command.
    pub turn: Signal,
    /// Hazard command.
    pub hazard: Hazard,
    /// What it rests on.
    pub basis: Basis,
    /// Why the turn command is not what the ground asks for.
    pub held: Option<Held>,
    /// The next turn, when that is what is signalled.
    pub intersection: IntersectionInfo,
    /// What each manoeuvre of the planner came to.
    pub remarks: Vec<ManoeuvreOutcome>,
    /// What is wrong with the inputs.
    pub findings: Vec<Finding>,
    /// When it may change though no input does.
    pub next_deadline: Option<MonoTime>,
}

/// What a decision rests on.
#[derive(Debug, Clone, PartialEq)]
pub enum Basis {
    /// Something indispensable is missing: no command. Upstream publishes nothing at all.
    NoInputs,
    /// A manoeuvre asks for the hazard lights.
    Hazard,
    /// There is no path to measure on: what the manoeuvres ask for.
    ManoeuvreAlone(Signal),
    /// The rule of the path generator, by this lanelet.
    PathGenerator(TaggedLanelet),
    /// The candidates were evaluated.
    Candidates(Resolution),
}

impl fmt::Display for Decision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.turn)?;
        match &self.basis {
            Basis::NoInputs => f.write_str("no inputs")?,
            Basis::Hazard => f.write_str("hazard lights")?,
            Basis::ManoeuvreAlone(_) => f.write_str("manoeuvres alone")?,
            Basis::PathGenerator(tagged) => write!(f, "path generator, {tagged}")?,
            Basis::Candidates(resolution) => write!(f, "{resolution}")?,
        }
        if let Some(held) = self.held {
            write!(f, "; {held}")?;
        }
        for remark in &self.remarks {
            write!(f, "; {remark}")?;
        }
        for finding in &self.findings {
            write!(f, "; {finding}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Resolution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.winner {
            Some(winner) => write!(f, "{}", winner.source)?,
            None => f.write_str("no candidate")?,
        }
        if let Some(case) = self.case {
            write!(f, " by {case}")?;
        }
        for evaluated in &self.evaluated {
            write!(f, "; {evaluated}")?;
        }
        Ok(())
    }
}

impl fmt::Display for ManoeuvreOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.kind, self.why)
    }
}

impl fmt::Display for SignalReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shift(verdict) => write!(f, "{verdict}"),
            Self::Ignored => f.write_str("decided before"),
            Self::Idle => f.write_str("nothing to signal"),
            Self::OwnRule => f.write_str("signalled"),
            Self::TooEarly => f.write_str("too far ahead"),
        }
    }
}

impl fmt::Display for ManoeuvreKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PullOut => "pull-out",
            Self::Avoidance => "avoidance",
            Self::LaneChange => "lane change",
            Self::PullOver => "pull-over",
            Self::SideShift => "side shift",
        })
    }
}
