//! Manoeuvres that are over and do not come back (weakness W4): signalled once, displaced by another,
//! required section passed.

use std::collections::BTreeSet;

use super::resolve::{CandidateOutcome, Candidates, Resolution, Source};
use super::section::Section;
use crate::core::light_command::TurnCommand;
use crate::core::map::geometry::Pose;

/// The end of a record that moves farther than this belongs to another manoeuvre, metres.
const SAME_END_M: f64 = 1.0;

/// The last record of each source, and whether it has finished.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FinishedMemory {
    sections: [Option<SignalledSection>; 3],
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct SignalledSection {
    turn: TurnCommand,
    end: Pose,
    was_signalled: bool,
    is_finished: bool,
}

impl FinishedMemory {
    /// Takes the records of this cycle and returns the sources whose manoeuvre may not come back.
    pub fn finished(&mut self, candidates: &Candidates) -> BTreeSet<Source> {
        for (source, section) in Source::ALL.into_iter().zip(&mut self.sections) {
            let record = candidates.of(source);
            *section = record.map(|record| {
                section.filter(|known| known.is_same(&record)).unwrap_or(SignalledSection::new(&record))
            });
        }
        let finished = |(source, section): (Source, &Option<SignalledSection>)| {
            section.filter(|section| section.is_finished).map(|_| source)
        };
        Source::ALL.into_iter().zip(&self.sections).filter_map(finished).collect()
    }

    /// Takes the outcomes of this cycle.
    pub fn note(&mut self, resolution: &Resolution) {
        for (evaluated, section) in resolution.evaluated.iter().zip(&mut self.sections) {
            let Some(section) = section else { continue };
            let is_over = evaluated.distances.is_some_and(|distances| distances.required_end_m < 0.0);
            match evaluated.outcome {
                CandidateOutcome::Won => section.was_signalled = true,
                CandidateOutcome::LostTo { .. } => section.is_finished = section.was_signalled && is_over,
                CandidateOutcome::Absent
                | CandidateOutcome::NoSide
                | CandidateOutcome::NotFinite
                | CandidateOutcome::NotReached
                | CandidateOutcome::Passed
                | CandidateOutcome::Finished => {}
            }
        }
    }

    /// Clears the memory, for another route.
    pub fn clear(&mut self) {
        self.sections = Default::default();
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
