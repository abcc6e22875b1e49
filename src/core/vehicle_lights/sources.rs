//! What each source of a state says now: its signals judged, what it remembers moved on, and all of
//! a report's sources made into one.

use super::binding::{
    BothOn, HazardBinding, HazardSource, LightsBinding, SidePair, Sources, TurnBinding, TurnSource,
};
use super::fusion::{Disagreement, Fusion, Statement, turn_codes_agree};
use super::lamp::{Lamp, LampFindings};
use super::stalk::button::HazardToggle;
use super::stalk::{MomentaryStalk, StalkPosition};
use super::state::{HazardCode, TurnCode};
use super::state::{Judged, UnavailableReason};
use super::warning::{Contradiction, Fallback, LampWarning, Warnings};
use crate::core::can::bus::{Bus, Received};
use crate::core::time::{MonoTime, Now};
use crate::core::validation::meaning::Meaning;
use crate::core::validation::observation::{Observations, Reading};
use crate::core::validation::table::Role;

/// All there is to judge by, at one moment.
#[derive(Debug, Clone, Copy)]
pub struct LightsContext<'a> {
    /// What the profile binds.
    pub binding: &'a LightsBinding,
    /// The last values.
    pub observations: &'a Observations,
    /// The buses they came over.
    pub buses: &'a [Bus],
    /// The moment.
    pub now: Now,
}

impl LightsContext<'_> {
    /// The last value of a signal, judged.
    pub fn read<T: Copy>(self, role: &Role<T>) -> Reading<T> {
        self.observations.read(&self.binding.table, role, self.buses, self.now.mono)
    }

    fn judge<T: Copy>(self, role: &Role<T>) -> Judged<T> {
        let signal = role.signal;
        match self.read(role) {
            Reading::Missing(why) => Err(UnavailableReason::Absent(signal, why)),
            Reading::Observed { meaning, raw, received } => match meaning {
                Meaning::Defined(value) => Ok((value, received)),
                Meaning::NotAvailable => Err(UnavailableReason::NotAvailable(signal, raw)),
                Meaning::Undefined => Err(UnavailableReason::Undefined(signal, raw)),
                Meaning::Fault => Err(UnavailableReason::Fault(signal, raw)),
            },
        }
    }

    /// Whether the frame came at this very moment. Taking it twice does no harm.
    fn is_new(self, received: Received) -> bool {
        received.at == self.now.mono
    }

    /// What is not fitted is off for ever, as of now.
    fn not_fitted<T>(self, off: T) -> FusedState<T> {
        let received = Received { at: self.now.mono, stamp: self.now.wall };
        FusedState { state: Ok((off, received)), source: 0, warnings: Warnings::default() }
    }
}

/// What the sources of both reports remember.
#[derive(Debug, Clone)]
pub struct SourceMemory {
    /// `None`: not fitted.
    turn: Option<SourceGroup<TurnReader, TurnCode>>,
    /// `None`: not fitted or unbound.
    hazard: Option<SourceGroup<HazardReader, HazardCode>>,
}

/// What the sources of both reports came to.
#[derive(Debug, Clone, Copy)]
pub struct SourceStates {
    /// Turn indicators.
    pub turn: FusedState<TurnCode>,
    /// Hazard lights.
    pub hazard: FusedState<HazardCode>,
}

/// What the sources of one state came to.
#[derive(Debug, Clone, Copy)]
pub struct FusedState<T> {
    /// The state, or why there is none.
    pub state: Judged<T>,
    /// The source that decided it, by position.
    pub source: usize,
    /// What is odd about them.
    pub warnings: Warnings,
}

const HAZARD_OFF: HazardCode = HazardCode { active: false, reason: None };

impl SourceMemory {
    /// Nothing seen yet.
    pub fn new(binding: &LightsBinding) -> Self {
        let turn = match &binding.turn {
            TurnBinding::LeftOut | TurnBinding::NotFitted => None,
            TurnBinding::From(sources) => Some(SourceGroup::new(sources, TurnReader::new, turn_codes_agree)),
        };
        let hazard = match &binding.hazard {
            HazardBinding::LeftOut | HazardBinding::NotFitted | HazardBinding::Unbound => None,
            HazardBinding::From(sources) => {
                let agree = |one: HazardCode, other: HazardCode| one.active == other.active;
                Some(SourceGroup::new(sources, HazardReader::new, agree))
            }
        };
        Self { turn, hazard }
    }

    /// Asks every source.
    pub fn evaluate(&mut self, context: LightsContext<'_>) -> SourceStates {
        let (turn, sides) = match (&mut self.turn, &context.binding.turn) {
            (None, TurnBinding::NotFitted) => {
                let off = context.not_fitted(TurnCode::Off);
                (off, off.state)
            }
            (None, TurnBinding::LeftOut | TurnBinding::From(_)) => (unbound(), unbound().state),
            (Some(group), _) => {
                let mut turn = group.evaluate(context.now.mono, turn_name, |reader| reader.evaluate(context));
                turn.warnings.lamps = group.readers.iter().find_map(TurnReader::warning);
                (turn, group.state_of(|reader| reader.shows_both))
            }
        };
        let hazard = match (&mut self.hazard, &context.binding.hazard) {
            (Some(group), _) => {
                group.evaluate(context.now.mono, hazard_name, |reader| reader.evaluate(context, sides))
            }
            (None, HazardBinding::NotFitted) => context.not_fitted(HAZARD_OFF),
            (None, HazardBinding::LeftOut | HazardBinding::Unbound | HazardBinding::From(_)) => unbound(),
        };
        SourceStates { turn, hazard }
    }

    /// When to ask again with nothing happening.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        let turn = self.turn.iter().flat_map(|group| {
            group.readers.iter().filter_map(TurnReader::next_deadline).chain(group.fusion.next_deadline())
        });
        let hazard = self.hazard.iter().flat_map(|group| {
            group.readers.iter().filter_map(HazardReader::next_deadline).chain(group.fusion.next_deadline())
        });
        turn.chain(hazard).min()
    }
}

fn unbound<T>() -> FusedState<T> {
    FusedState { state: Err(UnavailableReason::Unbound), source: 0, warnings: Warnings::default() }
}

/// What a turn state is called where sources disagree.
fn turn_name(code: TurnCode) -> &'static str {
    match code {
        TurnCode::Off => "off",
        TurnCode::Left => "left",
        TurnCode::Right => "right",
        TurnCode::Both => "both",
    }
}

fn hazard_name(code: HazardCode) -> &'static str {
    if code.active { "on" } else { "off" }
}

/// The sources of one state, side by side.
#[derive(Debug, Clone)]
struct SourceGroup<R, T> {
    readers: Vec<R>,
    fusion: Fusion<T>,
    /// What each said last. Kept, so that asking needs no memory.
    statements: Vec<Statement<T, UnavailableReason>>,
    /// When that was received; of no meaning without a value.
    received: Vec<Received>,
}

impl<R, T: Copy + PartialEq> SourceGroup<R, T> {
    fn new<S>(sources: &Sources<S>, reader: impl Fn(&S) -> R, agree: fn(T, T) -> bool) -> Self {
        let settings = sources.list.iter().map(|named| named.settings);
        Self {
            readers: sources.list.iter().map(|named| reader(&named.source)).collect(),
            fusion: Fusion::new(settings, sources.disagreement, agree),
            statements: vec![Statement::NotStated; sources.list.len()],
            received: vec![Received::default(); sources.list.len()],
        }
    }

    fn evaluate(
        &mut self,
        now: MonoTime,
        word: fn(T) -> &'static str,
        mut ask: impl FnMut(&mut R) -> Judged<T>,
    ) -> FusedState<T> {
        for ((reader, statements), received) in
            self.readers.iter_mut().zip(&mut self.statements).zip(&mut self.received)
        {
            *statements = match ask(reader) {
                Ok((value, at)) => {
                    *received = at;
                    Statement::Value(value)
                }
                Err(reason) => Statement::Unavailable(reason),
            };
        }
        self.fusion.update(&self.statements, now);
        let first = self.fusion.disagreements().next();
        let disagreement = first.map(|Disagreement { chosen, chosen_value, other, other_value, .. }| {
            Contradiction { chosen: (chosen, word(chosen_value)), other: (other, word(other_value)) }
        });
        let (state, source) = self.choose(|_| true);
        let fallback = match self.statements.first() {
            Some(Statement::Unavailable(reason)) if source > 0 => {
                Some(Fallback { by: source, reason: *reason })
            }
            Some(Statement::Unavailable(_) | Statement::Value(_) | Statement::NotStated) | None => None,
        };
        FusedState { state, source, warnings: Warnings { lamps: None, fallback, disagreement } }
    }

    /// What the sources that `count` come to.
    fn state_of(&self, counts: impl Fn(&R) -> bool) -> Judged<T> {
        self.choose(counts).0
    }

    fn choose(&self, counts: impl Fn(&R) -> bool) -> (Judged<T>, usize) {
        let statements =
            self.statements.iter().copied().enumerate().filter(|(source, _)| counts(&self.readers[*source]));
        match self.fusion.choose(statements) {
            None => (Err(UnavailableReason::Unbound), 0),
            Some(fused) => (fused.state.map(|value| (value, self.received[fused.source])), fused.source),
        }
    }
}

/// A turn source with what it remembers.
#[derive(Debug, Clone)]
struct TurnReader {
    shows_both: bool,
    kind: TurnKind,
}

#[derive(Debug, Clone)]
enum TurnKind {
    Enumerated(Role<TurnCode>),
    Pair(SidePair),
    Lamps(SidePair, Box<Lamp>),
    Stalk(Role<StalkPosition>, Box<MomentaryStalk>),
}

impl TurnReader {
    fn new(source: &TurnSource) -> Self {
        let kind = match source {
            TurnSource::Enumerated(role) => TurnKind::Enumerated(role.clone()),
            TurnSource::Pair(pair) => TurnKind::Pair(pair.clone()),
            TurnSource::Lamps { pair, settings, .. } => {
                TurnKind::Lamps(pair.clone(), Box::new(Lamp::new(*settings)))
            }
            TurnSource::Stalk { role, settings } => {
                TurnKind::Stalk(role.clone(), Box::new(MomentaryStalk::new(*settings)))
            }
        };
        Self { shows_both: source.shows_both(), kind }
    }

    fn evaluate(&mut self, context: LightsContext<'_>) -> Judged<TurnCode> {
        let now = context.now.mono;
        match &mut self.kind {
            TurnKind::Enumerated(role) => context.judge(role),
            TurnKind::Pair(pair) => {
                let ((left, right), received) = sides(context, pair)?;
                let code = match (left, right) {
                    (false, false) => TurnCode::Off,
                    (true, false) => TurnCode::Left,
                    (false, true) => TurnCode::Right,
                    (true, true) => TurnCode::Both,
                };
                defined(context, pair, code, received)
            }
            TurnKind::Lamps(pair, lamp) => match sides(context, pair) {
                Ok(((left, right), received)) => {
                    if context.is_new(received) {
                        lamp.observe(Some(left), Some(right), now);
                    } else {
                        lamp.advance(now);
                    }
                    let watching = UnavailableReason::WatchingLamps([pair.left.signal, pair.right.signal]);
                    defined(context, pair, lamp.state().ok_or(watching)?, received)
                }
                Err(reason) => {
                    lamp.observe(None, None, now);
                    Err(reason)
                }
            },
            TurnKind::Stalk(role, stalk) => match context.judge(role) {
                Ok((position, received)) => {
                    if context.is_new(received) {
                        stalk.observe(Some(position), now);
                    } else {
                        stalk.advance(now);
                    }
                    stalk.state().map(|code| (code, received)).ok_or(UnavailableReason::Settling(role.signal))
                }
                Err(reason) => {
                    stalk.observe(None, now);
                    Err(reason)
                }
            },
        }
    }

    fn warning(&self) -> Option<LampWarning> {
        match &self.kind {
            TurnKind::Enumerated(_) | TurnKind::Pair(_) | TurnKind::Stalk(..) => None,
            TurnKind::Lamps(pair, lamp) => {
                let findings = lamp.findings();
                let lamps = [pair.left.signal, pair.right.signal];
                (findings != LampFindings::default()).then_some(LampWarning { lamps, findings })
            }
        }
    }

    fn next_deadline(&self) -> Option<MonoTime> {
        match &self.kind {
            TurnKind::Enumerated(_) | TurnKind::Pair(_) => None,
            TurnKind::Lamps(_, lamp) => lamp.next_deadline(),
            TurnKind::Stalk(_, stalk) => stalk.next_deadline(),
        }
    }
}

fn sides(context: LightsContext<'_>, pair: &SidePair) -> Judged<(bool, bool)> {
    match (context.judge(&pair.left), context.judge(&pair.right)) {
        (Ok((left, since)), Ok((right, received))) => Ok(((left, right), since.newest(received))),
        (Err(reason), Ok(_)) | (Ok(_), Err(reason)) => Err(reason),
        (Err(first), Err(second)) => Err(graver(first, second)),
    }
}

/// Both sides on at once may be something the vehicle never sends.
fn defined(
    context: LightsContext<'_>,
    pair: &SidePair,
    code: TurnCode,
    received: Received,
) -> Judged<TurnCode> {
    if code == TurnCode::Both && pair.both == BothOn::Undefined {
        let raw = |signal| context.observations.last(signal).map_or(0, |last| last.raw);
        return Err(UnavailableReason::BothOn(
            [pair.left.signal, pair.right.signal].map(|signal| (signal, raw(signal))),
        ));
    }
    Ok((code, received))
}

/// Of two reasons the one an operator should hear first: fault, invalid, then unknown.
fn graver(first: UnavailableReason, second: UnavailableReason) -> UnavailableReason {
    let gravity = |reason| match reason {
        UnavailableReason::Fault(..) => 3,
        UnavailableReason::Undefined(..) | UnavailableReason::BothOn(..) => 2,
        UnavailableReason::NotAvailable(..) => 1,
        UnavailableReason::Absent(..)
        | UnavailableReason::Unbound
        | UnavailableReason::WatchingLamps(_)
        | UnavailableReason::Settling(_) => 0,
    };
    if gravity(second) > gravity(first) { second } else { first }
}

/// A hazard source with what it remembers.
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

    fn evaluate(&mut self, context: LightsContext<'_>, sides: Judged<TurnCode>) -> Judged<HazardCode> {
        let code = |active| HazardCode { active, reason: None };
        match self {
            Self::BothSides => sides.map(|(sides, received)| (code(sides == TurnCode::Both), received)),
            Self::Signal(role) => context.judge(role),
            Self::Button(role, toggle) => match context.judge(role) {
                Ok((pressed, received)) => {
                    if context.is_new(received) {
                        toggle.observe(Some(pressed), context.now.mono);
                    } else {
                        toggle.advance(context.now.mono);
                    }
                    toggle
                        .state()
                        .map(|on| (code(on), received))
                        .ok_or(UnavailableReason::Settling(role.signal))
                }
                Err(reason) => {
                    toggle.observe(None, context.now.mono);
                    Err(reason)
                }
            },
        }
    }

    fn next_deadline(&self) -> Option<MonoTime> {
        match self {
            Self::BothSides | Self::Signal(_) => None,
            Self::Button(_, toggle) => toggle.next_deadline(),
        }
    }
}
