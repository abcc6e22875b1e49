//! `do = [ … ]`: each action is a table with one of several keys.

use super::super::reader::ScenarioReader;
use super::condition::KnownNames;
use crate::config::reading::{Fields, Value, items};
use traffic_lights::scenario::Action;
use traffic_lights::state_check::StateWriter;

/// The kinds of actions by their keys; an action has exactly one of them.
const KINDS: &[&str] = &[
    "set",
    "clear",
    "enter",
    "enable_v2i",
    "disable_v2i",
    "v2i_rate_hz",
    "ground_truth_rate_hz",
    "confidence",
    "end",
];

pub(super) fn actions(reader: &mut ScenarioReader<'_>, value: &Value, known: &KnownNames<'_>) -> Vec<Action> {
    items(value).iter().filter_map(|item| action(reader, item, known)).collect()
}

fn action(reader: &mut ScenarioReader<'_>, value: &Value, known: &KnownNames<'_>) -> Option<Action> {
    let fields = Fields::of(reader.checker, value)?;
    let kind = fields.only_one_of(KINDS, "an action does exactly one thing")?;
    let action = of_kind(reader, &fields, kind, known);
    fields.done();
    action
}

fn of_kind(
    reader: &mut ScenarioReader<'_>,
    fields: &Fields<'_>,
    kind: &'static str,
    known: &KnownNames<'_>,
) -> Option<Action> {
    match kind {
        "set" => {
            let (target, state) = (fields.required_text(kind), fields.required_text("state"));
            let (target, state) = reader.written(target, state, StateWriter::Action)?;
            Some(Action::SetState { target, state })
        }
        "clear" => Some(Action::Clear(reader.target(&fields.required_text(kind)?)?)),
        "enter" => {
            let (name, phase) = (fields.required_text(kind), fields.required_text("phase"));
            let (controller, phase) = reader.phase_of(known.controllers, &name?, &phase?)?;
            Some(Action::EnterPhase { controller, phase })
        }
        "enable_v2i" => Some(Action::EnableV2i(ids(reader, fields.value(kind)?)?)),
        "disable_v2i" => Some(Action::DisableV2i(ids(reader, fields.value(kind)?)?)),
        "v2i_rate_hz" => Some(Action::SetV2iRate(reader.rate_hz(&fields.unquoted(kind)?)?)),
        "ground_truth_rate_hz" => Some(Action::SetGroundTruthRate(reader.rate_hz(&fields.unquoted(kind)?)?)),
        "confidence" => {
            let confidence = fields.unquoted(kind);
            let target = fields.required_text("of");
            let target = reader.target(&target?);
            let confidence = reader.confidence(&confidence?)?;
            Some(Action::SetConfidence { target: target?, confidence })
        }
        _ => Some(Action::End(fields.keyword(kind, &[("success", true), ("failure", false)])?)),
    }
}

fn ids(reader: &mut ScenarioReader<'_>, value: &Value) -> Option<Vec<i64>> {
    let values = items(value);
    if values.is_empty() {
        return reader.refused(&value.location, "no id is given", "give way or relation ids: [21, 100]");
    }
    let ids: Vec<_> = values.iter().filter_map(|value| reader.id_in(value)).collect();
    (ids.len() == values.len()).then_some(ids)
}
