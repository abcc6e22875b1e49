//! Scenarios as users of upstream and of other simulators write them.

use std::path::Path;

use signal_gateway::config::scenario::{ReadOptions, ScenarioFile, read};
use traffic_lights::compat::Compat;
use traffic_lights::scenario::{Action, Edge, Test};

use super::open_scenario::{A, condition, document, light_action};
use super::{accepted, read_as, read_text, shown};
use crate::support::files::MemoryFiles;

const AS_UPSTREAM: &str = "\
OpenSCENARIO:
  FileHeader: &header { date: '2024' }
  RoadNetwork:
    LogicFile:
      filepath: $(find-pkg-share town)/map
    TrafficSignals:
      TrafficSignalController:
      - name:
        Phase:
        - &phase
          name: go
          semantics: go
          duration: ${ $p * 2 }
          TrafficSignalState: [{ trafficSignalId: '21', state: green }]
        - <<: *phase
          name: stop
  ParameterDeclarations:
    ParameterDeclaration: [{ name: p, parameterType: double, value: '2.5' }]
";

fn has(text: &str, part: &str) {
    assert!(text.contains(part), "{text}");
}

fn left_out(file: &ScenarioFile) -> String {
    file.not_interpreted.iter().map(ToString::to_string).collect()
}

/// The problems of a scenario in XML that is refused.
fn refused(compat: Compat, text: &str) -> String {
    shown(&read_as(compat, "s.xosc", text.as_bytes()).unwrap_err())
}

fn with(options: ReadOptions, name: &str, text: &str) -> Result<ScenarioFile, String> {
    let files = MemoryFiles::new([(name, text.as_bytes())]);
    read(&files, Path::new(name), options).map_err(|refused| shown(&refused.0))
}

#[test]
fn yaml_with_merge_keys_empty_names_expressions_and_packages_is_read() {
    let packages = [("town".to_owned(), "maps/town".into())].into();
    let file = with(ReadOptions { packages, ..ReadOptions::default() }, "s.yaml", AS_UPSTREAM).unwrap();
    assert_eq!(file.map.as_deref(), Some(Path::new("maps/town/map")));
    let [controller] = file.scenario.controllers.as_slice() else { panic!() };
    let phases: Vec<_> =
        controller.phases.iter().map(|phase| (phase.name.as_str(), phase.duration)).collect();
    let five_seconds = Some(std::time::Duration::from_secs(5));
    assert_eq!(
        (controller.name.as_str(), phases.as_slice()),
        ("", [("go", five_seconds), ("stop", five_seconds)].as_slice())
    );
    assert_eq!(controller.phases[0].entries, controller.phases[1].entries);
    let without = accepted(Compat::Improved, "s.yaml", AS_UPSTREAM);
    let left_out = left_out(&without);
    assert!(without.map.is_none() && left_out.contains("--package town=FOLDER"), "{left_out}");
}

#[test]
fn a_modifier_is_named_as_one() {
    let refused = read_text("s.yaml", "ScenarioModifiers:\n  ScenarioModifier: []\n").unwrap_err();
    assert!(shown(&refused).contains("this is a scenario modifier, not a scenario"), "{}", shown(&refused));
}

#[test]
fn controllers_of_one_name_are_refused_and_upstream_means_the_first() {
    let text = document(&format!("{A}\n{A}"), "");
    let refused = refused(Compat::Improved, &text);
    has(&refused, "s.xosc:4:1: ");
    has(&refused, "two controllers are called \"A\"");
    assert_eq!(accepted(Compat::Upstream, "s.xosc", &text).scenario.controllers.len(), 2);
}

#[test]
fn a_state_by_position_needs_the_order_of_the_bulbs() {
    let text = |state: &str| {
        document("", &light_action(&format!("<TrafficSignalStateAction name=\"21\" state=\"{state}\"/>")))
    };
    let read = |order: &str, state: &str| {
        let bulb_orders = order.split_terminator('|').map(|order| order.parse().unwrap()).collect();
        let file = with(ReadOptions { bulb_orders, ..ReadOptions::default() }, "s.xosc", &text(state))?;
        let Action::SetState { state, .. } = &file.scenario.acts[0].events[0].actions[0] else { panic!() };
        Ok::<_, String>(state.text.clone())
    };
    let order = "red,yellow,green";
    for (state, expected) in [
        ("on;off;off", "red solidOn circle"),
        ("on; on; off", "red solidOn circle, yellow solidOn circle"),
        ("off;off;flashing", "green flashing circle"),
        ("off;off;off", ""),
        ("red", "red"),
    ] {
        assert_eq!(read(order, state).as_deref(), Ok(expected), "{state}");
    }
    assert_eq!(read("green left", "on").as_deref(), Ok("green solidOn left"));
    assert_eq!(read("red|21=green", "on").as_deref(), Ok("green solidOn circle"));
    assert_eq!(read("red,green|20=green", "off;on").as_deref(), Ok("green solidOn circle"));
    let refused = read("", "on;off;off").unwrap_err();
    has(&refused, "has 3 positions, but no order of as many bulbs is known for the light 21");
    let refused = read(order, "on;off").unwrap_err();
    has(&refused, "has 2 positions, but no order");
    has(&refused, "--bulb-order red,yellow,green");
    assert!(read(order, "on;dim;off").is_err());
    assert_eq!(
        read(order, "other;flashing;counting").as_deref(),
        Ok("yellow flashing circle, green solidOn circle")
    );
}

#[test]
fn what_cannot_be_shown_of_a_state_by_position_is_listed() {
    let bulb_orders = vec!["red,yellow,green".parse().unwrap()];
    let options = ReadOptions { bulb_orders, ..ReadOptions::default() };
    let text =
        document("", &light_action("<TrafficSignalStateAction name=\"21\" state=\"other;off;counting\"/>"));
    let file = with(options, "s.xosc", &text).unwrap();
    let left_out: Vec<_> = file.not_interpreted.iter().map(|part| part.what.as_str()).collect();
    let expected = [
        "the red bulb of the light 21 in \"other;off;counting\": it is `other`, which no message has, and shown as off",
        "the green bulb of the light 21 in \"other;off;counting\": it is `counting`, and shown as on without its number",
    ];
    assert_eq!(left_out, expected);
}

#[test]
fn a_declared_name_may_begin_with_a_dollar_sign() {
    let state = "<TrafficSignalStateAction name=\"$p\" state=\"red\"/>";
    let text = document("", &light_action(state)).replace("name=\"p\"", "name=\"$p\"");
    let file = accepted(Compat::Improved, "s.xosc", &text);
    assert_eq!(file.ids.iter().map(|used| used.id).collect::<Vec<_>>(), [21]);
    has(&refused(Compat::Upstream, &text), "no parameter is called p");
}

#[test]
fn the_name_of_a_condition_is_a_label() {
    for (name, shown_name) in [
        ("${$p + 1}", "22"),
        ("$p", "21"),
        ("$p passed", "$p passed"),
        ("${$p + 1} s", "${$p + 1} s"),
        ("${$p > 1}", "${$p > 1}"),
        ("$(env USER)", "$(env USER)"),
    ] {
        let text = document("", &condition(&TIME.replace("name=\"t\"", &format!("name=\"{name}\""))));
        let file = accepted(Compat::Improved, "s.xosc", &text.replace("> 1}", "&gt; 1}"));
        let event = &file.scenario.acts[0].events[0];
        assert_eq!(event.start.as_ref().unwrap().groups[0][0].name, shown_name);
    }
    let text = document("", &condition(&TIME.replace("name=\"t\"", "name=\"$p passed\"")));
    has(&refused(Compat::Upstream, &text), "no parameter is called p passed");
}

const ENTITY: &str = "<Condition name=\"c\"><ByEntityCondition><EntityCondition><SpeedCondition value=\"1\" \
     rule=\"greaterThan\"/></EntityCondition></ByEntityCondition></Condition>";
const TIME: &str = "<Condition name=\"t\" conditionEdge=\"sticky\"><ByValueCondition><SimulationTimeCondition \
     value=\"1\" rule=\"greaterThan\"/></ByValueCondition></Condition>";
const END: &str = "<Action name=\"x\"><UserDefinedAction><CustomCommandAction type=\"exitSuccess\"/>\
     </UserDefinedAction></Action>";

#[test]
fn an_undecidable_group_is_never_true_and_the_others_stay() {
    let groups = format!("{ENTITY}</ConditionGroup>\n<ConditionGroup>{TIME}");
    let file = accepted(Compat::Improved, "s.xosc", &document("", &condition(&groups)));
    let [condition] = file.scenario.acts[0].events[0].start.as_ref().unwrap().groups[0].as_slice() else {
        panic!()
    };
    assert!(matches!(condition.test, Test::SimulationTime { .. }) && condition.edge == Edge::Sticky);
    let left_out = file.not_interpreted.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
    has(&left_out, "this group of conditions is never true");
    assert_eq!(file.uncertain_ends, []);
}

#[test]
fn a_verdict_that_was_left_out_is_named() {
    let either = format!("{ENTITY}</ConditionGroup>\n<ConditionGroup>{TIME}");
    for (conditions, expected) in [(ENTITY, Some("e")), (TIME, None), (&either, Some("e"))] {
        let inner = condition(conditions).replace("</Event>", &format!("{END}</Event>"));
        let file = accepted(Compat::Improved, "s.xosc", &document("", &inner));
        let uncertain: Vec<_> =
            file.uncertain_ends.iter().map(|end| (end.event.as_deref(), end.success)).collect();
        let expected = expected.map(|event| (Some(event), Some(true)));
        assert_eq!(uncertain, expected.into_iter().collect::<Vec<_>>());
    }
}

#[test]
fn a_delay_of_zero_needs_no_reference() {
    let text = document(&A.replace("name=\"A\"", "name=\"A\" delay=\"0\""), "");
    let file = accepted(Compat::Improved, "s.xosc", &text);
    assert!(file.scenario.controllers[0].reference.is_none() && file.not_interpreted.is_empty());
    has(&refused(Compat::Upstream, &text), "a delay without a reference");
}

#[test]
fn a_criterion_of_scenario_runner_is_left_out_and_a_parameter_with_a_typo_is_refused() {
    let criteria = |name: &str, parameter: &str| {
        let condition = format!(
            "<Condition name=\"{name}\"><ByValueCondition><ParameterCondition parameterRef=\"{parameter}\" \
             value=\"21\" rule=\"equalTo\"/></ByValueCondition></Condition>"
        );
        document(
            "",
            &format!("<StopTrigger><ConditionGroup>{condition}{TIME}</ConditionGroup></StopTrigger>"),
        )
    };
    for parameter in ["", "distance_success"] {
        let file = accepted(Compat::Improved, "s.xosc", &criteria("criteria_CollisionTest", parameter));
        assert!(file.scenario.stop.as_ref().is_none_or(|stop| stop.groups.is_empty()));
        has(&left_out(&file), "criteria_CollisionTest, which CARLA's scenario_runner judges");
    }
    let declared = accepted(Compat::Improved, "s.xosc", &criteria("criteria_own", "p"));
    assert_eq!(declared.scenario.stop.unwrap().groups[0].len(), 2);
    for (name, parameter) in [("c", "distance_success"), ("c", "")] {
        has(&shown(&read_text("s.xosc", &criteria(name, parameter)).unwrap_err()), "no parameter is called");
    }
}

#[test]
fn a_parameter_that_a_launch_system_computes_is_refused_where_a_light_needs_it() {
    let text = |duration: &str| {
        let phase = format!("<Phase name=\"go\" duration=\"{duration}\"/>");
        let controller = format!("<TrafficSignalController name=\"A\">{phase}</TrafficSignalController>");
        document(&controller, "").replace("value=\"21\"", "value=\"$(ros2 run dice roll 1 6)\"")
    };
    let file = accepted(Compat::Improved, "s.xosc", &text("5"));
    has(&left_out(&file), "the value of \"p\": `$(ros2 run dice roll 1 6)`");
    for duration in ["$p", "${$p + 1}"] {
        let refused = shown(&read_text("s.xosc", &text(duration)).unwrap_err());
        has(&refused, "the value of the parameter p is not known");
        has(&refused, "Phase/@duration");
    }
}

#[test]
fn a_stop_trigger_that_was_left_out_makes_a_verdict_uncertain() {
    let stop = |conditions: &str| {
        format!("<StopTrigger><ConditionGroup>{conditions}</ConditionGroup></StopTrigger>")
    };
    for (conditions, expected) in [(TIME, 0), (ENTITY, 1)] {
        let file = accepted(Compat::Improved, "s.xosc", &document("", &stop(conditions)));
        assert_eq!(file.uncertain_ends.len(), expected);
        assert!(file.uncertain_ends.iter().all(|end| end.event.is_none() && end.success.is_none()));
    }
}

#[test]
fn a_map_in_a_package_may_be_a_parameter() {
    let text = "OpenSCENARIO:\n  ParameterDeclarations:\n    ParameterDeclaration:\n    \
                - { name: m, parameterType: string, value: $(find-pkg-share town)/map }\n  \
                RoadNetwork:\n    LogicFile: { filepath: $m }\n";
    let packages = [("town".to_owned(), "maps/town".into())].into();
    let file = with(ReadOptions { packages, ..ReadOptions::default() }, "a/s.yaml", text).unwrap();
    assert_eq!(file.map.as_deref(), Some(Path::new("maps/town/map")));
    let file = accepted(Compat::Improved, "a/s.yaml", text);
    let reason = file.unresolved_map.unwrap();
    assert!(file.map.is_none() && reason.contains("--package town=FOLDER"), "{reason}");
    assert!(read_text("s.yaml", &text.replace("$m", "$n")).is_err());
}

/// A phase whose light, state and name are scenario modifiers, the last one inside a longer word.
fn modified(modifiers: &str) -> String {
    let head = format!("ScenarioModifiers:\n  ScenarioModifier: {modifiers}\nOpenSCENARIO:");
    AS_UPSTREAM
        .replace("'21', state: green", "LIGHT, state: COLOR flashing")
        .replace("name: stop", "name: stop_COLORED")
        .replace("OpenSCENARIO:", &head)
}

#[test]
fn a_light_that_is_given_by_a_modifier_with_several_values_is_refused_until_one_is_chosen() {
    let text =
        modified("[{ name: COLOR, list: [red, green] }, { name: LIGHT, start: 21, step: 1, stop: 23 }]");
    let refused = shown(&read_text("s.yaml", &text).unwrap_err());
    for (key, reason) in [
        (
            "@state",
            "COLOR is a scenario modifier, which stands for several values; choose one with --modifier COLOR=red",
        ),
        ("@trafficSignalId", "LIGHT is a scenario modifier, which stands for several values"),
        ("@name", "COLOR is a scenario modifier"),
    ] {
        assert!(refused.lines().any(|line| line.contains(key) && line.contains(reason)), "{refused}");
    }
    let choose = |chosen: &[(&str, &str)]| {
        let modifiers =
            chosen.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        with(ReadOptions { modifiers, ..ReadOptions::default() }, "s.yaml", &text)
    };
    let file = choose(&[("COLOR", "green"), ("LIGHT", "22")]).unwrap();
    let phase = &file.scenario.controllers[0].phases[1];
    assert_eq!(
        (phase.name.as_str(), phase.entries[0].state.text.as_str()),
        ("stop_greenED", "green flashing")
    );
    assert!(file.ids.iter().all(|used| used.id == 22));
    let left_out = left_out(&file);
    assert!(!left_out.contains("modifier"), "{left_out}");
    let refused = choose(&[("COLOR", "blue"), ("LIGHT", "22")]).unwrap_err();
    has(&refused, "COLOR has no value \"blue\"; there are red, green");
    let refused = choose(&[("COLOUR", "green")]).unwrap_err();
    has(&refused, "no scenario modifier is called \"COLOUR\"; there are COLOR, LIGHT");
}

#[test]
fn a_modifier_with_one_value_is_that_value() {
    for compat in [Compat::Improved, Compat::Upstream] {
        let text = modified("[{ name: COLOR, list: [red] }, { name: LIGHT, start: 21, step: 5, stop: 22 }]");
        let file = accepted(compat, "s.yaml", &text);
        let entry = &file.scenario.controllers[0].phases[0].entries[0];
        assert_eq!((entry.target.id, entry.state.text.as_str()), (21, "red flashing"));
    }
}

#[test]
fn a_parameter_that_is_a_modifier_is_refused_where_a_light_needs_it() {
    let text = AS_UPSTREAM.replace("'2.5'", "WAIT").replace(
        "OpenSCENARIO:",
        "ScenarioModifiers:\n  ScenarioModifier: [{ name: WAIT, list: [1, 2] }]\nOpenSCENARIO:",
    );
    let refused = shown(&read_text("s.yaml", &text).unwrap_err());
    has(&refused, "the value of the parameter p is not known: WAIT is a scenario modifier");
    let file = accepted(Compat::Improved, "s.yaml", &text.replace("${ $p * 2 }", "5"));
    let left_out = left_out(&file);
    has(
        &left_out,
        "the scenario modifier WAIT, of which each value is a run; choose one with --modifier WAIT=1",
    );
    has(&left_out, "the value of \"p\": WAIT is a scenario modifier");
}
