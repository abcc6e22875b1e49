//! `[bus.*]` of a profile: the DBCs, and the messages that prove that a bus is alive.

use std::path::Path;
use std::time::Duration;

use super::arxml::{self, ArxmlError};
use super::binder::{Binder, LoadedDbc};
use super::message::MessageSections;
use crate::config::built_in::display;
use crate::config::file_kind::{BY_CANTOOLS, FileKind};
use crate::config::files::Files;
use crate::config::fingerprints;
use crate::config::reading::{Fields, LocatedText, Refusal, cannot_read, remedy_of};
use can_signal::can::{BusIndex, BusSettings, IdMatch};
use can_signal::dbc;
use can_signal::dbc::model::{Database, MAX_ENTRIES};
use can_signal::validation::requirement::{Condition, Requirement};
use can_signal::validation::table::BoundMessage;
use gateway_base::near_miss::did_you_mean;
use gateway_core::command::allow_list::AllowList;
use vehicle_bringup::plausibility::fingerprint::PlatformList;

/// Default silence after which a bus counts as dead; at least the timeout of its fastest message.
const ALIVE_TIMEOUT: Duration = Duration::from_secs(1);

/// Least time in which the first frame of each message must be received.
const MIN_START_TIMEOUT: Duration = Duration::from_secs(2);

/// The keys of `[bus.<name>]` that are needed once the messages are bound.
#[derive(Debug)]
pub(super) struct BusSection {
    /// Further messages that prove that the bus is alive.
    heartbeat_messages: Vec<LocatedText>,
    /// Maximum silence of a bus that is awake.
    alive_timeout: Option<Duration>,
    /// True if the whole bus may fall asleep.
    may_sleep: bool,
}

/// Reads the section of each bus, in the order of their names, with its DBC; `None` if a problem was
/// recorded.
pub(super) fn read_buses(files: &dyn Files, top: &Fields<'_>) -> Option<(Vec<LoadedDbc>, Vec<BusSection>)> {
    let checker = top.checker;
    let before = checker.count();
    let mut entries: Vec<_> = top.entries("bus", "write [bus.<name>]").iter().collect();
    entries.sort_by_key(|entry| &entry.key);
    if entries.len() > usize::from(u8::MAX) {
        checker.refuse(top.at("bus"), "more than 255 buses", "describe fewer");
    }
    let (mut buses, mut sections) = (Vec::new(), Vec::new());
    for (index, entry) in (0..=u8::MAX).zip(entries) {
        let Some(fields) = Fields::of(checker, &entry.value) else { continue };
        fields.require(&["dbc"], "");
        let heartbeat_messages = fields.list("heartbeat_messages", "give a list of messages").iter();
        sections.push(BusSection {
            heartbeat_messages: heartbeat_messages.filter_map(|value| checker.string(value)).collect(),
            alive_timeout: fields.limit("alive_timeout_ms"),
            may_sleep: fields.flag("may_sleep").unwrap_or_default(),
        });
        let identifier_lists = identifier_lists(&fields);
        if let Some(path) = fields.path("dbc")
            && let Some(database) = read_database(files, &fields, &path)
        {
            let (bus, index) = (entry.key.clone(), BusIndex(index));
            buses.push(LoadedDbc { bus, index, path, database, identifier_lists });
        }
        fields.done();
    }
    (checker.count() == before).then_some((buses, sections))
}

/// Reads the file of a bus, a DBC or an ARXML; `None` if it was refused.
fn read_database(files: &dyn Files, fields: &Fields<'_>, path: &Path) -> Option<Database> {
    let refused =
        |reason: &str, remedy: &str| fields.refused("dbc", format!("{}: {reason}", display(path)), remedy);
    let cluster = fields.string("cluster");
    let bytes = match files.read(path) {
        Ok(bytes) => bytes,
        Err(error) => {
            let remedy = remedy_of(&error, "give the DBC's path relative to this file");
            return refused(&cannot_read(&error), remedy);
        }
    };
    let database = match FileKind::of(&bytes) {
        Some(FileKind::Arxml) => {
            match arxml::read(&bytes, cluster.as_ref().map(|cluster| cluster.text.as_str())) {
                Ok(database) => database,
                Err(error @ ArxmlError::Choose(_)) if cluster.is_some() => {
                    let reason = format!("{}: there is no such cluster: {error}", display(path));
                    return fields.refused("cluster", reason, "name one of them");
                }
                Err(error) => {
                    let remedy = match error {
                        ArxmlError::Choose(_) => "name the one of this bus: cluster = \"…\"",
                        ArxmlError::Xml(_) => "correct the file",
                        ArxmlError::Version(_) | ArxmlError::NoCluster => BY_CANTOOLS,
                    };
                    return refused(&error.to_string(), remedy);
                }
            }
        }
        kind => {
            if let Some(Refusal { reason, .. }) = FileKind::Dbc.mismatch(&bytes) {
                let remedy = match kind {
                    Some(FileKind::Other(looks)) if !looks.remedy.is_empty() => looks.remedy,
                    _ => "give the path of a DBC",
                };
                return refused(&reason, remedy);
            }
            if cluster.is_some() {
                fields.refuse("cluster", "a DBC has no clusters", "remove it: it is for ARXML files");
            }
            dbc::parse(&bytes)
        }
    };
    if database.is_too_large {
        let reason =
            format!("more than {MAX_ENTRIES} messages, signals, names of values and malformed statements");
        return refused(&reason, "leave out what the profile does not use");
    }
    Some(database)
}

fn identifier_lists(fields: &Fields<'_>) -> Vec<&'static PlatformList> {
    let named = fields.list("identifier_lists", "give a list of names").iter();
    let named: Vec<_> = named.filter_map(|value| fields.checker.string(value)).collect();
    if named.is_empty() {
        return Vec::new();
    }
    let lists =
        fields.checker.accept(fields.at("identifier_lists"), fingerprints::lists(), "leave the key out");
    let Some(lists) = lists else { return Vec::new() };
    let find = |LocatedText { text, location }| {
        let list = lists.iter().find(|list| list.name == text);
        if list.is_none() {
            let names = lists.iter().map(|list| list.name.as_str());
            let otherwise = "config/cars/fingerprints.toml has the names";
            let remedy = did_you_mean(&text, names, otherwise);
            fields.checker.refuse(&location, format!("there is no list {text}"), &remedy);
        }
        list
    };
    named.into_iter().filter_map(find).collect()
}

/// Returns the time from the start in which a bus must show all that its reports need: the longest timeout of
/// its messages, and after that the longest time for which a requirement observes it.
pub(super) fn start_timeout<'a>(
    bus: BusIndex,
    messages: impl Iterator<Item = &'a BoundMessage>,
    requirements: &[Requirement],
) -> Duration {
    let timeouts =
        messages.filter(|message| message.bus == bus).filter_map(|message| message.timing.timeout());
    let observations = requirements.iter().filter(|requirement| requirement.bus == bus);
    let observations = observations.map(|requirement| match requirement.condition {
        Condition::Unseen { observation } => observation,
        Condition::Seen | Condition::Value { .. } => Duration::ZERO,
    });
    timeouts.fold(MIN_START_TIMEOUT, Duration::max) + observations.max().unwrap_or_default()
}

impl BusSection {
    /// Returns the settings of the bus, without an interface. By default a bus is not dead while its fastest
    /// message may be silent.
    pub(super) fn settings(
        &self,
        bus: &LoadedDbc,
        heartbeat_messages: Vec<IdMatch>,
        life_signs: &[&BoundMessage],
    ) -> BusSettings {
        let of_bus = life_signs.iter().filter(|message| message.bus == bus.index);
        let timeouts = of_bus.filter_map(|message| message.timing.timeout());
        let (fastest, slowest) = (timeouts.clone().min(), timeouts.max());
        let alive_timeout = self.alive_timeout.unwrap_or(fastest.unwrap_or_default().max(ALIVE_TIMEOUT));
        BusSettings {
            name: bus.bus.clone(),
            interface: String::new(),
            heartbeat_messages,
            alive_timeout,
            wake_up_timeout: slowest.unwrap_or_default().max(alive_timeout),
            start_timeout: MIN_START_TIMEOUT,
            may_sleep: self.may_sleep,
        }
    }

    /// Returns the further messages that prove that the bus is alive. Messages sent by the gateway itself
    /// prove nothing.
    pub(super) fn heartbeat_messages(
        &self,
        binder: &Binder<'_>,
        bus: &LoadedDbc,
        allowed: Option<&AllowList>,
        sections: &MessageSections<'_>,
    ) -> Vec<IdMatch> {
        let mut heartbeats = Vec::new();
        for LocatedText { text, location } in &self.heartbeat_messages {
            let Some(found) = binder.find_message(Some(&bus.bus), text, location) else { continue };
            let ids = sections.ids(binder, found);
            let is_ours = |allowed: &AllowList| {
                allowed.entries().iter().any(|(of, id)| *of == bus.index && ids.contains(*id))
            };
            if allowed.is_some_and(is_ours) {
                let reason = format!("{text} is sent by the gateway itself");
                binder.refuse(location, reason, "name messages that the vehicle sends");
            }
            heartbeats.push(ids);
        }
        heartbeats
    }
}
