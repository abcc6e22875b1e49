//! Parameters and variables that actions change and conditions compare.

use std::path::Path;

use lanelet2_map::light_map::{GroupEntry, LightMap};
use signal_gateway::config::scenario::read;
use signal_gateway::desk::lights::run::ScenarioRun;
use traffic_lights::compat::Compat::{self, Improved, Upstream};
use traffic_lights::engine::LightsSettings;
use traffic_lights::event_log::ScenarioEvent;

use crate::support::files::MemoryFiles;

/// The events that started, with their times in tenths of a second, and the left-out parts of the file.
pub(super) fn starts(compat: Compat, name: &str, text: &str) -> (Vec<(String, u128)>, String) {
    let files = MemoryFiles::new([(name, text.as_bytes())]);
    let file = read(&files, Path::new(name), compat).unwrap_or_else(|refused| panic!("{:?}", refused.0));
    let left_out = file.not_interpreted.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
    let map = LightMap::new([], &[GroupEntry::new(200, [21])]);
    let settings = LightsSettings::new(map.into(), file.scenario, compat);
    let mut run = ScenarioRun::new(settings, std::time::Duration::from_secs(20));
    let mut starts = Vec::new();
    while let Some(snapshot) = run.step() {
        for logged in snapshot.events {
            if let ScenarioEvent::EventStarted { act, event } = logged.event {
                let name = snapshot.scenario.acts[act].events[event].name.clone();
                starts.push((name, logged.at.as_millis() / 100));
            }
        }
    }
    (starts, left_out)
}

fn starts_of(text: &str) -> Vec<(String, u128)> {
    starts(Improved, "s.xosc", text).0
}

const DECLARED: &str = "<ParameterDeclarations>\
     <ParameterDeclaration name=\"count\" parameterType=\"integer\" value=\"1\"/>\
     <ParameterDeclaration name=\"word\" parameterType=\"string\" value=\"red\"/>\
     <ParameterDeclaration name=\"truth\" parameterType=\"boolean\" value=\"false\"/>\
     </ParameterDeclarations><VariableDeclarations>\
     <VariableDeclaration name=\"count\" variableType=\"double\" value=\"10\"/></VariableDeclarations>";

/// A document whose one maneuver has these events.
fn document(events: &str) -> String {
    format!(
        "<OpenSCENARIO>{DECLARED}<Storyboard><Story name=\"s\"><Act name=\"a\"><ManeuverGroup name=\"g\">\
         <Maneuver name=\"m\">{events}</Maneuver></ManeuverGroup></Act></Story></Storyboard></OpenSCENARIO>"
    )
}

fn event(name: &str, condition: &str, action: &str) -> String {
    format!(
        "<Event name=\"{name}\"><Action name=\"{name} does\"><GlobalAction>{action}</GlobalAction></Action>\
         <StartTrigger><ConditionGroup><Condition name=\"c\"><ByValueCondition>\n{condition}\n\
         </ByValueCondition></Condition></ConditionGroup></StartTrigger></Event>\n"
    )
}

fn at(seconds: &str) -> String {
    format!("<SimulationTimeCondition value=\"{seconds}\" rule=\"greaterOrEqual\"/>")
}

fn when(element: &str, name: &str, rule: &str, value: &str) -> String {
    let kind = element.trim_end_matches("Condition").to_lowercase();
    format!("<{element} {kind}Ref=\"{name}\" rule=\"{rule}\" value=\"{value}\"/>")
}

fn parameter(name: &str, inner: &str) -> String {
    format!("<ParameterAction parameterRef=\"{name}\">{inner}</ParameterAction>")
}

#[test]
fn actions_on_parameters_and_variables_start_the_events_that_compare_them() {
    let add = "<ModifyAction><Rule><AddValue value=\"1.5\"/></Rule></ModifyAction>";
    let twice = "<ModifyAction><Rule><MultiplyByValue value=\"2\"/></Rule></ModifyAction>";
    let nothing = parameter("word", "<SetAction value=\"red\"/>");
    let events = [
        event("adds", &at("1"), &parameter("count", add)),
        event("doubles", &at("2"), &parameter("$count", twice)),
        event("sets word", &at("3"), &parameter("word", "<SetAction value=\"green\"/>")),
        event("sets truth", &at("4"), &parameter("truth", "<SetAction value=\"true\"/>")),
        event(
            "lowers",
            &at("5"),
            "<VariableAction variableRef=\"count\"><SetAction value=\"-1\"/></VariableAction>",
        ),
        event("is 1", &when("ParameterCondition", "count", "equalTo", "1"), &nothing),
        event("is 2.5", &when("ParameterCondition", "count", "equalTo", "2.5"), &nothing),
        event("is above 4", &when("ParameterCondition", "count", "greaterThan", "4"), &nothing),
        event("is not red", &when("ParameterCondition", "word", "notEqualTo", "red"), &nothing),
        event("is true", &when("ParameterCondition", "truth", "equalTo", "true"), &nothing),
        event("is below 0", &when("VariableCondition", "count", "lessThan", "0"), &nothing),
    ];
    let found = starts_of(&document(&events.concat()));
    let expected = [
        ("is 1", 0),
        ("adds", 10),
        ("is 2.5", 10),
        ("doubles", 20),
        ("is above 4", 20),
        ("sets word", 30),
        ("is not red", 30),
        ("sets truth", 40),
        ("is true", 40),
        ("lowers", 50),
        ("is below 0", 50),
    ];
    assert_eq!(found, expected.map(|(name, at)| (name.to_owned(), at)));
}

#[test]
fn a_parameter_in_yaml_is_changed_and_references_keep_its_first_value() {
    let text = "\
OpenSCENARIO:
  ParameterDeclarations:
    ParameterDeclaration: [{ name: ready, parameterType: boolean, value: 'false' }]
  Storyboard:
    Story:
    - name: s
      Act:
      - name: a
        ManeuverGroup:
        - Maneuver:
          - name: m
            Event:
            - name: sets
              StartTrigger:
                ConditionGroup:
                - Condition:
                  - ByValueCondition: { SimulationTimeCondition: { value: 1, rule: greaterThan } }
              Action:
              - GlobalAction: { ParameterAction: { parameterRef: ready, SetAction: { value: 'true' } } }
            - name: waits
              StartTrigger:
                ConditionGroup:
                - Condition:
                  - ByValueCondition:
                      ParameterCondition: { parameterRef: ready, rule: notEqualTo, value: $ready }
              Action:
              - UserDefinedAction: { CustomCommandAction: { type: exitSuccess } }
";
    for compat in [Improved, Upstream] {
        let (starts, left_out) = starts(compat, "s.yaml", text);
        assert_eq!(starts, [("sets".to_owned(), 10), ("waits".to_owned(), 10)], "{compat:?}");
        assert_eq!(left_out, "", "{compat:?}");
    }
}

#[test]
fn a_parameter_of_the_document_is_told_from_one_of_a_maneuver() {
    let own = "<ParameterDeclarations><ParameterDeclaration name=\"count\" parameterType=\"integer\" value=\"7\"/>\
               </ParameterDeclarations>";
    let set = |name: &str| parameter(name, "<SetAction value=\"2\"/>");
    let nothing = parameter("word", "<SetAction value=\"red\"/>");
    let events = [
        event("own is 7", &when("ParameterCondition", "count", "equalTo", "7"), &nothing),
        event("own is 2", &when("ParameterCondition", "count", "equalTo", "2"), &nothing),
        event("global is 2", &when("ParameterCondition", "::count", "equalTo", "2"), &nothing),
        event("sets global", &at("1"), &set("::count")),
        event("sets own", &at("2"), &set("m::count")),
    ];
    let found = starts_of(&document(&format!("{own}{}", events.concat())));
    let expected =
        [("own is 7", 0), ("sets global", 10), ("global is 2", 10), ("sets own", 20), ("own is 2", 20)];
    assert_eq!(found, expected.map(|(name, at)| (name.to_owned(), at)));
}
