//! Our own form of scenario, for people at a bench: `config/scenarios/bench.toml` explains each key.

mod action;
mod condition;

use std::collections::BTreeMap;

use super::controllers::{ControllerDraft, PhaseDraft, resolve};
use super::file::ScenarioFile;
use super::naming::{Names, action_path, event_path};
use super::reader::Reader;
use crate::config::reading::fields::{Fields, LocatedText, given, items};
use crate::config::reading::value::{Kind, Value};
use crate::core::map::light_map::GroupEntry;
use crate::core::traffic_light::scenario::{
    Act, Condition, Edge, Event, PhaseEntry, Rule, Scenario, Test, Trigger,
};
use crate::core::traffic_light::state_check::Writer;
use crate::core::traffic_light::target::Target;
use condition::Known;

/// Name of the one act that a file is.
const ACT: &str = "bench";

/// Reads the file; problems go to `reader`.
pub(super) fn interpret(root: &Value, reader: &mut Reader) -> ScenarioFile {
    let mut file = ScenarioFile::default();
    let Some(mut top) = Fields::of(reader, root) else { return file };
    let map = top.text(reader, "map");
    file.groups = groups(reader, &mut top);
    if let Some(map) = map {
        if !file.groups.is_empty() {
            reader.refuse(&map.location, "both a map and groups", "keep one of them");
        }
        file.map = Some(reader.beside(&map.text));
    }
    let drafts =
        top.list(reader, "controller").iter().filter_map(|value| controller(reader, value)).collect();
    let controllers = resolve(reader, drafts);
    let events = top.list(reader, "event");
    let (names, known_events) = event_names(reader, events);
    let known = Known { controllers: &controllers, events: &known_events };
    let init = top.take("init");
    let init = init.map(|init| action::actions(reader, init, &known)).unwrap_or_default();
    let events = events.iter().zip(names);
    let events: Vec<_> = events.filter_map(|(value, name)| event(reader, value, name, &known)).collect();
    let stop = trigger(reader, &mut top, ["stop_at_s", "stop_when"], &known);
    top.done(reader);
    let acts = if events.is_empty() {
        Vec::new()
    } else {
        vec![Act { name: ACT.to_owned(), start: None, stop: None, events }]
    };
    file.scenario = Scenario { controllers, init, acts, stop };
    file
}

fn groups(reader: &mut Reader, top: &mut Fields<'_>) -> Vec<GroupEntry> {
    let mut groups: Vec<GroupEntry> = Vec::new();
    let mut places = BTreeMap::new();
    let entries = match top.take("groups").map(|value| (&value.kind, value)) {
        None => &[][..],
        Some((Kind::Map(entries), _)) => entries,
        Some((Kind::Null | Kind::Scalar { .. } | Kind::List(_), value)) => {
            let reason = format!("{} stands here", value.described());
            reader.refuse(
                &value.location,
                reason,
                "give a table of relation ids with their heads: 100 = [11, 12]",
            );
            &[]
        }
    };
    for entry in entries {
        let relation = reader.id(&LocatedText { text: entry.key.clone(), location: entry.location.clone() });
        let heads: Vec<_> = items(&entry.value).iter().filter_map(|item| reader.id_in(item)).collect();
        if items(&entry.value).is_empty() {
            reader.refuse(&entry.location, "a group without heads", "give way ids: 100 = [11, 12]");
        }
        let Some(relation_id) = relation else { continue };
        if places.insert(relation_id, groups.len()).is_some() {
            reader.refuse(&entry.location, format!("a second group {relation_id}"), "keep one");
        }
        groups.push(GroupEntry { relation_id, way_ids: heads, is_pedestrian: false });
    }
    for value in top.take("pedestrian_groups").map(items).unwrap_or_default() {
        let Some(id) = reader.id_in(value) else { continue };
        match places.get(&id).and_then(|place: &usize| groups.get_mut(*place)) {
            Some(group) => group.is_pedestrian = true,
            None => reader.refuse(&value.location, format!("{id} is none of the groups"), "name one of them"),
        }
    }
    groups
}

fn controller(reader: &mut Reader, value: &Value) -> Option<ControllerDraft> {
    let mut fields = Fields::of(reader, value)?;
    let name = fields.required(reader, "name");
    let reference = fields.text(reader, "reference");
    let delay = fields.text(reader, "delay_s");
    let phases = fields.list(reader, "phase").iter().filter_map(|value| phase(reader, value)).collect();
    fields.done(reader);
    Some(ControllerDraft { name: name?.text, location: value.location.clone(), reference, delay, phases })
}

fn phase(reader: &mut Reader, value: &Value) -> Option<PhaseDraft> {
    let mut fields = Fields::of(reader, value)?;
    let name = fields.required(reader, "name");
    let seconds = match fields.number(reader, "duration_s") {
        Some(given) => reader.phase_seconds(&given),
        None => Some(f64::INFINITY),
    };
    let mut entries = Vec::new();
    let states = fields.take("states");
    match states.map(|value| (&value.kind, value)) {
        None => {}
        Some((Kind::Map(states), _)) => {
            for state in states {
                let target = LocatedText { text: state.key.clone(), location: state.location.clone() };
                entries.extend(entry(reader, &target, &state.value));
            }
        }
        Some((Kind::List(pairs), _)) => {
            for pair in pairs {
                let Kind::List(both) = &pair.kind else {
                    refuse_pair(reader, pair);
                    continue;
                };
                let [target, state] = both.as_slice() else {
                    refuse_pair(reader, pair);
                    continue;
                };
                if let Some(target) = given(reader, target) {
                    entries.extend(entry(reader, &target, state));
                }
            }
        }
        Some((Kind::Null | Kind::Scalar { .. }, value)) => {
            reader.refuse(
                &value.location,
                "a single value stands here",
                "give a table: { \"21\" = \"green\" }",
            );
        }
    }
    fields.done(reader);
    Some(PhaseDraft { name: name?.text, seconds: seconds?, entries })
}

fn refuse_pair(reader: &mut Reader, value: &Value) {
    reader.refuse(&value.location, format!("{} stands here", value.described()), "give [target, state]");
}

fn entry(reader: &mut Reader, target: &LocatedText, state: &Value) -> Option<PhaseEntry> {
    let state = given(reader, state);
    let target: Target = reader.target(target)?;
    let state = reader.state(target.store, &state?, Writer::PhaseEntry)?;
    Some(PhaseEntry { target, state })
}

/// The names events are given, and those that conditions can use.
fn event_names(reader: &mut Reader, events: &[Value]) -> (Vec<String>, Vec<String>) {
    let mut own = Vec::new();
    for value in events {
        let Kind::Map(entries) = &value.kind else {
            own.push(String::new());
            continue;
        };
        let name = entries.iter().find(|entry| entry.key == "name");
        let name = name.and_then(|entry| given(reader, &entry.value));
        if let Some(name) = name.as_ref().filter(|name| own.contains(&name.text)) {
            reader.refuse(
                &name.location,
                format!("a second event {:?}", name.text),
                "give each its own name",
            );
        }
        own.push(name.map(|name| name.text).unwrap_or_default());
    }
    let mut names = Names::new(std::iter::once(ACT).chain(own.iter().map(String::as_str)));
    names.give(ACT, "Act[1]".to_owned());
    let given = own.iter().enumerate().map(|(index, own)| names.give(own, event_path(ACT, index))).collect();
    own.retain(|name| !name.is_empty());
    (given, own)
}

fn event(reader: &mut Reader, value: &Value, name: String, known: &Known<'_>) -> Option<Event> {
    let mut fields = Fields::of(reader, value)?;
    fields.take("name");
    let start = trigger(reader, &mut fields, ["at_s", "when"], known);
    let most = fields.number(reader, "times");
    let most_executions = match &most {
        None => Some(1),
        Some(given) => given.text.parse().ok().filter(|most| *most > 0),
    };
    if let (Some(given), None) = (&most, most_executions) {
        reader.refuse(&given.location, format!("{:?} is not a count", given.text), "give 1 or more");
    }
    let actions = match fields.take("do") {
        Some(value) => action::actions(reader, value, known),
        None => {
            reader.refuse(
                &value.location,
                "the key do is missing",
                "say what is done: do = [{ clear = \"21\" }]",
            );
            Vec::new()
        }
    };
    fields.done(reader);
    let action_names = (0..actions.len()).map(|index| action_path(&name, index)).collect();
    Some(Event { name, start, most_executions: most_executions?, action_names, actions })
}

/// A trigger at a time or on conditions; not both.
fn trigger(
    reader: &mut Reader,
    fields: &mut Fields<'_>,
    [at_s, when]: [&'static str; 2],
    known: &Known<'_>,
) -> Option<Trigger> {
    let at = fields.number(reader, at_s);
    match (at, fields.take(when)) {
        (None, None) => None,
        (None, Some(when)) => Some(condition::trigger(reader, when, known)),
        (Some(at), None) => Some(Trigger { groups: vec![vec![after(reader, &at)?]] }),
        (Some(at), Some(_)) => {
            reader.refuse(
                &at.location,
                format!("both {at_s} and {when}"),
                "keep one; when = { after_s = 5 } is a time",
            );
            None
        }
    }
}

/// True from a time on.
fn after(reader: &mut Reader, at: &LocatedText) -> Option<Condition> {
    let test = Test::SimulationTime { rule: Rule::GreaterOrEqual, value: reader.seconds(at)? };
    Some(Condition { name: String::new(), test, edge: Edge::None, delay: std::time::Duration::ZERO })
}
