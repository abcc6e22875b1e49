//! `[message.*]` of a profile: how long each bound message is valid, and its integrity checks.

use std::time::Duration;

use super::binder::Binder;
use super::integrity::integrity;
use crate::config::reading::{
    Fields, Keywords, LocatedText, Location, MAX_LIMIT_MS, MissingTimeout, Problem,
};
use crate::core::can::CanId;
use crate::core::dbc::model::Message;
use crate::core::validation::table::{BoundMessage, Timing};

/// The default of a timeout in multiples of `GenMsgCycleTime` …
const CYCLES_UNTIL_STALE: u64 = 5;
/// … and its lower bound: a busy bus and a loaded PC can hold a frame back for some 100 ms.
const MIN_DEFAULT_TIMEOUT_MS: u64 = 200;

/// Send types of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum SendType {
    /// Sent periodically, changed or not.
    #[default]
    Cyclic,
    /// Sent on change, never repeated.
    Event,
    /// Sent on change, and slowly repeated.
    EventCyclic,
}

const TIMINGS: Keywords<SendType> =
    &[("cyclic", SendType::Cyclic), ("event", SendType::Event), ("event_cyclic", SendType::EventCyclic)];

/// The section `[message.<NAME>]` of one message.
struct MessageSection<'c> {
    name: &'c str,
    /// Location of the name.
    location: &'c Location,
    /// The bus, when several have a message of this name.
    bus: Option<LocatedText>,
    /// `None` when it was refused.
    send_type: Option<SendType>,
    /// Silence after which its values are stale.
    timeout: Option<Duration>,
    fields: Fields<'c>,
}

impl<'c> MessageSection<'c> {
    /// Reads every section; one for a bus that does not exist is refused.
    fn all(binder: &Binder<'_>, top: &Fields<'c>) -> Vec<Self> {
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
            let default = (!fields.has("timing")).then(SendType::default);
            let send_type = fields.keyword("timing", TIMINGS).or(default);
            let timeout = fields.limit("timeout_ms");
            if send_type == Some(SendType::Event) && timeout.is_some() {
                let remedy = "remove it, or use timing = \"event_cyclic\" for one that is slowly repeated";
                fields.refuse("timeout_ms", "an event message has no timeout", remedy);
            }
            let (name, location) = (entry.key.as_str(), &entry.location);
            sections.push(Self { name, location, bus, send_type, timeout, fields });
        }
        sections
    }

    /// True if the section is about this message of this bus. One for a bus that does not exist is refused and
    /// causes no second problem.
    fn is_of(&self, binder: &Binder<'_>, (bus, message): (usize, &Message)) -> bool {
        let is_other =
            |named: &LocatedText| binder.buses.iter().position(|known| known.bus == named.text) != Some(bus);
        let exists = |named: &&LocatedText| binder.buses.iter().any(|known| known.bus == named.text);
        self.name == message.name && !self.bus.as_ref().filter(exists).is_some_and(is_other)
    }
}

/// Reads the sections, and gives the bound messages with their timing and their checks.
pub(super) fn messages(
    binder: &Binder<'_>,
    top: &Fields<'_>,
    heartbeat_messages: &[Vec<CanId>],
    all_bound: bool,
) -> Vec<BoundMessage> {
    let sections = MessageSection::all(binder, top);
    for section in &sections {
        match binder.messages.iter().filter(|bound| section.is_of(binder, **bound)).count() {
            1 => {}
            0 => {
                section.fields.accept_rest();
                // A signal that failed to be bound may have been in it.
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
    let of = |bound| sections.iter().find(|section| section.is_of(binder, bound));
    let timings: Vec<_> =
        binder.messages.iter().map(|bound| timing(binder, of(*bound), top.location(), bound.1)).collect();
    let mut compiled = Vec::new();
    for (bound @ (bus, message), timing) in binder.messages.iter().zip(&timings) {
        let section = of(*bound);
        let is_proof =
            |((other, _), timing): (&(usize, _), &Timing)| other == bus && *timing != Timing::Event;
        let is_proven =
            !heartbeat_messages[*bus].is_empty() || binder.messages.iter().zip(&timings).any(is_proof);
        if *timing == Timing::Event && !is_proven {
            let at = section.map_or(top.location(), |section| section.location);
            let reason =
                "an event message is valid while its bus is alive, and no message proves this bus alive";
            binder.refuse(at, reason, "name cyclic messages of the DBC in heartbeat_messages of the bus");
        }
        compiled.push(BoundMessage {
            name: binder.message_name(*bus, message),
            bus: binder.buses[*bus].index,
            id: message.id,
            format: message.format,
            timing: *timing,
            integrity: section
                .and_then(|section| integrity(binder, &section.fields, message, timing.timeout())),
        });
    }
    for section in sections {
        section.fields.done();
    }
    compiled
}

fn timing(
    binder: &Binder<'_>,
    section: Option<&MessageSection<'_>>,
    root: &Location,
    message: &Message,
) -> Timing {
    let send_type = section.map_or(Some(SendType::Cyclic), |section| section.send_type);
    if send_type == Some(SendType::Event) {
        return Timing::Event;
    }
    let cycle_ms = message.cycle_ms.map_or(0, u64::from);
    if send_type.is_some() && cycle_ms == 0 && section.is_none_or(|section| !section.fields.has("timeout_ms"))
    {
        let at = section.map_or(root, |section| section.location);
        let reason = format!("no timeout for {}: the DBC has no GenMsgCycleTime for it", message.name);
        let remedy = format!(
            "add [message.{}] timeout_ms; `check LOG --fix` proposes one from a recording",
            message.name
        );
        let missing = MissingTimeout {
            profile_key: root.key.to_string(),
            message: message.name.clone(),
            id: message.id,
        };
        let problem = binder.checker.source_location(at).problem(reason, remedy);
        binder.checker.adopt(vec![Problem { missing_timeout: Some(Box::new(missing)), ..problem }]);
    }
    let default_ms = (cycle_ms * CYCLES_UNTIL_STALE).clamp(MIN_DEFAULT_TIMEOUT_MS, MAX_LIMIT_MS);
    let timeout = section.and_then(|section| section.timeout).unwrap_or(Duration::from_millis(default_ms));
    if send_type == Some(SendType::EventCyclic) {
        Timing::EventCyclic { timeout }
    } else {
        Timing::Cyclic { timeout }
    }
}
