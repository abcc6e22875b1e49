//! `[turn]` of a profile: where the state of the turn indicators comes from.

mod lamp;
mod stalk;

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::binder::{Binder, no_state};
use super::keys::{Key, refuse_given, refuse_keys, require, section};
use super::light_sources::{FaultSignalFile, disagreement, longest_hold, source_settings};
use super::raw_values::RawValues;
use crate::config::reading::keyword::{Keyword, keywords};
use crate::core::vehicle_lights::binding::{
    BothOn, NamedSource, OnFault, SidePair, Sources, TurnBinding, TurnSource, TurnWhileHazard,
};
use crate::core::vehicle_lights::stalk::StalkPosition;
use crate::core::vehicle_lights::state::TurnCode;
use lamp::{LampFile, lamps};
use stalk::{StalkFile, stalk_settings};

/// The ways to bind the turn state.
const FORMS: &str = "give `signal` with off, left and right, or `left_signal`, `right_signal` and `both_on`, \
                     or `kind`, or [[turn.source]], or `fitted = false`";
/// What a key of `[turn]` belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TurnForm {
    /// `[turn]` alone.
    Section,
    /// `[[turn.source]]` alone.
    Source,
    /// Any form that is not a state itself.
    Kind,
    /// One signal with a value for each state.
    Enumerated,
    /// A signal for each side.
    Pair,
    /// Lamps, which blink.
    Lamp,
    /// A stalk that springs back.
    Stalk,
}

impl Key<TurnForm> {
    /// Whether it says what the signals are.
    fn is_of_form(&self) -> bool {
        !self.is_for(&TurnForm::Section) && !self.is_for(&TurnForm::Source)
    }
}

section! {
    /// `[turn]` and `[[turn.source]]`: one enumerated signal, a left and a right one, lamps, a stalk, or,
    /// in `[turn]` alone, sources or none fitted.
    pub struct TurnFile by TurnForm {
        /// What diagnostics call a source.
        name: Option<Spanned<String>> [Source],
        /// Whether a source may stand in for one above it.
        fallback: Option<Spanned<bool>> [Source],
        /// What the signals show, unless the state itself.
        kind: Option<Spanned<Keyword<TurnKind>>> [Kind],
        /// `false`: the vehicle has no indicators.
        fitted: Option<Spanned<bool>> [Section],
        /// The enumerated signal.
        signal: Option<Spanned<String>> [Enumerated, Stalk],
        /// Its values for "none on".
        off: Option<RawValues> [Enumerated],
        /// Its values for "left on".
        left: Option<RawValues> [Enumerated],
        /// Its values for "right on".
        right: Option<RawValues> [Enumerated],
        /// Its values for "both on".
        both: Option<RawValues> [Enumerated],
        /// Its values for "not available".
        not_available: Option<RawValues> [Enumerated, Stalk],
        /// Its values for "fault".
        fault: Option<RawValues> [Enumerated, Stalk],
        /// Left signal of a pair.
        left_signal: Option<Spanned<SwitchFile>> [Pair, Lamp],
        /// Right signal of a pair.
        right_signal: Option<Spanned<SwitchFile>> [Pair, Lamp],
        /// What both sides of a pair mean.
        both_on: Option<Spanned<Keyword<BothOn>>> [Pair, Lamp],
        /// Times of lamps.
        lamp: Option<Spanned<LampFile>> [Lamp],
        /// Values of a stalk in the middle.
        idle: Option<RawValues> [Stalk],
        /// Values of the first detent to the left.
        left_half: Option<RawValues> [Stalk],
        /// Values of the second detent to the left.
        left_full: Option<RawValues> [Stalk],
        /// Values of the first detent to the right.
        right_half: Option<RawValues> [Stalk],
        /// Values of the second detent to the right.
        right_full: Option<RawValues> [Stalk],
        /// Rules and times of a stalk.
        stalk: Option<Spanned<StalkFile>> [Stalk],
        /// Several sources, the most trusted first.
        #[serde(default)]
        source: Vec<Spanned<TurnFile>> [Section],
        /// How long sources may contradict each other, ms.
        disagreement_ms: Option<Spanned<u64>> [Section],
        /// What is reported while the hazard lights are on.
        while_hazard: Option<Spanned<Keyword<TurnWhileHazard>>> [Section],
        /// What a reported fault does.
        on_fault: Option<Spanned<Keyword<OnFault>>> [Section],
        /// Signals that report a fault.
        #[serde(default)]
        fault_signal: Vec<FaultSignalFile> [Section],
    }
}

/// `kind = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TurnKind {
    /// Lamps, which blink.
    Lamp,
    /// A stalk that springs back.
    Stalk,
}

keywords!(TurnKind { "lamp" => TurnKind::Lamp, "stalk" => TurnKind::Stalk });
keywords!(BothOn { "hazard" => BothOn::Hazard, "undefined" => BothOn::Undefined });
keywords!(TurnWhileHazard { "disable" => TurnWhileHazard::Disable, "keep" => TurnWhileHazard::Keep });

/// An on/off signal with its values.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SwitchFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// Values for "on".
    pub on: RawValues,
    /// Values for "off".
    pub off: RawValues,
    /// Values for "not available".
    pub not_available: Option<RawValues>,
    /// Values for "fault".
    pub fault: Option<RawValues>,
}

pub(super) fn turn(binder: &mut Binder<'_>, file: &Spanned<TurnFile>) -> Option<TurnBinding> {
    let (span, file) = (file.span(), file.get_ref());
    let before = binder.checker.problems.len();
    let keys = file.keys();
    if file.fitted.as_ref().is_some_and(|fitted| !fitted.get_ref()) {
        let sources = file.source.iter().map(Spanned::span);
        let signals = keys.into_iter().filter(Key::is_of_form).map(|key| key.span);
        let Some(extra) = signals.chain(sources).next() else {
            return Some(TurnBinding::NotFitted);
        };
        binder.refuse(extra, "a vehicle without indicators has no turn signal", FORMS);
        return None;
    }
    refuse_keys(
        binder,
        keys.iter().filter(|key| key.is_for(&TurnForm::Source)).cloned(),
        "belongs to [[turn.source]]",
        "remove it, or describe the sources in [[turn.source]]",
    );
    let sources = if file.source.is_empty() {
        refuse_given(
            binder,
            ("disagreement_ms", &file.disagreement_ms),
            "needs several sources",
            "remove it, or describe the sources in [[turn.source]]",
        );
        Sources::only(turn_source(binder, file, &span)?)
    } else {
        let keys = keys.into_iter().filter(Key::is_of_form);
        refuse_keys(binder, keys, "conflicts with [[turn.source]]", "move it into a [[turn.source]]");
        sources(binder, file)?
    };
    (binder.checker.problems.len() == before).then_some(TurnBinding::From(sources))
}

fn sources(binder: &mut Binder<'_>, file: &TurnFile) -> Option<Sources<TurnSource>> {
    let mut list: Vec<NamedSource<TurnSource>> = Vec::new();
    for part in &file.source {
        let (span, part) = (part.span(), part.get_ref());
        let misplaced = part.keys().into_iter().filter(|key| key.is_for(&TurnForm::Section));
        refuse_keys(binder, misplaced, "belongs to [turn]", "move it there");
        let names: Vec<_> = list.iter().map(|named| named.name.as_str()).collect();
        let settings = source_settings(binder, &span, part.name.as_ref(), part.fallback.as_ref(), &names);
        let source = turn_source(binder, part, &span);
        let (Some((name, settings)), Some(source)) = (settings, source) else { continue };
        list.push(NamedSource { name, settings, source });
    }
    let disagreement = disagreement(binder, file.disagreement_ms.as_ref(), longest_hold(&list));
    (list.len() == file.source.len()).then_some(Sources { list, disagreement })
}

fn turn_source(binder: &mut Binder<'_>, file: &TurnFile, span: &Range<usize>) -> Option<TurnSource> {
    let mut keys = file.keys();
    keys.retain(|key| key.is_of_form() && !key.is_for(&TurnForm::Kind));
    let given = |form| keys.iter().find(|key| key.is_for(&form)).map(|key| key.span.clone());
    let (form, name) = match file.kind.as_ref().map(|kind| kind.get_ref().0) {
        Some(TurnKind::Lamp) => (TurnForm::Lamp, "with kind = \"lamp\""),
        Some(TurnKind::Stalk) => (TurnForm::Stalk, "with kind = \"stalk\""),
        None => match (given(TurnForm::Enumerated), given(TurnForm::Pair)) {
            (Some(_), Some(extra)) => {
                let reason = "one enumerated signal and a pair of signals exclude each other";
                binder.refuse(extra, reason, FORMS);
                return None;
            }
            (None, None) if keys.is_empty() => {
                binder.refuse(span.clone(), "the turn state comes from no signal", FORMS);
                return None;
            }
            (_, None) => (TurnForm::Enumerated, "without `kind`"),
            (None, Some(_)) => (TurnForm::Pair, "without `kind`"),
        },
    };
    keys.retain(|key| !key.is_for(&form));
    if !keys.is_empty() {
        refuse_keys(binder, keys, &format!("has no meaning {name}"), "remove it, or change `kind`");
        return None;
    }
    match form {
        TurnForm::Lamp => {
            let pair = turn_pair(binder, file, span)?;
            let sides = [&file.left_signal, &file.right_signal];
            let sides = sides.map(|side| side.as_ref().map_or(span.clone(), Spanned::span));
            lamps(binder, pair, sides, file.lamp.as_ref())
        }
        TurnForm::Stalk => stalk(binder, file, span),
        TurnForm::Pair => turn_pair(binder, file, span).map(TurnSource::Pair),
        TurnForm::Enumerated | TurnForm::Section | TurnForm::Source | TurnForm::Kind => {
            enumerated_turn(binder, file, span)
        }
    }
}

fn enumerated_turn(binder: &mut Binder<'_>, file: &TurnFile, span: &Range<usize>) -> Option<TurnSource> {
    let remedy = "an enumerated turn signal needs signal, off, left and right";
    require!(binder, span, file.{ signal, off, left, right }, remedy);
    binder.require_values(&[off, left, right]);
    let codes = [
        (Some(off), TurnCode::Off),
        (Some(left), TurnCode::Left),
        (Some(right), TurnCode::Right),
        (file.both.as_ref(), TurnCode::Both),
    ];
    let role = binder.state_role(signal, codes, file.not_available.as_ref(), file.fault.as_ref());
    role.map(TurnSource::Enumerated)
}

fn turn_pair(binder: &mut Binder<'_>, file: &TurnFile, span: &Range<usize>) -> Option<SidePair> {
    let remedy = "a pair of turn signals needs left_signal, right_signal and both_on";
    require!(binder, span, file.{ left_signal, right_signal, both_on }, remedy);
    let [left, right] = [left_signal, right_signal].map(|side| {
        let SwitchFile { signal, on, off, not_available, fault } = side.get_ref();
        binder.switch(signal, [on, off], no_state(not_available.as_ref(), fault.as_ref()))
    });
    let (left, right) = (left?, right?);
    if left.signal == right.signal {
        binder.refuse(right_signal.span(), "left and right are the same signal", "bind one signal a side");
        return None;
    }
    Some(SidePair { left, right, both: both_on.get_ref().0 })
}

fn stalk(binder: &mut Binder<'_>, file: &TurnFile, span: &Range<usize>) -> Option<TurnSource> {
    let remedy =
        "a stalk needs signal, idle, left_full and right_full; left_half and right_half if it has them";
    require!(binder, span, file.{ signal, idle, left_full, right_full }, remedy);
    binder.require_values(&[idle, left_full, right_full]);
    let positions = [
        (Some(idle), StalkPosition::Idle),
        (Some(left_full), StalkPosition::LeftFull),
        (Some(right_full), StalkPosition::RightFull),
        (file.left_half.as_ref(), StalkPosition::LeftHalf),
        (file.right_half.as_ref(), StalkPosition::RightHalf),
    ];
    let role = binder.state_role(signal, positions, file.not_available.as_ref(), file.fault.as_ref());
    let settings = stalk_settings(binder, file.stalk.as_ref());
    Some(TurnSource::Stalk { role: role?, settings })
}

/// What is reported of the turn indicators while the hazard lights are on; `both_sides` means that those
/// are both turn sides on.
pub(super) fn while_hazard(binder: &mut Binder<'_>, turn: &TurnFile, both_sides: bool) -> TurnWhileHazard {
    let Some(policy) = &turn.while_hazard else { return TurnWhileHazard::default() };
    if policy.get_ref().0 == TurnWhileHazard::Keep && both_sides && turn.source.is_empty() {
        let reason = "hazard comes from both sides, so there is no turn state to keep";
        binder.refuse(policy.span(), reason, "use while_hazard = \"disable\"");
    }
    policy.get_ref().0
}
