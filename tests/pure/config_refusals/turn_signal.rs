//! What is accepted in `[turn_signal]`.

use turn_signal::parameters::DeciderParameters;
use turn_signal::parameters::table::PARAMETERS;
use turn_signal::side::Side;

use crate::pure::config_refusals::with;
use crate::support::files::MemoryFiles;

/// A configuration with the section and this key in it.
fn with_key(key: &str) -> MemoryFiles {
    with("gateway.toml", &format!("[turn_signal]\nmap = \"map.osm\"\n{key}\n"))
}

#[test]
fn rules_of_a_country_come_from_a_file() {
    let rules = include_str!("../../../config/countries/JP.toml");
    let rules = rules.replace("30.0 ", "41.5 ").replace("on_entry = \"none\"", "on_entry = \"right\"");
    let files = with_key("country = \"rules.toml\"").with("rules.toml", rules);
    let decider = files.settings().turn_signal.unwrap();
    let parameters = &decider.flow.decider.parameters;
    assert!((parameters.intersection_search_distance_m - 41.5).abs() < 1e-9);
    assert_eq!(parameters.roundabout_on_entry, Some(Side::Right));
    assert_eq!(decider.flow.decider.country.unwrap().code, "JP");
}

/// Every name and alias is accepted, and the value is what was given.
#[test]
fn every_parameter_is_set_by_each_of_its_names() {
    for parameter in PARAMETERS {
        for name in std::iter::once(parameter.name).chain(parameter.aliases.iter().copied()) {
            let default = parameter.value(&DeciderParameters::DEPLOYED);
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
            let settings = with_key(&format!("parameters.{name} = {other}")).settings();
            let set = settings.turn_signal.unwrap().flow.decider.parameters;
            assert_eq!(parameter.value(&set), other.trim_matches('"'), "{name}");
        }
    }
}
