//! Text columns: time, subject, event or change.

use std::collections::BTreeMap;

use super::display::{self, Style};
use super::entry::entry;
use super::snapshot::{Snapshot, States};
use gateway_base::time::MonoTime;
use traffic_lights::emission::Groups;
use traffic_lights::target::StoreId;

/// Returns one line of text: `seconds  subject  what`.
pub(super) fn line(at: MonoTime, subject: &str, what: &str) -> String {
    format!("{:>9}  {subject:<21}  {what}", display::seconds(at))
}

#[derive(Debug)]
pub(super) struct Columns {
    style: Style,
    /// The last shown texts, by subject, then id.
    shown: BTreeMap<&'static str, BTreeMap<i64, String>>,
}

impl Columns {
    pub(super) fn new(style: Style) -> Self {
        Self { style, shown: BTreeMap::new() }
    }

    /// Returns the lines of a snapshot: its events, then its changes, or all states if `whole`.
    pub(super) fn lines(&mut self, snapshot: &Snapshot<'_>, whole: bool) -> Vec<String> {
        let mut lines = Vec::new();
        for logged in snapshot.events {
            let entry = entry(&logged.event, snapshot.scenario);
            lines.push(line(snapshot.at, entry.subject, &entry.text));
        }
        if !snapshot.has_changed && !whole {
            return lines;
        }
        for (subject, now) in columns(snapshot.states, self.style) {
            let before = self.shown.entry(subject).or_default();
            let gone = before.keys().filter(|id| !now.contains_key(id)).map(|id| (*id, "-"));
            let new = now.iter().filter(|(id, text)| whole || before.get(id) != Some(text));
            let mut parts: Vec<_> = new.map(|(id, text)| (*id, text.as_str())).chain(gone).collect();
            parts.sort_unstable();
            if !parts.is_empty() {
                let parts: Vec<_> = parts.into_iter().map(|(id, text)| format!("{id}: {text}")).collect();
                lines.push(line(snapshot.at, subject, &parts.join("; ")));
            }
            *before = now;
        }
        lines
    }
}

fn columns(states: &States, style: Style) -> impl Iterator<Item = (&'static str, BTreeMap<i64, String>)> {
    let stores = StoreId::ALL.into_iter().map(move |store| {
        (store.name(), states.store(store).map(|(id, light)| (id, style.light(light))).collect())
    });
    let topics = [("internal", &states.internal), ("external", &states.external)].into_iter();
    stores.chain(topics.map(move |(topic, groups)| (topic, by_id(groups.as_ref(), style))))
}

/// Returns the texts of groups by id. Upstream sends a group once per head: its texts are joined by ` & `.
fn by_id(groups: Option<&Groups>, style: Style) -> BTreeMap<i64, String> {
    let mut texts: BTreeMap<i64, String> = BTreeMap::new();
    for group in groups.into_iter().flat_map(|groups| groups.iter()) {
        let text = texts.entry(group.relation_id).or_default();
        if !text.is_empty() {
            text.push_str(" & ");
        }
        text.push_str(&style.group(group));
    }
    texts
}
