//! Manoeuvres that are over and do not return (weakness W4): they were signalled, and then passed, or
//! displaced by a manoeuvre to the other side when the required section was over.

use super::manoeuvre::announced::{SAME_END_M, is_same_visit};
use super::resolve::CandidateSource;
use super::section::Section;
use crate::light_command::TurnCommand;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::path::PathFrame;

/// The sections of the previous cycle, each with its outcome.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FinishedMemory {
    known: Vec<KnownSection>,
}

/// The section of a manoeuvre. It is the same section in the next cycle if source and command are equal and
/// its ends hardly move (docs/spec/turn-signal-decider.md, "Identity of manoeuvres").
#[allow(clippy::struct_excessive_bools)] // independent of each other
#[derive(Debug, Clone, Copy, PartialEq)]
struct KnownSection {
    source: CandidateSource,
    turn: TurnCommand,
    ends: [Pose; 2],
    /// Distance from the rear axle to the end of the desired section, metres.
    ahead_m: f64,
    was_signalled: bool,
    /// The section won in this cycle.
    has_won: bool,
    /// A section to the other side won over it.
    is_displaced: bool,
    is_finished: bool,
}

impl FinishedMemory {
    /// Returns whether the manoeuvre of a section may not return. A displaced manoeuvre may not return
    /// either, once its required section is over.
    pub fn is_finished(
        &self,
        path_frame: &PathFrame<'_>,
        source: CandidateSource,
        section: &Section,
    ) -> bool {
        let is_over = || section.distances(path_frame).required_end_m < 0.0;
        self.of(path_frame, source, section)
            .is_some_and(|known| known.is_finished || known.was_signalled && known.is_displaced && is_over())
    }

    /// Returns whether the manoeuvre of a section won in the previous cycle.
    pub fn won_before(&self, path_frame: &PathFrame<'_>, source: CandidateSource, section: &Section) -> bool {
        self.of(path_frame, source, section).is_some_and(|known| known.has_won)
    }

    /// Records the sections of a cycle with their sources, the winner, and the command that was shown.
    /// Sections that are not listed are forgotten.
    pub fn note(
        &mut self,
        path_frame: &PathFrame<'_>,
        sections: &[(CandidateSource, Section)],
        winner: Option<&(CandidateSource, Section)>,
        shown: TurnCommand,
    ) {
        let noted = sections.iter().map(|given| {
            let (source, section) = given;
            let before = self.of(path_frame, *source, section);
            let was_signalled = before.is_some_and(|known| known.was_signalled);
            let distances = section.distances(path_frame);
            let is_over = distances.required_end_m < 0.0;
            // To the same side the signal continues, so nothing was displaced.
            let lost = winner.is_some_and(|(_, winner)| winner.turn != section.turn);
            // On a bend the end may reappear by a few centimetres.
            let is_passed = distances.desired_end_m < 0.0;
            KnownSection {
                source: *source,
                turn: section.turn,
                ends: [section.desired_end, section.required_end],
                ahead_m: distances.desired_end_m,
                was_signalled: was_signalled || winner == Some(given) && shown == section.turn,
                has_won: winner == Some(given),
                is_displaced: lost,
                is_finished: self.is_finished(path_frame, *source, section)
                    || was_signalled && (lost && is_over || is_passed),
            }
        });
        self.known = noted.collect();
    }

    fn of(
        &self,
        path_frame: &PathFrame<'_>,
        source: CandidateSource,
        section: &Section,
    ) -> Option<&KnownSection> {
        let ahead_m = section.distances(path_frame).desired_end_m;
        let is_same = |known: &&KnownSection| {
            let is_same_visit = is_same_visit(known.ahead_m, ahead_m);
            known.source == source && known.turn == section.turn && is_same_visit
        };
        let moved_m = |known: &KnownSection| {
            let [desired, required] = known.ends.map(|end| end.position);
            let desired_m = desired.distance_m(section.desired_end.position);
            desired_m.max(required.distance_m(section.required_end.position))
        };
        let near = self.known.iter().filter(is_same).filter(|known| moved_m(known) <= SAME_END_M);
        near.min_by(|one, other| moved_m(one).total_cmp(&moved_m(other)))
    }
}
