//! Converts events of a scenario to entries of a report.

use serde_json::json;

use super::display::list;
use crate::report::Entry;
use traffic_lights::event_log::{ActionSource, ScenarioEvent, ScenarioOutcome};
use traffic_lights::scenario::{Action, Scenario};
use traffic_lights::target::{SignalTarget, StoreId};
use traffic_lights::variable::VariableIndex;

/// Returns the entry of an event, with the names for its positions.
pub(super) fn entry(event: &ScenarioEvent, scenario: &Scenario) -> Entry {
    let act_name = |act: usize| scenario.acts.get(act).map_or("", |act| &act.name);
    let event_name = |act: usize, event: usize| {
        scenario.acts.get(act).and_then(|act| act.events.get(event)).map_or("", |event| &event.name)
    };
    match event {
        ScenarioEvent::PhaseEntered { controller, phase } => {
            let controller = scenario.controllers.get(controller.0);
            let phase = controller.and_then(|controller| controller.phases.get(*phase));
            let (controller, phase) =
                (controller.map_or("", |controller| &controller.name), phase.map_or("", |phase| &phase.name));
            let fields = json!({ "what": "phase", "controller": controller, "phase": phase });
            Entry::new("phase", format!("{}: {}", named(controller), named(phase)), fields)
        }
        ScenarioEvent::ActStarted(act) => {
            let act = act_name(*act);
            Entry::new("act", format!("{} begins", named(act)), json!({ "what": "act_begins", "act": act }))
        }
        ScenarioEvent::ActEnded(act) => {
            let act = act_name(*act);
            Entry::new("act", format!("{} ends", named(act)), json!({ "what": "act_ends", "act": act }))
        }
        ScenarioEvent::EventStarted { act, event } => {
            let (act, event) = (act_name(*act), event_name(*act, *event));
            Entry::new("event", named(event), json!({ "what": "event", "act": act, "event": event }))
        }
        ScenarioEvent::ActionDone(source) => {
            let event = match source {
                ActionSource::Event { act, event, .. } => Some(event_name(*act, *event)),
                ActionSource::Init(_) | ActionSource::Outside => None,
            };
            let text = action_of(*source, scenario).map(|done| action(done, scenario)).unwrap_or_default();
            let fields = json!({ "what": "action", "event": event, "does": text });
            Entry::new("action", text, fields)
        }
        ScenarioEvent::Ended(outcome) => {
            let (name, text, reason) = match outcome {
                ScenarioOutcome::Success => ("success", "success".to_owned(), None),
                ScenarioOutcome::Failure => ("failure", "failure".to_owned(), None),
                ScenarioOutcome::Stopped => ("stopped", "stopped by its stop trigger".to_owned(), None),
                ScenarioOutcome::Fault(refusal) => {
                    ("fault", format!("cannot continue: {refusal}"), Some(refusal.to_string()))
                }
            };
            Entry::new("end", text, json!({ "what": "end", "verdict": name, "reason": reason }))
        }
    }
}

/// Formats a name of the scenario, which may be empty.
fn named(name: &str) -> &str {
    if name.is_empty() { "(unnamed)" } else { name }
}

/// Returns the action of a source; `None` for an external source.
pub(super) fn action_of(source: ActionSource, scenario: &Scenario) -> Option<&Action> {
    match source {
        ActionSource::Init(index) => scenario.init.get(index),
        ActionSource::Event { act, event, action } => {
            scenario.acts.get(act)?.events.get(event)?.actions.get(action)
        }
        ActionSource::Outside => None,
    }
}

fn action(action: &Action, scenario: &Scenario) -> String {
    let set = |target: &SignalTarget, text: &str| {
        if text.is_empty() { format!("set {target} to nothing") } else { format!("set {target} to {text}") }
    };
    match action {
        Action::SetState { target, state } => set(target, &state.text),
        Action::Clear(target) => format!("clear {target}"),
        Action::EnterPhase { controller, phase } => {
            let controller = scenario.controllers.get(controller.0).map_or("", |controller| &controller.name);
            format!("{controller} shall enter {phase}")
        }
        Action::SetV2iState { id, state, rate_hz } => {
            let rate = rate_hz.map(|rate| format!(", v2i at {rate} Hz")).unwrap_or_default();
            set(&SignalTarget { id: *id, store: StoreId::V2I }, &state.text) + &rate
        }
        Action::SetV2iRate(rate_hz) => format!("send v2i at {rate_hz} Hz"),
        Action::SetGroundTruthRate(rate_hz) => format!("send ground truth at {rate_hz} Hz"),
        Action::EnableV2i(ids) => format!("enable v2i of {}", list(ids)),
        Action::DisableV2i(ids) => format!("disable v2i of {}", list(ids)),
        Action::SetConfidence { target, confidence } => format!("confidence of {target} is {confidence}"),
        Action::SetVariable { variable, value } => {
            format!("set the variable {} to {value}", variable_name(*variable, scenario))
        }
        Action::ModifyVariable { variable, by } => {
            let name = variable_name(*variable, scenario);
            format!("set the variable {name} to {name} {by}")
        }
        Action::End(true) => "end with success".to_owned(),
        Action::End(false) => "end with failure".to_owned(),
    }
}

fn variable_name(variable: VariableIndex, scenario: &Scenario) -> &str {
    scenario.variables.get(variable.0).map_or("", |variable| &variable.name)
}
