//! Joins the records of the planner's manoeuvres (docs/spec/turn-signal-decider.md, "Joining records").

use super::decision_context::DecisionContext;
use super::resolve::{PairwiseRules, Winner, prior};
use super::section::Section;
use super::subject::SignalSubject;
use crate::light_command::TurnCommand;
use lanelet2_map::geometry::path::PathFrame;

/// The records of the current cycle. Upstream joins each record with the previous one at once, so at most one
/// is left. In improved mode all records with a request stay, and the pairwise rule decides between them (W5,
/// W6, W19).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ManoeuvreRecords {
    /// All records, in the order of the chain.
    pub sections: Vec<Section>,
    subject: SignalSubject,
}

impl ManoeuvreRecords {
    /// Begins the records of a manoeuvre.
    pub fn begin(&mut self, subject: SignalSubject) {
        self.subject = subject;
    }

    /// Returns whether any record so far requests a side.
    pub fn request_side(&self) -> bool {
        self.sections.iter().any(|record| record.turn.side().is_some())
    }

    /// Adds the record of a manoeuvre that upstream joins by [`overwrite`].
    pub fn add(&mut self, context: &DecisionContext<'_>, new: Section) {
        self.join(context, new, |previous, new| Some(overwrite(&context.path_frame, previous, new)));
    }

    /// Adds the record of a manoeuvre that upstream joins by [`pairwise_prior`].
    pub fn add_by_rule(&mut self, context: &DecisionContext<'_>, new: Section) {
        self.join(context, new, |previous, new| pairwise_prior(&context.path_frame, previous, new));
    }

    /// Changes the command of the previous record, as upstream does at a start from the middle of a lane.
    pub fn change_command(&mut self, turn: TurnCommand) {
        let previous = self.sections.last().copied().unwrap_or_default();
        self.sections = vec![Section { turn, ..previous }];
    }

    /// Discards the records so far, as upstream does.
    pub fn lose(&mut self, context: &DecisionContext<'_>) {
        if context.quirks.empty_records_take_part {
            self.sections.clear();
        }
    }

    fn join(
        &mut self,
        context: &DecisionContext<'_>,
        new: Section,
        join: impl FnOnce(Section, Section) -> Option<Section>,
    ) {
        let new = Section { subject: self.subject, ..new };
        if context.quirks.last_manoeuvre_replaces {
            let previous = self.sections.last().copied().unwrap_or_default();
            self.sections = join(previous, new).into_iter().collect();
        } else if new.requests_something() {
            self.sections.push(new);
        }
    }
}

/// Upstream's *overwrite*: the new record, unless it starts after the previous one ends. An empty new record
/// erases an active one, and a hazard request is lost with its record (W5).
pub fn overwrite(path_frame: &PathFrame<'_>, previous: Section, new: Section) -> Section {
    let has_side = previous.turn.side().is_some();
    let starts_later = has_side
        && path_frame.from_front_m(new.desired_start) > path_frame.from_front_m(previous.desired_end);
    if starts_later { previous } else { new }
}

/// Upstream's pairwise prior rule, which ignores commands: an empty record takes part with its points at the
/// origin of the map (W6). `None` means an empty record.
pub fn pairwise_prior(path_frame: &PathFrame<'_>, previous: Section, new: Section) -> Option<Section> {
    let (of_previous, of_new) = (previous.distances(path_frame), new.distances(path_frame));
    match (of_previous.desired_start_m > 0.0, of_new.desired_start_m > 0.0) {
        (true, true) => return None,
        (true, false) => return Some(new),
        (false, true) => return Some(previous),
        (false, false) => {}
    }
    match (of_previous.desired_end_m < 0.0, of_new.desired_end_m < 0.0) {
        (true, true) => return None,
        (true, false) => return Some(new),
        (false, true) => return Some(previous),
        (false, false) => {}
    }
    let previous_first = of_previous.desired_start_m <= of_new.desired_start_m;
    let (p, q) = if previous_first { (of_previous, of_new) } else { (of_new, of_previous) };
    let (winner, _) = prior(&p, &q, &PairwiseRules::default(), None);
    Some(if (winner == Winner::P) == previous_first { previous } else { new })
}
