//! Columns for people: time, subject, what happened or is different.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::display::{self, Style};
use super::entry::entry;
use super::snapshot::{STORES, Snapshot, States};
use crate::core::time::MonoTime;
use crate::core::traffic_light::emission::GroupState;

/// One line: `seconds  subject  what`.
pub(super) fn line(at: MonoTime, subject: &str, what: &str) -> String {
    format!("{:>9}  {subject:<21}  {what}", display::seconds(at))
}

/// Finds what is different from snapshot to snapshot.
#[derive(Debug)]
pub(super) struct Columns {
    style: Style,
    /// What was shown last, by subject, then id.
    shown: BTreeMap<&'static str, BTreeMap<i64, String>>,
}

impl Columns {
    pub(super) fn new(style: Style) -> Self {
        Self { style, shown: BTreeMap::new() }
    }

    /// What happened, then what is different, or all there is when `whole` is asked for.
    pub(super) fn lines(&mut self, snapshot: &Snapshot<'_>, whole: bool) -> Vec<String> {
        let mut lines = Vec::new();
        for note in snapshot.notes {
            let entry = entry(&note.what, snapshot.scenario);
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
    let stores = STORES.into_iter().map(move |store| {
        let lights = states.store(store).map(|(id, light)| (id, style.light(light))).collect();
        (display::store(store), lights)
    });
    let topics = [("internal", states.internal()), ("external", states.external())].into_iter();
    stores.chain(topics.map(move |(topic, groups)| (topic, by_id(groups.unwrap_or_default(), style))))
}

/// Upstream sends a group once for each of its heads; ` & ` stands between.
fn by_id(groups: &[Arc<GroupState>], style: Style) -> BTreeMap<i64, String> {
    let mut texts: BTreeMap<i64, String> = BTreeMap::new();
    for group in groups {
        let text = texts.entry(group.relation_id).or_default();
        if !text.is_empty() {
            text.push_str(" & ");
        }
        text.push_str(&style.group(group));
    }
    texts
}
