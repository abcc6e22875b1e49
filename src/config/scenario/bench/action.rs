//! `do = [ … ]`: each action is a table, known by its first word.

use super::super::reading::Reading;
use super::condition::Known;
use super::id;
use crate::config::values::Value;
use crate::config::values::fields::{Fields, items};
use crate::core::traffic_light::scenario::Action;
use crate::core::traffic_light::state_check::Writer;

/// Keys that make an action; each has one of them.
const KINDS: &[&str] =
    &["set", "clear", "enter", "enable_v2i", "disable_v2i", "v2i_rate_hz", "confidence", "end"];

/// The actions of a list, or the one.
pub(super) fn actions(reading: &mut Reading, value: &Value, known: &Known<'_>) -> Vec<Action> {
    items(value).iter().filter_map(|item| action(reading, item, known)).collect()
}

fn action(reading: &mut Reading, value: &Value, known: &Known<'_>) -> Option<Action> {
    let mut fields = Fields::of(reading, value)?;
    let mut kinds = KINDS.iter().filter(|kind| fields.has(kind));
    let (Some(kind), None) = (kinds.next(), kinds.next()) else {
        let reason = "an action is exactly one thing to do";
        reading.refuse(&value.spot, reason, &format!("give one of {}", KINDS.join(", ")));
        return None;
    };
    let action = of_kind(reading, &mut fields, kind, known);
    fields.done(reading);
    action
}

fn of_kind(
    reading: &mut Reading,
    fields: &mut Fields<'_>,
    kind: &'static str,
    known: &Known<'_>,
) -> Option<Action> {
    match kind {
        "set" => {
            let (target, state) = (fields.required(reading, kind), fields.required(reading, "state"));
            let target = reading.target(&target?);
            let (target, state) = (target?, state?);
            let state = reading.state(target.store, &state, Writer::Action)?;
            Some(Action::SetState { target, state })
        }
        "clear" => {
            let target = fields.required(reading, kind)?;
            Some(Action::Clear { target: reading.target(&target)? })
        }
        "enter" => {
            let (name, phase) = (fields.required(reading, kind), fields.required(reading, "phase"));
            let (controller, phase) = reading.phase_of(known.controllers, &name?, &phase?)?;
            Some(Action::EnterPhase { controller, phase })
        }
        "enable_v2i" => Some(Action::EnableV2i { ids: ids(reading, fields.take(kind)?)? }),
        "disable_v2i" => Some(Action::DisableV2i { ids: ids(reading, fields.take(kind)?)? }),
        "v2i_rate_hz" => {
            let rate = fields.number(reading, kind)?;
            Some(Action::SetV2iRate { rate_hz: reading.rate_hz(&rate)? })
        }
        "confidence" => {
            let confidence = fields.number(reading, kind);
            let target = fields.required(reading, "of");
            let target = reading.target(&target?);
            let confidence = reading.confidence(&confidence?)?;
            Some(Action::SetConfidence { target: target?, confidence })
        }
        _ => {
            let end = fields.required(reading, kind)?;
            match end.text.as_str() {
                "success" => Some(Action::End { success: true }),
                "failure" => Some(Action::End { success: false }),
                _ => {
                    let reason = format!("{:?} is no end", end.text);
                    reading.refuse(&end.spot, reason, "give \"success\" or \"failure\"");
                    None
                }
            }
        }
    }
}

fn ids(reading: &mut Reading, value: &Value) -> Option<Vec<i64>> {
    let values = items(value);
    if values.is_empty() {
        reading.refuse(&value.spot, "no id stands here", "give way or relation ids: [21, 100]");
        return None;
    }
    let ids: Vec<_> = values.iter().filter_map(|value| id(reading, value)).collect();
    (ids.len() == values.len()).then_some(ids)
}
