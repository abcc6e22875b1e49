//! The result of a discovery: the best candidates, their rivals, and what is not sure.

use std::collections::BTreeMap;

use super::candidate::{Candidate, Drawback, HazardForm, TurnForm};
use super::capture::{Capture, MessageKey};
use super::protection::Protection;
use super::response::Shape;
use super::search;
use super::timeline::{Action, Timeline};

/// The candidates, each list with the best first.
#[derive(Debug, Clone, Default)]
pub struct Findings {
    /// Candidates for the turn indicators.
    pub turn: Vec<Candidate<TurnForm>>,
    /// Candidates for the hazard lights.
    pub hazard: Vec<Candidate<HazardForm>>,
    /// Counter and checksum of each message with candidates.
    pub protection: BTreeMap<MessageKey, Protection>,
    /// The certainty of each of [`Action::ALL`].
    pub certainty: [Certainty; 3],
}

/// The certainty of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Certainty {
    /// Enough requests were followed.
    Sure,
    /// A signal was found, but too few requests were followed, or too many were not.
    Unsure,
    /// No signal followed the requests, so far.
    #[default]
    NotFound,
    /// No signal follows the requests, after enough of them.
    NotVisible,
}

/// Requests that must be followed by a signal that shows the state itself.
const ENOUGH: usize = 2;
/// Requests that must be followed by a signal that chance may imitate.
const ENOUGH_IF_WEAK: usize = 3;
/// Requests without a following signal after which there is none.
const ENOUGH_WITHOUT: usize = 3;

impl Findings {
    /// Ranks all signals by how well they follow the requests.
    pub fn new(capture: &Capture, timeline: &Timeline) -> Self {
        let messages = search::responding(capture, timeline);
        let turn = search::turn(&messages, timeline);
        let signals = turn.first().map(|turn| turn.form.signals()).unwrap_or_default();
        let turn_messages: Vec<_> = signals.iter().map(|signal| signal.message).collect();
        let mut hazard = search::hazard(&messages, &turn_messages, timeline);
        if let Some(both_sides) = turn.first().and_then(both_sides) {
            // A lasting signal beside those of the indicators shows the hazard lights themselves.
            let is_better = |candidate: &Candidate<HazardForm>| {
                candidate.weight() <= both_sides.weight()
                    && candidate.shape == Shape::Steady
                    && !candidate.drawbacks.contains(&Drawback::OtherMessage)
            };
            let at = hazard.iter().take_while(|candidate| is_better(candidate)).count();
            hazard.insert(at, both_sides);
        }
        let protection = messages.into_iter().map(|message| (message.key, message.protection)).collect();
        let mut findings = Self { turn, hazard, protection, certainty: [Certainty::NotFound; 3] };
        findings.certainty = Action::ALL.map(|action| findings.certainty_of(action, timeline));
        findings
    }

    fn certainty_of(&self, action: Action, timeline: &Timeline) -> Certainty {
        let without = if timeline.count(action) >= ENOUGH_WITHOUT {
            Certainty::NotVisible
        } else {
            Certainty::NotFound
        };
        let at = action as usize;
        let turn = self.turn.first();
        match action {
            Action::Left | Action::Right => turn.map_or(without, |turn| {
                let is_weak =
                    turn.shape == Shape::Momentary || turn.drawbacks.contains(&Drawback::TwoMessages);
                certainty(turn.followed[at], is_weak)
            }),
            Action::Hazard => self.hazard.first().map_or(without, |hazard| {
                let is_far = hazard.drawbacks.contains(&Drawback::OtherMessage);
                certainty(hazard.followed[at], hazard.shape == Shape::Momentary || is_far)
            }),
        }
    }

    /// The certainty of an action.
    pub fn certainty(&self, action: Action) -> Certainty {
        self.certainty[action as usize]
    }

    /// True if both sides are sure, so that a configuration can be written.
    pub fn is_usable(&self) -> bool {
        [Action::Left, Action::Right].iter().all(|side| self.certainty(*side) == Certainty::Sure)
    }

    /// The candidate for the hazard lights that may be used; `None` when none is sure.
    pub fn sure_hazard(&self) -> Option<&Candidate<HazardForm>> {
        self.hazard.first().filter(|_| self.certainty(Action::Hazard) == Certainty::Sure)
    }
}

fn certainty((count, of): (usize, usize), is_weak: bool) -> Certainty {
    let enough = if is_weak { ENOUGH_IF_WEAK } else { ENOUGH };
    if count >= enough && count * 5 >= of * 3 { Certainty::Sure } else { Certainty::Unsure }
}

/// The hazard lights as both sides of the turn indicators; `None` when those do not show them.
fn both_sides(turn: &Candidate<TurnForm>) -> Option<Candidate<HazardForm>> {
    turn.form.shows_hazard().then(|| Candidate {
        form: HazardForm::BothSides,
        shape: turn.shape,
        followed: turn.followed,
        drawbacks: turn.drawbacks.clone(),
    })
}
