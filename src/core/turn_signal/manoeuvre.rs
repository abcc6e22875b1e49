//! Manoeuvres of the planner, each with the record it makes
//! (docs/spec/turn-signal-decider.md, "Joining records").

use std::collections::BTreeSet;

use super::chain::ManoeuvreRecords;
use super::decision_context::DecisionContext;
use super::section::Section;
use super::shift::{Shift, ShiftOutcome, ShiftVerdict, judge};
use super::subject::SignalSubject;
use crate::core::map::geometry::Pose;
use crate::core::map::lane_network::LaneId;

pub mod announced;
pub mod avoidance;
pub mod lane_change;
pub mod pull_out;
pub mod pull_over;

use announced::{AnnouncedManoeuvres, ManoeuvreIdentity};
use avoidance::Avoidance;
use lane_change::LaneChange;
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
    /// Side shift and the sampling planner: upstream loses whatever came before.
    SideShift,
}

/// The kind of a manoeuvre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ManoeuvreKind {
    /// Pulling out from the roadside.
    PullOut,
    /// Avoidance of static obstacles.
    Avoidance,
    /// A lane change to either side.
    LaneChange,
    /// Pulling over to the roadside.
    PullOver,
    /// A side shift, or a path of the sampling planner.
    SideShift,
}

/// The memory of manoeuvres from one cycle to the next.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ManoeuvreMemory {
    /// Upstream: shift lines that are not judged again while avoiding.
    avoidance_ignored: BTreeSet<u128>,
    /// Upstream: the lanelet in which pulling out is not judged again.
    pull_out_ignored: Option<LaneId>,
    /// Improved: the signal of the pull-out has ended before a junction.
    pull_out_has_ended: bool,
    /// Upstream: the lanelet in which pulling over is not judged again.
    pull_over_ignored: Option<LaneId>,
    /// First deceleration pose of a pull-over, and the stop pose if known then.
    pre_signal: Option<(Pose, Option<Pose>)>,
    /// Improved: what is announced.
    announced: AnnouncedManoeuvres,
}

/// The outcome of one manoeuvre, for the explanation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ManoeuvreOutcome {
    /// The kind of the manoeuvre.
    pub kind: ManoeuvreKind,
    /// The reason for its record.
    pub why: SignalReason,
}

/// The reason for the record of a manoeuvre.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignalReason {
    /// The shift rule decided.
    Shift(ShiftVerdict),
    /// It was decided before that it is not signalled.
    Ignored,
    /// Nothing to signal: no path, no shift left, too far beside it, not approved.
    Idle,
    /// It is signalled by a rule of its own.
    OwnRule,
    /// It is known, but too far ahead.
    TooEarly,
}

impl Manoeuvre {
    /// The kind of the manoeuvre.
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

impl ManoeuvreKind {
    /// The subject of its records; a side shift has none.
    const fn subject(self) -> SignalSubject {
        match self {
            Self::PullOut => SignalSubject::PullOut,
            Self::Avoidance => SignalSubject::Avoidance,
            Self::LaneChange => SignalSubject::LaneChange,
            Self::PullOver => SignalSubject::PullOver,
            Self::SideShift => SignalSubject::Unnamed,
        }
    }
}

impl ManoeuvreMemory {
    /// The records of the chain, at most one for upstream, and the outcome of each manoeuvre. `manoeuvres` stand in
    /// the order in which the planner runs them: approved ones first, then the one that waits.
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
            records.begin(manoeuvre.kind().subject());
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
        (records.sections(), remarks)
    }

    /// Judges a shift that, once signalled, is until it is complete (W18).
    fn judged(
        &mut self,
        context: &DecisionContext<'_>,
        shift: &Shift<'_>,
        kind: ManoeuvreKind,
    ) -> ShiftOutcome {
        let identity = ManoeuvreIdentity::new(&context.path_frame, kind, shift.side(), shift.line.end);
        let is_announced = self.announced.from(identity).is_some();
        let outcome = judge(context, &Shift { is_announced, ..*shift });
        if outcome.verdict == ShiftVerdict::Signalled && !is_announced {
            self.announced.announce(identity, context.ego());
        }
        outcome
    }

    /// Clears the memory, for another route.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Clears what was remembered for modules without a manoeuvre now.
    fn forget_absent(&mut self, present: &BTreeSet<ManoeuvreKind>) {
        if !present.contains(&ManoeuvreKind::Avoidance) {
            self.avoidance_ignored.clear();
        }
        if !present.contains(&ManoeuvreKind::PullOut) {
            self.pull_out_ignored = None;
            self.pull_out_has_ended = false;
        }
        if !present.contains(&ManoeuvreKind::PullOver) {
            self.pull_over_ignored = None;
            self.pre_signal = None;
        }
        self.announced.end_cycle();
    }
}
