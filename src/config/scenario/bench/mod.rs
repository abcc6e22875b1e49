//! Our own form of scenario, for people at a bench: `config/scenarios/bench.toml` explains each key.

mod action;
mod condition;

use std::collections::BTreeMap;
use std::path::Path;

use super::ScenarioFile;
use super::beside;
use super::controllers::{ControllerDraft, PhaseDraft, resolve};
use super::naming::{Names, action_path, event_path};
use super::reading::Reading;
use crate::config::values::fields::{Fields, Given, given, items};
use crate::config::values::{Kind, Value};
use crate::core::map::light_map::GroupEntry;
use crate::core::traffic_light::scenario::{
    Act, Condition, Edge, Event, PhaseEntry, Rule, Scenario, Test, Trigger,
};
use crate::core::traffic_light::state_check::Writer;
use crate::core::traffic_light::target::Target;
use condition::Known;

/// Name of the one act that a file is.
const ACT: &str = "bench";

/// Reads the file; problems go to `reading`.
pub(super) fn interpret(root: &Value, path: &Path, reading: &mut Reading) -> ScenarioFile {
    let mut file = ScenarioFile {
        scenario: Scenario::default(),
        map: None,
        groups: Vec::new(),
        not_interpreted: Vec::new(),
        ids: Vec::new(),
    };
    let Some(mut top) = Fields::of(reading, root) else { return file };
    let map = top.text(reading, "map");
    file.groups = groups(reading, &mut top);
    if let Some(map) = map {
        if !file.groups.is_empty() {
            reading.refuse(&map.spot, "both a map and groups", "keep one of them");
        }
        file.map = Some(beside(path, &map.text));
    }
    let drafts =
        top.list(reading, "controller").iter().filter_map(|value| controller(reading, value)).collect();
    let controllers = resolve(reading, drafts);
    let events = top.list(reading, "event");
    let (names, known_events) = event_names(reading, events);
    let known = Known { controllers: &controllers, events: &known_events };
    let init = top.take("init");
    let init = init.map(|init| action::actions(reading, init, &known)).unwrap_or_default();
    let events = events.iter().zip(names);
    let events: Vec<_> = events.filter_map(|(value, name)| event(reading, value, name, &known)).collect();
    let stop = trigger(reading, &mut top, ["stop_at_s", "stop_when"], &known);
    top.done(reading);
    let acts = if events.is_empty() {
        Vec::new()
    } else {
        vec![Act { name: ACT.to_owned(), start: None, stop: None, events }]
    };
    file.scenario = Scenario { controllers, init, acts, stop };
    file
}

fn groups(reading: &mut Reading, top: &mut Fields<'_>) -> Vec<GroupEntry> {
    let mut groups: Vec<GroupEntry> = Vec::new();
    let mut places = BTreeMap::new();
    let entries = match top.take("groups").map(|value| (&value.kind, value)) {
        None => &[][..],
        Some((Kind::Map(entries), _)) => entries,
        Some((Kind::Null | Kind::Scalar { .. } | Kind::List(_), value)) => {
            let reason = format!("{} stands here", value.described());
            reading.refuse(
                &value.spot,
                reason,
                "give a table of relation ids with their heads: 100 = [11, 12]",
            );
            &[]
        }
    };
    for entry in entries {
        let relation = reading.id(&Given { text: entry.key.clone(), spot: entry.spot.clone() });
        let heads: Vec<_> = items(&entry.value).iter().filter_map(|item| id(reading, item)).collect();
        if items(&entry.value).is_empty() {
            reading.refuse(&entry.spot, "a group without heads", "give way ids: 100 = [11, 12]");
        }
        let Some(relation_id) = relation else { continue };
        if places.insert(relation_id, groups.len()).is_some() {
            reading.refuse(&entry.spot, format!("a second group {relation_id}"), "keep one");
        }
        groups.push(GroupEntry { relation_id, way_ids: heads, is_pedestrian: false });
    }
    for value in top.take("pedestrian_groups").map(items).unwrap_or_default() {
        let Some(id) = id(reading, value) else { continue };
        match places.get(&id).and_then(|place: &usize| groups.get_mut(*place)) {
            Some(group) => group.is_pedestrian = true,
            None => reading.refuse(&value.spot, format!("{id} is none of the groups"), "name one of them"),
        }
    }
    groups
}

fn id(reading: &mut Reading, value: &Value) -> Option<i64> {
    let given = given(reading, value)?;
    reading.id(&given)
}

fn controller(reading: &mut Reading, value: &Value) -> Option<ControllerDraft> {
    let mut fields = Fields::of(reading, value)?;
    let name = fields.required(reading, "name");
    let reference = fields.text(reading, "reference");
    let delay = fields.text(reading, "delay_s");
    let phases = fields.list(reading, "phase").iter().filter_map(|value| phase(reading, value)).collect();
    fields.done(reading);
    Some(ControllerDraft { name: name?.text, spot: value.spot.clone(), reference, delay, phases })
}

fn phase(reading: &mut Reading, value: &Value) -> Option<PhaseDraft> {
    let mut fields = Fields::of(reading, value)?;
    let name = fields.required(reading, "name");
    let seconds = match fields.number(reading, "duration_s") {
        Some(given) => reading.phase_seconds(&given),
        None => Some(f64::INFINITY),
    };
    let mut entries = Vec::new();
    let states = fields.take("states");
    match states.map(|value| (&value.kind, value)) {
        None => {}
        Some((Kind::Map(states), _)) => {
            for state in states {
                let target = Given { text: state.key.clone(), spot: state.spot.clone() };
                entries.extend(entry(reading, &target, &state.value));
            }
        }
        Some((Kind::List(pairs), _)) => {
            for pair in pairs {
                let Kind::List(both) = &pair.kind else {
                    refuse_pair(reading, pair);
                    continue;
                };
                let [target, state] = both.as_slice() else {
                    refuse_pair(reading, pair);
                    continue;
                };
                if let Some(target) = given(reading, target) {
                    entries.extend(entry(reading, &target, state));
                }
            }
        }
        Some((Kind::Null | Kind::Scalar { .. }, value)) => {
            reading.refuse(&value.spot, "a single value stands here", "give a table: { \"21\" = \"green\" }");
        }
    }
    fields.done(reading);
    Some(PhaseDraft { name: name?.text, seconds: seconds?, entries })
}

fn refuse_pair(reading: &mut Reading, value: &Value) {
    reading.refuse(&value.spot, format!("{} stands here", value.described()), "give [target, state]");
}

fn entry(reading: &mut Reading, target: &Given, state: &Value) -> Option<PhaseEntry> {
    let state = given(reading, state);
    let target: Target = reading.target(target)?;
    let state = reading.state(target.store, &state?, Writer::PhaseEntry)?;
    Some(PhaseEntry { target, state })
}

/// The names events are given, and those that conditions can use.
fn event_names(reading: &mut Reading, events: &[Value]) -> (Vec<String>, Vec<String>) {
    let mut own = Vec::new();
    for value in events {
        let Kind::Map(entries) = &value.kind else {
            own.push(String::new());
            continue;
        };
        let name = entries.iter().find(|entry| entry.key == "name");
        let name = name.and_then(|entry| given(reading, &entry.value));
        if let Some(name) = name.as_ref().filter(|name| own.contains(&name.text)) {
            reading.refuse(&name.spot, format!("a second event {:?}", name.text), "give each its own name");
        }
        own.push(name.map(|name| name.text).unwrap_or_default());
    }
    let mut names = Names::new(std::iter::once(ACT).chain(own.iter().map(String::as_str)));
    names.give(ACT, "Act[1]".to_owned());
    let given = own.iter().enumerate().map(|(index, own)| names.give(own, event_path(ACT, index))).collect();
    own.retain(|name| !name.is_empty());
    (given, own)
}

fn event(reading: &mut Reading, value: &Value, name: String, known: &Known<'_>) -> Option<Event> {
    let mut fields = Fields::of(reading, value)?;
    fields.take("name");
    let start = trigger(reading, &mut fields, ["at_s", "when"], known);
    let most = fields.number(reading, "times");
    let most_executions = match &most {
        None => Some(1),
        Some(given) => given.text.parse().ok().filter(|most| *most > 0),
    };
    if let (Some(given), None) = (&most, most_executions) {
        reading.refuse(&given.spot, format!("{:?} is no count", given.text), "give 1 or more");
    }
    let actions = match fields.take("do") {
        Some(value) => action::actions(reading, value, known),
        None => {
            reading.refuse(
                &value.spot,
                "the key do is missing",
                "say what is done: do = [{ clear = \"21\" }]",
            );
            Vec::new()
        }
    };
    fields.done(reading);
    let action_names = (0..actions.len()).map(|index| action_path(&name, index)).collect();
    Some(Event { name, start, most_executions: most_executions?, action_names, actions })
}

/// A trigger at a time or on conditions; not both.
fn trigger(
    reading: &mut Reading,
    fields: &mut Fields<'_>,
    [at_s, when]: [&'static str; 2],
    known: &Known<'_>,
) -> Option<Trigger> {
    let at = fields.number(reading, at_s);
    match (at, fields.take(when)) {
        (None, None) => None,
        (None, Some(when)) => Some(condition::trigger(reading, when, known)),
        (Some(at), None) => Some(Trigger { groups: vec![vec![after(reading, &at)?]] }),
        (Some(at), Some(_)) => {
            reading.refuse(
                &at.spot,
                format!("both {at_s} and {when}"),
                "keep one; when = { after_s = 5 } is a time",
            );
            None
        }
    }
}

/// True from a time on.
fn after(reading: &mut Reading, at: &Given) -> Option<Condition> {
    let test = Test::SimulationTime { rule: Rule::GreaterOrEqual, value: reading.seconds(at)? };
    Some(Condition { name: String::new(), test, edge: Edge::None, delay: std::time::Duration::ZERO })
}
