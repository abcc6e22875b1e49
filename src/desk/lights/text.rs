//! The timeline as lines for people: when, where, what is different.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::display::{self, Style};
use super::run::{Run, STORES, Shown, Step};
use crate::core::time::MonoTime;
use crate::core::traffic_light::emission::GroupState;

/// Finds what is different from step to step.
#[derive(Debug, Default)]
pub struct TextTimeline {
    style: Style,
    /// By column, then id.
    before: BTreeMap<&'static str, BTreeMap<i64, String>>,
}

/// One line: `seconds  where  what`.
pub fn line(at: MonoTime, column: &str, what: &str) -> String {
    format!("{:>9}  {column:<21}  {what}", display::seconds(at))
}

impl TextTimeline {
    /// Nothing was written yet.
    pub fn new(style: Style) -> Self {
        Self { style, before: BTreeMap::new() }
    }

    /// The lines for a step: what happened, then what is different from the last step, or all of it
    /// when `whole` is asked for.
    pub fn lines(&mut self, step: &Step, run: &Run, whole: bool) -> Vec<String> {
        let mut lines = Vec::new();
        for note in &step.notes {
            let (column, what) = display::happening(&note.what, run.scenario());
            lines.push(line(step.at, column, &what));
        }
        if !step.has_changed && !whole {
            return lines;
        }
        for (column, now) in columns(run.shown(), self.style) {
            let before = self.before.entry(column).or_default();
            let gone = before.keys().filter(|id| !now.contains_key(id)).map(|id| (*id, "-"));
            let new = now.iter().filter(|(id, text)| whole || before.get(id) != Some(text));
            let mut parts: Vec<_> = new.map(|(id, text)| (*id, text.as_str())).chain(gone).collect();
            parts.sort_unstable();
            if !parts.is_empty() {
                let parts: Vec<_> = parts.into_iter().map(|(id, text)| format!("{id}: {text}")).collect();
                lines.push(line(step.at, column, &parts.join("; ")));
            }
            *before = now;
        }
        lines
    }
}

fn columns(shown: &Shown, style: Style) -> Vec<(&'static str, BTreeMap<i64, String>)> {
    let stores = STORES.map(|store| {
        let sights = shown.store(store).map(|(id, sight)| (id, style.sight(sight))).collect();
        (display::store(store), sights)
    });
    let topics = [("internal", shown.internal()), ("external", shown.external())];
    let topics = topics.map(|(column, groups)| (column, by_id(groups.unwrap_or_default(), style)));
    stores.into_iter().chain(topics).collect()
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
