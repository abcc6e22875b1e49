//! Evaluates the sources of both reports: reads signals, advances state machines and fuses the sources of
//! each report.

use super::binding::{
    BothOn, HazardBinding, HazardSource, LightsBinding, SidePair, StateBinding, TurnBinding, TurnSource,
};
use super::fusion::{Disagreement, Fusion, turn_codes_agree};
use super::lamp::{Lamp, LampFindings};
use super::stalk::button::HazardToggle;
use super::stalk::tap::TapHold;
use super::stalk::{MomentaryStalk, StalkPosition};
use super::state::{HazardCode, Judged, Sides, StateMachine, TurnCode, UnavailableReason};
use super::warning::{Fallback, LampWarning, Warnings};
use can_signal::can::{Bus, ReceiveTime};
use can_signal::validation::observation::{MissingReason, Observations};
use can_signal::validation::requirement::Unmet;
use can_signal::validation::table::{Role, SignalIndex};
use can_signal::validation::unusable::Unusable;
use gateway_base::time::{MonoTime, Now};

/// Binding, observations and buses at one instant.
#[derive(Debug, Clone, Copy)]
pub struct LightsContext<'a> {
    /// Compiled binding of the lights.
    pub binding: &'a LightsBinding,
    /// Last values of the bound signals.
    pub observations: &'a Observations,
    /// Requirement of the profile that is not met; `None` = all are met.
    pub unmet: Option<&'a Unmet>,
    /// Buses that carry the signals.
    pub buses: &'a [Bus],
    /// Time of the evaluation.
    pub now: Now,
}

impl LightsContext<'_> {
    /// Reads and checks a signal.
    pub fn judge<T: Copy>(self, role: &Role<T>) -> Judged<T> {
        let table = &self.binding.table;
        Ok(self.observations.defined(table, role, self.buses, self.now.mono)?)
    }

    /// Returns the receive time of the condition's signal if the source applies; `None` without a condition.
    fn judge_condition(
        self,
        condition: Option<&Role<bool>>,
    ) -> Result<Option<ReceiveTime>, UnavailableReason> {
        let Some(role) = condition else { return Ok(None) };
        let (is_on, received) = self.judge(role)?;
        let raw = self.observations.last(role.signal).map_or(0, |last| last.raw);
        if is_on { Ok(Some(received)) } else { Err(UnavailableReason::NotSelected(role.signal, raw)) }
    }

    /// Returns both sides of a pair, with the later receive time.
    fn judge_pair(self, pair: &SidePair) -> Judged<Sides> {
        match (self.judge(&pair.left), self.judge(&pair.right)) {
            (Ok((left, since)), Ok((right, received))) => Ok((Sides { left, right }, since.newest(received))),
            (Err(reason), Ok(_)) | (Ok(_), Err(reason)) => Err(reason),
            (Err(first), Err(second)) => Err(graver(first, second)),
        }
    }

    /// Passes an input to a state machine and returns its state; `unknown` is the reason while the state is
    /// unknown.
    fn track<M: StateMachine>(
        self,
        machine: &mut M,
        input: Judged<M::Input>,
        unknown: UnavailableReason,
    ) -> Judged<M::State> {
        let now = self.now.mono;
        match input {
            Ok((input, received)) => {
                // A frame received now is new; processing it twice does no harm.
                if received.at == now {
                    machine.observe(Some(input), now);
                } else {
                    machine.advance(now);
                }
                machine.state().map(|state| (state, received)).ok_or(unknown)
            }
            Err(reason) => {
                machine.observe(None, now);
                Err(reason)
            }
        }
    }

    /// Returns the state of a steady signal, whose taps may be held.
    fn hold_taps(
        self,
        tap: Option<&mut TapHold>,
        state: Judged<TurnCode>,
        signal: SignalIndex,
    ) -> Judged<TurnCode> {
        match tap {
            Some(tap) => self.track(tap, state, UnavailableReason::Settling(signal)),
            None => state,
        }
    }

    /// Returns the state of a pair, where both sides on at once may be undefined.
    fn pair_state(self, pair: &SidePair, state: Judged<TurnCode>) -> Judged<TurnCode> {
        let is_undefined = |(code, _)| code == TurnCode::Both && pair.both == BothOn::Undefined;
        if !state.is_ok_and(is_undefined) {
            return state;
        }
        let raw = |signal| self.observations.last(signal).map_or(0, |last| last.raw);
        let signals = [pair.left.signal, pair.right.signal];
        Err(UnavailableReason::BothOn(signals.map(|signal| (signal, raw(signal)))))
    }

    /// Returns off, as of now, for lights that are not fitted.
    fn not_fitted<T>(self, off: T) -> FusedState<T> {
        let received = ReceiveTime { at: self.now.mono, stamp: self.now.wall };
        FusedState { state: Ok((off, received)), source: 0, warnings: Warnings::default() }
    }
}

/// State machines and contradictions of the sources of both reports.
#[derive(Debug, Clone)]
pub struct SourceMemory {
    /// `None` if the binding has no sources.
    turn: Option<SourceGroup<TurnReader, TurnCode>>,
    /// `None` if the binding has no sources.
    hazard: Option<SourceGroup<HazardReader, HazardCode>>,
}

/// Fused states of both reports.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)] // their names say it
pub struct SourceStates {
    pub turn: FusedState<TurnCode>,
    pub hazard: FusedState<HazardCode>,
}

/// Fused state of the sources of one report.
#[derive(Debug, Clone, Copy)]
pub struct FusedState<T> {
    /// The state, or the reason why it is unavailable.
    pub state: Judged<T>,
    /// Position of the deciding source in the profile.
    pub source: usize,
    /// Irregularities of the sources.
    pub warnings: Warnings,
}

const HAZARD_OFF: HazardCode = HazardCode { active: false, reason: None };

impl SourceMemory {
    /// Creates sources before any frame.
    pub fn new(binding: &LightsBinding) -> Self {
        let agree = |one: HazardCode, other: HazardCode| one.active == other.active;
        Self {
            turn: SourceGroup::new(&binding.turn, TurnReader::new, turn_codes_agree),
            hazard: SourceGroup::new(&binding.hazard, HazardReader::new, agree),
        }
    }

    /// Returns the sources of another binding, keeping the memory of sources in both. A source is the same if
    /// it has the same position and settings, and its signals are the same according to `is_same_signal`.
    #[must_use]
    pub fn carried_over(
        &self,
        before: &LightsBinding,
        binding: &LightsBinding,
        is_same_signal: impl Fn(SignalIndex) -> bool,
    ) -> Self {
        let mut carried = Self::new(binding);
        let is_same_turn = |source: &TurnSource| source.signals().all(&is_same_signal);
        let is_same_hazard = |source: &HazardSource| source.signal().is_none_or(&is_same_signal);
        if let (Some(group), Some(was)) = (&mut carried.turn, &self.turn) {
            group.carry_over(was, &before.turn, &binding.turn, is_same_turn);
        }
        if let (Some(group), Some(was)) = (&mut carried.hazard, &self.hazard) {
            group.carry_over(was, &before.hazard, &binding.hazard, is_same_hazard);
        }
        carried
    }

    /// Evaluates every source and fuses the states of each report.
    pub fn evaluate(&mut self, context: LightsContext<'_>) -> SourceStates {
        let (turn, sides) = match &mut self.turn {
            Some(group) => {
                let mut turn = group.evaluate(context, TurnCode::name, TurnReader::evaluate);
                turn.warnings.lamps =
                    group.applicable().find_map(|(source, _)| group.readers[source].warning());
                (turn, group.state_of(|reader| reader.shows_both))
            }
            None if matches!(context.binding.turn, TurnBinding::NotFitted) => {
                let off = context.not_fitted(TurnCode::Off);
                (off, off.state)
            }
            None => (not_visible(), not_visible().state),
        };
        let hazard = match &mut self.hazard {
            Some(group) => group.evaluate(context, HazardCode::name, |reader, context, applies| {
                reader.evaluate(context, applies, sides)
            }),
            None if matches!(context.binding.hazard, HazardBinding::NotFitted) => {
                context.not_fitted(HAZARD_OFF)
            }
            None => not_visible(),
        };
        SourceStates { turn, hazard }
    }

    /// Returns true if a state depends on when frames arrive, not only on their values.
    pub fn observes_frames(&self) -> bool {
        let has_machine = |reader: &TurnReader| match &reader.kind {
            TurnKind::Enumerated(_, tap) | TurnKind::Pair(_, tap) => tap.is_some(),
            TurnKind::Lamps(..) | TurnKind::Stalk(..) => true,
        };
        let is_button = |reader: &HazardReader| matches!(reader, HazardReader::Button(..));
        self.turn.iter().any(|group| group.readers.iter().any(has_machine))
            || self.hazard.iter().any(|group| group.readers.iter().any(is_button))
    }

    /// Returns the next instant at which [`Self::evaluate`] is due without an event.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        let turn = self.turn.iter().flat_map(|group| group.deadlines(TurnReader::next_deadline));
        let hazard = self.hazard.iter().flat_map(|group| group.deadlines(HazardReader::next_deadline));
        turn.chain(hazard).min()
    }
}

fn not_visible<T>() -> FusedState<T> {
    FusedState { state: Err(UnavailableReason::NotVisible), source: 0, warnings: Warnings::default() }
}

/// Sources of one state in the order of the profile.
#[derive(Debug, Clone)]
struct SourceGroup<R, T> {
    readers: Vec<R>,
    conditions: Vec<Option<Role<bool>>>,
    fusion: Fusion<T>,
    /// Last state of each source, stored so that an evaluation does not allocate.
    states: Vec<Judged<T>>,
}

impl<R, T: Copy + PartialEq> SourceGroup<R, T> {
    fn new<S>(binding: &StateBinding<S>, reader: impl Fn(&S) -> R, agree: fn(T, T) -> bool) -> Option<Self> {
        let StateBinding::From(sources) = binding else { return None };
        let fallbacks = sources.list.iter().map(|named| named.is_fallback);
        Some(Self {
            readers: sources.list.iter().map(|named| reader(&named.source)).collect(),
            conditions: sources.list.iter().map(|named| named.condition.clone()).collect(),
            fusion: Fusion::new(fallbacks, sources.disagreement, agree),
            states: vec![Err(UnavailableReason::NotVisible); sources.list.len()],
        })
    }

    /// Keeps the memory of the sources that are the same in two bindings, and the memory of the fusion if all
    /// sources are the same.
    fn carry_over<S: PartialEq>(
        &mut self,
        was: &Self,
        before: &StateBinding<S>,
        binding: &StateBinding<S>,
        has_same_signals: impl Fn(&S) -> bool,
    ) where
        R: Clone,
    {
        let pairs = before.sources().iter().zip(binding.sources());
        let alike: Vec<_> = pairs.map(|(old, new)| old == new && has_same_signals(&new.source)).collect();
        for ((own, reader), alike) in self.readers.iter_mut().zip(&was.readers).zip(&alike) {
            if *alike {
                own.clone_from(reader);
            }
        }
        if before == binding && alike.iter().all(|alike| *alike) {
            self.fusion.clone_from(&was.fusion);
        }
    }

    /// Evaluates every source and fuses the states. `read` receives the reason why a source must not be read:
    /// its condition is off or unknown.
    fn evaluate(
        &mut self,
        context: LightsContext<'_>,
        name: fn(T) -> &'static str,
        mut read: impl FnMut(&mut R, LightsContext<'_>, Result<(), UnavailableReason>) -> Judged<T>,
    ) -> FusedState<T> {
        for ((reader, condition), state) in
            self.readers.iter_mut().zip(&self.conditions).zip(&mut self.states)
        {
            let applies = context.judge_condition(condition.as_ref());
            let since = applies.ok().flatten();
            let read = read(reader, context, applies.map(|_| ()));
            *state =
                read.map(|(value, received)| (value, since.map_or(received, |since| received.newest(since))));
        }
        let values =
            self.states.iter().map(|state| applicable(*state).map(|state| state.map(|(value, _)| value)));
        let deciding = self.fusion.update(values, context.now.mono);
        let names = |found: Disagreement<T>| Disagreement {
            chosen: found.chosen,
            chosen_value: name(found.chosen_value),
            other: found.other,
            other_value: name(found.other_value),
        };
        let disagreement = self.fusion.disagreements().next().map(names);
        // If no source applies, the first gives the reason.
        let source = deciding.unwrap_or(0);
        let fallback = match self.applicable().next() {
            Some((first, Err(reason))) if source > first => Some(Fallback { by: source, reason }),
            Some(_) | None => None,
        };
        let warnings = Warnings { lamps: None, fallback, disagreement };
        let state = self.states.get(source).copied().unwrap_or(Err(UnavailableReason::NotVisible));
        FusedState { state, source, warnings }
    }

    /// Returns the sources that apply, with their states.
    fn applicable(&self) -> impl Iterator<Item = (usize, Judged<T>)> {
        self.states.iter().enumerate().filter_map(|(source, state)| Some((source, applicable(*state)?)))
    }

    /// Returns the state of the sources for which `is_included` holds. If none of them applies, the first
    /// gives the reason.
    fn state_of(&self, is_included: impl Fn(&R) -> bool) -> Judged<T> {
        let is_included = |source: usize| is_included(&self.readers[source]);
        let states = self.applicable().filter(|(source, _)| is_included(*source));
        let chosen = self.fusion.choose(states.map(|(source, state)| (source, state.is_ok())));
        let source = chosen.or_else(|| (0..self.states.len()).find(|source| is_included(*source)));
        source.map_or(Err(UnavailableReason::NotVisible), |source| self.states[source])
    }

    fn deadlines(&self, deadline: fn(&R) -> Option<MonoTime>) -> impl Iterator<Item = MonoTime> {
        self.readers.iter().filter_map(deadline).chain(self.fusion.next_deadline())
    }
}

/// Returns the state of a source; `None` if the source does not apply.
fn applicable<T>(state: Judged<T>) -> Option<Judged<T>> {
    (!matches!(state, Err(UnavailableReason::NotSelected(..)))).then_some(state)
}

/// A turn source with its state machine.
#[derive(Debug, Clone)]
struct TurnReader {
    shows_both: bool,
    kind: TurnKind,
}

#[derive(Debug, Clone)]
enum TurnKind {
    Enumerated(Role<TurnCode>, Option<TapHold>),
    Pair(SidePair, Option<TapHold>),
    Lamps(SidePair, Box<Lamp>),
    Stalk(Role<StalkPosition>, Box<MomentaryStalk>),
}

impl TurnReader {
    fn new(source: &TurnSource) -> Self {
        let kind = match source {
            TurnSource::Enumerated { role, tap_hold } => {
                TurnKind::Enumerated(role.clone(), tap_hold.map(TapHold::new))
            }
            TurnSource::Pair { pair, tap_hold } => TurnKind::Pair(pair.clone(), tap_hold.map(TapHold::new)),
            TurnSource::Lamps { pair, settings, .. } => {
                TurnKind::Lamps(pair.clone(), Box::new(Lamp::new(*settings)))
            }
            TurnSource::Stalk { role, settings } => {
                TurnKind::Stalk(role.clone(), Box::new(MomentaryStalk::new(*settings)))
            }
        };
        Self { shows_both: source.shows_both(), kind }
    }

    fn evaluate(
        &mut self,
        context: LightsContext<'_>,
        applies: Result<(), UnavailableReason>,
    ) -> Judged<TurnCode> {
        match &mut self.kind {
            TurnKind::Enumerated(role, tap) => {
                let state = applies.and_then(|()| context.judge(role));
                context.hold_taps(tap.as_mut(), state, role.signal)
            }
            TurnKind::Pair(pair, tap) => {
                let sides = applies.and_then(|()| context.judge_pair(pair));
                let code = sides.map(|(sides, received)| (TurnCode::from_sides(sides), received));
                context.hold_taps(tap.as_mut(), context.pair_state(pair, code), pair.left.signal)
            }
            TurnKind::Lamps(pair, lamp) => {
                let watching = UnavailableReason::WatchingLamps([pair.left.signal, pair.right.signal]);
                let lamps = applies.and_then(|()| context.judge_pair(pair));
                if let Err(UnavailableReason::Signal(Unusable::Absent(_, MissingReason::Link(_)))) = lamps {
                    lamp.forget();
                }
                let state = context.track(lamp.as_mut(), lamps, watching);
                context.pair_state(pair, state)
            }
            TurnKind::Stalk(role, stalk) => {
                let settling = UnavailableReason::Settling(role.signal);
                let position = applies.and_then(|()| context.judge(role));
                context.track(stalk.as_mut(), position, settling)
            }
        }
    }

    fn warning(&self) -> Option<LampWarning> {
        let TurnKind::Lamps(pair, lamp) = &self.kind else { return None };
        let findings = lamp.findings();
        let lamps = [pair.left.signal, pair.right.signal];
        (findings != LampFindings::default()).then_some(LampWarning { lamps, findings })
    }

    fn next_deadline(&self) -> Option<MonoTime> {
        match &self.kind {
            TurnKind::Enumerated(_, tap) | TurnKind::Pair(_, tap) => tap.as_ref()?.next_deadline(),
            TurnKind::Lamps(_, lamp) => lamp.next_deadline(),
            TurnKind::Stalk(_, stalk) => stalk.next_deadline(),
        }
    }
}

/// Returns the reason to report first: a fault, then an invalid value, then "not available", and last a sleep
/// of the bus or a first value that is awaited.
fn graver(first: UnavailableReason, second: UnavailableReason) -> UnavailableReason {
    let gravity = |reason: UnavailableReason| {
        let is_told = matches!(reason, UnavailableReason::Signal(Unusable::NotAvailable(..)));
        (reason.kind(), is_told, !reason.is_sleep() && !reason.is_awaited(false))
    };
    if gravity(second) > gravity(first) { second } else { first }
}

/// A hazard source with its state machine.
#[derive(Debug, Clone)]
enum HazardReader {
    BothSides,
    Signal(Role<HazardCode>),
    Button(Role<bool>, HazardToggle),
}

impl HazardReader {
    fn new(source: &HazardSource) -> Self {
        match source {
            HazardSource::BothSides => Self::BothSides,
            HazardSource::Signal { role, .. } => Self::Signal(role.clone()),
            HazardSource::Button { role, max_gap, startup_delay } => {
                Self::Button(role.clone(), HazardToggle::new(*max_gap, *startup_delay))
            }
        }
    }

    fn evaluate(
        &mut self,
        context: LightsContext<'_>,
        applies: Result<(), UnavailableReason>,
        sides: Judged<TurnCode>,
    ) -> Judged<HazardCode> {
        let code = |active| HazardCode { active, reason: None };
        match self {
            Self::BothSides => {
                let (sides, received) = applies.and(sides)?;
                Ok((code(sides == TurnCode::Both), received))
            }
            Self::Signal(role) => applies.and_then(|()| context.judge(role)),
            Self::Button(role, toggle) => {
                let settling = UnavailableReason::Settling(role.signal);
                let pressed = applies.and_then(|()| context.judge(role));
                let state = context.track(toggle, pressed, settling);
                state.map(|(on, received)| (code(on), received))
            }
        }
    }

    fn next_deadline(&self) -> Option<MonoTime> {
        match self {
            Self::BothSides | Self::Signal(_) => None,
            Self::Button(_, toggle) => toggle.next_deadline(),
        }
    }
}
