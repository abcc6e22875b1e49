//! `when = …`: one condition, a list of which all must hold, or `{ any = [ … ] }` of either.

use std::time::Duration;

use super::super::reader::{Reader, listed};
use crate::config::reading::fields::{Fields, items};
use crate::config::reading::value::{Kind, Value};
use crate::core::traffic_light::scenario::{Condition, Controller, Edge, ElementState, Rule, Test, Trigger};

/// What conditions and actions can refer to.
pub(super) struct Known<'a> {
    pub(super) controllers: &'a [Controller],
    /// Names of events.
    pub(super) events: &'a [String],
}

/// Keys that make a condition; each has one of them.
const KINDS: &[&str] = &["after_s", "before_s", "controller", "light", "event"];
const EDGES: &[(&str, Edge)] = &[
    ("none", Edge::None),
    ("rising", Edge::Rising),
    ("falling", Edge::Falling),
    ("either", Edge::RisingOrFalling),
];
const STATES: &[(&str, ElementState)] = &[
    ("standby", ElementState::Standby),
    ("running", ElementState::Running),
    ("complete", ElementState::Complete),
    ("starts", ElementState::StartTransition),
    ("ends", ElementState::EndTransition),
    ("stops", ElementState::StopTransition),
];

/// The trigger that a value of `when` says.
pub(super) fn trigger(reader: &mut Reader, value: &Value, known: &Known<'_>) -> Trigger {
    let Kind::Map(entries) = &value.kind else {
        return Trigger { groups: vec![group(reader, value, known)] };
    };
    if !entries.iter().any(|entry| entry.key == "any") {
        return Trigger { groups: vec![group(reader, value, known)] };
    }
    let Some(mut fields) = Fields::of(reader, value) else { return Trigger::default() };
    let any = fields.list(reader, "any");
    fields.done(reader);
    if any.is_empty() {
        reader.refuse(&value.location, "no condition stands here", "give at least one");
    }
    Trigger { groups: any.iter().map(|value| group(reader, value, known)).collect() }
}

fn group(reader: &mut Reader, value: &Value, known: &Known<'_>) -> Vec<Condition> {
    if items(value).is_empty() {
        reader.refuse(&value.location, "no condition stands here", "give at least one");
    }
    items(value).iter().filter_map(|item| condition(reader, item, known)).collect()
}

fn condition(reader: &mut Reader, value: &Value, known: &Known<'_>) -> Option<Condition> {
    let mut fields = Fields::of(reader, value)?;
    let mut kinds = KINDS.iter().filter(|kind| fields.has(kind));
    let (Some(kind), None) = (kinds.next(), kinds.next()) else {
        let reason = "a condition looks at exactly one thing";
        reader.refuse(&value.location, reason, &format!("give one of {}", KINDS.join(", ")));
        return None;
    };
    let test = test(reader, &mut fields, kind, known);
    let name = fields.text(reader, "name").map(|given| given.text).unwrap_or_default();
    let edge = match fields.text(reader, "edge") {
        Some(given) => reader.keyword(&given, EDGES),
        None => Some(Edge::None),
    };
    let delay = match fields.number(reader, "delay_s") {
        Some(given) => reader.seconds(&given),
        None => Some(Duration::ZERO),
    };
    fields.done(reader);
    Some(Condition { name, test: test?, edge: edge?, delay: delay? })
}

fn test(reader: &mut Reader, fields: &mut Fields<'_>, kind: &'static str, known: &Known<'_>) -> Option<Test> {
    match kind {
        "after_s" | "before_s" => {
            let given = fields.number(reader, kind)?;
            let rule = if kind == "after_s" { Rule::GreaterOrEqual } else { Rule::LessThan };
            Some(Test::SimulationTime { rule, value: reader.seconds(&given)? })
        }
        "controller" => {
            let (name, phase) = (fields.required(reader, kind), fields.required(reader, "phase"));
            let (controller, phase) = reader.phase_of(known.controllers, &name?, &phase?)?;
            Some(Test::Phase { controller, phase })
        }
        "light" => {
            let (target, state) = (fields.required(reader, kind), fields.required(reader, "state"));
            let exact = fields.truth(reader, "exact");
            let target = reader.target(&target?);
            reader.state_test(target?, &state?, exact)
        }
        _ => {
            let name = fields.required(reader, kind);
            let state = match fields.text(reader, "is") {
                Some(given) => reader.keyword(&given, STATES),
                None => Some(ElementState::Complete),
            };
            let name = name?;
            if !known.events.contains(&name.text) {
                let remedy = listed(known.events.iter().map(String::as_str));
                reader.refuse(&name.location, format!("no event is called {:?}", name.text), &remedy);
                return None;
            }
            Some(Test::Element { name: name.text, state: state? })
        }
    }
}
