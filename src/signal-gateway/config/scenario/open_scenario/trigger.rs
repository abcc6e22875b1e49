//! Triggers and their conditions.

use std::cell::Cell;
use std::time::Duration;

use super::document::Document;
use super::draft::{ConditionDraft, TestDraft, TriggerDraft};
use crate::config::reading::{Attribute, Element, Keywords};
use traffic_lights::compat::Compat;
use traffic_lights::scenario::{Edge, ElementState, Rule, Test};
use traffic_lights::variable::VariableValue;

const EDGES: Keywords<Edge> = &[
    ("none", Edge::None),
    ("rising", Edge::Rising),
    ("falling", Edge::Falling),
    ("risingOrFalling", Edge::RisingOrFalling),
    ("sticky", Edge::Sticky),
];
const RULES: Keywords<Rule> = &[
    ("equalTo", Rule::EqualTo),
    ("notEqualTo", Rule::NotEqualTo),
    ("greaterThan", Rule::GreaterThan),
    ("greaterOrEqual", Rule::GreaterOrEqual),
    ("lessThan", Rule::LessThan),
    ("lessOrEqual", Rule::LessOrEqual),
];
const STATES: Keywords<ElementState> = &[
    ("standbyState", ElementState::Standby),
    ("runningState", ElementState::Running),
    ("completeState", ElementState::Complete),
    ("startTransition", ElementState::StartTransition),
    ("endTransition", ElementState::EndTransition),
    ("stopTransition", ElementState::StopTransition),
    ("skipTransition", ElementState::SkipTransition),
];
const KINDS: [&str; 6] = ["story", "act", "maneuverGroup", "maneuver", "event", "action"];

impl Document<'_, '_> {
    pub(super) fn trigger(&mut self, parent: &Element, name: &str) -> Option<TriggerDraft> {
        let trigger = parent.child(name)?;
        let group = |group: &Element| group.all("Condition").filter_map(|it| self.condition(it)).collect();
        Some(trigger.all("ConditionGroup").map(group).collect())
    }

    fn condition(&mut self, element: &Element) -> Option<ConditionDraft> {
        let name = self.label(element);
        let delay = match self.given(element, "delay") {
            Some(given) => self.reader.seconds(&given),
            None => Some(Duration::ZERO),
        };
        let edge = match self.given(element, "conditionEdge") {
            Some(given) => self.reader.checker.keyword(&given, EDGES),
            None => Some(Edge::None),
        };
        self.no_others(element);
        let test = match self.only_child(element)? {
            child if ["ByValueCondition", "ByStateCondition"].contains(&child.name.as_str()) => {
                let inner = self.only_child(child)?;
                if self.is_criterion(&name, inner) {
                    inner.mark_all_interpreted();
                    let what = format!("{name}, which CARLA's scenario_runner judges");
                    Some(TestDraft::Undecidable { what, location: inner.location.clone() })
                } else {
                    self.test(inner)
                }
            }
            child => {
                // It is listed as the reason why its group is never true.
                child.mark_all_interpreted();
                let inner = child.child("EntityCondition").and_then(|inner| inner.children.first());
                Some(undecidable(inner.unwrap_or(child)))
            }
        };
        Some(ConditionDraft { name, edge: edge?, delay: delay?, test: test? })
    }

    /// Returns true if a condition is a criterion of CARLA's `scenario_runner`: it is named `criteria_…`, and
    /// compares an undeclared parameter or none.
    fn is_criterion(&self, name: &str, test: &Element) -> bool {
        let reference = test.attribute("parameterRef").filter(|_| test.name == "ParameterCondition");
        let is_declared = |reference: &Attribute| {
            self.parameters.parameter(reference.value.trim_start_matches('$')).is_ok()
        };
        name.starts_with("criteria_") && reference.is_some_and(|reference| !is_declared(reference))
    }

    /// Returns the only child of an element; any other number is refused.
    pub(super) fn only_child<'e>(&mut self, element: &'e Element) -> Option<&'e Element> {
        let [child] = element.children.as_slice() else {
            let reason = format!("{} holds {} elements", element.name, element.children.len());
            return self.reader.refused(&element.location, reason, "give exactly one");
        };
        child.is_interpreted.set(true);
        element.is_interpreted.set(true);
        Some(child)
    }

    fn test(&mut self, element: &Element) -> Option<TestDraft> {
        let test = match element.name.as_str() {
            "SimulationTimeCondition" => self.simulation_time(element).map(TestDraft::Ready),
            "TrafficSignalCondition" => self.signal_state(element).map(TestDraft::Ready),
            "TrafficSignalControllerCondition" => {
                let name = self.required(element, "trafficSignalControllerRef");
                let phase = self.required(element, "phase");
                let found = self.reader.phase_of(&self.controllers, &name?, &phase?);
                found.map(|(controller, phase)| TestDraft::Ready(Test::Phase { controller, phase }))
            }
            "ParameterCondition" => self.variable_test(element, "parameterRef").map(TestDraft::Ready),
            "VariableCondition" => self.variable_test(element, "variableRef").map(TestDraft::Ready),
            "StoryboardElementStateCondition" => self.element_state(element),
            _ => return Some(undecidable(element)),
        };
        self.no_others(element);
        test
    }

    fn simulation_time(&mut self, element: &Element) -> Option<Test> {
        let value = self.required(element, "value");
        let rule = self.required(element, "rule");
        let rule = self.reader.checker.keyword(&rule?, RULES);
        let value = value?;
        let is_past = self.reader.number(&value)? < 0.0;
        match self.reader.compat {
            Compat::Upstream if is_past => Some(since_ever(rule?)),
            Compat::Improved | Compat::Upstream => {
                let value = self.reader.seconds(&value)?;
                Some(Test::SimulationTime { rule: rule?, value })
            }
        }
    }

    fn signal_state(&mut self, element: &Element) -> Option<Test> {
        let (name, state) = (self.required(element, "name"), self.required(element, "state"));
        let target = self.reader.upstream_plain_target(&name?);
        self.reader.state_test(target?, &state?, false)
    }

    fn variable_test(&mut self, element: &Element, reference: &'static str) -> Option<Test> {
        let found = self.variable(element, reference);
        let (rule, value) = (self.required(element, "rule"), self.required(element, "value"));
        let given = rule?;
        let rule = self.reader.checker.keyword(&given, RULES);
        let value = self.value_of(found?, &value?);
        let (rule, (variable, value)) = (rule?, value?);
        let has_order = matches!(value, VariableValue::Number(_)) || self.reader.compat == Compat::Upstream;
        if !has_order && !matches!(rule, Rule::EqualTo | Rule::NotEqualTo) {
            let reason = format!("{} compares numbers, and \"{value}\" is not one", given.text);
            return self.reader.refused(&given.location, reason, "give equalTo or notEqualTo");
        }
        Some(Test::Variable { variable, rule, value })
    }

    fn element_state(&mut self, element: &Element) -> Option<TestDraft> {
        let kind = self.required(element, "storyboardElementType");
        let reference = self.required(element, "storyboardElementRef");
        let state = self.required(element, "state");
        let kind = self.reader.checker.keyword(&kind?, &KINDS.map(|kind| (kind, kind)));
        let state = self.reader.checker.keyword(&state?, STATES);
        let (kind, reference, state) = (kind?, reference?, state?);
        Some(TestDraft::Element { target: Cell::default(), kind, reference, state })
    }
}

fn undecidable(element: &Element) -> TestDraft {
    TestDraft::Undecidable { what: element.name.clone(), location: element.location.clone() }
}

/// Returns the comparison of a time with a time before the start, which has always passed.
fn since_ever(rule: Rule) -> Test {
    let rule = match rule {
        Rule::NotEqualTo | Rule::GreaterThan | Rule::GreaterOrEqual => Rule::GreaterOrEqual,
        Rule::EqualTo | Rule::LessThan | Rule::LessOrEqual => Rule::LessThan,
    };
    Test::SimulationTime { rule, value: Duration::ZERO }
}
