//! `when = …`: one condition, a list of which all must hold, or `{ any = [ … ] }` of either.

use std::time::Duration;

use super::super::reading::{Reading, listed};
use crate::config::values::fields::Given;
use crate::config::values::fields::{Fields, items};
use crate::config::values::{Kind, Value};
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
pub(super) fn trigger(reading: &mut Reading, value: &Value, known: &Known<'_>) -> Trigger {
    let Kind::Map(entries) = &value.kind else {
        return Trigger { groups: vec![group(reading, value, known)] };
    };
    if !entries.iter().any(|entry| entry.key == "any") {
        return Trigger { groups: vec![group(reading, value, known)] };
    }
    let Some(mut fields) = Fields::of(reading, value) else { return Trigger::default() };
    let any = fields.list(reading, "any");
    fields.done(reading);
    if any.is_empty() {
        reading.refuse(&value.spot, "no condition stands here", "give at least one");
    }
    Trigger { groups: any.iter().map(|value| group(reading, value, known)).collect() }
}

fn group(reading: &mut Reading, value: &Value, known: &Known<'_>) -> Vec<Condition> {
    if items(value).is_empty() {
        reading.refuse(&value.spot, "no condition stands here", "give at least one");
    }
    items(value).iter().filter_map(|item| condition(reading, item, known)).collect()
}

fn condition(reading: &mut Reading, value: &Value, known: &Known<'_>) -> Option<Condition> {
    let mut fields = Fields::of(reading, value)?;
    let mut kinds = KINDS.iter().filter(|kind| fields.has(kind));
    let (Some(kind), None) = (kinds.next(), kinds.next()) else {
        let reason = "a condition looks at exactly one thing";
        reading.refuse(&value.spot, reason, &format!("give one of {}", KINDS.join(", ")));
        return None;
    };
    let test = test(reading, &mut fields, kind, known);
    let name = fields.text(reading, "name").map(|given| given.text).unwrap_or_default();
    let edge = match fields.text(reading, "edge") {
        Some(given) => word(reading, &given, EDGES),
        None => Some(Edge::None),
    };
    let delay = match fields.number(reading, "delay_s") {
        Some(given) => reading.seconds(&given),
        None => Some(Duration::ZERO),
    };
    fields.done(reading);
    Some(Condition { name, test: test?, edge: edge?, delay: delay? })
}

fn test(
    reading: &mut Reading,
    fields: &mut Fields<'_>,
    kind: &'static str,
    known: &Known<'_>,
) -> Option<Test> {
    match kind {
        "after_s" | "before_s" => {
            let given = fields.number(reading, kind)?;
            let rule = if kind == "after_s" { Rule::GreaterOrEqual } else { Rule::LessThan };
            Some(Test::SimulationTime { rule, value: reading.seconds(&given)? })
        }
        "controller" => {
            let (name, phase) = (fields.required(reading, kind), fields.required(reading, "phase"));
            let (controller, phase) = reading.phase_of(known.controllers, &name?, &phase?)?;
            Some(Test::Phase { controller, phase })
        }
        "light" => {
            let (target, state) = (fields.required(reading, kind), fields.required(reading, "state"));
            let exact = fields.truth(reading, "exact");
            let target = reading.target(&target?);
            reading.state_test(target?, &state?, exact)
        }
        _ => {
            let name = fields.required(reading, kind);
            let state = match fields.text(reading, "is") {
                Some(given) => word(reading, &given, STATES),
                None => Some(ElementState::Complete),
            };
            let name = name?;
            if !known.events.contains(&name.text) {
                let remedy = listed(known.events.iter().map(String::as_str));
                reading.refuse(&name.spot, format!("no event is called {:?}", name.text), &remedy);
                return None;
            }
            Some(Test::Element { name: name.text, state: state? })
        }
    }
}

fn word<T: Copy>(reading: &mut Reading, given: &Given, words: &[(&str, T)]) -> Option<T> {
    let found = words.iter().find(|(word, _)| *word == given.text);
    if found.is_none() {
        let known: Vec<_> = words.iter().map(|(word, _)| *word).collect();
        let reason = format!("{:?} is unknown here", given.text);
        reading.refuse(&given.spot, reason, &format!("give {}", known.join(", ")));
    }
    found.map(|(_, value)| *value)
}
