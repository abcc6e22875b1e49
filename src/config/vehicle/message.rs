//! `[message.*]` of a profile: how long each bound message is believed, and what it must prove.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use super::binder::Binder;
use super::integrity::checksum::ChecksumFile;
use super::integrity::counter::CounterFile;
use super::integrity::e2e::E2eFile;
use super::integrity::window::WindowFile;
use super::integrity::{Asked, integrity};
use crate::config::reading::checker::MAX_LIMIT_MS;
use crate::core::can::frame::CanId;
use crate::core::dbc::model::Message;
use crate::core::validation::table::{BoundMessage, Timing};

/// A timeout in multiples of `GenMsgCycleTime`, when the profile gives none…
const CYCLES_UNTIL_STALE: u64 = 5;
/// …and its lower bound: a busy bus and a loaded PC can hold a frame back for some 100 ms.
const MIN_DEFAULT_TIMEOUT_MS: u64 = 200;

/// The sections by the DBC names of their messages.
type MessageFiles = BTreeMap<Spanned<String>, MessageFile>;

/// `[message.<NAME>]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MessageFile {
    /// The bus, when several have a message of this name.
    pub bus: Option<Spanned<String>>,
    /// How it is sent.
    #[serde(default)]
    pub timing: TimingFile,
    /// Longest believed silence, ms.
    pub timeout_ms: Option<Spanned<u64>>,
    /// The only right length, bytes.
    pub length: Option<Spanned<usize>>,
    /// Its checksum.
    pub checksum: Option<Spanned<ChecksumFile>>,
    /// Its counter.
    pub counter: Option<Spanned<CounterFile>>,
    /// Its E2E protection, instead of the two.
    pub e2e: Option<Spanned<E2eFile>>,
    /// What its latest frames together must show.
    pub window: Option<Spanned<WindowFile>>,
}

impl MessageFile {
    /// What it must prove.
    fn asked(&self) -> Asked<'_> {
        Asked {
            length: self.length.as_ref(),
            checksum: self.checksum.as_ref(),
            counter: self.counter.as_ref(),
            e2e: self.e2e.as_ref(),
            window: self.window.as_ref(),
        }
    }
}

/// `timing = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TimingFile {
    /// Again and again.
    #[default]
    Cyclic,
    /// On change only.
    Event,
    /// On change, and slowly repeated.
    EventCyclic,
}

/// What the sections say of the messages that are bound.
pub(super) fn messages(
    binder: &mut Binder<'_>,
    sections: &MessageFiles,
    heartbeat_messages: &[Vec<CanId>],
    all_bound: bool,
) -> Vec<BoundMessage> {
    for (name, timing) in sections {
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
            // What failed to be bound may have been in it.
            0 if !all_bound => {}
            0 => binder.refuse(
                name.span(),
                "no bound signal is in this message",
                "remove the section, or bind a signal of it",
            ),
            _ => binder.refuse(name.span(), "bound on several buses", "add `bus`"),
        }
    }
    let bound = binder.messages.clone();
    let timings: Vec<_> =
        bound.iter().map(|(bus, message)| timing(binder, sections, *bus, message)).collect();
    for ((bus, message), timing) in bound.iter().zip(&timings) {
        let proof =
            |(other, timing): (&(usize, &Message), &Timing)| other.0 == *bus && *timing != Timing::Event;
        let proven = !heartbeat_messages[*bus].is_empty() || bound.iter().zip(&timings).any(proof);
        if *timing == Timing::Event && !proven {
            let at = sections.iter().find(|(name, _)| *name.get_ref() == message.name);
            let at = at.map_or(0..0, |(name, _)| name.span());
            let reason = "an event message holds while its bus is alive, and nothing proves this bus alive";
            binder.refuse(at, reason, "name cyclic messages of the DBC in heartbeat_messages of the bus");
        }
    }
    let mut compiled = Vec::new();
    for ((bus, message), timing) in bound.iter().zip(timings) {
        let forget_after = timing.timeout();
        let section = section(binder, sections, *bus, message).map(|(_, section)| section);
        let integrity =
            section.and_then(|section| integrity(binder, &section.asked(), message, forget_after));
        let (name, bus) = (binder.message_name(*bus, message), binder.buses[*bus].index);
        compiled.push(BoundMessage { name, bus, id: message.id, timing, integrity });
    }
    compiled
}

/// What the profile says of a message.
fn section<'f>(
    binder: &Binder<'_>,
    sections: &'f MessageFiles,
    bus: usize,
    message: &Message,
) -> Option<(&'f Spanned<String>, &'f MessageFile)> {
    let bus_name = &binder.buses[bus].name;
    sections.iter().find(|(name, section)| {
        // A bus that does not exist is refused elsewhere and draws no second problem here.
        let named = section.bus.as_ref().filter(|bus| has_bus(binder, bus));
        *name.get_ref() == message.name && named.is_none_or(|named| named.get_ref() == bus_name)
    })
}

fn has_bus(binder: &Binder<'_>, bus: &Spanned<String>) -> bool {
    binder.buses.iter().any(|known| known.name == *bus.get_ref())
}

fn timing(binder: &mut Binder<'_>, sections: &MessageFiles, bus: usize, message: &Message) -> Timing {
    let section = section(binder, sections, bus, message);
    let timeout = section.and_then(|(_, section)| section.timeout_ms.as_ref());
    let timing = section.map_or(TimingFile::Cyclic, |(_, section)| section.timing);
    let timeout_ms = match (timing, timeout) {
        (TimingFile::Event, None) => return Timing::Event,
        (TimingFile::Event, Some(timeout)) => {
            binder.refuse(
                timeout.span(),
                "an event message has no timeout",
                "remove it, or use timing = \"event_cyclic\" for one that is slowly repeated",
            );
            return Timing::Event;
        }
        (TimingFile::Cyclic | TimingFile::EventCyclic, Some(timeout)) => {
            binder.checker.limit(Some(timeout));
            *timeout.get_ref()
        }
        (TimingFile::Cyclic | TimingFile::EventCyclic, None) => {
            let cycle_ms = message.cycle_ms.map_or(0, u64::from);
            if cycle_ms == 0 {
                let at = section.map_or(0..0, |(name, _)| name.span());
                let reason =
                    format!("no timeout for {}: the DBC has no GenMsgCycleTime for it", message.name);
                binder.refuse(at, reason, &format!("add [message.{}] timeout_ms", message.name));
            }
            (cycle_ms * CYCLES_UNTIL_STALE).clamp(MIN_DEFAULT_TIMEOUT_MS, MAX_LIMIT_MS)
        }
    };
    let timeout = Duration::from_millis(timeout_ms);
    if timing == TimingFile::EventCyclic {
        Timing::EventCyclic { timeout }
    } else {
        Timing::Cyclic { timeout }
    }
}
