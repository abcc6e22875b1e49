//! What is refused in `[turn_signal]`.

use signal_gateway::config::Problem;
use signal_gateway::config::Settings;
use signal_gateway::core::turn_signal::parameters::{PARAMETERS, Parameters};
use signal_gateway::core::turn_signal::side::Side;

use crate::pure::config_refusals::{HERE, assert_refused, load_texts, with};

/// The section, with further keys behind it.
const DECIDER: &str = "[turn_signal]\nmap = \"map.osm\"\n# here\n";

#[test]
fn broken_sections_are_refused_where_they_break() {
    let cases = r#"
- map = "map.osm"
+ enabled = true
> gateway.toml:8:1: turn_signal: the turn signal decider has no map; name the lanelet2 map, relative to this file, with [turn_signal] map = "….osm"
- map = "map.osm"
+ map = "away.osm"
> gateway.toml:9:7: turn_signal.map: away.osm: there is no such file; name the lanelet2 map, relative to this file, with [turn_signal] map = "….osm"
- map = "map.osm"
+ map = "empty.osm"
> gateway.toml:9:7: turn_signal.map: empty.osm: it has no lanelet; name the lanelet2 map, relative to this file, with [turn_signal] map = "….osm"
- map = "map.osm"
+ map = "torn.osm"
> torn.osm:1:1: the file ends before </osm>: it is cut short
+ maps = "map.osm"
> gateway.toml:10:1: turn_signal.maps: unknown key "maps"; valid keys: compat, map, country, parameters, minimum_on_ms, minimum_gap_ms, standing_limit_ms, age_limits, vehicle, planning_hz, shadow_tolerance_ms, enabled, shadow, inputs, outputs
+ enabled = true
+ shadow = true
> gateway.toml:11:10: turn_signal.shadow: a shadow publishes nothing; set enabled = false, or shadow = false
+ compat = "both"
> gateway.toml:10:10: turn_signal.compat: unknown value "both"; give one of improved, upstream, path_generator
+ country = "FR"
> gateway.toml:10:11: turn_signal.country: there are no rules for "FR"; give AT, CH, DE, GB, JP, KR, US-CA, the path of a file like config/countries/JP.toml, or leave it out
+ country = "away.toml"
> gateway.toml:10:11: turn_signal.country: away.toml: there is no such file; give the path of a country's rules, relative to this file, or AT, CH, DE, GB, JP, KR, US-CA
+ planning_hz = 0.5
> gateway.toml:10:15: turn_signal.planning_hz: 0.5 Hz is out of range; give 1 to 100 Hz
+ planning_hz = nan
> gateway.toml:10:15: turn_signal.planning_hz: nan Hz is out of range; give 1 to 100 Hz
+ minimum_on_ms = 60001
> gateway.toml:10:17: turn_signal.minimum_on_ms: 60001 ms is out of range; give 0 to 60000 ms
+ shadow_tolerance_ms = 99999
> gateway.toml:10:23: turn_signal.shadow_tolerance_ms: 99999 ms is out of range; give 0 to 60000 ms
"#;
    assert_refused(&with("gateway.toml", HERE, DECIDER), "gateway.toml", cases);
}

#[test]
fn limits_dimensions_parameters_and_topics_that_do_not_fit_are_refused() {
    let cases = r#"
+ age_limits.odometry_ms = 0
> gateway.toml:10:26: turn_signal.age_limits.odometry_ms: 0 ms is out of range; give 10 to 60000 ms
+ vehicle.wheel_base_m = -1.0
> gateway.toml:10:24: turn_signal.vehicle.wheel_base_m: -1.0 m is out of range; give 0 to 50 m
+ parameters.turn_signal_serch_time = 3.0
> gateway.toml:10:12: turn_signal.parameters.turn_signal_serch_time: `turn_signal_serch_time` is not a parameter of the turn signal decider; see config/gateway.toml
+ parameters.turn_signal_search_time = -3.0
> gateway.toml:10:38: turn_signal.parameters.turn_signal_search_time: invalid value -3.0; give seconds, 0 to 3600
+ parameters.turn_signal_on_swerving = "maybe"
> gateway.toml:10:38: turn_signal.parameters.turn_signal_on_swerving: invalid value maybe; give true or false
+ parameters.turn_signal_intersection_angle_threshold_deg = 9
+ parameters.turn_signal_intersection_angle_threshold_degree = 9
> gateway.toml:11:12: turn_signal.parameters.turn_signal_intersection_angle_threshold_degree: turn_signal_intersection_angle_threshold_degree is given twice; keep one of its names
+ inputs.odometry = ""
> gateway.toml:10:19: turn_signal.inputs.odometry: "" is not a topic; write it as /a/b, a/b or ~/a
+ inputs.scenario = "scen-ario"
> gateway.toml:10:19: turn_signal.inputs.scenario: "scen-ario" is not a topic; write it as /a/b, a/b or ~/a
+ outputs.markers = "/localization/kinematic_state"
> gateway.toml:10:19: turn_signal.outputs.markers: another topic has this name; give each its own
+ outputs.planning_factors = "/planning/planning_factors/goal_planner"
> gateway.toml:10:28: turn_signal.outputs.planning_factors: another topic has this name; give each its own
+ outputs.turn_command = "/planning/hazard_lights_cmd"
> gateway.toml:10:24: turn_signal.outputs.turn_command: another topic has this name; give each its own
+ enabled = true
+ inputs.hazard_request = "/planning/hazard_lights_cmd"
> gateway.toml:11:25: turn_signal.inputs.hazard_request: another topic has this name; give each its own
+ inputs.odometry = "/planning/mission_planning/route"
> gateway.toml:10:19: turn_signal.inputs.odometry: another topic has this name; give each its own
+ shadow = true
+ inputs.own_turn_command = "/localization/kinematic_state"
> gateway.toml:11:27: turn_signal.inputs.own_turn_command: another topic has this name; give each its own
"#;
    assert_refused(&with("gateway.toml", HERE, DECIDER), "gateway.toml", cases);
}

const RULES: &str = include_str!("../../../config/countries/JP.toml");

/// A configuration with these rules of a country.
fn with_rules(rules: &str) -> Result<Settings, Vec<Problem>> {
    let keys = DECIDER.replace(HERE, "country = \"rules.toml\"\n");
    load_texts(&with("gateway.toml", HERE, &keys).with("rules.toml", rules))
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
    for (part, other, expected) in [
        ("\"JP\"", "\" \"", "rules.toml:3:8: code: expected a readable text; write it"),
        ("traffic = \"left\"", "traffic = \"Left\"", "rules.toml:5:11: traffic: unknown value \"Left\""),
        (
            "turn_distance_m = 30.0",
            "turn_distance_m = nan",
            "rules.toml:6:19: turn_distance_m: nan m is out of",
        ),
        ("search_time_s = 3.0", "search_time_s = -1", "search_time_s: -1 s is out of range; give 0 to 60 s"),
        ("on_exit = \"left\"", "on_exit = 1", "rules.toml:12:11: roundabout.on_exit: "),
        ("on_exit", "on_exits", "roundabout.on_exits: unknown key \"on_exits\""),
        ("source", "sources", "sources: unknown key \"sources\""),
        ("code = ", "# ", "missing key: code; see config/countries/JP.toml"),
        ("[roundabout]", "[roundabout", "rules.toml:10:"),
    ] {
        let problems = with_rules(&RULES.replacen(part, other, 1)).unwrap_err();
        let text = problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
        assert!(text.contains(expected), "{other}: {text}");
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
            let keys = DECIDER.replace(HERE, &format!("parameters.{name} = {other}\n"));
            let settings = with("gateway.toml", HERE, &keys).settings();
            let set = settings.turn_signal.unwrap().flow.decider.parameters;
            assert_eq!(parameter.value(&set), other.trim_matches('"'), "{name}");
        }
    }
}
