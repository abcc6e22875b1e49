//! What each source of a state says now: its signals judged, what it remembers moved on, and all of
//! a report's sources made into one.

use super::binding::{
    BothOn, HazardBinding, HazardCode, HazardSource, LightsBinding, SidePair, Sources, TurnBinding, TurnCode,
    TurnSource,
};
use super::fusion::{Disagreement, Fusion, Statement, turn_codes_agree};
use super::lamp::{Lamp, LampFindings};
use super::remark::{Contradiction, LampRemark, Remarks, StandIn};
use super::stalk::button::HazardToggle;
use super::stalk::{MomentaryStalk, StalkPosition};
use super::verdict::{Doubt, Judged};
use crate::core::bus::{Bus, Received};
use crate::core::time::{MonoTime, Now};
use crate::core::trust::meaning::Meaning;
use crate::core::trust::observation::{Observations, Reading};
use crate::core::trust::table::Role;

/// All there is to judge by, at one moment.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// What the profile binds.
    pub binding: &'a LightsBinding,
    /// The last values.
    pub seen: &'a Observations,
    /// The buses they came over.
    pub buses: &'a [Bus],
    /// The moment.
    pub now: Now,
}

impl View<'_> {
    /// The last value of a signal, judged.
    pub fn read<T: Copy>(self, role: &Role<T>) -> Reading<T> {
        self.seen.read(&self.binding.table, role, self.buses, self.now.mono)
    }

    fn judge<T: Copy>(self, role: &Role<T>) -> Judged<T> {
        let signal = role.signal;
        match self.read(role) {
            Reading::Absent(why) => Err(Doubt::Absent(signal, why)),
            Reading::Seen { meaning, raw, received } => match meaning {
                Meaning::Defined(value) => Ok((value, received)),
                Meaning::NotAvailable => Err(Doubt::NotAvailable(signal, raw)),
                Meaning::Undefined => Err(Doubt::Undefined(signal, raw)),
                Meaning::Fault => Err(Doubt::Fault(signal, raw)),
            },
        }
    }

    /// Whether the frame came at this very moment. Taking it twice does no harm.
    fn is_new(self, received: Received) -> bool {
        received.at == self.now.mono
    }

    /// What is not fitted is off for ever, as of now.
    fn off_for_ever<T>(self, off: T) -> Told<T> {
        let received = Received { at: self.now.mono, stamp: self.now.wall };
        Told { state: Ok((off, received)), source: 0, remarks: Remarks::default() }
    }
}

/// What the sources of both reports remember.
#[derive(Debug, Clone)]
pub struct Memory {
    /// `None`: not fitted.
    turn: Option<Panel<TurnReader, TurnCode>>,
    /// `None`: not fitted or unbound.
    hazard: Option<Panel<HazardReader, HazardCode>>,
}

/// What the sources of both reports came to.
#[derive(Debug, Clone, Copy)]
pub struct Heard {
    /// Turn indicators.
    pub turn: Told<TurnCode>,
    /// Hazard lights.
    pub hazard: Told<HazardCode>,
}

/// What the sources of one state came to.
#[derive(Debug, Clone, Copy)]
pub struct Told<T> {
    /// The state, or why there is none.
    pub state: Judged<T>,
    /// The source that decided it, by position.
    pub source: usize,
    /// What is odd about them.
    pub remarks: Remarks,
}

const HAZARD_OFF: HazardCode = HazardCode { active: false, reason: None };

impl Memory {
    /// Nothing seen yet.
    pub fn new(binding: &LightsBinding) -> Self {
        let turn = match &binding.turn {
            TurnBinding::LeftOut | TurnBinding::NotFitted => None,
            TurnBinding::From(sources) => Some(Panel::new(sources, TurnReader::new, turn_codes_agree)),
        };
        let hazard = match &binding.hazard {
            HazardBinding::LeftOut | HazardBinding::NotFitted | HazardBinding::Unbound => None,
            HazardBinding::From(sources) => {
                let agree = |one: HazardCode, other: HazardCode| one.active == other.active;
                Some(Panel::new(sources, HazardReader::new, agree))
            }
        };
        Self { turn, hazard }
    }

    /// Asks every source.
    pub fn hear(&mut self, view: View<'_>) -> Heard {
        let (turn, sides) = match (&mut self.turn, &view.binding.turn) {
            (None, TurnBinding::NotFitted) => {
                let off = view.off_for_ever(TurnCode::Off);
                (off, off.state)
            }
            (None, TurnBinding::LeftOut | TurnBinding::From(_)) => (unbound(), unbound().state),
            (Some(panel), _) => {
                let mut turn = panel.hear(view.now.mono, turn_word, |reader| reader.says(view));
                turn.remarks.lamps = panel.readers.iter().find_map(TurnReader::remark);
                (turn, panel.told_by(|reader| reader.shows_both))
            }
        };
        let hazard = match (&mut self.hazard, &view.binding.hazard) {
            (Some(panel), _) => panel.hear(view.now.mono, hazard_word, |reader| reader.says(view, sides)),
            (None, HazardBinding::NotFitted) => view.off_for_ever(HAZARD_OFF),
            (None, HazardBinding::LeftOut | HazardBinding::Unbound | HazardBinding::From(_)) => unbound(),
        };
        Heard { turn, hazard }
    }

    /// When to ask again with nothing happening.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        let turn = self.turn.iter().flat_map(|panel| {
            panel.readers.iter().filter_map(TurnReader::next_deadline).chain(panel.fusion.next_deadline())
        });
        let hazard = self.hazard.iter().flat_map(|panel| {
            panel.readers.iter().filter_map(HazardReader::next_deadline).chain(panel.fusion.next_deadline())
        });
        turn.chain(hazard).min()
    }
}

fn unbound<T>() -> Told<T> {
    Told { state: Err(Doubt::Unbound), source: 0, remarks: Remarks::default() }
}

/// What a turn state is called where sources disagree.
fn turn_word(code: TurnCode) -> &'static str {
    match code {
        TurnCode::Off => "off",
        TurnCode::Left => "left",
        TurnCode::Right => "right",
        TurnCode::Both => "both",
    }
}

fn hazard_word(code: HazardCode) -> &'static str {
    if code.active { "on" } else { "off" }
}

/// The sources of one state, side by side.
#[derive(Debug, Clone)]
struct Panel<R, T> {
    readers: Vec<R>,
    fusion: Fusion<T>,
    /// What each said last. Kept, so that asking needs no memory.
    said: Vec<Statement<T, Doubt>>,
    /// When that was received; of no meaning for a doubt.
    received: Vec<Received>,
}

impl<R, T: Copy + PartialEq> Panel<R, T> {
    fn new<S>(sources: &Sources<S>, reader: impl Fn(&S) -> R, agree: fn(T, T) -> bool) -> Self {
        let settings = sources.list.iter().map(|named| named.settings);
        Self {
            readers: sources.list.iter().map(|named| reader(&named.source)).collect(),
            fusion: Fusion::new(settings, sources.disagreement, agree),
            said: vec![Statement::Silent; sources.list.len()],
            received: vec![Received::default(); sources.list.len()],
        }
    }

    fn hear(
        &mut self,
        now: MonoTime,
        word: fn(T) -> &'static str,
        mut ask: impl FnMut(&mut R) -> Judged<T>,
    ) -> Told<T> {
        for ((reader, said), received) in self.readers.iter_mut().zip(&mut self.said).zip(&mut self.received)
        {
            *said = match ask(reader) {
                Ok((value, at)) => {
                    *received = at;
                    Statement::Value(value)
                }
                Err(doubt) => Statement::Doubt(doubt),
            };
        }
        self.fusion.update(&self.said, now);
        let first = self.fusion.disagreements().next();
        let disagreement = first.map(|Disagreement { chosen, chosen_value, other, other_value, .. }| {
            Contradiction { chosen: (chosen, word(chosen_value)), other: (other, word(other_value)) }
        });
        let (state, source) = self.choose(|_| true);
        let stand_in = match self.said.first() {
            Some(Statement::Doubt(doubt)) if source > 0 => Some(StandIn { by: source, doubt: *doubt }),
            Some(Statement::Doubt(_) | Statement::Value(_) | Statement::Silent) | None => None,
        };
        Told { state, source, remarks: Remarks { lamps: None, stand_in, disagreement } }
    }

    /// What the sources that `count` come to.
    fn told_by(&self, counts: impl Fn(&R) -> bool) -> Judged<T> {
        self.choose(counts).0
    }

    fn choose(&self, counts: impl Fn(&R) -> bool) -> (Judged<T>, usize) {
        let said = self.said.iter().copied().enumerate().filter(|(source, _)| counts(&self.readers[*source]));
        match self.fusion.choose(said) {
            None => (Err(Doubt::Unbound), 0),
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

    fn says(&mut self, view: View<'_>) -> Judged<TurnCode> {
        let now = view.now.mono;
        match &mut self.kind {
            TurnKind::Enumerated(role) => view.judge(role),
            TurnKind::Pair(pair) => {
                let ((left, right), received) = sides(view, pair)?;
                let code = match (left, right) {
                    (false, false) => TurnCode::Off,
                    (true, false) => TurnCode::Left,
                    (false, true) => TurnCode::Right,
                    (true, true) => TurnCode::Both,
                };
                defined(view, pair, code, received)
            }
            TurnKind::Lamps(pair, lamp) => match sides(view, pair) {
                Ok(((left, right), received)) => {
                    if view.is_new(received) {
                        lamp.observe(Some(left), Some(right), now);
                    } else {
                        lamp.advance(now);
                    }
                    let watching = Doubt::WatchingLamps([pair.left.signal, pair.right.signal]);
                    defined(view, pair, lamp.state().ok_or(watching)?, received)
                }
                Err(doubt) => {
                    lamp.observe(None, None, now);
                    Err(doubt)
                }
            },
            TurnKind::Stalk(role, stalk) => match view.judge(role) {
                Ok((position, received)) => {
                    if view.is_new(received) {
                        stalk.observe(Some(position), now);
                    } else {
                        stalk.advance(now);
                    }
                    stalk.state().map(|code| (code, received)).ok_or(Doubt::Settling(role.signal))
                }
                Err(doubt) => {
                    stalk.observe(None, now);
                    Err(doubt)
                }
            },
        }
    }

    fn remark(&self) -> Option<LampRemark> {
        match &self.kind {
            TurnKind::Enumerated(_) | TurnKind::Pair(_) | TurnKind::Stalk(..) => None,
            TurnKind::Lamps(pair, lamp) => {
                let findings = lamp.findings();
                let lamps = [pair.left.signal, pair.right.signal];
                (findings != LampFindings::default()).then_some(LampRemark { lamps, findings })
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

fn sides(view: View<'_>, pair: &SidePair) -> Judged<(bool, bool)> {
    match (view.judge(&pair.left), view.judge(&pair.right)) {
        (Ok((left, since)), Ok((right, received))) => Ok(((left, right), since.newest(received))),
        (Err(doubt), Ok(_)) | (Ok(_), Err(doubt)) => Err(doubt),
        (Err(first), Err(second)) => Err(graver(first, second)),
    }
}

/// Both sides on at once may be something the vehicle never sends.
fn defined(view: View<'_>, pair: &SidePair, code: TurnCode, received: Received) -> Judged<TurnCode> {
    if code == TurnCode::Both && pair.both == BothOn::Undefined {
        let raw = |signal| view.seen.last(signal).map_or(0, |last| last.raw);
        return Err(Doubt::BothOn([pair.left.signal, pair.right.signal].map(|signal| (signal, raw(signal)))));
    }
    Ok((code, received))
}

/// Of two doubts the one an operator should hear first: fault, invalid, then unknown.
fn graver(first: Doubt, second: Doubt) -> Doubt {
    let gravity = |doubt| match doubt {
        Doubt::Fault(..) => 3,
        Doubt::Undefined(..) | Doubt::BothOn(..) => 2,
        Doubt::NotAvailable(..) => 1,
        Doubt::Absent(..) | Doubt::Unbound | Doubt::WatchingLamps(_) | Doubt::Settling(_) => 0,
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
            HazardSource::Button { role, blind, settle } => {
                Self::Button(role.clone(), HazardToggle::new(*blind, *settle))
            }
        }
    }

    fn says(&mut self, view: View<'_>, sides: Judged<TurnCode>) -> Judged<HazardCode> {
        let code = |active| HazardCode { active, reason: None };
        match self {
            Self::BothSides => sides.map(|(sides, received)| (code(sides == TurnCode::Both), received)),
            Self::Signal(role) => view.judge(role),
            Self::Button(role, toggle) => match view.judge(role) {
                Ok((pressed, received)) => {
                    if view.is_new(received) {
                        toggle.observe(Some(pressed), view.now.mono);
                    } else {
                        toggle.advance(view.now.mono);
                    }
                    toggle.state().map(|on| (code(on), received)).ok_or(Doubt::Settling(role.signal))
                }
                Err(doubt) => {
                    toggle.observe(None, view.now.mono);
                    Err(doubt)
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
