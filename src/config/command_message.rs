//! From `[[command.message]]` of a vehicle profile to one message that may be sent, every bit of it
//! accounted for.

use std::ops::Range;

use toml::Spanned;

use super::command_profile::{split, within};
use super::command_profile_file::{
    ButtonFile, CommandMessageFile, EnableFile, HazardPartFile, IdleFile, StateFile, TurnPartFile,
};
use super::integrity::integrity;
use super::integrity_file::CountsFile;
use super::roles::Binder;
use super::vehicle_file::{MessageFile, TimingFile};
use crate::core::command::allow_list::AllowList;
use crate::core::command::button::ButtonRules;
use crate::core::command::message::{CommandMessage, Enable, HazardPart, Idle, SendTiming, TurnPart};
use crate::core::command::patch::Patch;
use crate::core::dbc::model::{Message, Number};
use crate::core::frame::MAX_DATA;
use crate::core::trust::integrity::Protection;

/// Slowest and fastest rhythm of a command, ms.
const PERIODS_MS: (u64, u64) = (10, 1000);
const BURST_GAP_MS: u64 = 20;
const LEAST_GAP_MS: u64 = 10;
const LONGEST_BURST: u8 = 10;
const PRESS_MS: u64 = 200;
const WAIT_MS: u64 = 800;
const LONGEST_PRESS_MS: u64 = 60_000;
const ATTEMPTS: u8 = 3;

/// One message; `None` when a problem was noted that leaves nothing to go on with.
pub(super) fn command_message(
    binder: &mut Binder<'_>,
    allowed: &mut AllowList,
    file: &CommandMessageFile,
) -> Option<CommandMessage> {
    let before = binder.problems.len();
    let (bus_name, name) = split(file.name.get_ref());
    let (bus, message) = binder.find_message(bus_name, name, file.name.span())?;
    let mut parts = Parts { message, placed: Vec::new(), named: Vec::new() };
    let turn = file.turn.as_ref().and_then(|file| parts.turn(binder, file.get_ref()));
    let timing = timing(binder, file, message);
    let hazard = file.hazard.as_ref().and_then(|file| parts.hazard(binder, file.get_ref(), timing));
    let enable = file.enable.as_ref().and_then(|file| parts.enable(binder, file.get_ref()));
    let constants = file.constants.as_ref().map(|file| parts.group(binder, &[file])).unwrap_or_default();
    let protection = protection(binder, file, message);
    if binder.problems.len() > before {
        return None;
    }
    parts.protected(binder, file, protection.as_ref());
    parts.refuse_unnamed(binder, file);
    let idle = idle(binder, file);
    let permit = allowed.admit(binder.buses[bus].index, message.id, message.length);
    let permit = permit.map_err(|error| {
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
    let permit = permit.ok().filter(|_| binder.problems.len() == before)?;
    Some(CommandMessage { name, permit, background, turn, hazard, enable, protection, idle, timing })
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
        let states =
            [Some(&file.off), Some(&file.left), Some(&file.right), file.hazard.as_ref(), file.none.as_ref()];
        let given: Vec<_> = states.into_iter().flatten().collect();
        let patches = self.group(binder, &given);
        must_differ(binder, &given, &patches, file.none.is_some());
        let mut patches = patches.into_iter();
        let (off, left, right) = (patches.next()?, patches.next()?, patches.next()?);
        let hazard = file.hazard.as_ref().and_then(|_| patches.next());
        let none = file.none.as_ref().and_then(|_| patches.next());
        Some(TurnPart { off, left, right, hazard, none })
    }

    fn hazard(
        &mut self,
        binder: &mut Binder<'_>,
        file: &HazardPartFile,
        timing: SendTiming,
    ) -> Option<HazardPart> {
        let given: Vec<_> =
            [Some(&file.off), Some(&file.on), file.none.as_ref()].into_iter().flatten().collect();
        let button = file.button.as_ref().map(|button| button_rules(binder, button.get_ref(), timing));
        let patches = self.group(binder, &given);
        must_differ(binder, &given, &patches, file.none.is_some());
        let mut patches = patches.into_iter();
        let (off, on) = (patches.next()?, patches.next()?);
        Some(HazardPart { off, on, none: patches.next(), button })
    }

    fn enable(&mut self, binder: &mut Binder<'_>, file: &EnableFile) -> Option<Enable> {
        let patches = self.group(binder, &[&file.on, &file.off]);
        must_differ(binder, &[&file.on, &file.off], &patches, false);
        let mut patches = patches.into_iter();
        Some(Enable { on: patches.next()?, off: patches.next()? })
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
        let before = binder.problems.len();
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
        (binder.problems.len() == before).then_some(patch)
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
    if file.period_ms.is_none() && cycle.is_none_or(|ms| ms < PERIODS_MS.0 || ms > PERIODS_MS.1) {
        let reason = format!("no period for {}: the DBC has no usable GenMsgCycleTime for it", message.name);
        binder.refuse(file.name.span(), reason, "add period_ms");
    }
    let period = within(binder, file.period_ms.as_ref(), cycle.unwrap_or(PERIODS_MS.1), PERIODS_MS);
    let period_ms = file.period_ms.as_ref().map_or(cycle.unwrap_or(PERIODS_MS.1), |ms| *ms.get_ref()).max(1);
    // As long as the period it would make every delay a lasting one.
    let default_gap = LEAST_GAP_MS.min(period_ms / 2);
    let least_gap = within(binder, file.least_gap_ms.as_ref(), default_gap, (1, period_ms));
    let least_ms = u64::try_from(least_gap.as_millis()).unwrap_or(1).min(period_ms);
    let burst_gap = within(binder, file.burst_gap_ms.as_ref(), BURST_GAP_MS, (least_ms, period_ms));
    if let Some(burst) = file.burst.as_ref().filter(|burst| !(1..=LONGEST_BURST).contains(burst.get_ref())) {
        let reason = format!("{} frames are no burst", burst.get_ref());
        binder.refuse(burst.span(), reason, &format!("give 1 to {LONGEST_BURST}"));
    }
    SendTiming {
        period,
        burst: file.burst.as_ref().map_or(1, |burst| *burst.get_ref()),
        burst_gap,
        least_gap,
    }
}

fn button_rules(binder: &mut Binder<'_>, file: &ButtonFile, timing: SendTiming) -> ButtonRules {
    let period_ms = u64::try_from(timing.period.as_millis()).unwrap_or(PERIODS_MS.1).min(PERIODS_MS.1);
    // A press no frame is sent in is no press.
    let range = (period_ms, LONGEST_PRESS_MS);
    let press = within(binder, file.press_ms.as_ref(), PRESS_MS, range);
    let wait = within(binder, file.wait_ms.as_ref(), WAIT_MS, range);
    if let Some(attempts) = file.attempts.as_ref().filter(|attempts| *attempts.get_ref() == 0) {
        binder.refuse(attempts.span(), "a button that is never pressed", "give 1 to 255");
    }
    ButtonRules {
        press,
        wait,
        attempts: file.attempts.as_ref().map_or(ATTEMPTS, |attempts| *attempts.get_ref()),
    }
}

/// Counter and checksum, by the same rules as of received messages.
fn protection(binder: &mut Binder<'_>, file: &CommandMessageFile, message: &Message) -> Option<Protection> {
    if let Some(counter) = &file.counter
        && counter.get_ref().counts == CountsFile::Changes
    {
        let remedy = "remove `counts`";
        binder.refuse(counter.get_ref().signal.span(), "the counter of a command counts every frame", remedy);
    }
    let received = MessageFile {
        bus: None,
        timing: TimingFile::Cyclic,
        timeout_ms: None,
        length: None,
        checksum: file.checksum.clone(),
        counter: file.counter.clone(),
        e2e: file.e2e.clone(),
        window: None,
    };
    integrity(binder, &received, message, None).map(|integrity| integrity.protection)
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
    match file.idle.as_ref().map(|idle| (idle.span(), *idle.get_ref())) {
        Some((span, IdleFile::Neutral)) if !can_be_neutral => {
            let remedy = "give `enable` or a state `none`, or idle = \"silent\"";
            binder.refuse(span, "nothing in this message says that nothing is asked for", remedy);
            Idle::Silent
        }
        Some((_, IdleFile::Neutral)) => Idle::Neutral,
        None if can_be_neutral => Idle::Neutral,
        Some((_, IdleFile::Silent)) | None => Idle::Silent,
    }
}
