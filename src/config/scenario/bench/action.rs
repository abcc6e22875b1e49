//! `do = [ … ]`: each action is a table, known by its first word.

use super::super::reader::Reader;
use super::condition::Known;
use crate::config::reading::fields::{Fields, items};
use crate::config::reading::value::Value;
use crate::core::traffic_light::scenario::Action;
use crate::core::traffic_light::state_check::Writer;

/// Keys that make an action; each has one of them.
const KINDS: &[&str] =
    &["set", "clear", "enter", "enable_v2i", "disable_v2i", "v2i_rate_hz", "confidence", "end"];

/// The actions of a list, or the one.
pub(super) fn actions(reader: &mut Reader, value: &Value, known: &Known<'_>) -> Vec<Action> {
    items(value).iter().filter_map(|item| action(reader, item, known)).collect()
}

fn action(reader: &mut Reader, value: &Value, known: &Known<'_>) -> Option<Action> {
    let mut fields = Fields::of(reader, value)?;
    let mut kinds = KINDS.iter().filter(|kind| fields.has(kind));
    let (Some(kind), None) = (kinds.next(), kinds.next()) else {
        let reason = "an action is exactly one thing to do";
        reader.refuse(&value.location, reason, &format!("give one of {}", KINDS.join(", ")));
        return None;
    };
    let action = of_kind(reader, &mut fields, kind, known);
    fields.done(reader);
    action
}

fn of_kind(
    reader: &mut Reader,
    fields: &mut Fields<'_>,
    kind: &'static str,
    known: &Known<'_>,
) -> Option<Action> {
    match kind {
        "set" => {
            let (target, state) = (fields.required(reader, kind), fields.required(reader, "state"));
            let target = reader.target(&target?);
            let (target, state) = (target?, state?);
            let state = reader.state(target.store, &state, Writer::Action)?;
            Some(Action::SetState { target, state })
        }
        "clear" => {
            let target = fields.required(reader, kind)?;
            Some(Action::Clear { target: reader.target(&target)? })
        }
        "enter" => {
            let (name, phase) = (fields.required(reader, kind), fields.required(reader, "phase"));
            let (controller, phase) = reader.phase_of(known.controllers, &name?, &phase?)?;
            Some(Action::EnterPhase { controller, phase })
        }
        "enable_v2i" => Some(Action::EnableV2i { ids: ids(reader, fields.take(kind)?)? }),
        "disable_v2i" => Some(Action::DisableV2i { ids: ids(reader, fields.take(kind)?)? }),
        "v2i_rate_hz" => {
            let rate = fields.number(reader, kind)?;
            Some(Action::SetV2iRate { rate_hz: reader.rate_hz(&rate)? })
        }
        "confidence" => {
            let confidence = fields.number(reader, kind);
            let target = fields.required(reader, "of");
            let target = reader.target(&target?);
            let confidence = reader.confidence(&confidence?)?;
            Some(Action::SetConfidence { target: target?, confidence })
        }
        _ => {
            let end = fields.required(reader, kind)?;
            match end.text.as_str() {
                "success" => Some(Action::End { success: true }),
                "failure" => Some(Action::End { success: false }),
                _ => {
                    let reason = format!("{:?} is not an end", end.text);
                    reader.refuse(&end.location, reason, "give \"success\" or \"failure\"");
                    None
                }
            }
        }
    }
}

fn ids(reader: &mut Reader, value: &Value) -> Option<Vec<i64>> {
    let values = items(value);
    if values.is_empty() {
        reader.refuse(&value.location, "no id stands here", "give way or relation ids: [21, 100]");
        return None;
    }
    let ids: Vec<_> = values.iter().filter_map(|value| reader.id_in(value)).collect();
    (ids.len() == values.len()).then_some(ids)
}
