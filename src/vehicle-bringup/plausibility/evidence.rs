//! Evidence of all frames for one profile.

use super::message::MessageEvidence;
use super::states::{ShownState, StateHistory};
use can_signal::can::{BusIndex, Frame, IdMatch};
use can_signal::dbc::model::Database;
use can_signal::validation::meaning::Meaning;
use can_signal::validation::requirement::{RequirementStates, Unmet};
use can_signal::validation::table::{MessageIndex, Role, SignalIndex, SignalTable};
use gateway_base::time::MonoTime;
use gateway_core::vehicle_lights::binding::{BothOn, HazardSource, LightsBinding, SidePair, TurnSource};
use gateway_core::vehicle_lights::stalk::StalkPosition;
use gateway_core::vehicle_lights::state::{Sides, TurnCode};

/// The evidence for a profile, frame by frame.
#[derive(Debug, Clone)]
pub struct ProfileEvidence {
    lights: LightsBinding,
    /// Messages of the lights, then messages of V2I alone.
    pub messages: Vec<MessageEvidence>,
    /// States of each turn source, in the order of the binding.
    pub turn: Vec<StateHistory>,
    /// States of each hazard source, in the order of the binding; without frames if both turn sides show it.
    pub hazard: Vec<StateHistory>,
    /// States of the requirements of the profile.
    requirements: RequirementStates,
    /// Last raw value of each signal of the lights.
    raw: Vec<Option<i128>>,
}

impl ProfileEvidence {
    /// Creates the evidence before any frame; `databases` has one entry for each bus.
    pub fn new(lights: &LightsBinding, v2i: &SignalTable, databases: &[&Database]) -> Self {
        // A message of both tables is listed once.
        let others = v2i.messages.iter().filter(|message| !lights.table.messages.contains(message));
        let messages = lights.table.messages.iter().chain(others).map(|bound| {
            let database = databases.get(usize::from(bound.bus.0));
            let of_database = |database: &&Database| {
                database.messages.iter().find(|message| message.id == bound.ids.described()).cloned()
            };
            MessageEvidence::new(bound, database.and_then(of_database).as_ref())
        });
        Self {
            messages: messages.collect(),
            turn: vec![StateHistory::default(); lights.turn.sources().len()],
            hazard: vec![StateHistory::default(); lights.hazard.sources().len()],
            requirements: RequirementStates::new(&lights.requirements),
            raw: vec![None; lights.table.signals.len()],
            lights: lights.clone(),
        }
    }

    /// Returns the binding to which the evidence belongs.
    pub fn lights(&self) -> &LightsBinding {
        &self.lights
    }

    /// Returns the first unmet requirement of the profile, contradicted requirements first.
    pub fn unmet(&self) -> Option<Unmet> {
        self.requirements.unmet()
    }

    /// Returns the buses and identifiers of the messages that are bound or required.
    pub fn ids(&self) -> impl Iterator<Item = (BusIndex, IdMatch)> {
        let required = self.lights.requirements.iter().map(|required| (required.bus, required.ids));
        self.messages.iter().map(|message| (message.bound.bus, message.bound.ids)).chain(required)
    }

    /// Adds the next frame of a bus. Times must not run backwards.
    pub fn frame(&mut self, bus: BusIndex, frame: &Frame, now: MonoTime) {
        self.requirements.frame_arrived(&self.lights.requirements, bus, frame, true, now);
        let is_bound = |message: &MessageEvidence| {
            message.bound.bus == bus
                && message.bound.ids.contains(frame.id())
                && message.bound.format.is_none_or(|format| format == frame.format())
        };
        let Some(position) = self.messages.iter().position(is_bound) else { return };
        let is_usable = self.messages[position].frame(frame, now);
        if !is_usable || position >= self.lights.table.messages.len() {
            return;
        }
        let message = MessageIndex(position);
        for (signal, raw) in self.lights.table.signals.iter().zip(&mut self.raw) {
            if signal.message == message
                && signal.codec.needed_length() <= frame.data().len()
                && signal.codec.is_present(frame.padded())
            {
                *raw = Some(signal.codec.value(frame.padded()));
            }
        }
        let carries = |signal: SignalIndex| self.lights.table.signals[signal.0].message == message;
        for (source, states) in self.lights.turn.sources().iter().zip(&mut self.turn) {
            if source.source.signals().any(carries)
                && let Some(shown) = turn_shown(&source.source, &self.raw)
            {
                states.frame(shown, now);
            }
        }
        for (source, states) in self.lights.hazard.sources().iter().zip(&mut self.hazard) {
            if !source.source.signal().is_some_and(carries) {
                continue;
            }
            let shown = match &source.source {
                HazardSource::BothSides => None,
                HazardSource::Signal { role, .. } => shown(role, &self.raw, |code| on_off(code.active)),
                HazardSource::Button { role, .. } => shown(role, &self.raw, on_off),
            };
            if let Some(shown) = shown {
                states.frame(shown, now);
            }
        }
    }

    /// Returns true if any turn source has shown this state.
    pub fn has_seen_turn(&self, state: TurnCode) -> bool {
        self.turn.iter().any(|states| states.has_seen(state))
    }

    /// Returns true if any source has shown more than one state.
    pub fn has_changed(&self) -> bool {
        self.turn.iter().chain(&self.hazard).any(|states| states.changes > 0)
    }

    /// Returns true if the hazard lights were on, or their button was pressed.
    pub fn has_seen_hazard(&self) -> bool {
        let mut sources = self.lights.hazard.sources().iter();
        let has_both_sides = sources.any(|named| matches!(named.source, HazardSource::BothSides));
        self.hazard.iter().any(|states| states.has_seen(TurnCode::Both))
            || has_both_sides && self.has_seen_turn(TurnCode::Both)
    }
}

fn on_off(on: bool) -> TurnCode {
    if on { TurnCode::Both } else { TurnCode::Off }
}

/// Returns the state that a source shows; `None` until all its signals have been received.
fn turn_shown(source: &TurnSource, raw: &[Option<i128>]) -> Option<ShownState> {
    match source {
        TurnSource::Enumerated { role, .. } => shown(role, raw, |code| code),
        TurnSource::Pair { pair, .. } | TurnSource::Lamps { pair, .. } => pair_shown(pair, raw),
        TurnSource::Stalk { role, .. } => shown(role, raw, StalkPosition::side),
    }
}

fn pair_shown(pair: &SidePair, raw: &[Option<i128>]) -> Option<ShownState> {
    let sides = [&pair.left, &pair.right].map(|role| raw[role.signal.0].map(|raw| role.values.meaning(raw)));
    let [Some(left), Some(right)] = sides else { return None };
    Some(match (left, right) {
        (Meaning::Defined(true), Meaning::Defined(true)) if pair.both == BothOn::Undefined => {
            ShownState::Undefined
        }
        (Meaning::Defined(left), Meaning::Defined(right)) => {
            ShownState::State(TurnCode::from_sides(Sides { left, right }))
        }
        (Meaning::Undefined, _) | (_, Meaning::Undefined) => ShownState::Undefined,
        _ => ShownState::Unusable,
    })
}

fn shown<T: Copy>(role: &Role<T>, raw: &[Option<i128>], state: impl Fn(T) -> TurnCode) -> Option<ShownState> {
    Some(match role.values.meaning(raw[role.signal.0]?) {
        Meaning::Defined(value) => ShownState::State(state(value)),
        Meaning::Undefined => ShownState::Undefined,
        Meaning::NotAvailable | Meaning::Fault => ShownState::Unusable,
    })
}
