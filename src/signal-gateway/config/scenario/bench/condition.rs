//! `when = …`: one condition, a list of conditions that must all hold, or `{ any = [ … ] }` for alternatives.

use super::super::naming::listed;
use super::super::reader::ScenarioReader;
use crate::config::reading::{Fields, Keywords, Value, items};
use traffic_lights::scenario::{Condition, Edge, ElementState, Rule, Test, TrafficSignalController, Trigger};

/// The controllers and events to which conditions and actions can refer.
pub(super) struct KnownNames<'a> {
    pub(super) controllers: &'a [TrafficSignalController],
    pub(super) events: &'a [String],
}

/// The kinds of conditions by their keys; a condition has exactly one of them.
const KINDS: &[&str] = &["after_s", "before_s", "controller", "light", "event"];
const EDGES: Keywords<Edge> = &[
    ("none", Edge::None),
    ("rising", Edge::Rising),
    ("falling", Edge::Falling),
    ("either", Edge::RisingOrFalling),
];
const STATES: Keywords<ElementState> = &[
    ("standby", ElementState::Standby),
    ("running", ElementState::Running),
    ("complete", ElementState::Complete),
    ("starts", ElementState::StartTransition),
    ("ends", ElementState::EndTransition),
    ("stops", ElementState::StopTransition),
];

pub(super) fn trigger(reader: &mut ScenarioReader<'_>, value: &Value, known: &KnownNames<'_>) -> Trigger {
    let any = Fields::of_table(reader.checker, value).filter(|fields| fields.has("any"));
    let Some(fields) = any else {
        return Trigger { groups: vec![group(reader, value, known)] };
    };
    let any = fields.list("any", "give a list of conditions");
    fields.done();
    if any.is_empty() {
        reader.refuse(&value.location, "no condition is given", "give at least one");
    }
    Trigger { groups: any.iter().map(|value| group(reader, value, known)).collect() }
}

fn group(reader: &mut ScenarioReader<'_>, value: &Value, known: &KnownNames<'_>) -> Vec<Condition> {
    if items(value).is_empty() {
        reader.refuse(&value.location, "no condition is given", "give at least one");
    }
    items(value).iter().filter_map(|item| condition(reader, item, known)).collect()
}

fn condition(reader: &mut ScenarioReader<'_>, value: &Value, known: &KnownNames<'_>) -> Option<Condition> {
    let fields = Fields::of(reader.checker, value)?;
    let kind = fields.only_one_of(KINDS, "a condition tests exactly one thing")?;
    let test = test(reader, &fields, kind, known);
    let name = fields.text("name").map(|given| given.text).unwrap_or_default();
    let edge = fields.keyword("edge", EDGES).unwrap_or(Edge::None);
    let delay = fields.unquoted("delay_s").and_then(|given| reader.seconds(&given)).unwrap_or_default();
    fields.done();
    Some(Condition { name, test: test?, edge, delay })
}

fn test(
    reader: &mut ScenarioReader<'_>,
    fields: &Fields<'_>,
    kind: &'static str,
    known: &KnownNames<'_>,
) -> Option<Test> {
    match kind {
        "after_s" | "before_s" => {
            let given = fields.unquoted(kind)?;
            let rule = if kind == "after_s" { Rule::GreaterOrEqual } else { Rule::LessThan };
            Some(Test::SimulationTime { rule, value: reader.seconds(&given)? })
        }
        "controller" => {
            let (name, phase) = (fields.required_text(kind), fields.required_text("phase"));
            let (controller, phase) = reader.phase_of(known.controllers, &name?, &phase?)?;
            Some(Test::Phase { controller, phase })
        }
        "light" => {
            let (target, state) = (fields.required_text(kind), fields.required_text("state"));
            let exact = fields.flag("exact").unwrap_or_default();
            let target = reader.target(&target?);
            reader.state_test(target?, &state?, exact)
        }
        _ => {
            let name = fields.required_text(kind);
            let state = fields.keyword("is", STATES).unwrap_or(ElementState::Complete);
            let name = name?;
            if !known.events.contains(&name.text) {
                let remedy = listed(known.events.iter().map(String::as_str));
                let reason = format!("no event is called {:?}", name.text);
                return reader.refused(&name.location, reason, &remedy);
            }
            Some(Test::Element { name: name.text, state })
        }
    }
}
