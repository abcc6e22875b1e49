//! Acts, events, triggers and element states, and how a scenario ends.

use std::time::Duration;

use traffic_lights::compat::Compat::{self, Improved, Upstream};
use traffic_lights::event_log::{ScenarioEvent, ScenarioOutcome};
use traffic_lights::refusal::ActionRefusal;
use traffic_lights::scenario::{
    Act, Action, Condition, ControllerIndex, Edge, ElementState, Event, Rule, Scenario, StateText, Test,
    Trigger,
};

use super::scene::{BOTH, Scene, controller, event, set, settings, small_map, target, time_condition};

fn when(test: Test) -> Trigger {
    let condition = Condition { name: "c".to_owned(), test, edge: Edge::None, delay: Duration::ZERO };
    Trigger { groups: vec![vec![condition]] }
}

fn state_is(at: &str, state: &str, exact: bool) -> Test {
    let state = (state != "none").then(|| StateText::new(state));
    Test::State { target: target(at), state, exact }
}

fn element(name: &str, state: ElementState) -> Trigger {
    when(Test::Element { name: name.to_owned(), state })
}

fn act(name: &str, events: Vec<Event>) -> Act {
    Act { name: name.to_owned(), events, ..Act::default() }
}

fn scene(compat: Compat, acts: Vec<Act>) -> Scene {
    let phases = [("p1", "3", "21=red, green right"), ("p2", "3", "21=none"), ("p3", "3", "")];
    let scenario = Scenario { controllers: vec![controller("A", &phases)], acts, ..Scenario::default() };
    Scene::new(settings(small_map(), scenario, compat))
}

/// Seconds in which each event started, by name.
fn starts(scene: &Scene) -> Vec<(&str, u64)> {
    let started = scene.events.iter().filter_map(|logged| {
        let ScenarioEvent::EventStarted { act, event } = logged.event else { return None };
        Some((scene.lights.scenario().acts[act].events[event].name.as_str(), logged.at.as_secs()))
    });
    started.collect()
}

fn run(compat: Compat, acts: Vec<Act>) -> Scene {
    let mut scene = scene(compat, acts);
    scene.run_to(10);
    scene
}

#[test]
fn states_of_lights_start_events() {
    let cases = [
        ("contained", state_is("21", "red", false), Some(0), Some(0)),
        ("not exactly", state_is("21", "red", true), None, Some(0)),
        ("a list", state_is("21", "green right, red", true), Some(0), None),
        ("none", state_is("21", "none", false), Some(3), Some(6)),
        ("a group", state_is("200", "green none circle", true), Some(3), Some(3)),
        ("untouched", state_is("100", "none", false), Some(0), Some(0)),
        ("another store", state_is("21 conventional_detected", "red", false), None, None),
    ];
    for (case, test, improved, upstream) in cases {
        for (compat, expected) in [(Improved, improved), (Upstream, upstream)] {
            let scene = run(compat, vec![act("act", vec![event("e", when(test.clone()), Vec::new())])]);
            assert_eq!(starts(&scene).first().map(|(_, at)| *at), expected, "{case} {compat:?}");
            // Upstream compares with one bulb only (Q9).
            assert_eq!(scene.verdict().is_some(), case == "a list" && compat == Upstream, "{case}");
        }
    }
}

#[test]
fn phases_start_events_from_the_first_one_on() {
    for compat in BOTH {
        let phase = |name: &str| when(Test::Phase { controller: ControllerIndex(0), phase: name.to_owned() });
        let stray = when(Test::Phase { controller: ControllerIndex(7), phase: "p1".to_owned() });
        let events = vec![
            event("p2", phase("p2"), Vec::new()),
            event("p1", phase("p1"), Vec::new()),
            event("stray", stray, Vec::new()),
        ];
        assert_eq!(starts(&run(compat, vec![act("act", events)])), [("p1", 0), ("p2", 3)]);
    }
}

#[test]
fn rules_of_time() {
    for (rule, expected) in [
        (Rule::EqualTo, vec![2]),
        (Rule::NotEqualTo, vec![0, 1, 3]),
        (Rule::GreaterThan, vec![3, 4, 5]),
        (Rule::GreaterOrEqual, vec![2, 3, 4]),
        (Rule::LessThan, vec![0, 1]),
        (Rule::LessOrEqual, vec![0, 1, 2]),
    ] {
        for compat in BOTH {
            let mut thrice = event("e", time_condition(rule, 2.0), Vec::new());
            thrice.max_executions = 3;
            let scene = run(compat, vec![act("act", vec![thrice])]);
            let seconds: Vec<_> = starts(&scene).iter().map(|(_, at)| *at).collect();
            // Upstream executes it three times in the first frame.
            let expected = if compat == Upstream { vec![expected[0]; 3] } else { expected.clone() };
            assert_eq!(seconds, expected, "{rule:?} {compat:?}");
        }
    }
}

#[test]
fn a_trigger_fires_when_all_conditions_of_a_group_are_true() {
    let time = |rule, seconds| time_condition(rule, seconds).groups.remove(0).remove(0);
    let start = Trigger {
        groups: vec![
            vec![time(Rule::GreaterThan, 2.0), time(Rule::LessThan, 4.0)],
            vec![time(Rule::EqualTo, 7.0)],
        ],
    };
    let mut often = event("e", start, Vec::new());
    often.max_executions = 9;
    let never = event("never", Trigger::default(), Vec::new());
    let scene = run(Improved, vec![act("act", vec![often, never])]);
    assert_eq!(starts(&scene), [("e", 3), ("e", 7)]);
}

#[test]
fn transitions_are_observed_once_by_earlier_and_later_elements() {
    for compat in BOTH {
        for (state, expected) in [
            (ElementState::StartTransition, vec![("after", 2), ("before", 3)]),
            (ElementState::EndTransition, vec![("after", 2), ("before", 3)]),
            (ElementState::Running, vec![("after", 2), ("before", 3)]),
            (ElementState::StopTransition, vec![]),
        ] {
            let often =
                |name: &str| Event { max_executions: 9, ..event(name, element("it/0", state), Vec::new()) };
            let it = event("it", time_condition(Rule::GreaterOrEqual, 2.0), vec![set("11", "red")]);
            let acts = vec![
                act("one", vec![often("before")]),
                act("two", vec![it]),
                act("three", vec![often("after")]),
            ];
            let scene = run(compat, acts);
            let others: Vec<_> = starts(&scene).into_iter().filter(|(name, _)| *name != "it").collect();
            // Upstream executes it nine times in the first frame.
            let times = if compat == Upstream { 9 } else { 1 };
            let expected: Vec<_> = expected.into_iter().flat_map(|start| vec![start; times]).collect();
            assert_eq!(others, expected, "{state:?} {compat:?}");
        }
    }
}

#[test]
fn upstream_remembers_that_a_state_was_reached() {
    for (state, improved) in [
        (ElementState::Standby, None),
        (ElementState::Running, None),
        (ElementState::StartTransition, None),
        (ElementState::EndTransition, None),
        (ElementState::Complete, Some(5)),
        (ElementState::StopTransition, None),
    ] {
        for (compat, expected) in [(Improved, improved), (Upstream, Some(5))] {
            let it = event("it", time_condition(Rule::GreaterOrEqual, 2.0), Vec::new());
            let late = Trigger {
                groups: vec![
                    [element("it", state), time_condition(Rule::GreaterOrEqual, 5.0)]
                        .into_iter()
                        .flat_map(|trigger| trigger.groups.into_iter().flatten())
                        .collect(),
                ],
            };
            let scene =
                run(compat, vec![act("one", vec![it]), act("two", vec![event("late", late, Vec::new())])]);
            let found = starts(&scene).into_iter().find(|(name, _)| *name == "late").map(|(_, at)| at);
            let expected = expected.filter(|_| state != ElementState::StopTransition);
            assert_eq!(found, expected, "{state:?} {compat:?}");
        }
    }
}

#[test]
fn an_event_that_can_happen_again_is_in_standby() {
    let mut twice = event("twice", time_condition(Rule::GreaterOrEqual, 2.0), Vec::new());
    twice.max_executions = 2;
    let watch = |name: &str, state| event(name, element("twice", state), Vec::new());
    let events =
        vec![twice, watch("standby", ElementState::Standby), watch("complete", ElementState::Complete)];
    let scene = run(Improved, vec![act("act", events)]);
    assert_eq!(starts(&scene), [("standby", 0), ("twice", 2), ("twice", 3), ("complete", 3)]);
}

#[test]
fn acts_start_and_stop_and_end() {
    for compat in BOTH {
        let late = Act {
            start: Some(time_condition(Rule::GreaterOrEqual, 2.0)),
            stop: Some(time_condition(Rule::GreaterOrEqual, 4.0)),
            ..act(
                "late",
                vec![
                    Event { max_executions: 9, start: None, ..event("each", Trigger::default(), Vec::new()) },
                    event("never", time_condition(Rule::GreaterOrEqual, 5.0), Vec::new()),
                ],
            )
        };
        let watch = vec![
            event("stopped", element("never", ElementState::StopTransition), Vec::new()),
            event("act stopped", element("late", ElementState::StopTransition), Vec::new()),
        ];
        let scene = run(compat, vec![late, act("watch", watch)]);
        let mut expected =
            if compat == Upstream { vec![("each", 2); 9] } else { vec![("each", 2), ("each", 3)] };
        expected.extend([("stopped", 4), ("act stopped", 4)]);
        assert_eq!(starts(&scene), expected, "{compat:?}");
        let mut of_acts = scene.events.clone();
        of_acts.retain(|logged| {
            matches!(logged.event, ScenarioEvent::ActStarted(_) | ScenarioEvent::ActEnded(_))
        });
        let of_acts: Vec<_> = of_acts.into_iter().map(|logged| (logged.event, logged.at.as_secs())).collect();
        let expected = [
            (ScenarioEvent::ActStarted(1), 0),
            (ScenarioEvent::ActStarted(0), 2),
            (ScenarioEvent::ActEnded(0), 4),
            (ScenarioEvent::ActEnded(1), 4),
        ];
        assert_eq!(of_acts, expected, "{compat:?}");
    }
}

#[test]
fn after_the_end_controllers_and_events_stop() {
    let end = |success| {
        let actions = vec![Action::End(success), set("11", "red")];
        vec![act("act", vec![event("end", time_condition(Rule::GreaterOrEqual, 2.0), actions)])]
    };
    for compat in BOTH {
        for (success, verdict) in [(true, ScenarioOutcome::Success), (false, ScenarioOutcome::Failure)] {
            let scene = run(compat, end(success));
            assert_eq!(scene.verdict(), Some(&verdict));
            assert_eq!((scene.value("A", 10), scene.value("gt11", 10)), ("p1".to_owned(), "-".to_owned()));
            assert!(scene.value("int", 10).starts_with("200:"), "it is still sent");
        }
    }
    let scenario = Scenario { stop: Some(time_condition(Rule::GreaterThan, 4.0)), ..Scenario::default() };
    let mut scene = Scene::new(settings(small_map(), scenario, Improved));
    scene.run_to(4);
    assert_eq!(scene.verdict(), None);
    scene.run_to(5);
    assert_eq!(scene.verdict(), Some(&ScenarioOutcome::Stopped));
}

#[test]
fn only_upstream_applies_a_wrong_text_up_to_its_mistake() {
    let wrong = || vec![act("act", vec![event("e", Trigger::default(), vec![set("11", "red,,green")])])];
    for (compat, expected) in [(Improved, "-"), (Upstream, "R")] {
        let mut acts = wrong();
        acts[0].events[0].start = None;
        let scene = run(compat, acts);
        assert!(
            matches!(scene.verdict(), Some(ScenarioOutcome::Fault(ActionRefusal::State { .. }))),
            "{compat:?}"
        );
        assert_eq!(scene.value("gt11", 10), expected, "{compat:?}");
    }
}
