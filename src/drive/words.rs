//! Decisions in short words.

use crate::core::turn_signal::decision::{Decision, Ground};
use crate::core::turn_signal::resolve::{Case, Resolution, Source};
use crate::core::turn_signal::scene::Mode;

/// Whose behaviour.
pub(super) const fn mode(mode: Mode) -> &'static str {
    match mode {
        Mode::Improved => "improved",
        Mode::Compat => "upstream",
    }
}

/// The candidates, if they were weighed.
pub(super) const fn resolution(decision: &Decision) -> Option<&Resolution> {
    match &decision.ground {
        Ground::Weighed(resolution) => Some(resolution),
        Ground::Blind | Ground::Hazard | Ground::BehaviourAlone(_) => None,
    }
}

/// Who is signalled.
pub(super) fn winner(decision: &Decision) -> Option<Source> {
    resolution(decision)?.winner.map(|winner| winner.source)
}

/// The branch that decided last.
pub(super) fn case(decision: &Decision) -> Option<Case> {
    resolution(decision)?.case
}

/// What the decision rests on, in a word or two.
pub(super) fn ground(decision: &Decision) -> String {
    match &decision.ground {
        Ground::Blind => "nothing to go by".to_owned(),
        Ground::Hazard => "hazard lights".to_owned(),
        Ground::BehaviourAlone(_) => "manoeuvres alone".to_owned(),
        Ground::Weighed(resolution) => match (resolution.winner, resolution.case) {
            (Some(winner), Some(case)) => format!("{} by {case}", winner.source),
            (Some(winner), None) => format!("{}, alone", winner.source),
            (None, _) => "no candidate".to_owned(),
        },
    }
}
