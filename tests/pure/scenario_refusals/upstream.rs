//! In upstream mode the checks are those of upstream.

use std::time::Duration;

use traffic_lights::compat::Compat;
use traffic_lights::scenario::{Action, Rule, Test};

use crate::pure::scenario_refusals::open_scenario::{A, by_value, document, light_action};
use crate::pure::scenario_refusals::{accepted, read_as, read_text, shown};

/// Reads a scenario that upstream mode accepts and improved mode refuses.
fn only_upstream(text: &str) -> signal_gateway::config::scenario::ScenarioFile {
    assert!(read_text("s.xosc", text).is_err(), "{text}");
    accepted(Compat::Upstream, "s.xosc", text)
}

fn phase(entries: &str) -> String {
    let phase = format!(
        "<TrafficSignalController name=\"B\"><Phase name=\"p\">{entries}</Phase></TrafficSignalController>"
    );
    document(&phase, "")
}

#[test]
fn bad_states_wait_until_they_are_applied() {
    let file = only_upstream(&phase("<TrafficSignalState trafficSignalId=\"1\" state=\"red,,green\"/>"));
    let state = &file.scenario.controllers[0].phases[0].entries[0].state;
    assert!(state.mistake.is_some());
    assert_eq!(state.bulbs.to_string(), "red solidOn circle");
    let file = only_upstream(&document(
        "",
        &light_action("<TrafficSignalStateAction name=\"1\" state=\"unknown\"/>"),
    ));
    let Action::SetState { state, .. } = &file.scenario.acts[0].events[0].actions[0] else { panic!() };
    assert_eq!(state.text, "unknown");
    let file = only_upstream(&document("", &by_value("<TrafficSignalCondition name=\"1\" state=\"blue\"/>")));
    let test = &file.scenario.acts[0].events[0].start.as_ref().unwrap().groups[0][0].test;
    assert!(matches!(test, Test::State { state: Some(state), .. } if state.single.is_none()));
}

#[test]
fn durations_below_zero_are_zero() {
    let text = document(&A.replace("\"5\"", "\"-5\""), "");
    assert_eq!(only_upstream(&text).scenario.controllers[0].phases[0].duration, Some(Duration::ZERO));
}

#[test]
fn times_before_the_start_are_in_the_past() {
    for (rule, expected) in [("greaterThan", Rule::GreaterOrEqual), ("lessOrEqual", Rule::LessThan)] {
        let condition = format!("<SimulationTimeCondition value=\"-1\" rule=\"{rule}\"/>");
        let file = only_upstream(&document("", &by_value(&condition)));
        let test = &file.scenario.acts[0].events[0].start.as_ref().unwrap().groups[0][0].test;
        assert_eq!(*test, Test::SimulationTime { rule: expected, value: Duration::ZERO });
    }
}

#[test]
fn names_of_phases_are_looked_up_when_they_are_needed() {
    let action = "<TrafficSignalControllerAction trafficSignalControllerRef=\"A\" phase=\"went\"/>";
    only_upstream(&document(A, &light_action(action)));
    let condition = "<TrafficSignalControllerCondition trafficSignalControllerRef=\"A\" phase=\"went\"/>";
    only_upstream(&document(A, &by_value(condition)));
}

/// Durations of two controllers, and whether each mode accepts that one follows the other (Q11).
#[test]
fn cycles_are_compared_as_each_counts_them() {
    let rows: &[(&[&str], &[&str], bool, bool)] = &[
        (&["1.9", "1.9"], &["2"], false, true),
        (&["1.9", "1.9"], &["3.8"], true, false),
        (&["0.5", "0.5", "0.5"], &["0.2"], false, true),
        (&["0.1", "0.2"], &["0.3"], true, true),
        (&["4"], &["4.0009"], true, true),
        (&["4"], &["4.002"], false, true),
        (&["4", "6"], &["10"], true, true),
        (&["4", "6"], &["11"], false, false),
        (&["INF"], &["INF", "INF"], true, true),
        (&["INF"], &["INF", "5"], true, false),
        (&["INF"], &["5"], false, false),
    ];
    let phases = |durations: &[&str]| -> String {
        durations.iter().map(|duration| format!("<Phase name=\"p\" duration=\"{duration}\"/>")).collect()
    };
    for (own, other, improved, upstream) in rows {
        let text = format!(
            "<TrafficSignalController name=\"A\">{}</TrafficSignalController>\
             <TrafficSignalController name=\"B\" reference=\"A\" delay=\"0\">{}</TrafficSignalController>",
            phases(other),
            phases(own)
        );
        for (compat, expected) in [(Compat::Improved, improved), (Compat::Upstream, upstream)] {
            let read = read_as(compat, "s.xosc", document(&text, "").as_bytes());
            assert_eq!(read.is_ok(), *expected, "{own:?} {other:?} {compat:?}");
            if let Err(problems) = read {
                let text = shown(&problems);
                assert!(text.contains("\"A\"") && text.contains("\"B\""), "{text}");
            }
        }
    }
}

#[test]
fn upstream_accepts_circles() {
    let circle = "<TrafficSignalController name=\"A\" reference=\"B\" delay=\"1\"/>\
                  <TrafficSignalController name=\"B\" reference=\"A\" delay=\"1\"/>";
    only_upstream(&document(circle, ""));
}
