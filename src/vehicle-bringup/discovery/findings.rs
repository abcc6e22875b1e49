//! The result of a discovery: the best candidates, their rivals, and the remaining doubts.

use std::collections::BTreeMap;

use derive_more::Display;

use super::candidate::{Drawback, FoundSignal, HazardForm, SignalCandidate, TurnForm};
use super::capture::{Capture, MessageKey};
use super::protection::FoundProtection;
use super::response::ResponseShape;
use super::search::{self, Responding};
use super::timeline::{ActionTimeline, DriverAction};
use super::two_messages;
use super::widening::{widen_hazard, widen_turn};

/// Candidates, with the best of each list first.
#[derive(Debug, Clone, Default)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct DiscoveryFindings {
    pub turn: Vec<SignalCandidate<TurnForm>>,
    pub hazard: Vec<SignalCandidate<HazardForm>>,
    /// Counter and checksum of each message with candidates.
    pub protection: BTreeMap<MessageKey, FoundProtection>,
    /// The certainty of each of [`DriverAction::ALL`].
    pub certainty: [Certainty; 3],
    /// Reason why the turn indicators are unsure, however often they followed.
    pub turn_doubt: Option<Doubt>,
    /// Reason why the hazard lights are unsure.
    pub hazard_doubt: Option<Doubt>,
    /// Signal that follows both sides, but was left out because it changed during [`DriverMark::Quiet`], like
    /// a lever that is moved then; `None` if both sides are sure.
    ///
    /// [`DriverMark::Quiet`]: can_signal::can::DriverMark::Quiet
    pub moved_at_rest: Option<TurnForm>,
}

/// A reason why followed requests are not sufficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
#[allow(missing_docs)] // the texts say it
pub enum Doubt {
    #[display("{_0} always changed together with it: one may be of a checksum or counter")]
    Twin(FoundSignal),
    #[display("it may be a part of a checksum, which another candidate is not")]
    Checksum,
    #[display("another signal followed as well, at other moments")]
    Disputed,
}

/// The certainty of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Display)]
pub enum Certainty {
    /// Enough requests were followed.
    #[display("found")]
    Sure,
    /// A signal was found, but too few requests were followed, or too many were not.
    #[display("not sure")]
    Unsure,
    /// No signal followed the requests, so far.
    #[default]
    #[display("not found")]
    NotFound,
    /// No signal follows the requests, after enough of them.
    #[display("not visible on this bus")]
    NotVisible,
}

/// Number of requests that a direct signal of the state must follow.
const ENOUGH: usize = 2;
/// Number of requests that a signal must follow if chance may imitate it.
const ENOUGH_IF_WEAK: usize = 3;
/// Number of requests after which a signal is considered absent if none followed.
const ENOUGH_WITHOUT: usize = 4;

impl DiscoveryFindings {
    /// Ranks all signals by how well they follow the requests.
    pub fn new(capture: &Capture, timeline: &ActionTimeline) -> Self {
        let mut findings = Self::search(capture, timeline);
        if !findings.is_usable() {
            let without_quiet = ActionTimeline { quiet: Vec::new(), ..timeline.clone() };
            let others = Self::search(capture, &without_quiet);
            findings.moved_at_rest = others.turn.first().filter(|_| others.is_usable()).map(|turn| turn.form);
        }
        findings
    }

    fn search(capture: &Capture, timeline: &ActionTimeline) -> Self {
        let messages = search::responding(capture, timeline);
        let mut turn = search::turn(&messages, timeline);
        turn.extend(two_messages::candidates(&messages, timeline));
        turn.sort_by_key(SignalCandidate::weight);
        let signals = turn.first().map(|turn| turn.form.signals()).unwrap_or_default();
        let turn_messages: Vec<_> = signals.iter().map(|signal| signal.message).collect();
        let mut hazard = search::hazard(&messages, &turn_messages, timeline);
        let is_shown =
            hazard_certainty(&hazard) == Some(Certainty::Sure) && hazard_doubt(&messages, &hazard).is_none();
        if !is_shown && let Some(at) = turn.iter().position(shows_all) {
            // If nothing else shows the hazard lights, lamps that show them are better than a lever that does
            // not.
            turn[..=at].rotate_right(1);
        }
        if let Some(turn) = turn.first_mut() {
            widen_turn(&messages, &mut turn.form);
        }
        if let Some(hazard) = hazard.first_mut() {
            widen_hazard(&messages, &mut hazard.form);
        }
        if let Some(both_sides) = turn.first().and_then(both_sides) {
            // A lasting signal next to the indicators' signals shows the hazard lights directly.
            let is_better = |candidate: &SignalCandidate<HazardForm>| {
                candidate.weight() <= both_sides.weight()
                    && candidate.shape == ResponseShape::Steady
                    && !candidate.is_suspect()
                    && !candidate.drawbacks.contains(&Drawback::OtherMessage)
            };
            let at = hazard.iter().take_while(|candidate| is_better(candidate)).count();
            hazard.insert(at, both_sides);
        }
        let is_open = DriverAction::ALL.map(|action| {
            timeline.count(action) < ENOUGH_WITHOUT || search::is_open(&messages, timeline, action)
        });
        let turn_doubt = turn_doubt(&messages, &turn);
        let hazard_doubt = hazard_doubt(&messages, &hazard);
        let protection = messages.into_iter().map(|message| (message.key, message.protection)).collect();
        let certainty = [Certainty::NotFound; 3];
        let mut findings =
            Self { turn, hazard, protection, certainty, turn_doubt, hazard_doubt, moved_at_rest: None };
        findings.certainty = DriverAction::ALL.map(|action| findings.certainty_of(action, is_open));
        findings
    }

    fn certainty_of(&self, action: DriverAction, is_open: [bool; 3]) -> Certainty {
        // Lamps that show the hazard lights may still become sure.
        let may_show = |turn: &SignalCandidate<TurnForm>| turn.form.shows_hazard() && !turn.is_suspect();
        let is_open =
            is_open[action as usize] || (action == DriverAction::Hazard && self.turn.iter().any(may_show));
        let without = if is_open { Certainty::NotFound } else { Certainty::NotVisible };
        let found = match action {
            DriverAction::Left | DriverAction::Right => {
                let is_disputed = is_disputed(&self.turn);
                self.turn.first().map_or(without, |turn| turn_certainty(turn, action, is_disputed))
            }
            DriverAction::Hazard => hazard_certainty(&self.hazard).unwrap_or(without),
        };
        if self.doubt(action).is_some() { found.max(Certainty::Unsure) } else { found }
    }

    /// Returns the reason why an action is unsure, however often its requests were followed.
    pub fn doubt(&self, action: DriverAction) -> Option<Doubt> {
        match action {
            DriverAction::Left | DriverAction::Right => self.turn_doubt,
            DriverAction::Hazard => self.hazard_doubt,
        }
    }

    /// Returns the certainty of an action.
    pub fn certainty(&self, action: DriverAction) -> Certainty {
        self.certainty[action as usize]
    }

    /// Returns the actions to repeat: the unsure ones, or all if the hazard lights are unsure, since a
    /// mistake with a side may hide lamps that show them.
    pub fn unsure(&self) -> Vec<DriverAction> {
        let is_unsure = |action: &DriverAction| {
            matches!(self.certainty(*action), Certainty::Unsure | Certainty::NotFound)
        };
        if is_unsure(&DriverAction::Hazard) {
            return DriverAction::ALL.to_vec();
        }
        DriverAction::ALL.into_iter().filter(is_unsure).collect()
    }

    /// Returns true if both sides are sure, so that a configuration can be written.
    pub fn is_usable(&self) -> bool {
        [DriverAction::Left, DriverAction::Right].iter().all(|side| self.certainty(*side) == Certainty::Sure)
    }

    /// Returns the usable candidate for the hazard lights; `None` if none is sure.
    pub fn sure_hazard(&self) -> Option<&SignalCandidate<HazardForm>> {
        self.hazard.first().filter(|_| self.certainty(DriverAction::Hazard) == Certainty::Sure)
    }
}

/// Returns the certainty of a side. Each unfollowed request requires one more followed request, and a signal
/// that chance may imitate requires more of them.
fn turn_certainty(turn: &SignalCandidate<TurnForm>, side: DriverAction, is_disputed: bool) -> Certainty {
    let is_weak =
        is_disputed || turn.is_suspect() || (turn.shape == ResponseShape::Momentary && turn.missed() > 0);
    let [left, right, _] = turn.followed;
    let count = turn.followed[side as usize].count;
    if turn.drawbacks.contains(&Drawback::TwoMessages) {
        // Among all pairs of bits on a bus, some follow by chance.
        return certainty(count, ENOUGH_IF_WEAK + 1 + turn.missed());
    }
    let of_both = certainty(left.count + right.count, 2 * enough(is_weak) + turn.missed_sides());
    certainty(count, enough(is_weak)).max(of_both)
}

fn turn_doubt(messages: &[Responding<'_>], turn: &[SignalCandidate<TurnForm>]) -> Option<Doubt> {
    let form = &turn.first()?.form;
    doubt(messages, turn, &form.telling_bits(), form.shows_hazard())
}

fn hazard_doubt(messages: &[Responding<'_>], hazard: &[SignalCandidate<HazardForm>]) -> Option<Doubt> {
    let bits = |signal: FoundSignal| (signal.message, signal.bits());
    doubt(messages, hazard, hazard.first()?.form.signal().map(bits).as_slice(), false)
}

/// Returns the doubt about the first candidate, whose bits are `bits`.
fn doubt<F>(
    messages: &[Responding<'_>],
    candidates: &[SignalCandidate<F>],
    bits: &[(MessageKey, Vec<u16>)],
    shows_all: bool,
) -> Option<Doubt> {
    let (first, others) = candidates.split_first()?;
    let is_better = |other: &SignalCandidate<F>| {
        !other.is_like_checksum() && other.missed_sides() <= first.missed_sides()
    };
    if let Some(twin) = search::twin(messages, bits, shows_all) {
        Some(Doubt::Twin(twin))
    } else if first.is_like_checksum() && others.iter().any(is_better) {
        Some(Doubt::Checksum)
    } else if others.iter().any(|other| first.is_mostly_disputed_by(other)) {
        Some(Doubt::Disputed)
    } else {
        None
    }
}

/// Returns true if another candidate is as good as the first and responds at other times.
fn is_disputed<F>(candidates: &[SignalCandidate<F>]) -> bool {
    candidates.split_first().is_some_and(|(first, others)| others.iter().any(|it| first.is_disputed_by(it)))
}

/// Returns the certainty of the hazard lights; `None` without a candidate. A signal that chance may imitate
/// must not follow other requests, and needs one more request if another message has such a signal too.
fn hazard_certainty(candidates: &[SignalCandidate<HazardForm>]) -> Option<Certainty> {
    let (hazard, others) = candidates.split_first()?;
    let is_elsewhere = hazard.drawbacks.contains(&Drawback::OtherMessage);
    let is_weak = is_disputed(candidates)
        || hazard.shape == ResponseShape::Momentary
        || is_elsewhere
        || hazard.is_suspect();
    let message =
        |candidate: &SignalCandidate<HazardForm>| candidate.form.signal().map(|signal| signal.message);
    let is_rival =
        |other: &SignalCandidate<HazardForm>| message(other) != message(hazard) && hazard.has_rival(other);
    let more = usize::from(is_elsewhere && others.iter().any(is_rival));
    let followed = hazard.followed[DriverAction::Hazard as usize];
    let missed = if is_weak { hazard.missed() } else { followed.missed() };
    Some(certainty(followed.count, enough(is_weak) + more + missed))
}

/// Returns true if a candidate shows both sides and the hazard lights, all of them surely.
fn shows_all(turn: &SignalCandidate<TurnForm>) -> bool {
    let is_sure = |action: &DriverAction| turn_certainty(turn, *action, false) == Certainty::Sure;
    turn.form.shows_hazard() && !turn.is_suspect() && DriverAction::ALL.iter().all(is_sure)
}

fn enough(is_weak: bool) -> usize {
    if is_weak { ENOUGH_IF_WEAK } else { ENOUGH }
}

fn certainty(followed: usize, enough: usize) -> Certainty {
    if followed >= enough { Certainty::Sure } else { Certainty::Unsure }
}

/// Returns the hazard lights as both sides of the turn indicators; `None` when these do not show them.
fn both_sides(turn: &SignalCandidate<TurnForm>) -> Option<SignalCandidate<HazardForm>> {
    turn.form.shows_hazard().then(|| SignalCandidate {
        form: HazardForm::BothSides,
        shape: turn.shape,
        followed: turn.followed,
        drawbacks: turn.drawbacks.clone(),
        times: turn.times.clone(),
    })
}
