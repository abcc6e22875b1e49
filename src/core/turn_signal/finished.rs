//! Manoeuvres that are over and do not come back (weakness W4): signalled once, displaced by another,
//! required section passed.

use super::resolve::{CandidateOutcome, Candidates, FinishedSources, Resolution, Source};
use super::section::Section;
use super::signal::Signal;
use crate::core::map::geometry::Pose;

/// The end of a record that moves farther than this belongs to another manoeuvre, metres.
const SAME_END_M: f64 = 1.0;

/// What each source has come to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FinishedMemory {
    seen: [Option<SignalledSection>; 3],
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct SignalledSection {
    turn: Signal,
    end: Pose,
    was_signalled: bool,
    is_finished: bool,
}

impl FinishedMemory {
    /// Takes the records of this cycle; the sources whose manoeuvre may not come back.
    pub fn finished(&mut self, candidates: &Candidates) -> FinishedSources {
        for (source, seen) in Source::ALL.into_iter().zip(&mut self.seen) {
            let record = candidates.of(source);
            *seen = record.map(|record| {
                seen.filter(|seen| seen.is_same(&record)).unwrap_or(SignalledSection::new(&record))
            });
        }
        let finished = |(source, seen): (Source, &Option<SignalledSection>)| {
            seen.filter(|seen| seen.is_finished).map(|_| source)
        };
        Source::ALL.into_iter().zip(&self.seen).filter_map(finished).collect()
    }

    /// Takes what came of them.
    pub fn note(&mut self, resolution: &Resolution) {
        for (evaluated, seen) in resolution.evaluated.iter().zip(&mut self.seen) {
            let Some(seen) = seen else { continue };
            let is_over = evaluated.distances.is_some_and(|distances| distances.required_end_m < 0.0);
            match evaluated.outcome {
                CandidateOutcome::Won => seen.was_signalled = true,
                CandidateOutcome::LostTo { .. } => seen.is_finished = seen.was_signalled && is_over,
                CandidateOutcome::Absent
                | CandidateOutcome::NoSide
                | CandidateOutcome::NotFinite
                | CandidateOutcome::NotReached
                | CandidateOutcome::Passed
                | CandidateOutcome::Finished => {}
            }
        }
    }

    /// Forgets all: the route is another one.
    pub fn clear(&mut self) {
        self.seen = Default::default();
    }
}

impl SignalledSection {
    fn new(record: &Section) -> Self {
        Self { turn: record.turn, end: record.desired_end, was_signalled: false, is_finished: false }
    }

    fn is_same(&self, record: &Section) -> bool {
        self.turn == record.turn && self.end.position.distance_m(record.desired_end.position) <= SAME_END_M
    }
}
