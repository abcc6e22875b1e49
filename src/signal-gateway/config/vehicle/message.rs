//! `[message.*]` of a profile: how long each bound message is valid, and its integrity checks.

use std::time::Duration;

use super::binder::Binder;
use super::integrity::integrity;
use super::life_signs::LifeSigns;
use crate::config::reading::{
    Fields, Keywords, Kind, LocatedText, Location, MAX_LIMIT_MS, MissingTimeout, Problem,
};
use can_signal::can::{CanId, IdMatch, SourceAddresses};
use can_signal::dbc::model::Message;
use can_signal::validation::table::{BoundMessage, Timing};
use gateway_core::command::allow_list::AllowList;

/// The default of a timeout in multiples of `GenMsgCycleTime` …
const CYCLES_UNTIL_STALE: u64 = 5;
/// … and its lower bound: a busy bus and a loaded PC can hold a frame back for some 100 ms.
const MIN_DEFAULT_TIMEOUT_MS: u64 = 200;

/// Minimum default for the status of the vehicle: Autoware discards a speed that is older than 200 ms.
const MIN_STATUS_TIMEOUT_MS: u64 = 50;

/// The highest source address of a control unit; 254 stands for none, 255 for all.
const MAX_SOURCE_ADDRESS: u8 = 253;

/// The timing of a message that is sent periodically, without its timeout.
const CYCLIC: Timing = Timing::Cyclic { timeout: Duration::ZERO };
/// Timings without their timeouts.
const TIMINGS: Keywords<Timing> = &[
    ("cyclic", CYCLIC),
    ("event", Timing::Event),
    ("event_cyclic", Timing::EventCyclic { timeout: Duration::ZERO }),
];

struct MessageSection<'c> {
    name: &'c str,
    /// Location of the name.
    location: &'c Location,
    /// Bus, if several buses have a message with this name.
    bus: Option<LocatedText>,
    /// Without the timeout; `None` if it was refused.
    timing: Option<Timing>,
    /// Silence after which its values are stale.
    timeout: Option<Duration>,
    /// Senders of a J1939 message; `None` = only the identifier in the DBC.
    sources: Option<SourceAddresses>,
    fields: Fields<'c>,
}

pub(super) struct MessageSections<'c>(Vec<MessageSection<'c>>);

impl<'c> MessageSections<'c> {
    /// Reads every section; refuses a section for a bus that does not exist.
    pub(super) fn read(binder: &Binder<'_>, top: &Fields<'c>) -> Self {
        let mut sections = Vec::new();
        for entry in top.entries("message", "write [message.<NAME>]") {
            let Some(fields) = Fields::of(top.checker, &entry.value) else { continue };
            let bus = fields.string("bus");
            if let Some(bus) =
                bus.as_ref().filter(|bus| binder.buses.iter().all(|known| known.bus != bus.text))
            {
                binder.refuse_bus(&bus.location, &bus.text);
                fields.accept_rest();
            }
            let default = (!fields.has("timing")).then_some(CYCLIC);
            let timing = fields.keyword("timing", TIMINGS).or(default);
            let timeout = fields.limit("timeout_ms");
            if timing == Some(Timing::Event) && timeout.is_some() {
                let remedy = "remove it, or use timing = \"event_cyclic\" for one that is slowly repeated";
                fields.refuse("timeout_ms", "an event message has no timeout", remedy);
            }
            let (name, location) = (entry.key.as_str(), &entry.location);
            let sources = source_addresses(&fields);
            let section = MessageSection { name, location, bus, timing, timeout, sources, fields };
            let is_short = |(_, message): (usize, &Message)| matches!(message.id, CanId::Standard(_));
            if sources.is_some() && section.described(binder).any(is_short) {
                let reason = format!("{name} has an identifier of 11 bits, without a source address");
                section.fields.refuse("source_addresses", reason, "remove it: J1939 has 29 bits");
            }
            let mut others = sections.iter().filter(|other: &&MessageSection<'_>| {
                section.described(binder).any(|message| other.is_of(binder, message))
            });
            if let Some(MessageSection { name: other, .. }) = others.next() {
                let reason = format!("{name} and {other} are two names of one message");
                binder.refuse(location, reason, "write one section");
            }
            sections.push(section);
        }
        Self(sections)
    }

    fn of(&self, binder: &Binder<'_>, message: (usize, &Message)) -> Option<&MessageSection<'c>> {
        self.0.iter().find(|section| section.is_of(binder, message))
    }

    /// Returns the identifiers of a message.
    pub(super) fn ids(&self, binder: &Binder<'_>, message: (usize, &Message)) -> IdMatch {
        let id = message.1.id;
        let sources = self.of(binder, message).and_then(|section| section.sources);
        sources.and_then(|sources| IdMatch::j1939(id, sources)).unwrap_or(id.into())
    }

    /// Returns the bound messages with their timing and checks.
    pub(super) fn bind(
        self,
        binder: &Binder<'_>,
        top: &Fields<'_>,
        life_signs: &LifeSigns<'_>,
        allowed: Option<&AllowList>,
        all_bound: bool,
    ) -> BoundMessages {
        for section in &self.0 {
            match binder.messages.iter().filter(|bound| section.is_of(binder, **bound)).count() {
                1 => {}
                0 if section.is_heartbeat(binder, life_signs.heartbeats) => {
                    for key in ["timing", "timeout_ms"].into_iter().filter(|key| section.fields.has(key)) {
                        let remedy = "remove it: the message only proves the bus alive";
                        section.fields.refuse(key, "no signal of this message is bound", remedy);
                    }
                }
                0 => {
                    section.fields.accept_rest();
                    // The message may contain a signal that could not be bound.
                    if all_bound {
                        let remedy = "remove the section, or bind one";
                        binder.refuse(section.location, "no signal of this message is bound", remedy);
                    }
                }
                _ => binder.refuse(
                    section.location,
                    "messages of this name are bound on several buses",
                    "add `bus`",
                ),
            }
        }
        let of = |bound| self.of(binder, bound);
        let timings: Vec<_> = binder
            .messages
            .iter()
            .map(|bound| timing(binder, of(*bound), top.location(), bound.1, self.ids(binder, *bound)))
            .collect();
        let mut compiled = Vec::new();
        for (bound @ (bus, message), timing) in binder.messages.iter().zip(&timings) {
            let section = of(*bound);
            let is_proven = life_signs.prove(*bus, |index| timings[index] != Timing::Event);
            if *timing == Timing::Event && !is_proven {
                let at = section.map_or(top.location(), |section| section.location);
                let reason =
                    "an event message is valid while its bus is alive, and no message proves this bus alive";
                binder.refuse(at, reason, "name cyclic messages of the DBC in heartbeat_messages of the bus");
            }
            compiled.push(BoundMessage {
                name: binder.message_name(*bus, message),
                bus: binder.buses[*bus].index,
                ids: self.ids(binder, *bound),
                format: message.format,
                timing: *timing,
                integrity: section
                    .and_then(|section| integrity(binder, &section.fields, message, timing.timeout())),
            });
        }
        self.refuse_common_frames(binder, &compiled, allowed);
        let of_status = compiled.iter().zip(&binder.messages).map(|(compiled, bound)| {
            let has_timeout = of(*bound).is_some_and(|section| section.timeout.is_some());
            let cycle_ms = bound.1.cycle_ms.filter(|_| !has_timeout);
            let timing = cycle_ms.map_or(compiled.timing, |cycle_ms| {
                with_timeout(compiled.timing, default_timeout(cycle_ms, MIN_STATUS_TIMEOUT_MS))
            });
            BoundMessage { timing, ..compiled.clone() }
        });
        let of_status = of_status.collect();
        for section in self.0 {
            section.fields.done();
        }
        BoundMessages { all: compiled, of_status }
    }

    /// Refuses J1939 messages that share frames with another message, or with a message that the gateway
    /// sends.
    fn refuse_common_frames(&self, binder: &Binder<'_>, bound: &[BoundMessage], allowed: Option<&AllowList>) {
        for (message, found) in bound.iter().zip(&binder.messages) {
            let section = self.of(binder, *found).filter(|section| section.sources.is_some());
            let Some(section) = section else { continue };
            let others = bound.iter().filter(|other| other.bus == message.bus && other.ids != message.ids);
            let common =
                others.filter(|other| other.ids.overlaps(message.ids)).map(|other| other.name.as_str());
            let sent = allowed.into_iter().flat_map(AllowList::entries);
            let sent = sent.filter(|(bus, id)| *bus == message.bus && message.ids.contains(*id));
            let ours = sent.map(|_| "a message that the gateway sends");
            for other in common.chain(ours) {
                let reason = format!("{} has frames in common with {other}", message.name);
                section.fields.refuse("source_addresses", reason, "name the senders of each");
            }
        }
    }
}

impl MessageSection<'_> {
    /// Returns true if the section is about this message of this bus. A section for a bus that does not exist
    /// is already refused, and causes no second problem.
    fn is_of(&self, binder: &Binder<'_>, (bus, message): (usize, &Message)) -> bool {
        let is_other =
            |named: &LocatedText| binder.buses.iter().position(|known| known.bus == named.text) != Some(bus);
        let exists = |named: &&LocatedText| binder.buses.iter().any(|known| known.bus == named.text);
        message.is_called(self.name) && !self.bus.as_ref().filter(exists).is_some_and(is_other)
    }

    /// Returns the messages of the DBCs that the section is about.
    fn described<'b>(&self, binder: &Binder<'b>) -> impl Iterator<Item = (usize, &'b Message)> {
        let named = binder.buses.iter().map(|bus| bus.database.message(self.name)).enumerate();
        let named = named.filter_map(|(bus, message)| Some((bus, message?)));
        named.filter(|message| self.is_of(binder, *message))
    }

    /// Returns true if no signal of the message needs to be bound: it only proves that its bus is alive.
    fn is_heartbeat(&self, binder: &Binder<'_>, heartbeats: &[Vec<IdMatch>]) -> bool {
        self.described(binder)
            .any(|(bus, message)| heartbeats[bus].iter().any(|ids| ids.described() == message.id))
    }
}

/// The messages of a profile, in the order of their first use.
pub(super) struct BoundMessages {
    /// Messages for lights, V2I and commands.
    pub(super) all: Vec<BoundMessage>,
    /// The same messages, with the default timeouts of the status.
    pub(super) of_status: Vec<BoundMessage>,
}

/// Returns the default timeout of a message by its period, 0 without one.
fn default_timeout(cycle_ms: u32, min_ms: u64) -> Duration {
    Duration::from_millis((u64::from(cycle_ms) * CYCLES_UNTIL_STALE).clamp(min_ms, MAX_LIMIT_MS))
}

fn with_timeout(timing: Timing, timeout: Duration) -> Timing {
    match timing {
        Timing::Cyclic { .. } => Timing::Cyclic { timeout },
        Timing::EventCyclic { .. } => Timing::EventCyclic { timeout },
        Timing::Event => Timing::Event,
    }
}

/// Reads `source_addresses`: `"any"`, or a list.
fn source_addresses(fields: &Fields<'_>) -> Option<SourceAddresses> {
    const EXAMPLE: &str = "write \"any\", or a list such as [0x21, 0x27]";
    let value = fields.value("source_addresses")?;
    if fields.is("source_addresses", "any") {
        return Some(SourceAddresses::ANY);
    }
    let given = fields.checker.list(value, EXAMPLE);
    if matches!(&value.kind, Kind::List(items) if items.is_empty()) {
        fields.refuse("source_addresses", "no source address is given", EXAMPLE);
    }
    let addresses =
        given.iter().filter_map(|value| fields.checker.number(value, &(0..=MAX_SOURCE_ADDRESS), ""));
    Some(addresses.collect())
}

fn timing(
    binder: &Binder<'_>,
    section: Option<&MessageSection<'_>>,
    root: &Location,
    message: &Message,
    ids: IdMatch,
) -> Timing {
    let timing = section.map_or(Some(CYCLIC), |section| section.timing);
    if timing == Some(Timing::Event) {
        return Timing::Event;
    }
    let cycle_ms = message.cycle_ms.unwrap_or(0);
    if timing.is_some() && cycle_ms == 0 && section.is_none_or(|section| !section.fields.has("timeout_ms")) {
        let at = section.map_or(root, |section| section.location);
        let name = section.map_or(message.name.as_str(), |section| section.name);
        let reason = format!("no timeout for {name}: the DBC has no GenMsgCycleTime for it");
        let remedy =
            format!("add [message.{name}] timeout_ms; `check LOG --fix` proposes one from a recording");
        let missing = MissingTimeout { profile_key: root.key.to_string(), message: name.to_owned(), ids };
        let problem = binder.checker.source_location(at).problem(reason, remedy);
        binder.checker.adopt(vec![Problem { missing_timeout: Some(Box::new(missing)), ..problem }]);
    }
    let default = default_timeout(cycle_ms, MIN_DEFAULT_TIMEOUT_MS);
    let timeout = section.and_then(|section| section.timeout).unwrap_or(default);
    with_timeout(timing.unwrap_or(CYCLIC), timeout)
}
