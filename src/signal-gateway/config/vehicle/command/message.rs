//! `[[command.message]]` of a profile: one message that may be sent, every bit of it accounted for.

use std::ops::RangeInclusive;
use std::time::Duration;

use super::super::binder::{Binder, split_bus};
use super::super::integrity::protection;
use crate::config::reading::{Fields, Keywords, LocatedText, Value};
use can_signal::can::MAX_DATA;
use can_signal::dbc::model::{Message, Number};
use can_signal::validation::integrity::Protection;
use gateway_base::time::millis;
use gateway_core::command::allow_list::AllowList;
use gateway_core::command::message::{CommandMessage, Enable, HazardPart, Idle, SendTiming, TurnPart};
use gateway_core::command::patch::Patch;
use gateway_core::command::push_button::PushButtonSettings;

const IDLE: Keywords<Idle> = &[("neutral", Idle::Neutral), ("silent", Idle::Silent)];

/// Range of the period of a command, ms.
const PERIODS_MS: RangeInclusive<u64> = 10..=1000;
const BURST_GAP_MS: u64 = 20;
const MIN_GAP_MS: u64 = 10;
const MAX_BURST: u8 = 10;
const PRESS_MS: u64 = 200;
const WAIT_MS: u64 = 800;
const MAX_PRESS_MS: u64 = 60_000;
const ATTEMPTS: u8 = 3;

pub(super) fn command_message(
    binder: &Binder<'_>,
    allowed: &mut AllowList,
    fields: &Fields<'_>,
) -> Option<CommandMessage> {
    let before = binder.checker.count();
    let Some(name) = fields.required_string("name") else {
        fields.accept_rest();
        return None;
    };
    let (bus_name, message_name) = split_bus(&name.text);
    let Some((bus, message)) = binder.find_message(bus_name, message_name, &name.location) else {
        fields.accept_rest();
        return None;
    };
    // Admitted even if another part is refused, for the checks on messages that are both sent and received.
    let permission = allowed.admit(binder.buses[bus].index, message.id, message.length, message.format);
    let remedy = "describe messages that can be sent, each once";
    let permission = binder.checker.accept(&name.location, permission, remedy);
    let mut parts = MessageParts { binder, message, placed: Vec::new(), named: Vec::new() };
    let timing = timing(binder, fields, &name, message);
    refuse_counting_changes(fields);
    let unused_bits = fields.number("unused_bits", 0..=1, "").unwrap_or(0_u8);
    let idle = fields.keyword("idle", IDLE);
    let accompanies = fields.flag("accompanies").unwrap_or_default();
    let before_parts = binder.checker.count();
    let turn = fields.read_table("turn", |section| parts.turn(section));
    let hazard = fields.read_table("hazard", |section| parts.hazard(section, timing));
    let enable = fields.read_table("enable", |section| parts.enable(section));
    let constants = fields.value("constants").map(|value| parts.group(&[value])).unwrap_or_default();
    let protection = protection(binder, fields, message);
    if binder.checker.count() > before_parts {
        return None;
    }
    parts.protected(fields, protection.as_ref());
    parts.refuse_unnamed(&name);
    if accompanies {
        refuse_requests(fields);
    } else {
        check_requests(binder, &name, turn.as_ref(), hazard.as_ref());
    }
    let nones =
        [turn.as_ref().map(|part| part.none.is_some()), hazard.as_ref().map(|part| part.none.is_some())];
    let can_be_neutral = enable.is_some() || nones.iter().flatten().all(|has_none| *has_none);
    if idle == Some(Idle::Neutral) && !can_be_neutral {
        let remedy = "give `enable` or a state `none`, or idle = \"silent\"";
        fields.refuse("idle", "this message cannot express that nothing is requested", remedy);
    }
    let idle = idle.unwrap_or(if can_be_neutral { Idle::Neutral } else { Idle::Silent });
    let mut background = [if unused_bits == 1 { 0xFF } else { 0 }; MAX_DATA];
    for patch in &constants {
        patch.apply(&mut background);
    }
    let name = binder.message_name(bus, message);
    let permission = permission.filter(|_| binder.checker.count() == before)?;
    Some(CommandMessage { name, permission, background, turn, hazard, enable, protection, idle, timing })
}

/// The parts of a message that are accounted for so far.
struct MessageParts<'b> {
    binder: &'b Binder<'b>,
    message: &'b Message,
    /// Bits that are set together, per group.
    placed: Vec<Patch>,
    named: Vec<String>,
}

impl MessageParts<'_> {
    fn turn(&mut self, fields: &Fields<'_>) -> Option<TurnPart> {
        let ([off, left, right], [hazard, none]) =
            self.states(fields, ["off", "left", "right"], ["hazard", "none"])?;
        Some(TurnPart { off, left, right, hazard, none })
    }

    fn hazard(&mut self, fields: &Fields<'_>, timing: SendTiming) -> Option<HazardPart> {
        let button = fields.read_table("button", |section| Some(button_rules(section, timing)));
        let ([off, on], [none]) = self.states(fields, ["off", "on"], ["none"])?;
        Some(HazardPart { off, on, none, button })
    }

    fn enable(&mut self, fields: &Fields<'_>) -> Option<Enable> {
        let ([on, off], []) = self.states(fields, ["on", "off"], [])?;
        Some(Enable { on, off })
    }

    /// Reads a patch for each state of a group; the first state is "off". `None` if a problem was recorded.
    fn states<const N: usize, const M: usize>(
        &mut self,
        fields: &Fields<'_>,
        required: [&'static str; N],
        optional: [&'static str; M],
    ) -> Option<([Patch; N], [Option<Patch>; M])> {
        let is_complete = fields.require(&required, "");
        let given: Vec<_> =
            required.into_iter().chain(optional).filter_map(|key| fields.value(key)).collect();
        let patches = self.group(&given);
        must_differ(self.binder, &given, &patches, fields.has("none"));
        is_complete?;
        let mut patches = patches.into_iter();
        let required: Vec<_> = patches.by_ref().take(N).collect();
        let optional = optional.map(|key| if fields.has(key) { patches.next() } else { None });
        Some((required.try_into().ok()?, optional))
    }

    /// Reads the states of one group, which must all set the same signals; empty if a problem was recorded.
    fn group(&mut self, states: &[&Value]) -> Vec<Patch> {
        let patches: Vec<_> = states.iter().filter_map(|state| self.patch(state)).collect();
        if patches.len() != states.len() {
            return Vec::new();
        }
        let (Some(first), Some(first_state)) = (patches.first(), states.first()) else { return patches };
        if let Some((state, _)) = states.iter().zip(&patches).find(|(_, patch)| !patch.sets_like(first)) {
            let remedy = "give each state of a group the same signals, so that none keeps an old value";
            let reason = "this state sets other signals than the first of its group";
            self.binder.refuse(&state.location, reason, remedy);
            return Vec::new();
        }
        if self.placed.iter().any(|known| known.overlaps(first)) {
            let reason = "these bits are set elsewhere in the message as well";
            self.binder.refuse(&first_state.location, reason, "set each bit once");
        }
        self.placed.push(first.clone());
        patches
    }

    /// Reads raw values by signal: `{ TURN = 1 }`.
    fn patch(&mut self, state: &Value) -> Option<Patch> {
        const EXAMPLE: &str = "give signals with raw values, e.g. { TURN = 1 }";
        let checker = self.binder.checker;
        let before = checker.count();
        let mut patch = Patch::default();
        let entries = checker.entries(state, EXAMPLE);
        if entries.is_empty() && checker.count() == before {
            checker.refuse(&state.location, "no signal is given", EXAMPLE);
        }
        for entry in entries {
            let Some(signal) = self.binder.signal_of(self.message, &entry.key, &entry.location) else {
                continue;
            };
            if signal.number != Number::Integer {
                let reason = format!("{} is a floating-point signal", signal.name);
                checker.refuse(&entry.location, reason, "set signals with integer raw values");
                continue;
            }
            if let Some(raw) = checker.whole::<i128>(&entry.value)
                && let Err(error) = patch.set(&signal.codec, raw)
            {
                let reason = format!("{} cannot be {raw}", signal.name);
                checker.refuse(&entry.value.location, reason, &error.to_string());
            }
            self.named.push(signal.name.clone());
        }
        (checker.count() == before).then_some(patch)
    }

    /// Accounts for counter, checksum and E2E header, which have bits of their own.
    fn protected(&mut self, fields: &Fields<'_>, protection: Option<&Protection>) {
        for section in ["counter", "checksum"].iter().filter_map(|key| fields.table(key)) {
            let Some(signal) = section.string("signal").and_then(|name| self.message.signal(&name.text))
            else {
                continue;
            };
            let mut patch = Patch::default();
            if patch.set(&signal.codec, 0).is_ok() && self.placed.iter().any(|known| known.overlaps(&patch)) {
                let reason = format!("the bits of {} are set elsewhere as well", signal.name);
                section.refuse("signal", reason, "set each bit once");
            }
            self.placed.push(patch);
            self.named.push(signal.name.clone());
        }
        // The header of an E2E profile has no signals of its own in many DBCs: signals that it covers need no
        // value.
        if let Some(Protection::E2e { profile, .. }) = protection {
            let (mut low, mut high) = ([0; MAX_DATA], [0xFF; MAX_DATA]);
            let length = self.message.length.min(MAX_DATA);
            profile.protect(0, &mut low[..length]);
            profile.protect(0, &mut high[..length]);
            for signal in &self.message.signals {
                let mut patch = Patch::default();
                let is_kept = patch.set(&signal.codec, 0).is_ok() && {
                    let (lowest, highest) = signal.codec.range();
                    let all = if lowest < 0 { -1 } else { highest };
                    signal.codec.value(&low) == 0 && signal.codec.value(&high) == all
                };
                if !is_kept && self.named.contains(&signal.name) {
                    let reason = format!("{} lies in the E2E header", signal.name);
                    fields.refuse("e2e", reason, "remove its value: the profile writes it");
                } else if !is_kept {
                    self.named.push(signal.name.clone());
                }
            }
        }
    }

    fn refuse_unnamed(&self, name: &LocatedText) {
        let signals = self.message.signals.iter().map(|signal| &signal.name);
        let unnamed: Vec<_> = signals.filter(|name| !self.named.contains(name)).map(String::as_str).collect();
        if !unnamed.is_empty() {
            let reason = format!("no value is given for {}", unnamed.join(", "));
            self.binder.refuse(&name.location, reason, "give each a raw value in `constants`");
        }
    }
}

/// Refuses states with the same values, which would request the wrong state, or request something without
/// authority. The first state is "off", and with `has_none` the last state is "none", which may equal "off".
fn must_differ(binder: &Binder<'_>, states: &[&Value], patches: &[Patch], has_none: bool) {
    for (at, patch) in patches.iter().enumerate() {
        let is_none = has_none && at + 1 == patches.len();
        let others = patches.iter().take(at).skip(usize::from(is_none));
        if let Some(state) = states.get(at).filter(|_| others.clone().any(|other| other == patch)) {
            let remedy = "give each state values of its own; only `none` may be the same as `off`";
            binder.refuse(&state.location, "another state of the group has the same values", remedy);
        }
    }
}

/// Reads the times between frames; the period defaults to the cycle time of the DBC.
fn timing(binder: &Binder<'_>, fields: &Fields<'_>, name: &LocatedText, message: &Message) -> SendTiming {
    let cycle = message.cycle_ms.map(u64::from);
    if !fields.has("period_ms") && cycle.is_none_or(|ms| !PERIODS_MS.contains(&ms)) {
        let reason = format!("no period for {}: the DBC has no usable GenMsgCycleTime for it", message.name);
        binder.refuse(&name.location, reason, "add period_ms");
    }
    let period = within(fields, "period_ms", cycle.unwrap_or(*PERIODS_MS.end()), PERIODS_MS);
    let period_ms = millis(period);
    // With a gap as long as the period, every delay would be permanent.
    let default_gap = MIN_GAP_MS.min(period_ms / 2);
    let min_send_interval = within(fields, "min_send_interval_ms", default_gap, 1..=period_ms);
    let burst_gaps = millis(min_send_interval)..=period_ms;
    SendTiming {
        period,
        burst: fields.number("burst", 1..=MAX_BURST, "frames").unwrap_or(1),
        burst_gap: within(fields, "burst_gap_ms", BURST_GAP_MS, burst_gaps),
        min_send_interval,
    }
}

fn button_rules(fields: &Fields<'_>, timing: SendTiming) -> PushButtonSettings {
    // Without a frame during the press there is no press.
    let range = millis(timing.period)..=MAX_PRESS_MS;
    PushButtonSettings {
        press: within(fields, "press_ms", PRESS_MS, range.clone()),
        wait: within(fields, "wait_ms", WAIT_MS, range),
        attempts: fields.number("attempts", 1..=u8::MAX, "").unwrap_or(ATTEMPTS),
    }
}

/// Reads a time within a range of milliseconds; if absent, returns the time in the range that is nearest to
/// `default`.
fn within(fields: &Fields<'_>, key: &'static str, default: u64, range: RangeInclusive<u64>) -> Duration {
    let default = Duration::from_millis(default.clamp(*range.start(), *range.end()));
    fields.millis(key, range).unwrap_or(default)
}

/// Refuses counters that count changes: the counter of a command counts every frame.
fn refuse_counting_changes(fields: &Fields<'_>) {
    let Some(counter) = fields.table("counter") else { return };
    if counter.text("increments_on").is_some_and(|counts| counts.text == "changes") {
        let remedy = "remove `increments_on`";
        counter.refuse("increments_on", "the counter of a command counts every frame", remedy);
    }
}

/// Refuses parts that request something in a message that only accompanies others.
fn refuse_requests(fields: &Fields<'_>) {
    for key in ["turn", "hazard", "enable"].iter().filter(|key| fields.has(key)) {
        let reason = "a message that accompanies others requests nothing";
        fields.refuse(key, reason, &format!("remove `{key}`, or `accompanies`"));
    }
}

/// Refuses a message that requests nothing, or the hazard lights twice. Parts that share a message each need
/// a state `none`; otherwise a request for one would also be a request for the other.
fn check_requests(
    binder: &Binder<'_>,
    name: &LocatedText,
    turn: Option<&TurnPart>,
    hazard: Option<&HazardPart>,
) {
    let refuse = |reason, remedy| binder.refuse(&name.location, reason, remedy);
    match (turn, hazard) {
        (None, None) => {
            let remedy = "give it `turn` or `hazard`; or `accompanies = true`, where the vehicle expects it beside the others";
            refuse("this message requests nothing", remedy);
        }
        (Some(turn), Some(hazard)) => {
            if turn.hazard.is_some() {
                let remedy = "remove the state `hazard` of `turn`, or the part `hazard`";
                refuse("this message requests the hazard lights twice", remedy);
            }
            if turn.none.is_none() || hazard.none.is_none() {
                let reason =
                    "turn indicators and hazard lights share this message, but are requested separately";
                refuse(reason, "give `turn` and `hazard` a state `none` each, which requests nothing");
            }
        }
        (Some(_), None) | (None, Some(_)) => {}
    }
}
