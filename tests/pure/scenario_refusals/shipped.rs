//! The scenarios in `config/scenarios`.

use lanelet2_map::light_map::{GroupEntry, LightMap};
use traffic_lights::compat::Compat;

use crate::pure::scenario_refusals::{accepted, read_text, shown};

const TOML: &str = include_str!("../../../config/scenarios/bench.toml");
const XOSC: &str = include_str!("../../../config/scenarios/bench.xosc");

#[test]
fn both_forms_give_the_same_scenario() {
    let toml = accepted(Compat::Improved, "bench.toml", TOML);
    let mut xosc = accepted(Compat::Improved, "bench.xosc", XOSC);
    // Only OpenSCENARIO has these; nothing in the file refers to them.
    (xosc.scenario.stories, xosc.scenario.variables) = Default::default();
    xosc.scenario.acts.iter_mut().for_each(|act| act.groups.clear());
    assert_eq!(toml.scenario, xosc.scenario);
    assert!(toml.not_interpreted.is_empty());
    let left_out: Vec<_> = xosc.not_interpreted.iter().map(ToString::to_string).collect();
    assert_eq!(left_out.len(), 1, "{left_out:?}");
    assert!(left_out[0].ends_with("ManeuverGroup/Actors: not interpreted: once, 1 element"));
}

#[test]
fn the_bench_scenario_has_its_groups_and_events() {
    let file = accepted(Compat::Improved, "bench.toml", TOML);
    let crosswalk = GroupEntry { is_pedestrian: true, ..GroupEntry::new(200, [21]) };
    assert_eq!(file.groups, [GroupEntry::new(100, [11, 12]), crosswalk]);
    assert_eq!(file.map, None);
    let events = &file.scenario.acts[0].events;
    let names: Vec<_> = events.iter().map(|event| event.name.as_str()).collect();
    assert_eq!(names, ["camera loses a light", "bench/Event[2]", "over"]);
    assert_eq!(events[1].action_names[1], "bench/Event[2]/Action[2]");
    assert_eq!((events[1].max_executions, events[1].actions.len()), (2, 6));
    assert_eq!(events[1].start.as_ref().unwrap().groups.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
    let follower = file.scenario.controllers[1].reference.unwrap();
    assert_eq!((follower.controller.0, follower.delay.as_millis()), (0, 4500));
    let map = LightMap::new([], &file.groups);
    assert_eq!(file.check_against(&map, Compat::Improved), []);
}

#[test]
fn every_key_that_is_commented_out_is_valid() {
    let mut shown_keys = Vec::new();
    for (index, line) in TOML.lines().enumerate() {
        let Some(bare) = line.trim_start().strip_prefix("# ") else { continue };
        let is_key = bare.split_once(" = ").is_some_and(|(key, _)| !key.contains(' '));
        if !is_key && !bare.starts_with("{ ") {
            continue;
        }
        let mut lines: Vec<_> = TOML.lines().collect();
        lines[index] = bare;
        let mut text = lines.join("\n");
        // Alternatives to lines of the file.
        for (instead, line) in [
            ("map = ", "pedestrian_groups = [200]\n"),
            ("map = ", "[groups]\n100 = [11, 12]\n200 = [21]\n"),
            ("stop_when = ", "stop_at_s = 60\n"),
        ] {
            if bare.starts_with(instead) {
                assert_eq!(text.matches(line).count(), 1, "{line}");
                text = text.replace(line, "");
            }
        }
        if let Err(problems) = read_text("bench.toml", &text) {
            panic!("{bare}:\n{}", shown(&problems));
        }
        shown_keys.push(bare.split(' ').find(|part| *part != "{").unwrap().to_owned());
    }
    assert_eq!(shown_keys, ["map", "stop_when", "light", "before_s", "v2i_rate_hz", "ground_truth_rate_hz"]);
}

#[test]
fn ids_that_the_map_lacks_are_named_with_their_locations() {
    let file = accepted(Compat::Improved, "bench.xosc", XOSC);
    let map = LightMap::new([], &[GroupEntry::new(100, [11, 12])]);
    assert_eq!(file.check_against(&map, Compat::Upstream), []);
    let problems = file.check_against(&map, Compat::Improved);
    let lines: Vec<_> = problems.iter().map(|problem| problem.position.unwrap().line).collect();
    let line_of = |text: &str| XOSC.lines().position(|line| line.contains(text)).unwrap() + 1;
    let walk = line_of("trafficSignalId=\"200\" state=\"green\"");
    let expected = [
        walk,
        walk + 3,
        line_of("Enable"),
        line_of("Disable"),
        line_of("(21, 0.7)"),
        line_of("TrafficSignalCondition name=\"21\""),
    ];
    assert_eq!(lines, expected);
    let first = problems[0].to_string();
    assert!(
        first.starts_with(&format!("bench.xosc:{walk}:"))
            && first.contains("Controller[2]/Phase/TrafficSignalState/@trafficSignalId: the map has neither a light nor a group 200; give an id of the map, or another map: its lights are 11, 12; its groups are 100"),
        "{first}"
    );
}
