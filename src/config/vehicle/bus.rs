//! `[bus.*]` of a profile: the DBCs, and what proves a bus alive.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use super::binder::{Binder, ProfileBus};
use crate::config::files::Files;
use crate::config::reading::checker::Checker;
use crate::config::reading::document::Document;
use crate::config::reading::problem::Problem;
use crate::core::can::frame::CanId;
use crate::core::can::link::BusIndex;
use crate::core::command::allow_list::AllowList;
use crate::core::dbc;
use crate::core::validation::table::BoundMessage;

/// Silence that ends a bus's life when the profile gives none, at least.
const ALIVE_TIMEOUT_MS: u64 = 1000;

/// The sections by name.
pub(super) type BusFiles = BTreeMap<Spanned<String>, BusFile>;

/// `[bus.<name>]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BusFile {
    /// Path of the DBC, relative to the profile.
    pub dbc: Spanned<String>,
    /// Further messages that prove the bus alive.
    #[serde(default)]
    pub heartbeat_messages: Vec<Spanned<String>>,
    /// Longest silence of a bus that is awake, ms.
    pub alive_timeout_ms: Option<Spanned<u64>>,
    /// Whether the whole bus may fall asleep.
    #[serde(default)]
    pub may_sleep: bool,
}

/// Reads the DBC of each bus.
///
/// # Errors
/// Every problem found.
pub(super) fn read_buses(
    document: &Document,
    files: &dyn Files,
    sections: &BusFiles,
) -> Result<Vec<ProfileBus>, Vec<Problem>> {
    let mut checker = Checker::new(document);
    let mut buses = Vec::new();
    for (index, (name, bus)) in (0..=u8::MAX).zip(sections) {
        let path = checker.beside(&bus.dbc);
        match files.read(&path) {
            Ok(bytes) => buses.push(ProfileBus {
                name: name.get_ref().clone(),
                index: BusIndex(index),
                dbc_path: path.display().to_string(),
                database: dbc::parse(&bytes),
            }),
            Err(error) => {
                let reason = format!("cannot read {}: {error}", path.display());
                checker.refuse(&bus.dbc, reason, "give the DBC's path relative to this file");
            }
        }
        checker.limit(bus.alive_timeout_ms.as_ref());
    }
    if sections.len() > usize::from(u8::MAX) {
        checker.refuse_at(0..0, "more than 255 buses", "describe fewer");
    }
    if checker.problems.is_empty() { Ok(buses) } else { Err(checker.problems) }
}

/// As the profile says; by default no bus is called silent while its liveliest message may be.
pub(super) fn alive_timeout(sections: &BusFiles, bus: &ProfileBus, messages: &[BoundMessage]) -> Duration {
    let given = sections.get(bus.name.as_str()).and_then(|bus| bus.alive_timeout_ms.as_ref());
    let of_bus = messages.iter().filter(|message| message.bus == bus.index);
    let silences = of_bus.filter_map(|message| message.timing.timeout());
    let default = silences.min().unwrap_or_default().max(Duration::from_millis(ALIVE_TIMEOUT_MS));
    given.map_or(default, |ms| Duration::from_millis(*ms.get_ref()))
}

/// The further messages that prove a bus alive.
pub(super) fn heartbeat_messages(
    binder: &mut Binder<'_>,
    sections: &BusFiles,
    bus: &ProfileBus,
) -> Vec<CanId> {
    let names = sections.get(bus.name.as_str()).map_or(&[][..], |bus| &bus.heartbeat_messages);
    let find = |name: &Spanned<String>| {
        binder.find_message(Some(&bus.name), name.get_ref(), name.span()).map(|(_, message)| message.id)
    };
    names.iter().filter_map(find).collect()
}

/// The gateway's own frames prove nothing of the vehicle.
pub(super) fn refuse_own_messages(binder: &mut Binder<'_>, sections: &BusFiles, allowed: &AllowList) {
    for (name, bus) in sections {
        let own = |message: &Spanned<String>| {
            let known = binder.buses.iter().find(|known| known.name == *name.get_ref())?;
            let message = known.database.message(message.get_ref())?;
            allowed.contains(known.index, message.id).then_some(())
        };
        let own: Vec<_> = bus.heartbeat_messages.iter().filter(|message| own(message).is_some()).collect();
        for message in own {
            let reason = format!("{} is sent by the gateway itself", message.get_ref());
            binder.refuse(message.span(), reason, "name messages that the vehicle sends");
        }
    }
}
