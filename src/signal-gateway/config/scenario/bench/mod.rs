//! Our own form of scenario, for tests at a bench: `config/scenarios/bench.toml` explains each key.

mod action;
mod condition;

use std::collections::BTreeMap;

use super::controllers::{ControllerDraft, PhaseDraft, resolve};
use super::file::ScenarioFile;
use super::naming::{Names, action_path, event_path};
use super::reader::ScenarioReader;
use crate::config::reading::{Entry, Fields, Kind, LocatedText, Value, items};
use condition::KnownNames;
use lanelet2_map::light_map::GroupEntry;
use traffic_lights::scenario::{Act, Condition, Edge, Event, PhaseEntry, Rule, Scenario, Test, Trigger};
use traffic_lights::state_check::StateWriter;

const ACT: &str = "bench";

pub(super) fn interpret(root: &Value, reader: &mut ScenarioReader<'_>) -> ScenarioFile {
    let mut file = ScenarioFile::default();
    let Some(top) = Fields::of(reader.checker, root) else { return file };
    file.map = top.text("map").map(|map| reader.beside(&map.text));
    file.groups = groups(reader, &top);
    if file.map.is_some() && !file.groups.is_empty() {
        top.refuse("map", "both a map and groups", "keep one of them");
    }
    let drafts = top.read_tables("controller", |fields| controller(reader, fields));
    let controllers = resolve(reader, drafts);
    let events: Vec<_> = top.tables("event").collect();
    let (names, known_events) = event_names(&events);
    let known = KnownNames { controllers: &controllers, events: &known_events };
    let init = top.value("init");
    let init = init.map(|init| action::actions(reader, init, &known)).unwrap_or_default();
    let mut event =
        |(fields, name): (Fields<'_>, String)| fields.read_all(|fields| event(reader, fields, name, &known));
    let events: Vec<_> = events.into_iter().zip(names).map(&mut event).collect();
    let stop = trigger(reader, &top, ["stop_at_s", "stop_when"], &known);
    top.done();
    let acts = if events.is_empty() {
        Vec::new()
    } else {
        vec![Act { name: ACT.to_owned(), events, ..Act::default() }]
    };
    file.scenario = Scenario { controllers, init, acts, stop, ..Scenario::default() };
    file
}

fn groups(reader: &mut ScenarioReader<'_>, top: &Fields<'_>) -> Vec<GroupEntry> {
    let mut groups: Vec<GroupEntry> = Vec::new();
    let mut indices = BTreeMap::new();
    for entry in top.entries("groups", "give relation ids with their heads: 100 = [11, 12]") {
        let relation = reader.id(&key(entry));
        let heads: Vec<_> = items(&entry.value).iter().filter_map(|item| reader.id_in(item)).collect();
        if items(&entry.value).is_empty() {
            reader.refuse(&entry.location, "a group without heads", "give way ids: 100 = [11, 12]");
        }
        let Some(relation_id) = relation else { continue };
        if indices.insert(relation_id, groups.len()).is_some() {
            reader.refuse(&entry.location, format!("a second group {relation_id}"), "keep one");
        }
        groups.push(GroupEntry::new(relation_id, heads));
    }
    for value in top.value("pedestrian_groups").map(items).unwrap_or_default() {
        let Some(id) = reader.id_in(value) else { continue };
        match indices.get(&id).and_then(|index: &usize| groups.get_mut(*index)) {
            Some(group) => group.is_pedestrian = true,
            None => {
                let reason = format!("{id} is not one of the groups");
                reader.refuse(&value.location, reason, "name one of them");
            }
        }
    }
    groups
}

fn key(entry: &Entry) -> LocatedText {
    LocatedText { text: entry.key.clone(), location: entry.location.clone() }
}

fn controller(reader: &mut ScenarioReader<'_>, fields: &Fields<'_>) -> Option<ControllerDraft> {
    let name = fields.required_text("name");
    let reference = fields.text("reference");
    let delay = fields.text("delay_s");
    let phases = fields.read_tables("phase", |fields| phase(reader, fields));
    let location = fields.location().clone();
    Some(ControllerDraft { name: name?.text, location, reference, delay, phases })
}

fn phase(reader: &mut ScenarioReader<'_>, fields: &Fields<'_>) -> Option<PhaseDraft> {
    let name = fields.required_text("name");
    let seconds = if fields.has("duration_s") {
        fields.unquoted("duration_s").and_then(|given| reader.phase_seconds(&given))
    } else {
        Some(f64::INFINITY)
    };
    let mut entries = Vec::new();
    match fields.value("states").map(|value| (&value.kind, value)) {
        None => {}
        Some((Kind::Map(states), _)) => {
            for state in states {
                entries.extend(phase_entry(reader, Some(key(state)), &state.value));
            }
        }
        Some((Kind::List(pairs), _)) => {
            for pair in pairs {
                if let Kind::List(both) = &pair.kind
                    && let [target, state] = both.as_slice()
                {
                    let target = reader.checker.text(target);
                    entries.extend(phase_entry(reader, target, state));
                } else {
                    let reason = format!("expected a target and its state, found {}", pair.described());
                    reader.refuse(&pair.location, reason, "give [target, state]");
                }
            }
        }
        Some((Kind::Null | Kind::Scalar { .. }, value)) => {
            let reason = format!("expected a table, found {}", value.described());
            reader.refuse(&value.location, reason, "give a table: { \"21\" = \"green\" }");
        }
    }
    Some(PhaseDraft { name: name?.text, seconds, entries })
}

fn phase_entry(
    reader: &mut ScenarioReader<'_>,
    target: Option<LocatedText>,
    state: &Value,
) -> Option<PhaseEntry> {
    let state = reader.checker.text(state);
    let (target, state) = reader.written(target, state, StateWriter::PhaseEntry)?;
    Some(PhaseEntry { target, state })
}

/// Returns the names that are assigned to the events, and the names that conditions can use.
fn event_names(events: &[Fields<'_>]) -> (Vec<String>, Vec<String>) {
    let mut own = Vec::new();
    for fields in events {
        let name = fields.text("name").map(|name| name.text).unwrap_or_default();
        if !name.is_empty() && own.contains(&name) {
            fields.refuse("name", format!("a second event {name:?}"), "give each its own name");
        }
        own.push(name);
    }
    let mut names = Names::new(std::iter::once(ACT).chain(own.iter().map(String::as_str)));
    names.assign(ACT, "Act[1]".to_owned());
    let assigned = own.iter().enumerate().map(|(index, own)| names.assign(own, event_path(ACT, index)));
    let assigned = assigned.collect();
    own.retain(|name| !name.is_empty());
    (assigned, own)
}

fn event(
    reader: &mut ScenarioReader<'_>,
    fields: &Fields<'_>,
    name: String,
    known: &KnownNames<'_>,
) -> Event {
    let start = trigger(reader, fields, ["at_s", "when"], known);
    let max_executions = fields.number("times", 1..=u32::MAX, "").unwrap_or(1);
    fields.require(&["do"], "give the actions: do = [{ clear = \"21\" }]");
    let actions = fields.value("do").map(|value| action::actions(reader, value, known)).unwrap_or_default();
    let action_names = (0..actions.len()).map(|index| action_path(&name, index)).collect();
    Event { name, start, max_executions, action_names, actions }
}

/// Reads a trigger at a time or on conditions; not both.
fn trigger(
    reader: &mut ScenarioReader<'_>,
    fields: &Fields<'_>,
    [at_s, when]: [&'static str; 2],
    known: &KnownNames<'_>,
) -> Option<Trigger> {
    let at = fields.unquoted(at_s);
    match (at, fields.value(when)) {
        (None, None) => None,
        (None, Some(when)) => Some(condition::trigger(reader, when, known)),
        (Some(at), None) => Some(Trigger { groups: vec![vec![after(reader, &at)?]] }),
        (Some(_), Some(_)) => {
            let reason = format!("both {at_s} and {when}");
            fields.refused(at_s, reason, "keep one; when = { after_s = 5 } is a time")
        }
    }
}

fn after(reader: &ScenarioReader<'_>, at: &LocatedText) -> Option<Condition> {
    let test = Test::SimulationTime { rule: Rule::GreaterOrEqual, value: reader.seconds(at)? };
    Some(Condition { name: String::new(), test, edge: Edge::None, delay: std::time::Duration::ZERO })
}
