//! Chooses the candidate that is signalled (docs/spec/turn-signal-decider.md, "Resolution"): validity, order,
//! the pairwise rule. State of earlier decisions is passed in.

use std::collections::BTreeSet;

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::section::{Distances, Section};
use super::side::Side;
use super::subject::SignalSubject;
use crate::light_command::TurnCommand;
use gateway_base::names::{display_by_name, named_by_variant};
use lanelet2_map::geometry::path::PathFrame;

/// The source of a record, in the order that settles equal starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CandidateSource {
    /// A turn at an intersection.
    Intersection,
    /// Entering or leaving a roundabout.
    Roundabout,
    /// A manoeuvre of the planner: lane change, avoidance, pulling out or over.
    Manoeuvre,
}

named_by_variant!(CandidateSource);
display_by_name!(CandidateSource, Case);

impl CandidateSource {
    /// All sources, in order.
    pub const ALL: [Self; 3] = [Self::Intersection, Self::Roundabout, Self::Manoeuvre];
}

/// The records to choose from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Candidates {
    /// The record of turns at intersections.
    pub intersection: Option<Section>,
    /// The record of entries and exits of roundabouts.
    pub roundabout: Option<Section>,
    /// The record of the planner's manoeuvres.
    pub manoeuvre: Option<Section>,
}

impl Candidates {
    /// Returns the record of one source.
    pub const fn of(&self, source: CandidateSource) -> Option<Section> {
        match source {
            CandidateSource::Intersection => self.intersection,
            CandidateSource::Roundabout => self.roundabout,
            CandidateSource::Manoeuvre => self.manoeuvre,
        }
    }
}

/// Rules of the resolver in which improved mode and upstream differ.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PairwiseRules {
    /// A front exactly at P's required start has not reached it (W3). Upstream: the front is neither before
    /// nor inside, and Q wins for one sample.
    pub start_belongs_to_before: bool,
    /// Q wins until P's required section begins, if that lies within Q's: no signal is shown against the
    /// direction of steering (W21). Upstream: P wins from its desired start.
    pub nested_waits: bool,
    /// Sources whose manoeuvre is over and may not return (W4).
    pub finished: BTreeSet<CandidateSource>,
    /// The source that won in the previous cycle, if its manoeuvre is the same.
    pub won_before: Option<CandidateSource>,
}

/// A branch of the pairwise rule (docs/spec/turn-signal-decider.md, "Pairwise rule").
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum Case {
    /// Q's required section lies within P's: P.
    A1,
    /// P starts first and is not over: P.
    A2,
    /// P is over, Q not reached: P.
    A3,
    /// P starts first and is over: Q.
    A4,
    /// P's required section lies within Q's: P until it is over, by default only once it has begun.
    B1,
    /// Q starts first and ends no later: Q until P starts.
    B2,
}

impl Case {
    /// Every branch, in the order of the rule.
    pub const ALL: [Self; 6] = [Self::A1, Self::A2, Self::A3, Self::A4, Self::B1, Self::B2];
}

/// The winner of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Winner {
    /// The candidate with the earlier desired start.
    P,
    /// The candidate with the later desired start.
    Q,
}

/// A source eligible to be signalled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contender {
    /// The source of its record.
    pub source: CandidateSource,
    /// The side it requests.
    pub side: Side,
    /// Distances to its four points.
    pub distances: Distances,
}

/// The outcome of a source.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema, Display)]
#[serde(rename_all = "snake_case")]
pub enum CandidateOutcome {
    /// It has no record.
    #[display("no record")]
    Absent,
    /// A record without a side.
    #[display("requests no side")]
    NoSide,
    /// A point of its record, or its distance, is not a number.
    #[display("a point of it is not a number")]
    NotFinite,
    /// The front is before its desired start.
    #[display("desired start not reached")]
    NotReached,
    /// The rear axle is past its desired end.
    #[display("desired end passed")]
    Passed,
    /// It waits until a junction is passed that offers its side.
    #[display("waits until a junction that offers its side is passed")]
    WaitsForJunction,
    /// It was signalled before, was displaced, and its required section is over.
    #[display("finished before another took over")]
    Finished,
    /// It lost a comparison.
    #[display("lost to {source} by {case}")]
    LostTo {
        /// The source that won.
        source: CandidateSource,
        /// The branch of the pairwise rule that decided.
        case: Case,
    },
    /// The candidate is signalled.
    #[display("won")]
    Won,
}

/// The evaluation of one source.
#[derive(Debug, Clone, Copy, PartialEq, Display)]
#[display("{source}: {}", self.reason())]
#[allow(missing_docs)] // their names say it
pub struct EvaluatedCandidate {
    pub source: CandidateSource,
    pub subject: SignalSubject,
    pub turn: TurnCommand,
    /// Distances to its four points; `None` without a record.
    pub distances: Option<Distances>,
    pub outcome: CandidateOutcome,
}

/// The result of the comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// The candidate that is signalled.
    pub winner: Option<Contender>,
    /// The branch that decided last; `None` when there was nothing to compare.
    pub case: Option<Case>,
    /// Every source, in order.
    pub evaluated: [EvaluatedCandidate; 3],
}

impl Resolution {
    /// Returns left, right, or off.
    pub fn signal(&self) -> TurnCommand {
        self.winner.map_or(TurnCommand::Disable, |winner| winner.side.into())
    }
}

/// Chooses the candidate that is signalled. `path_frame` finds the points of the records within its own
/// limits.
pub fn resolve(path_frame: &PathFrame<'_>, candidates: &Candidates, rules: &PairwiseRules) -> Resolution {
    let mut evaluated =
        CandidateSource::ALL.map(|source| evaluate(path_frame, source, candidates.of(source), rules));
    let mut contenders: Vec<Contender> = evaluated.iter().filter_map(EvaluatedCandidate::contender).collect();
    // Stable: equal starts keep the order of the sources.
    contenders
        .sort_by(|one, other| one.distances.desired_start_m.total_cmp(&other.distances.desired_start_m));
    let (mut winner, mut last_case) = (None, None);
    for next in contenders {
        let Some(holder) = winner.replace(next) else { continue };
        let won_before = match rules.won_before {
            Some(source) if source == holder.source => Some(Winner::P),
            Some(source) if source == next.source => Some(Winner::Q),
            Some(_) | None => None,
        };
        let (prior, case) = prior(&holder.distances, &next.distances, rules, won_before);
        last_case = Some(case);
        let (kept, lost) = match prior {
            Winner::P => (holder, next),
            Winner::Q => (next, holder),
        };
        winner = Some(kept);
        set_outcome(&mut evaluated, lost.source, CandidateOutcome::LostTo { source: kept.source, case });
    }
    if let Some(winner) = winner {
        set_outcome(&mut evaluated, winner.source, CandidateOutcome::Won);
    }
    Resolution { winner, case: last_case, evaluated }
}

/// Chooses the record of the planner's manoeuvres that takes part, by the same rules; the first record if
/// none is valid, so that the reason is known. `won_before` tells whether a record won in the previous cycle.
pub fn foremost(
    path_frame: &PathFrame<'_>,
    records: &[Section],
    rules: &PairwiseRules,
    won_before: impl Fn(&Section) -> bool,
) -> Option<Section> {
    let evaluated = records.iter().map(|record| {
        let evaluated =
            evaluate(path_frame, CandidateSource::Manoeuvre, Some(*record), &PairwiseRules::default());
        Some((evaluated.contender()?.distances, *record))
    });
    let mut contenders: Vec<(Distances, Section)> = evaluated.flatten().collect();
    contenders.sort_by(|(one, _), (other, _)| one.desired_start_m.total_cmp(&other.desired_start_m));
    let winner = contenders.into_iter().reduce(|holder, next| {
        let before =
            if won_before(&holder.1) { Some(Winner::P) } else { won_before(&next.1).then_some(Winner::Q) };
        match prior(&holder.0, &next.0, rules, before).0 {
            Winner::P => holder,
            Winner::Q => next,
        }
    });
    winner.map(|(_, record)| record).or(records.first().copied())
}

/// Required sections whose starts are within this distance start together, metres: none is signalled only for
/// an instant.
const SAME_START_M: f64 = 3.0;
/// Starts that were together remain so while they are at most this much farther apart, and separate starts
/// remain separate while they are at most this much nearer, metres: measured starts move a little from cycle
/// to cycle, and the signal would flicker.
const STILL_SAME_START_M: f64 = 1.0;

/// Applies the pairwise rule: `p` has the earlier desired start. `won_before` is the winner of the previous
/// cycle.
pub fn prior(
    p: &Distances,
    q: &Distances,
    rules: &PairwiseRules,
    won_before: Option<Winner>,
) -> (Winner, Case) {
    let (ps, pe, qs, qe) = (p.required_start_m, p.required_end_m, q.required_start_m, q.required_end_m);
    let before_p = ps > 0.0 || rules.start_belongs_to_before && ps >= 0.0;
    let inside_p = ps < 0.0 && pe >= 0.0;
    let together_m = match won_before {
        Some(Winner::P) => SAME_START_M + STILL_SAME_START_M,
        Some(Winner::Q) => SAME_START_M - STILL_SAME_START_M,
        None => SAME_START_M,
    };
    let start_together = rules.nested_waits && ps - qs <= together_m;
    let waits = rules.nested_waits && ps > 0.0 && !start_together;
    let unless_over = if (before_p || inside_p) && !waits { Winner::P } else { Winner::Q };
    if ps < qs {
        if qe < pe {
            (Winner::P, Case::A1)
        } else if before_p || inside_p {
            (Winner::P, Case::A2)
        } else if qs > 0.0 {
            (Winner::P, Case::A3)
        } else {
            (Winner::Q, Case::A4)
        }
    } else if pe < qe {
        (unless_over, Case::B1)
    } else {
        (if ps > 0.0 && !start_together { Winner::Q } else { Winner::P }, Case::B2)
    }
}

fn evaluate(
    path_frame: &PathFrame<'_>,
    source: CandidateSource,
    record: Option<Section>,
    rules: &PairwiseRules,
) -> EvaluatedCandidate {
    let Some(record) = record else {
        return EvaluatedCandidate {
            source,
            subject: SignalSubject::Unnamed,
            turn: TurnCommand::NoCommand,
            distances: None,
            outcome: CandidateOutcome::Absent,
        };
    };
    let distances = record.distances(path_frame);
    let outcome = if record.turn.side().is_none() {
        CandidateOutcome::NoSide
    } else if !record.is_finite() || !distances.values().iter().all(|distance| distance.is_finite()) {
        CandidateOutcome::NotFinite
    } else if distances.desired_start_m > 0.0 {
        CandidateOutcome::NotReached
    } else if distances.desired_end_m < 0.0 {
        CandidateOutcome::Passed
    } else if record.waits() {
        CandidateOutcome::WaitsForJunction
    } else if rules.finished.contains(&source) {
        CandidateOutcome::Finished
    } else {
        CandidateOutcome::Won
    };
    let Section { subject, turn, .. } = record;
    EvaluatedCandidate { source, subject, turn, distances: Some(distances), outcome }
}

fn set_outcome(evaluated: &mut [EvaluatedCandidate; 3], source: CandidateSource, outcome: CandidateOutcome) {
    for candidate in evaluated.iter_mut().filter(|candidate| candidate.source == source) {
        candidate.outcome = outcome;
    }
}

impl EvaluatedCandidate {
    /// Returns the candidate as a contender; `None` when it was ruled out.
    fn contender(&self) -> Option<Contender> {
        let distances = self.distances.filter(|_| self.outcome == CandidateOutcome::Won)?;
        Some(Contender { source: self.source, side: self.turn.side()?, distances })
    }

    /// Returns the outcome with the command and the distances, as text.
    pub fn reason(&self) -> String {
        let Some(distances) = self.distances else { return self.outcome.to_string() };
        let [ds, de, rs, re] = distances.values();
        format!("{} ({}, ds {ds:.2} de {de:.2} rs {rs:.2} re {re:.2} m)", self.outcome, self.turn)
    }
}
