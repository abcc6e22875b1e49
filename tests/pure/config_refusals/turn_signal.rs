//! What is refused in `[turn_signal]`.

use signal_gateway::config::Problem;
use signal_gateway::config::Settings;
use signal_gateway::core::turn_signal::parameters::{PARAMETERS, Parameters};
use signal_gateway::core::turn_signal::signal::Side;

use crate::pure::config_refusals::{assert_refused, load_texts, row, sound};

const ROS: &str = "[ros]\n";

/// The section with these keys, in front of `[ros]`.
macro_rules! section {
    ($keys:literal) => {
        concat!("[turn_signal]\nmap = \"map.osm\"\n", $keys, "\n[ros]\n")
    };
}

#[test]
fn broken_sections_are_refused_where_they_break() {
    assert_refused(
        "gateway.toml",
        &[
            row(ROS, "@@[turn_signal]\nenabled = true\n[ros]\n", "turn_signal", "no map", "map = "),
            row(
                ROS,
                "[turn_signal]\nmap = @@\"away.osm\"\n[ros]\n",
                "turn_signal.map",
                "away.osm: cannot read it",
                "relative to this file",
            ),
            row(
                ROS,
                "[turn_signal]\nmap = @@\"empty.osm\"\n[ros]\n",
                "turn_signal.map",
                "it has no lanelet",
                "lanelet2 map",
            ),
            row(
                ROS,
                "[turn_signal]\nmap = @@\"torn.osm\"\n[ros]\n",
                "turn_signal.map",
                "torn.osm: ",
                "lanelet2 map",
            ),
            row(
                ROS,
                section!("@@maps = \"map.osm\""),
                "turn_signal.maps",
                "unknown key \"maps\"",
                "known here are",
            ),
            row(
                ROS,
                section!("enabled = true\nshadow = @@true"),
                "turn_signal.shadow",
                "a shadow publishes nothing",
                "enabled = false",
            ),
            row(
                ROS,
                section!("compat = @@\"both\""),
                "turn_signal.compat",
                "unknown value \"both\"",
                "improved, upstream",
            ),
            row(
                ROS,
                section!("country = @@\"FR\""),
                "turn_signal.country",
                "no rules for \"FR\"",
                "give AT, CH, DE",
            ),
            row(
                ROS,
                section!("country = @@\"away.toml\""),
                "turn_signal.country",
                "away.toml: cannot read it",
                "relative to this file",
            ),
            row(
                ROS,
                section!("planning_hz = @@0.5"),
                "turn_signal.planning_hz",
                "0.5 Hz is out of range",
                "1 to 100 Hz",
            ),
            row(ROS, section!("planning_hz = @@nan"), "turn_signal.planning_hz", "nan Hz", "1 to 100 Hz"),
            row(
                ROS,
                section!("minimum_on_ms = @@60001"),
                "turn_signal.minimum_on_ms",
                "60001 ms",
                "0 to 60000 ms",
            ),
            row(
                ROS,
                section!("shadow_tolerance_ms = @@99999"),
                "turn_signal.shadow_tolerance_ms",
                "99999 ms",
                "0 to 60000 ms",
            ),
        ],
    );
}

#[test]
fn limits_dimensions_parameters_and_topics_that_do_not_fit_are_refused() {
    assert_refused(
        "gateway.toml",
        &[
            row(
                ROS,
                section!("age_limits.odometry_ms = @@0"),
                "turn_signal.age_limits.odometry_ms",
                "0 ms",
                "10 to 60000 ms",
            ),
            row(
                ROS,
                section!("vehicle.wheel_base_m = @@-1.0"),
                "turn_signal.vehicle.wheel_base_m",
                "-1.0 m is out of range",
                "0 to 50 m",
            ),
            row(
                ROS,
                section!("parameters.@@turn_signal_serch_time = 3.0"),
                "turn_signal.parameters.turn_signal_serch_time",
                "is not a parameter of the turn signal decider",
                "config/gateway.toml",
            ),
            row(
                ROS,
                section!("parameters.turn_signal_search_time = @@-3.0"),
                "turn_signal.parameters.turn_signal_search_time",
                "invalid value -3.0",
                "seconds, 0 to 3600",
            ),
            row(
                ROS,
                section!("parameters.turn_signal_on_swerving = @@\"maybe\""),
                "turn_signal.parameters.turn_signal_on_swerving",
                "invalid value maybe",
                "true or false",
            ),
            row(
                ROS,
                section!(
                    "parameters.turn_signal_intersection_angle_threshold_deg = 9\nparameters.@@turn_signal_intersection_angle_threshold_degree = 9"
                ),
                "turn_signal.parameters.turn_signal_intersection_angle_threshold_degree",
                "is given twice",
                "keep one",
            ),
            row(
                ROS,
                section!("inputs.odometry = @@\"\""),
                "turn_signal.inputs.odometry",
                "not an absolute topic",
                "/a/b",
            ),
            row(
                ROS,
                section!("inputs.scenario = @@\"scenario\""),
                "turn_signal.inputs.scenario",
                "not an absolute topic",
                "/a/b",
            ),
            row(
                ROS,
                section!("outputs.turn_command = @@\"/planning/hazard_lights_cmd\""),
                "turn_signal.outputs.turn_command",
                "another topic has this name",
                "its own",
            ),
            row(
                ROS,
                section!("enabled = true\ninputs.hazard_request = @@\"/planning/hazard_lights_cmd\""),
                "turn_signal.inputs.hazard_request",
                "another topic has this name",
                "its own",
            ),
            row(
                ROS,
                section!("inputs.odometry = @@\"/planning/mission_planning/route\""),
                "turn_signal.inputs.odometry",
                "another topic has this name",
                "its own",
            ),
            row(
                ROS,
                section!("shadow = true\ninputs.own_turn_command = @@\"/localization/kinematic_state\""),
                "turn_signal.inputs.own_turn_command",
                "another topic has this name",
                "its own",
            ),
        ],
    );
}

const RULES: &str = include_str!("../../../config/countries/JP.toml");

/// A configuration with these rules of a country.
fn with_rules(rules: &str) -> Result<Settings, Vec<Problem>> {
    let mut texts = sound();
    let gateway = texts.text("gateway.toml").to_owned();
    let gateway = gateway.replace(ROS, section!("country = \"rules.toml\""));
    texts.insert("gateway.toml", gateway);
    texts.insert("rules.toml", rules);
    load_texts(&texts)
}

#[test]
fn rules_of_a_country_come_from_a_file() {
    let rules = RULES.replace("30.0 ", "41.5 ").replace("on_entry = \"none\"", "on_entry = \"right\"");
    let decider = with_rules(&rules).unwrap().turn_signal.unwrap();
    let parameters = &decider.flow.decider.parameters;
    assert!((parameters.intersection_search_distance_m - 41.5).abs() < 1e-9);
    assert_eq!(parameters.roundabout_on_entry, Some(Side::Right));
    assert_eq!(decider.country.unwrap().code, "JP");
}

#[test]
fn rules_of_a_country_are_refused_where_they_break() {
    for (part, other, told) in [
        ("\"JP\"", "\" \"", "rules.toml:3:8: code: expected a readable text; write it"),
        ("traffic = \"left\"", "traffic = \"Left\"", "rules.toml:5:11: traffic: unknown value \"Left\""),
        (
            "turn_distance_m = 30.0",
            "turn_distance_m = nan",
            "rules.toml:6:19: turn_distance_m: nan m is out of",
        ),
        (
            "lane_change_time_s = 3.0",
            "lane_change_time_s = -1",
            "lane_change_time_s: -1 s is out of range; give 0 to 60 s",
        ),
        ("on_exit = \"left\"", "on_exit = 1", "rules.toml:12:11: roundabout.on_exit: "),
        ("on_exit", "on_exits", "roundabout.on_exits: unknown key \"on_exits\""),
        ("source", "sources", "sources: unknown key \"sources\""),
        ("code = ", "# ", "a key is missing: code; see config/countries/JP.toml"),
        ("[roundabout]", "[roundabout", "rules.toml:10:"),
    ] {
        let problems = with_rules(&RULES.replacen(part, other, 1)).unwrap_err();
        let text = problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
        assert!(text.contains(told), "{other}: {text}");
    }
}

/// Every name and alias is accepted, and the value is what was given.
#[test]
fn every_parameter_is_set_by_each_of_its_names() {
    for parameter in PARAMETERS {
        for name in std::iter::once(parameter.name).chain(parameter.aliases.iter().copied()) {
            let default = parameter.value(&Parameters::DEPLOYED);
            let other = match default.as_str() {
                "true" => "false".to_owned(),
                "false" => "true".to_owned(),
                "None" => "\"Right\"".to_owned(),
                "Left" | "LEFT" => {
                    "\"RIGHT\"".replace("RIGHT", if default == "Left" { "Right" } else { "RIGHT" })
                }
                "RIGHT" => "\"LEFT\"".to_owned(),
                "left_side" => "\"right_side\"".to_owned(),
                "none" => "\"all_candidate\"".to_owned(),
                _ => "4".to_owned(),
            };
            let mut texts = sound();
            let text = format!("[turn_signal]\nmap = \"map.osm\"\nparameters.{name} = {other}\n[ros]\n");
            let gateway = texts.text("gateway.toml").replace(ROS, &text);
            texts.insert("gateway.toml", gateway);
            let settings = load_texts(&texts).unwrap_or_else(|problems| panic!("{name}: {problems:?}"));
            let set = settings.turn_signal.unwrap().flow.decider.parameters;
            assert_eq!(parameter.value(&set), other.trim_matches('"'), "{name}");
        }
    }
}
