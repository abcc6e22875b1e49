//! Joins the record of one manoeuvre with that of the one before it
//! (docs/spec/turn-signal-decider.md, "Joining records").

use super::resolve::{Rules, Winner, prior};
use super::section::Section;
use crate::core::light_command::{HazardCommand, TurnCommand};
use crate::core::map::geometry::path::PathFrame;

/// Upstream's *overwrite*: the new record, unless it starts after the previous one ends. An empty new
/// record erases an active one, and a hazard request goes with the record that made it (W5).
pub fn overwrite(path_frame: &PathFrame<'_>, previous: Section, new: Section) -> Section {
    let has_side = previous.turn.side().is_some();
    let starts_later = has_side
        && path_frame.from_front_m(new.desired_start) > path_frame.from_front_m(previous.desired_end);
    if starts_later { previous } else { new }
}

/// Upstream's pairwise prior rule, which does not look at commands: an empty record takes part with
/// its points at the origin of the map (W6). `None` = an empty record.
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
    let (winner, _) = prior(&p, &q, &Rules::default());
    Some(if (winner == Winner::P) == previous_first { previous } else { new })
}

/// Improved mode: a record without a command replaces none (W5, W6), and a request for the hazard lights stays with
/// whatever is signalled. `join` decides between two that have a command.
pub fn join_present(
    previous: Option<Section>,
    new: Option<Section>,
    join: impl FnOnce(Section, Section) -> Option<Section>,
) -> Option<Section> {
    let hazard = [previous, new].iter().flatten().any(|record| record.hazard == HazardCommand::Enable);
    let has_command = |record: &Section| record.turn != TurnCommand::NoCommand;
    let chosen = match (previous.filter(has_command), new.filter(has_command)) {
        (Some(previous), Some(new)) => join(previous, new),
        (previous, new) => previous.or(new),
    };
    let chosen = chosen.or_else(|| [previous, new].into_iter().flatten().find(|_| hazard));
    chosen.map(|record| if hazard { Section { hazard: HazardCommand::Enable, ..record } } else { record })
}
