//! From a vehicle profile and its DBCs to compiled bindings.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use toml::Spanned;

use super::files::Files;
use super::problem::{Document, Problem};
use super::roles::{Binder, Meanings, ProfileBus};
use super::vehicle_file::{
    FaultSignalFile, HazardFile, HazardFrom, OnFaultFile, RawValues, SwitchFile, TimingFile, TurnFile,
    VehicleFile, WhileHazardFile,
};
use crate::core::dbc;
use crate::core::dbc::model::{Database, Message};
use crate::core::event::BusIndex;
use crate::core::frame::CanId;
use crate::core::vehicle_lights::binding::{
    BothOn, BoundMessage, FaultBinding, FaultSignal, HazardBinding, HazardCode, LightsBinding, Role, Timing,
    TurnBinding, TurnCode, TurnWhileHazard,
};
use crate::core::vehicle_lights::meaning::Meaning;

/// What a profile comes to.
#[derive(Debug)]
pub struct Vehicle {
    /// For people.
    pub name: String,
    /// Its buses, in the order of their names; [`BusIndex`] points here.
    pub buses: Vec<VehicleBus>,
    /// Its lights.
    pub lights: LightsBinding,
}

/// A bus as the profile describes it.
#[derive(Debug)]
pub struct VehicleBus {
    /// Name in the profile.
    pub name: String,
    /// Further messages that prove it alive.
    pub alive_by: Vec<CanId>,
    /// Longest silence while awake.
    pub alive_timeout: Duration,
    /// Whether the whole bus may fall asleep.
    pub may_sleep: bool,
    /// Path of its DBC.
    pub dbc_path: PathBuf,
    /// Its DBC.
    pub database: Database,
}

/// Silence that ends a bus's life when the profile gives none, at least.
const ALIVE_TIMEOUT_MS: u64 = 1000;
/// A timeout in multiples of `GenMsgCycleTime`, when the profile gives none…
const CYCLES_UNTIL_STALE: u64 = 5;
/// …and its lower bound: a busy bus and a loaded PC can hold a frame back for some 100 ms.
const SHORTEST_DEFAULT_TIMEOUT_MS: u64 = 200;
/// No believed silence is longer than an hour.
const LONGEST_TIMEOUT_MS: u64 = 3_600_000;

/// Compiles a profile.
///
/// # Errors
/// Every problem found, each with its place in `document`.
pub fn compile(document: &Document, file: &VehicleFile, files: &dyn Files) -> Result<Vehicle, Vec<Problem>> {
    let buses = read_buses(document, file, files)?;
    let mut binder = Binder::new(document, &buses);
    let turn = turn(&mut binder, &file.turn);
    let hazard = hazard(&mut binder, &file.hazard, turn.as_ref());
    let turn_file = file.turn.get_ref();
    let hazard_file = file.hazard.get_ref();
    let turn_faults = faults(&mut binder, &turn_file.fault_signal, turn_file.on_fault);
    let hazard_faults = faults(&mut binder, &hazard_file.fault_signal, hazard_file.on_fault);
    let turn_while_hazard = while_hazard(&mut binder, turn_file, hazard_file);
    let alive_by: Vec<_> = buses.iter().map(|bus| alive_by(&mut binder, file, bus)).collect();
    let messages = messages(&mut binder, file, &alive_by);
    let (signals, problems) = (binder.signals, binder.problems);
    match (turn, hazard, problems) {
        (Some(turn), Some(hazard), problems) if problems.is_empty() => {
            let lights = LightsBinding {
                messages,
                signals,
                turn,
                turn_faults,
                hazard,
                hazard_faults,
                turn_while_hazard,
            };
            let limits: Vec<_> = buses.iter().map(|bus| alive_timeout(file, bus, &lights.messages)).collect();
            let buses =
                buses.into_iter().zip(alive_by).zip(limits).map(|((bus, alive_by), limit)| VehicleBus {
                    alive_timeout: limit,
                    may_sleep: file.bus.get(bus.name.as_str()).is_some_and(|bus| bus.may_sleep),
                    alive_by,
                    dbc_path: bus.dbc_path.into(),
                    name: bus.name,
                    database: bus.database,
                });
            Ok(Vehicle { name: file.name.clone(), buses: buses.collect(), lights })
        }
        (_, _, problems) => Err(problems),
    }
}

fn read_buses(
    document: &Document,
    file: &VehicleFile,
    files: &dyn Files,
) -> Result<Vec<ProfileBus>, Vec<Problem>> {
    let mut problems = Vec::new();
    let mut buses = Vec::new();
    for (index, (name, bus)) in (0..=u8::MAX).zip(&file.bus) {
        let path = document.path().parent().unwrap_or(Path::new("")).join(bus.dbc.get_ref());
        match files.read(&path) {
            Ok(bytes) => buses.push(ProfileBus {
                name: name.get_ref().clone(),
                index: BusIndex(index),
                dbc_path: path.display().to_string(),
                database: dbc::parse(&bytes),
            }),
            Err(error) => problems.push(document.problem(
                bus.dbc.span(),
                format!("cannot read {}: {error}", path.display()),
                "give the DBC's path relative to this file",
            )),
        }
        if let Some(limit) = bus.alive_timeout_ms.as_ref().filter(|limit| !is_timeout(*limit.get_ref())) {
            problems.push(out_of_range(document, limit));
        }
    }
    if file.bus.len() > usize::from(u8::MAX) {
        problems.push(document.problem(0..0, "more than 255 buses", "describe fewer"));
    }
    if problems.is_empty() { Ok(buses) } else { Err(problems) }
}

fn is_timeout(ms: u64) -> bool {
    (1..=LONGEST_TIMEOUT_MS).contains(&ms)
}

fn out_of_range(document: &Document, limit: &Spanned<u64>) -> Problem {
    let reason = format!("{} ms is no usable limit", limit.get_ref());
    document.problem(limit.span(), reason, format!("give 1 to {LONGEST_TIMEOUT_MS} ms"))
}

/// As the profile says; by default no bus is called silent while its liveliest message may be.
fn alive_timeout(file: &VehicleFile, bus: &ProfileBus, messages: &[BoundMessage]) -> Duration {
    let given = file.bus.get(bus.name.as_str()).and_then(|bus| bus.alive_timeout_ms.as_ref());
    let silences = messages.iter().filter(|message| message.bus == bus.index).filter_map(|message| {
        match message.timing {
            Timing::Cyclic { timeout } => Some(timeout),
            Timing::Event => None,
        }
    });
    let default = silences.min().unwrap_or_default().max(Duration::from_millis(ALIVE_TIMEOUT_MS));
    given.map_or(default, |ms| Duration::from_millis(*ms.get_ref()))
}

/// The three ways to bind the turn state.
const FORMS: &str = "give `signal` with off, left and right, or `left_signal`, `right_signal` and `both_on`, \
                         or `fitted = false`";

fn turn(binder: &mut Binder<'_>, file: &Spanned<TurnFile>) -> Option<TurnBinding> {
    let (span, file) = (file.span(), file.get_ref());
    let enumerated: Vec<_> = [
        file.signal.as_ref().map(Spanned::span),
        file.off.as_ref().map(Spanned::span),
        file.left.as_ref().map(Spanned::span),
        file.right.as_ref().map(Spanned::span),
        file.both.as_ref().map(Spanned::span),
        file.not_available.as_ref().map(Spanned::span),
        file.fault.as_ref().map(Spanned::span),
    ]
    .into_iter()
    .flatten()
    .collect();
    let pair: Vec<_> = [
        file.left_signal.as_ref().map(Spanned::span),
        file.right_signal.as_ref().map(Spanned::span),
        file.both_on.as_ref().map(Spanned::span),
    ]
    .into_iter()
    .flatten()
    .collect();
    let not_fitted = file.fitted.as_ref().is_some_and(|fitted| !fitted.get_ref());
    match (not_fitted, enumerated.first(), pair.first()) {
        (true, None, None) => Some(TurnBinding::NotFitted),
        (true, Some(extra), _) | (true, None, Some(extra)) => {
            binder.refuse(extra.clone(), "a vehicle without indicators has no turn signal", FORMS);
            None
        }
        (false, Some(_), Some(extra)) => {
            binder.refuse(
                extra.clone(),
                "one enumerated signal and a pair of signals exclude each other",
                FORMS,
            );
            None
        }
        (false, None, None) => {
            binder.refuse(span, "the turn state comes from no signal", FORMS);
            None
        }
        (false, Some(_), None) => enumerated_turn(binder, file, &span),
        (false, None, Some(_)) => turn_pair(binder, file, &span),
    }
}

fn enumerated_turn(
    binder: &mut Binder<'_>,
    file: &TurnFile,
    span: &std::ops::Range<usize>,
) -> Option<TurnBinding> {
    let (Some(signal), Some(off), Some(left), Some(right)) =
        (&file.signal, &file.off, &file.left, &file.right)
    else {
        let missing = missing(&[
            ("signal", file.signal.is_none()),
            ("off", file.off.is_none()),
            ("left", file.left.is_none()),
            ("right", file.right.is_none()),
        ]);
        binder.refuse(span.clone(), missing, "an enumerated turn signal needs signal, off, left and right");
        return None;
    };
    binder.require_values(&[off, left, right]);
    let defined = |code| Meaning::Defined(code);
    let mut meanings: Meanings<'_, TurnCode> = vec![
        (off, defined(TurnCode::Off)),
        (left, defined(TurnCode::Left)),
        (right, defined(TurnCode::Right)),
    ];
    meanings.extend(file.both.iter().map(|values| (values, defined(TurnCode::Both))));
    meanings.extend(file.not_available.iter().map(|values| (values, Meaning::NotAvailable)));
    meanings.extend(file.fault.iter().map(|values| (values, Meaning::Fault)));
    binder.role(signal, &meanings).map(TurnBinding::Enumerated)
}

fn turn_pair(binder: &mut Binder<'_>, file: &TurnFile, span: &std::ops::Range<usize>) -> Option<TurnBinding> {
    let (Some(left_file), Some(right_file), Some(both)) =
        (&file.left_signal, &file.right_signal, &file.both_on)
    else {
        let missing = missing(&[
            ("left_signal", file.left_signal.is_none()),
            ("right_signal", file.right_signal.is_none()),
            ("both_on", file.both_on.is_none()),
        ]);
        let remedy = "a pair of turn signals needs left_signal, right_signal and both_on";
        binder.refuse(span.clone(), missing, remedy);
        return None;
    };
    let left = binder.switch(left_file.get_ref());
    let right = binder.switch(right_file.get_ref());
    let (left, right) = (left?, right?);
    if left.signal == right.signal {
        binder.refuse(right_file.span(), "left and right are the same signal", "bind one signal a side");
        return None;
    }
    Some(TurnBinding::Pair { left, right, both: (*both.get_ref()).into() })
}

/// Names the keys that are missing.
fn missing(keys: &[(&str, bool)]) -> String {
    let missing: Vec<_> = keys.iter().filter(|(_, missing)| *missing).map(|(key, _)| *key).collect();
    format!("{} missing: {}", if missing.len() == 1 { "a key is" } else { "keys are" }, missing.join(", "))
}

/// Whether a turn binding can show "both sides on".
fn shows_both(turn: &TurnBinding) -> bool {
    match turn {
        TurnBinding::NotFitted => false,
        TurnBinding::Enumerated(role) => {
            role.values.entries().iter().any(|(_, meaning)| *meaning == Meaning::Defined(TurnCode::Both))
        }
        TurnBinding::Pair { both, .. } => *both == BothOn::Hazard,
    }
}

fn hazard(
    binder: &mut Binder<'_>,
    file: &Spanned<HazardFile>,
    turn: Option<&TurnBinding>,
) -> Option<HazardBinding> {
    let (span, file) = (file.span(), file.get_ref());
    let lists: [(&str, &Option<RawValues>); 4] = [
        ("on", &file.on),
        ("off", &file.off),
        ("not_available", &file.not_available),
        ("fault", &file.fault),
    ];
    let from = *file.from.get_ref();
    let takes: &[&str] = match from {
        HazardFrom::Signal => &["signal", "on", "off", "not_available", "fault"],
        HazardFrom::Reason => &["signal", "off", "not_available", "fault", "reasons"],
        HazardFrom::BothSides | HazardFrom::NotFitted | HazardFrom::Unbound => &[],
    };
    let before = binder.problems.len();
    let given = lists.iter().filter_map(|(key, values)| values.as_ref().map(|values| (*key, values.span())));
    let signal = file.signal.as_ref().map(|signal| ("signal", signal.span()));
    let reasons = file.reasons.as_ref().map(|reasons| ("reasons", reasons.span()));
    for (key, at) in given.chain(signal).chain(reasons).filter(|(key, _)| !takes.contains(key)) {
        binder.refuse(at, format!("`{key}` has no meaning with this `from`"), "remove it, or change `from`");
    }
    if binder.problems.len() > before {
        return None;
    }
    match from {
        HazardFrom::NotFitted => Some(HazardBinding::NotFitted),
        HazardFrom::Unbound => Some(HazardBinding::Unbound),
        HazardFrom::BothSides => {
            if turn.is_some_and(|turn| !shows_both(turn)) {
                let remedy = "give [turn] `both` values or `both_on = \"hazard\"`, or change `from`";
                binder.refuse(file.from.span(), "the turn binding cannot show both sides on", remedy);
                return None;
            }
            Some(HazardBinding::BothLamps)
        }
        HazardFrom::Signal => {
            let (Some(signal), Some(on), Some(off)) = (&file.signal, &file.on, &file.off) else {
                let lists = [("on", file.on.is_none()), ("off", file.off.is_none())];
                let missing = missing(&[("signal", file.signal.is_none()), lists[0], lists[1]]);
                binder.refuse(span, missing, "a hazard signal needs signal, on and off");
                return None;
            };
            let code = |active| Meaning::Defined(HazardCode { active, reason: None });
            binder.require_values(&[on, off]);
            let meanings = vec![(on, code(true)), (off, code(false))];
            let role = hazard_role(binder, file, signal, meanings)?;
            Some(HazardBinding::Signal { role, reasons: vec![] })
        }
        HazardFrom::Reason => {
            let (Some(signal), Some(off), Some(reasons)) = (&file.signal, &file.off, &file.reasons) else {
                let lists = [("off", file.off.is_none()), ("reasons", file.reasons.is_none())];
                let missing = missing(&[("signal", file.signal.is_none()), lists[0], lists[1]]);
                binder.refuse(span, missing, "a hazard reason needs signal, off and [hazard.reasons]");
                return None;
            };
            reason_binding(binder, file, signal, off, reasons)
        }
    }
}

fn reason_binding(
    binder: &mut Binder<'_>,
    file: &HazardFile,
    signal: &Spanned<String>,
    off: &RawValues,
    reasons: &Spanned<BTreeMap<String, RawValues>>,
) -> Option<HazardBinding> {
    let (span, reasons) = (reasons.span(), reasons.get_ref());
    if reasons.is_empty() || reasons.len() > usize::from(u8::MAX) {
        binder.refuse(span, "no reason is named, or more than 255", "name reasons in [hazard.reasons]");
        return None;
    }
    binder.require_values(&reasons.values().chain([off]).collect::<Vec<_>>());
    let mut meanings = vec![(off, Meaning::Defined(HazardCode { active: false, reason: None }))];
    meanings.extend(
        (0..=u8::MAX).zip(reasons.values()).map(|(index, values)| {
            (values, Meaning::Defined(HazardCode { active: true, reason: Some(index) }))
        }),
    );
    let role = hazard_role(binder, file, signal, meanings)?;
    Some(HazardBinding::Signal { role, reasons: reasons.keys().cloned().collect() })
}

fn hazard_role<'f>(
    binder: &mut Binder<'_>,
    file: &'f HazardFile,
    signal: &Spanned<String>,
    mut meanings: Meanings<'f, HazardCode>,
) -> Option<Role<HazardCode>> {
    meanings.extend(file.not_available.iter().map(|values| (values, Meaning::NotAvailable)));
    meanings.extend(file.fault.iter().map(|values| (values, Meaning::Fault)));
    binder.role(signal, &meanings)
}

fn faults(binder: &mut Binder<'_>, files: &[FaultSignalFile], on_fault: OnFaultFile) -> FaultBinding {
    let fault = |file: &FaultSignalFile| {
        let switch = SwitchFile {
            signal: file.signal.clone(),
            on: file.on.clone(),
            off: file.off.clone(),
            not_available: None,
            fault: None,
        };
        Some(FaultSignal { role: binder.switch(&switch)?, text: file.text.clone() })
    };
    FaultBinding { signals: files.iter().filter_map(fault).collect(), on_fault: on_fault.into() }
}

fn while_hazard(binder: &mut Binder<'_>, turn: &TurnFile, hazard: &HazardFile) -> TurnWhileHazard {
    let Some(policy) = &turn.while_hazard else { return TurnWhileHazard::default() };
    if *policy.get_ref() == WhileHazardFile::Keep && *hazard.from.get_ref() == HazardFrom::BothSides {
        let reason = "hazard comes from both sides, so there is no turn state to keep";
        binder.refuse(policy.span(), reason, "use while_hazard = \"disable\"");
    }
    (*policy.get_ref()).into()
}

fn alive_by(binder: &mut Binder<'_>, file: &VehicleFile, bus: &ProfileBus) -> Vec<CanId> {
    let names = file.bus.get(bus.name.as_str()).map_or(&[][..], |bus| &bus.alive_by);
    let find = |name: &Spanned<String>| {
        binder.find_message(Some(&bus.name), name.get_ref(), name.span()).map(|(_, message)| message.id)
    };
    names.iter().filter_map(find).collect()
}

fn messages(binder: &mut Binder<'_>, file: &VehicleFile, alive_by: &[Vec<CanId>]) -> Vec<BoundMessage> {
    for (name, timing) in &file.message {
        if let Some(bus) = timing.bus.as_ref().filter(|bus| !has_bus(binder, bus)) {
            binder.refuse_bus(bus.span(), bus.get_ref());
            continue;
        }
        let named = timing.bus.as_ref().map(|bus| bus.get_ref().as_str());
        let bound = |(bus, message): &(usize, &Message)| {
            message.name == *name.get_ref() && named.is_none_or(|named| binder.buses[*bus].name == named)
        };
        match binder.messages.iter().filter(|message| bound(message)).count() {
            1 => {}
            0 => binder.refuse(
                name.span(),
                "no bound signal is in this message",
                "remove the section, or bind a signal of it",
            ),
            _ => binder.refuse(name.span(), "bound on several buses", "add `bus`"),
        }
    }
    let bound = binder.messages.clone();
    let timings: Vec<_> = bound.iter().map(|(bus, message)| timing(binder, file, *bus, message)).collect();
    for ((bus, message), timing) in bound.iter().zip(&timings) {
        let proof =
            |(other, timing): (&(usize, &Message), &Timing)| other.0 == *bus && *timing != Timing::Event;
        let proven = !alive_by[*bus].is_empty() || bound.iter().zip(&timings).any(proof);
        if *timing == Timing::Event && !proven {
            let at = file.message.iter().find(|(name, _)| *name.get_ref() == message.name);
            let at = at.map_or(0..0, |(name, _)| name.span());
            let reason = "an event message holds while its bus is alive, and nothing proves this bus alive";
            binder.refuse(at, reason, "name cyclic messages of the DBC in alive_by of the bus");
        }
    }
    let compiled = bound.iter().zip(timings).map(|((bus, message), timing)| BoundMessage {
        name: message.name.clone(),
        bus: binder.buses[*bus].index,
        id: message.id,
        timing,
    });
    compiled.collect()
}

fn has_bus(binder: &Binder<'_>, bus: &Spanned<String>) -> bool {
    binder.buses.iter().any(|known| known.name == *bus.get_ref())
}

fn timing(binder: &mut Binder<'_>, file: &VehicleFile, bus: usize, message: &Message) -> Timing {
    let bus_name = &binder.buses[bus].name;
    let section = file.message.iter().find(|(name, section)| {
        // A bus that does not exist is refused elsewhere and draws no second problem here.
        let named = section.bus.as_ref().filter(|bus| has_bus(binder, bus));
        *name.get_ref() == message.name && named.is_none_or(|named| named.get_ref() == bus_name)
    });
    let timeout = section.and_then(|(_, section)| section.timeout_ms.as_ref());
    match (section.map_or(TimingFile::Cyclic, |(_, section)| section.timing), timeout) {
        (TimingFile::Event, None) => Timing::Event,
        (TimingFile::Event, Some(timeout)) => {
            binder.refuse(
                timeout.span(),
                "an event message has no timeout",
                "remove it, or use timing = \"cyclic\"",
            );
            Timing::Event
        }
        (TimingFile::Cyclic, Some(timeout)) => {
            if !is_timeout(*timeout.get_ref()) {
                binder.problems.push(out_of_range(binder.document, timeout));
            }
            Timing::Cyclic { timeout: Duration::from_millis(*timeout.get_ref()) }
        }
        (TimingFile::Cyclic, None) => {
            let cycle_ms = message.cycle_ms.map_or(0, u64::from);
            if cycle_ms == 0 {
                let at = section.map_or(0..0, |(name, _)| name.span());
                let reason =
                    format!("no timeout for {}: the DBC has no GenMsgCycleTime for it", message.name);
                binder.refuse(at, reason, &format!("add [message.{}] timeout_ms", message.name));
            }
            let timeout_ms =
                (cycle_ms * CYCLES_UNTIL_STALE).clamp(SHORTEST_DEFAULT_TIMEOUT_MS, LONGEST_TIMEOUT_MS);
            Timing::Cyclic { timeout: Duration::from_millis(timeout_ms) }
        }
    }
}
