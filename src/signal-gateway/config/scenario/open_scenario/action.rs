//! Actions on traffic lights.

use super::document::Document;
use crate::config::reading::{Element, LocatedText};
use traffic_lights::command::{CommandError, parse_command};
use traffic_lights::scenario::Action;
use traffic_lights::state_check::StateWriter;
use traffic_lights::variable::{Modification, VariableValue};

impl Document<'_, '_> {
    /// Reads the light actions among the children of an `Action` or of `Init/Actions`. Returns false if there
    /// are other children.
    pub(super) fn actions(&mut self, parent: &Element) -> (Vec<Action>, bool) {
        let mut actions = Vec::new();
        let mut is_whole = true;
        for child in &parent.children {
            match child.name.as_str() {
                "GlobalAction" => actions.extend(self.global(child)),
                "UserDefinedAction" => {
                    child.is_interpreted.set(true);
                    for command in child.all("CustomCommandAction") {
                        let (action, is_ours) = self.command(command);
                        actions.extend(action);
                        is_whole &= is_ours;
                    }
                }
                _ => {}
            }
            is_whole &= child.is_all_interpreted();
        }
        (actions, is_whole)
    }

    fn global(&mut self, element: &Element) -> Vec<Action> {
        element.is_interpreted.set(true);
        let infrastructure: Vec<_> = element.all("InfrastructureAction").collect();
        let signals = infrastructure.iter().flat_map(|inner| inner.all("TrafficSignalAction"));
        let mut actions = Vec::new();
        for (name, reference) in [("ParameterAction", "parameterRef"), ("VariableAction", "variableRef")] {
            for child in element.all(name) {
                actions.extend(self.variable_action(child, reference));
            }
        }
        for child in signals.flat_map(|signal| &signal.children) {
            match child.name.as_str() {
                "TrafficSignalStateAction" => actions.extend(self.set_state(child)),
                "TrafficSignalControllerAction" => actions.extend(self.enter_phase(child)),
                _ => {}
            }
        }
        actions
    }

    fn set_state(&mut self, element: &Element) -> Option<Action> {
        element.is_interpreted.set(true);
        let (name, state) = (self.required(element, "name"), self.required(element, "state"));
        self.no_others(element);
        let target = self.reader.upstream_plain_target(&name?);
        let (target, state) = (target?, state?);
        let state = self.reader.state(target, &state, StateWriter::Action)?;
        Some(Action::SetState { target, state })
    }

    fn enter_phase(&mut self, element: &Element) -> Option<Action> {
        element.is_interpreted.set(true);
        let name = self.required(element, "trafficSignalControllerRef");
        let phase = self.required(element, "phase");
        self.no_others(element);
        let (controller, phase) = self.reader.phase_of(&self.controllers, &name?, &phase?)?;
        Some(Action::EnterPhase { controller, phase })
    }

    fn variable_action(&mut self, element: &Element, reference: &'static str) -> Option<Action> {
        let variable = self.variable(element, reference);
        self.no_others(element);
        let inner = self.only_child(element)?;
        match inner.name.as_str() {
            "SetAction" => {
                let value = self.required(inner, "value");
                self.no_others(inner);
                let (variable, value) = self.value_of(variable?, &value?)?;
                Some(Action::SetVariable { variable, value })
            }
            "ModifyAction" => {
                let rule = self.only_child(inner)?;
                let change = self.only_child(rule)?;
                let value = self.required(change, "value");
                self.no_others(change);
                let (variable, value) = (variable?, value?);
                let number = self.reader.number(&value)?;
                let by = match change.name.as_str() {
                    "AddValue" => Modification::Add(number),
                    "MultiplyByValue" => Modification::Multiply(number),
                    name => {
                        let reason = format!("{name} is not a rule of a ModifyAction");
                        let remedy = "give AddValue or MultiplyByValue";
                        return self.reader.refused(&change.location, reason, remedy);
                    }
                };
                let kind = self.variables.get(variable.0).map(|variable| &variable.value);
                if !matches!(kind, Some(VariableValue::Number(_))) {
                    let reason = format!("{} changes a number, and this is not one", change.name);
                    let remedy = "use SetAction, or declare it as a number";
                    return self.reader.refused(&change.location, reason, remedy);
                }
                Some(Action::ModifyVariable { variable, by })
            }
            name => {
                let reason = format!("{name} is not an action on a parameter or variable");
                self.reader.refused(&inner.location, reason, "give SetAction or ModifyAction")
            }
        }
    }

    /// Reads the command in `type`; its arguments may be the content of the element instead. Returns false if
    /// the command is not about traffic lights.
    fn command(&mut self, element: &Element) -> (Option<Action>, bool) {
        let Some(LocatedText { text: name, location }) = self.required(element, "type") else {
            return (None, true);
        };
        let content = element.text();
        let text = if name.contains('(') || content.is_empty() { name } else { format!("{name}({content})") };
        match parse_command(&text, &self.controllers, self.reader.compat) {
            Ok(action) => {
                self.reader.use_ids_of(&action, &location);
                (Some(action), true)
            }
            Err(error @ CommandError::NotOurs(_)) => {
                element.mark_all_interpreted();
                self.reader.leave_out(&location, &error.to_string());
                (None, false)
            }
            Err(error) => {
                let is_form = matches!(error, CommandError::Form { .. } | CommandError::Count { .. });
                let remedy = if is_form { "write it as Name(argument, \"long argument\")" } else { "" };
                self.reader.refuse(&location, error.to_string(), remedy);
                (None, true)
            }
        }
    }
}
