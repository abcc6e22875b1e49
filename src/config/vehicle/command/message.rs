//! `[[command.message]]` of a profile: one message that may be sent, every bit of it accounted for.

use std::collections::BTreeMap;
use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use super::super::binder::{Binder, split_bus};
use super::super::integrity::checksum::ChecksumFile;
use super::super::integrity::counter::CounterFile;
use super::super::integrity::e2e::E2eFile;
use super::super::integrity::{Asked, integrity};
use crate::config::reading::keyword::{Keyword, keywords};
use crate::core::can::frame::MAX_DATA;
use crate::core::command::allow_list::AllowList;
use crate::core::command::message::{CommandMessage, Enable, HazardPart, Idle, SendTiming, TurnPart};
use crate::core::command::patch::Patch;
use crate::core::command::push_button::PushButtonSettings;
use crate::core::dbc::model::{Message, Number};
use crate::core::validation::integrity::Protection;
use crate::core::validation::integrity::counter::IncrementsOn;

keywords!(Idle { "neutral" => Idle::Neutral, "silent" => Idle::Silent });

/// `[[command.message]]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandMessageFile {
    /// `MESSAGE` or `BUS:MESSAGE`
    pub name: Spanned<String>,
    /// From frame to frame, ms.
    pub period_ms: Option<Spanned<u64>>,
    /// Frames in quick succession after a change.
    pub burst: Option<Spanned<u8>>,
    /// From frame to frame of them, ms.
    pub burst_gap_ms: Option<Spanned<u64>>,
    /// Least time between two frames, ms.
    pub min_send_interval_ms: Option<Spanned<u64>>,
    /// What goes out without authority.
    pub idle: Option<Spanned<Keyword<Idle>>>,
    /// What bits hold that no signal has, 0 or 1.
    pub unused_bits: Option<Spanned<u8>>,
    /// Signals that never change.
    pub constants: Option<StateFile>,
    /// The bits that give authority.
    pub enable: Option<Spanned<EnableFile>>,
    /// Turn-indicator part.
    pub turn: Option<Spanned<TurnPartFile>>,
    /// Hazard part.
    pub hazard: Option<Spanned<HazardPartFile>>,
    /// Its counter.
    pub counter: Option<Spanned<CounterFile>>,
    /// Its checksum.
    pub checksum: Option<Spanned<ChecksumFile>>,
    /// Its E2E protection, instead of the two.
    pub e2e: Option<Spanned<E2eFile>>,
}

/// Raw values by signal: `{ TURN = 1 }`.
type StateFile = Spanned<BTreeMap<Spanned<String>, Spanned<i64>>>;

/// `enable = { on = { … }, off = { … } }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnableFile {
    /// The message counts.
    pub on: StateFile,
    /// It does not.
    pub off: StateFile,
}

/// `[command.message.turn]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TurnPartFile {
    /// Neither side.
    pub off: StateFile,
    /// Left.
    pub left: StateFile,
    /// Right.
    pub right: StateFile,
    /// Both sides.
    pub hazard: Option<StateFile>,
    /// Nothing is asked for.
    pub none: Option<StateFile>,
}

/// `[command.message.hazard]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HazardPartFile {
    /// Off, or not pressed.
    pub off: StateFile,
    /// On, or pressed.
    pub on: StateFile,
    /// Nothing is asked for.
    pub none: Option<StateFile>,
    /// How to press a button that springs back.
    pub button: Option<Spanned<ButtonFile>>,
}

/// `button = { … }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ButtonFile {
    /// How long it is held down, ms.
    pub press_ms: Option<Spanned<u64>>,
    /// How long to wait for the report afterwards, ms.
    pub wait_ms: Option<Spanned<u64>>,
    /// Presses for one wish.
    pub attempts: Option<Spanned<u8>>,
}

/// Slowest and fastest rhythm of a command, ms.
const PERIODS_MS: RangeInclusive<u64> = 10..=1000;
const BURST_GAP_MS: u64 = 20;
const MIN_GAP_MS: u64 = 10;
const MAX_BURST: u8 = 10;
const PRESS_MS: u64 = 200;
const WAIT_MS: u64 = 800;
const MAX_PRESS_MS: u64 = 60_000;
const ATTEMPTS: u8 = 3;

/// One message; `None` when a problem was noted that leaves nothing to go on with.
pub(super) fn command_message(
    binder: &mut Binder<'_>,
    allowed: &mut AllowList,
    file: &CommandMessageFile,
) -> Option<CommandMessage> {
    let before = binder.checker.problems.len();
    let (bus_name, name) = split_bus(file.name.get_ref());
    let (bus, message) = binder.find_message(bus_name, name, file.name.span())?;
    let mut parts = Parts { message, placed: Vec::new(), named: Vec::new() };
    let turn = file.turn.as_ref().and_then(|file| parts.turn(binder, file.get_ref()));
    let timing = timing(binder, file, message);
    let hazard = file.hazard.as_ref().and_then(|file| parts.hazard(binder, file.get_ref(), timing));
    let enable = file.enable.as_ref().and_then(|file| parts.enable(binder, file.get_ref()));
    let constants = file.constants.as_ref().map(|file| parts.group(binder, &[file])).unwrap_or_default();
    let protection = protection(binder, file, message);
    if binder.checker.problems.len() > before {
        return None;
    }
    parts.protected(binder, file, protection.as_ref());
    parts.refuse_unnamed(binder, file);
    let idle = idle(binder, file);
    let permission = allowed.admit(binder.buses[bus].index, message.id, message.length);
    let permission = permission.map_err(|error| {
        binder.refuse(file.name.span(), error.to_string(), "describe messages that can be sent, each once");
    });
    let mut background = match file.unused_bits.as_ref().map(|bits| (bits.span(), *bits.get_ref())) {
        None | Some((_, 0)) => [0; MAX_DATA],
        Some((_, 1)) => [0xFF; MAX_DATA],
        Some((span, _)) => {
            binder.refuse(span, "a bit is 0 or 1", "give the value that unused bits are to have");
            return None;
        }
    };
    for patch in &constants {
        patch.apply(&mut background);
    }
    let name = binder.message_name(bus, message);
    let permission = permission.ok().filter(|_| binder.checker.problems.len() == before)?;
    Some(CommandMessage { name, permission, background, turn, hazard, enable, protection, idle, timing })
}

/// What of the message is accounted for so far.
struct Parts<'a> {
    message: &'a Message,
    /// What is set together, once a group.
    placed: Vec<Patch>,
    named: Vec<String>,
}

impl Parts<'_> {
    fn turn(&mut self, binder: &mut Binder<'_>, file: &TurnPartFile) -> Option<TurnPart> {
        let TurnPartFile { off, left, right, hazard, none } = file;
        let states = [Some(off), Some(left), Some(right), hazard.as_ref(), none.as_ref()];
        let [off, left, right, hazard, none] = self.states(binder, states, none.is_some())?;
        Some(TurnPart { off: off?, left: left?, right: right?, hazard, none })
    }

    fn hazard(
        &mut self,
        binder: &mut Binder<'_>,
        file: &HazardPartFile,
        timing: SendTiming,
    ) -> Option<HazardPart> {
        let HazardPartFile { off, on, none, button } = file;
        let button = button.as_ref().map(|button| button_rules(binder, button.get_ref(), timing));
        let states = [Some(off), Some(on), none.as_ref()];
        let [off, on, none] = self.states(binder, states, none.is_some())?;
        Some(HazardPart { off: off?, on: on?, none, button })
    }

    fn enable(&mut self, binder: &mut Binder<'_>, file: &EnableFile) -> Option<Enable> {
        let [on, off] = self.states(binder, [Some(&file.on), Some(&file.off)], false)?;
        Some(Enable { on: on?, off: off? })
    }

    /// A patch for each state of a group that is given. The first state is "off", and with `has_none` the
    /// last one is "none".
    fn states<const N: usize>(
        &mut self,
        binder: &mut Binder<'_>,
        states: [Option<&StateFile>; N],
        has_none: bool,
    ) -> Option<[Option<Patch>; N]> {
        let given: Vec<_> = states.into_iter().flatten().collect();
        let patches = self.group(binder, &given);
        must_differ(binder, &given, &patches, has_none);
        if patches.is_empty() {
            return None;
        }
        let mut patches = patches.into_iter();
        Some(states.map(|state| state.and_then(|_| patches.next())))
    }

    /// The states of one group, which must all set the same signals; nothing when a problem was noted.
    fn group(&mut self, binder: &mut Binder<'_>, states: &[&StateFile]) -> Vec<Patch> {
        let patches: Vec<_> = states.iter().filter_map(|state| self.patch(binder, state)).collect();
        if patches.len() != states.len() {
            return Vec::new();
        }
        let Some(first) = patches.first() else { return patches };
        if let Some((state, _)) = states.iter().zip(&patches).find(|(_, patch)| !patch.sets_like(first)) {
            let remedy = "give each state of a group the same signals, so that none keeps an old value";
            binder.refuse(state.span(), "this state sets other signals than the first of its group", remedy);
            return Vec::new();
        }
        if self.placed.iter().any(|known| known.overlaps(first)) {
            let at = states.first().map_or(0..0, |state| state.span());
            binder.refuse(at, "these bits are set elsewhere in the message as well", "set each bit once");
        }
        self.placed.push(first.clone());
        patches
    }

    fn patch(&mut self, binder: &mut Binder<'_>, state: &StateFile) -> Option<Patch> {
        let mut patch = Patch::default();
        let before = binder.checker.problems.len();
        if state.get_ref().is_empty() {
            binder.refuse(
                state.span(),
                "no signal is named",
                "give signals with raw values, e.g. { TURN = 1 }",
            );
        }
        for (name, raw) in state.get_ref() {
            let Some(signal) = self.message.signal(name.get_ref()) else {
                self.refuse_signal(binder, name.get_ref(), name.span());
                continue;
            };
            if signal.number != Number::Integer {
                let reason = format!("{} is a floating-point signal", signal.name);
                binder.refuse(name.span(), reason, "set signals with integer raw values");
                continue;
            }
            if let Err(error) = patch.set(&signal.codec, (*raw.get_ref()).into()) {
                let reason = format!("{} cannot be {}", signal.name, raw.get_ref());
                binder.refuse(raw.span(), reason, &error.to_string());
            }
            self.named.push(signal.name.clone());
        }
        (binder.checker.problems.len() == before).then_some(patch)
    }

    fn refuse_signal(&self, binder: &mut Binder<'_>, name: &str, at: Range<usize>) {
        let names: Vec<_> = self.message.signals.iter().map(|signal| signal.name.as_str()).collect();
        let reason = format!("{} has no signal {name}", self.message.name);
        binder.refuse(at, reason, &format!("it has {}", names.join(", ")));
    }

    /// Counter and checksum have bits of their own.
    fn protected(
        &mut self,
        binder: &mut Binder<'_>,
        file: &CommandMessageFile,
        protection: Option<&Protection>,
    ) {
        let counter = file.counter.as_ref().map(|file| &file.get_ref().signal);
        let checksum = file.checksum.as_ref().map(|file| &file.get_ref().signal);
        for name in [counter, checksum].into_iter().flatten() {
            let Some(signal) = self.message.signal(name.get_ref()) else { continue };
            let mut patch = Patch::default();
            if patch.set(&signal.codec, 0).is_ok() && self.placed.iter().any(|known| known.overlaps(&patch)) {
                let reason = format!("the bits of {} are set elsewhere as well", signal.name);
                binder.refuse(name.span(), reason, "set each bit once");
            }
            self.placed.push(patch);
            self.named.push(signal.name.clone());
        }
        // The header of an E2E profile has no signals of its own in many DBCs: those it covers need no value.
        if let (Some(Protection::E2e { profile, .. }), Some(e2e)) = (protection, &file.e2e) {
            let (mut low, mut high) = ([0; MAX_DATA], [0xFF; MAX_DATA]);
            let length = self.message.length.min(MAX_DATA);
            profile.protect(0, &mut low[..length]);
            profile.protect(0, &mut high[..length]);
            for signal in &self.message.signals {
                let mut patch = Patch::default();
                let kept = patch.set(&signal.codec, 0).is_ok() && {
                    let (lowest, highest) = signal.codec.range();
                    let all = if lowest < 0 { -1 } else { highest };
                    signal.codec.value(&low) == 0 && signal.codec.value(&high) == all
                };
                if !kept && self.named.contains(&signal.name) {
                    let reason = format!("{} lies in the E2E header", signal.name);
                    binder.refuse(e2e.span(), reason, "remove its value: the profile writes it");
                } else if !kept {
                    self.named.push(signal.name.clone());
                }
            }
        }
    }

    fn refuse_unnamed(&self, binder: &mut Binder<'_>, file: &CommandMessageFile) {
        let signals = self.message.signals.iter().map(|signal| &signal.name);
        let unnamed: Vec<_> = signals.filter(|name| !self.named.contains(name)).map(String::as_str).collect();
        if !unnamed.is_empty() {
            let reason = format!("nothing says what is sent in {}", unnamed.join(", "));
            binder.refuse(file.name.span(), reason, "give each a raw value in `constants`");
        }
    }
}

/// States with the same values would ask for what nobody wants, or for something with no authority. The
/// first state is "off", and with `has_none` the last one is "none", which may be the same as "off".
fn must_differ(binder: &mut Binder<'_>, states: &[&StateFile], patches: &[Patch], has_none: bool) {
    for (at, patch) in patches.iter().enumerate() {
        let is_none = has_none && at + 1 == patches.len();
        let others = patches.iter().take(at).skip(usize::from(is_none));
        if let Some(state) = states.get(at).filter(|_| others.clone().any(|other| other == patch)) {
            let remedy = "give each state values of its own; only `none` may be the same as `off`";
            binder.refuse(state.span(), "another state of the group has the same values", remedy);
        }
    }
}

fn timing(binder: &mut Binder<'_>, file: &CommandMessageFile, message: &Message) -> SendTiming {
    let cycle = message.cycle_ms.map(u64::from);
    if file.period_ms.is_none() && cycle.is_none_or(|ms| !PERIODS_MS.contains(&ms)) {
        let reason = format!("no period for {}: the DBC has no usable GenMsgCycleTime for it", message.name);
        binder.refuse(file.name.span(), reason, "add period_ms");
    }
    let cycle = cycle.unwrap_or(*PERIODS_MS.end());
    let period = within(binder, file.period_ms.as_ref(), cycle, PERIODS_MS);
    let period_ms = file.period_ms.as_ref().map_or(cycle, |ms| *ms.get_ref()).max(1);
    // As long as the period it would make every delay a lasting one.
    let default_gap = MIN_GAP_MS.min(period_ms / 2);
    let min_send_interval = within(binder, file.min_send_interval_ms.as_ref(), default_gap, 1..=period_ms);
    let least_ms = u64::try_from(min_send_interval.as_millis()).unwrap_or(1).min(period_ms);
    let burst_gap = within(binder, file.burst_gap_ms.as_ref(), BURST_GAP_MS, least_ms..=period_ms);
    let remedy = format!("give 1 to {MAX_BURST}");
    let burst =
        binder.checker.in_range(file.burst.as_ref(), &(1..=MAX_BURST), "invalid burst of {} frames", &remedy);
    SendTiming { period, burst: burst.unwrap_or(1), burst_gap, min_send_interval }
}

fn button_rules(binder: &mut Binder<'_>, file: &ButtonFile, timing: SendTiming) -> PushButtonSettings {
    let longest_ms = *PERIODS_MS.end();
    let period_ms = u64::try_from(timing.period.as_millis()).unwrap_or(longest_ms).min(longest_ms);
    // A press no frame is sent in is not a press.
    let range = period_ms..=MAX_PRESS_MS;
    let press = within(binder, file.press_ms.as_ref(), PRESS_MS, range.clone());
    let wait = within(binder, file.wait_ms.as_ref(), WAIT_MS, range);
    if let Some(attempts) = file.attempts.as_ref().filter(|attempts| *attempts.get_ref() == 0) {
        binder.refuse(attempts.span(), "a button that is never pressed", "give 1 to 255");
    }
    let attempts = file.attempts.as_ref().map_or(ATTEMPTS, |attempts| *attempts.get_ref());
    PushButtonSettings { press, wait, attempts }
}

/// A time within a range of milliseconds, and the nearest to `default` without one.
fn within(
    binder: &mut Binder<'_>,
    given: Option<&Spanned<u64>>,
    default: u64,
    range: RangeInclusive<u64>,
) -> Duration {
    let time = binder.checker.millis(given, &range, "{} ms is not possible here");
    time.unwrap_or(Duration::from_millis(default.clamp(*range.start(), *range.end())))
}

/// Counter and checksum, by the same rules as of received messages.
fn protection(binder: &mut Binder<'_>, file: &CommandMessageFile, message: &Message) -> Option<Protection> {
    if let Some(counter) = &file.counter
        && counter.get_ref().increments_on.0 == IncrementsOn::Changes
    {
        let remedy = "remove `increments_on`";
        binder.refuse(counter.get_ref().signal.span(), "the counter of a command counts every frame", remedy);
    }
    let asked = Asked {
        checksum: file.checksum.as_ref(),
        counter: file.counter.as_ref(),
        e2e: file.e2e.as_ref(),
        ..Asked::default()
    };
    integrity(binder, &asked, message, None).map(|integrity| integrity.protection)
}

/// What goes out without authority: what the message can say. Parts that share a message need a way each
/// to ask for nothing, or a request for one would be one for both.
fn idle(binder: &mut Binder<'_>, file: &CommandMessageFile) -> Idle {
    let turn = file.turn.as_ref().map(Spanned::get_ref);
    let hazard = file.hazard.as_ref().map(Spanned::get_ref);
    let nones = [turn.map(|part| part.none.is_some()), hazard.map(|part| part.none.is_some())];
    let has_nones = nones.iter().flatten().all(|has| *has);
    if turn.is_none() && hazard.is_none() {
        let remedy = "give it `turn` or `hazard`, or remove it";
        binder.refuse(file.name.span(), "this message asks for nothing", remedy);
    }
    if turn.is_some_and(|part| part.hazard.is_some()) && hazard.is_some() {
        let remedy = "remove the state `hazard` of `turn`, or the part `hazard`";
        binder.refuse(file.name.span(), "this message asks for hazard lights in two ways", remedy);
    }
    if turn.is_some() && hazard.is_some() && !has_nones {
        let remedy = "give `turn` and `hazard` a state `none` each, in which the vehicle does as it likes";
        let reason = "turn indicators and hazard lights share this message, and one is to be asked for alone";
        binder.refuse(file.name.span(), reason, remedy);
    }
    let can_be_neutral = file.enable.is_some() || has_nones;
    match file.idle.as_ref().map(|idle| (idle.span(), idle.get_ref().0)) {
        Some((span, Idle::Neutral)) if !can_be_neutral => {
            let remedy = "give `enable` or a state `none`, or idle = \"silent\"";
            binder.refuse(span, "nothing in this message says that nothing is asked for", remedy);
            Idle::Silent
        }
        Some((_, Idle::Neutral)) => Idle::Neutral,
        None if can_be_neutral => Idle::Neutral,
        Some((_, Idle::Silent)) | None => Idle::Silent,
    }
}
