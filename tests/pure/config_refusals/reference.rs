//! `config/gateway.toml` explains every key, so every key it shows must be accepted.

use std::collections::BTreeSet;
use std::path::Path;

use signal_gateway::config::Settings;

use crate::pure::config_refusals::{load_texts, sound};
use crate::support::files::MemoryFiles;

fn reference() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("config/gateway.toml")).unwrap()
}

/// The gateway's keys and the profile's, in front of and behind the long rule.
fn halves() -> (String, String) {
    let reference = reference();
    let (gateway, profile) = reference.split_once("\n# -----").unwrap();
    (gateway.to_owned(), profile.to_owned())
}

/// A line that shows a key or a section is taken out of its comment; prose is left out.
fn shown(line: &str) -> Option<String> {
    let bare = line.strip_prefix("# ").unwrap_or(line).split(" #").next()?.trim_end();
    let is_key = |text: &str| {
        !text.is_empty()
            && text.chars().all(|char| char.is_ascii_lowercase() || char.is_ascii_digit() || char == '_')
    };
    let is_setting = bare.split_once(" = ").is_some_and(|(key, _)| is_key(key));
    let is_section = bare.starts_with('[') && bare.ends_with(']');
    (is_setting || is_section).then(|| bare.to_owned())
}

/// Sections with their lines; lines in front of the first section come under "".
fn sections(text: &str) -> Vec<(String, Vec<String>)> {
    let mut sections = vec![(String::new(), Vec::new())];
    for line in text.lines().filter_map(shown) {
        if line.starts_with('[') {
            sections.push((line, Vec::new()));
        } else {
            sections.last_mut().unwrap().1.push(line);
        }
    }
    sections
}

fn section(sections: &[(String, Vec<String>)], name: &str) -> Vec<String> {
    let found = sections.iter().filter(|(known, _)| known == name).flat_map(|(_, lines)| lines.clone());
    let lines: Vec<_> = found.collect();
    assert!(!lines.is_empty(), "{name} is not shown");
    lines
}

const DBC: &str = "\
BO_ 2147483904 BLINKERS: 8 X
 SG_ TURN : 0|4@1+ (1,0) [0|15] \"\" X
 SG_ HAZARD : 4|3@1+ (1,0) [0|7] \"\" X
 SG_ CHECKSUM : 56|4@1+ (1,0) [0|15] \"\" X
 SG_ COUNTER : 60|2@1+ (1,0) [0|3] \"\" X
BO_ 257 LAMPS: 4 X
 SG_ LEFT : 0|1@1+ (1,0) [0|1] \"\" X
 SG_ RIGHT : 1|1@1+ (1,0) [0|1] \"\" X
 SG_ BULB_FAULT : 2|1@1+ (1,0) [0|1] \"\" X
 SG_ BANK : 3|1@1+ (1,0) [0|1] \"\" X
BO_ 258 ENGINE_DATA: 4 X
BO_ 260 TURN_CMD: 4 X
 SG_ ENABLE : 0|1@1+ (1,0) [0|1] \"\" X
 SG_ DOOR : 1|1@1+ (1,0) [0|1] \"\" X
 SG_ TURN_REQUEST : 2|3@1+ (1,0) [0|7] \"\" X
 SG_ HAZARD_REQUEST : 5|2@1+ (1,0) [0|3] \"\" X
 SG_ CMD_COUNTER : 8|4@1+ (1,0) [0|15] \"\" X
 SG_ CMD_CHECKSUM : 16|8@1+ (1,0) [0|255] \"\" X
BO_ 261 KIT_STATE: 1 X
 SG_ MODE : 0|1@1+ (1,0) [0|1] \"\" X
 SG_ OVERRIDE : 1|1@1+ (1,0) [0|1] \"\" X
BO_ 259 V2X: 8 X
 SG_ STATE : 0|4@1+ (1,0) [0|15] \"\" X
 SG_ USABLE : 4|1@1+ (1,0) [0|1] \"\" X
 SG_ INTERSECTION : 8|16@1+ (1,0) [0|65535] \"\" X
 SG_ SIGNAL_GROUP : 24|8@1+ (1,0) [0|255] \"\" X
 SG_ CONFIDENCE : 32|7@1+ (1,0) [0|127] \"\" X
";

/// A configuration with a profile whose bus is `body`.
const GATEWAY: &str = "profile = \"vehicles/hyundai_kia.toml\"\ncan.body.interface = \"can0\"\n";

const VEHICLE_INFO: &str = "/**:\n  ros__parameters:\n    wheel_radius: 0.383\n    wheel_width: 0.235\n    wheel_base: 2.79\n    \
     wheel_tread: 1.64\n    front_overhang: 1.0\n    rear_overhang: 1.1\n    left_overhang: 0.128\n    right_overhang: 0.128\n    \
     vehicle_height: 2.5\n    max_steer_angle: 0.70\n";

const SCENARIO: &str = "init = [{ set = \"11\", state = \"red\" }]\n";

fn texts(gateway: String, profile: String) -> MemoryFiles {
    let files = [
        ("gateway.toml", gateway),
        ("vehicles/hyundai_kia.toml", profile),
        ("vehicles/../../dbc/my_car.dbc", DBC.to_owned()),
        ("vehicle_info.param.yaml", VEHICLE_INFO.to_owned()),
        ("lanelet2_map.osm", sound().text("map.osm").to_owned()),
        ("scenarios/bench.toml", SCENARIO.to_owned()),
    ];
    MemoryFiles::new(files)
}

const PROFILE: &str = "\
name = \"x\"
bus.powertrain.dbc = \"../../dbc/my_car.dbc\"
turn.fitted = false
hazard.from = \"not_fitted\"
[[command.message]]
name = \"TURN_CMD\"
period_ms = 100
turn = { off = { TURN_REQUEST = 0 }, left = { TURN_REQUEST = 1 }, right = { TURN_REQUEST = 2 }, none = { TURN_REQUEST = 7 } }
hazard = { off = { HAZARD_REQUEST = 0 }, on = { HAZARD_REQUEST = 1 }, none = { HAZARD_REQUEST = 3 } }
constants = { ENABLE = 0, DOOR = 0, CMD_COUNTER = 0, CMD_CHECKSUM = 0 }
";

fn assert_accepted(what: &str, texts: &MemoryFiles) {
    if let Err(problems) = load_texts(texts) {
        let problems: Vec<_> = problems.iter().map(ToString::to_string).collect();
        panic!("{what}:\n{}", problems.join("\n"));
    }
}

/// The lines that are shown, without the keys that stand for another one or name what the profile does not
/// have.
fn uncommented(gateway: &str) -> String {
    let stands_apart =
        |line: &String| ["steering_table", "vgr_coef", "gear_source"].iter().any(|key| line.starts_with(key));
    gateway.lines().filter_map(shown).filter(|line| !stands_apart(line)).map(|line| line + "\n").collect()
}

#[test]
fn the_gateway_file_with_everything_uncommented_is_accepted() {
    let (gateway, _) = halves();
    let all = uncommented(&gateway);
    for key in ["speed", "rate_hz", "durability", "only_networks", "receive_buffer_bytes", "domain_id"] {
        assert!(all.contains(&format!("\n{key} = ")), "{key} is shown");
    }
    assert_accepted(&all, &texts(all.clone(), PROFILE.to_owned()));
}

#[test]
fn what_the_gateway_file_shows_are_the_defaults() {
    let (gateway, _) = halves();
    let all = uncommented(&gateway);
    let plain = "profile = \"vehicles/hyundai_kia.toml\"\n[can.powertrain]\ninterface = \"can0\"\n\
                 [recording]\nfile = \"drive.log.gz\"\n\
                 [traffic_lights]\nscenario = \"scenarios/bench.toml\"\nmap = \"lanelet2_map.osm\"\n\
                 [traffic_lights.arbiter]\n[command]\n[turn_signal]\nmap = \"lanelet2_map.osm\"\n";
    let shown = load_texts(&texts(all, PROFILE.to_owned())).unwrap();
    let mut default = load_texts(&texts(plain.to_owned(), PROFILE.to_owned())).unwrap();
    // The car's own dimensions have no defaults.
    default.gateway.status_settings.geometry.clone_from(&shown.gateway.status_settings.geometry);
    // Shown as examples: without them the environment, all networks and systemd's folder count.
    default.ros.domain_id = shown.ros.domain_id;
    default.ros.only_networks.clone_from(&shown.ros.only_networks);
    let (there, here) = (&shown.light_topics, &mut default.light_topics);
    here.inputs.clone_from(&there.inputs);
    here.camera.clone_from(&there.camera);
    here.command.clone_from(&there.command);
    let flow = |settings: &Settings| settings.gateway.traffic_lights.clone().unwrap();
    let lights = default.gateway.traffic_lights.as_mut().unwrap();
    lights.lights.v2i_timeout = flow(&shown).lights.v2i_timeout;
    lights.camera_faults = flow(&shown).camera_faults;
    lights.external_camera = there.camera.is_some();
    default.black_box.folder.clone_from(&shown.black_box.folder);
    default.status.socket.clone_from(&shown.status.socket);
    default.http.clone_from(&shown.http);
    default.parameters.clone_from(&shown.parameters);
    default.in_effect.clone_from(&shown.in_effect);
    default.mcap.folder.clone_from(&shown.mcap.folder);
    let (there, here) = (shown.turn_signal.as_ref().unwrap(), default.turn_signal.as_mut().unwrap());
    here.flow.decider.country.clone_from(&there.flow.decider.country);
    assert_eq!(format!("{shown:?}"), format!("{default:?}"));
}

#[test]
fn every_key_of_a_profile_is_accepted_in_each_of_its_forms() {
    let (_, profile) = halves();
    let sections = sections(&profile);
    let turn = section(&sections, "[turn]");
    let of = |keys: &[&str]| -> String {
        let has_key = |line: &&String| keys.contains(&line.split(" = ").next().unwrap());
        turn.iter().filter(has_key).map(|line| line.clone() + "\n").collect()
    };
    let enumerated = of(&["signal", "off", "left", "right", "both", "not_available", "fault"]);
    let pair = of(&["left_signal", "right_signal", "both_on"]);
    let tap = of(&["tap_hold_ms"]);
    let lever = pair.clone() + &tap;
    let both = pair.replace("both_on = \"undefined\"", "both_on = \"hazard\"");
    let lamps = both.clone() + &of(&["lamp"]) + "kind = \"lamp\"\n";
    let stalk_keys = of(&["idle", "left_half", "left_full", "right_half", "right_full", "stalk"]);
    let stalk = of(&["signal", "not_available", "fault"]) + &stalk_keys + "kind = \"stalk\"\n";
    let disagreement = of(&["disagreement_ms"]);
    let name = section(&sections, "[[turn.source]]").join("\n");
    let several = format!(
        "{disagreement}[[turn.source]]\n{name}\n{lamps}[[turn.source]]\nname = \"state\"\n{enumerated}"
    );
    let rest = of(&["while_hazard", "on_fault"]);
    let shown = [&enumerated, &pair, &tap, &of(&["lamp"]), &stalk_keys, &disagreement, &rest];
    let shown: usize = shown.iter().map(|keys| keys.lines().count()).sum();
    assert_eq!(turn.len(), shown + 3, "and `fitted`, `kind` twice");
    let faults = section(&sections, "[[turn.fault_signal]]").join("\n");
    let all = section(&sections, "[hazard]");
    let hazard_of = |without: &[&str]| -> String {
        let is_kept = |line: &&String| !without.contains(&line.split(" = ").next().unwrap());
        all.iter().filter(is_kept).map(|line| line.clone() + "\n").collect()
    };
    let button_keys = ["max_gap_ms", "startup_delay_ms"];
    let hazard = hazard_of(&[&button_keys[..], &["disagreement_ms"]].concat());
    let button = hazard_of(&["on_fault", "disagreement_ms"]).replace("\"signal\"", "\"button\"");
    let hazard_name = section(&sections, "[[hazard.source]]").join("\n");
    let hazard_sources = format!(
        "disagreement_ms = 1000\n[[hazard.source]]\n{hazard_name}\n{button}[[hazard.source]]\n\
         name = \"signal\"\n{}",
        hazard.replace("on_fault = \"report\"\n", "")
    );
    let reasons = section(&sections, "[hazard.reasons]").join("\n");
    let reason = hazard.replace("from = \"signal\"", "from = \"reason\"").replace("\non = [1]", "\n");
    let hazards = [
        hazard.clone(),
        format!("{reason}\n[hazard.reasons]\n{reasons}"),
        button,
        hazard_sources,
        "from = \"both_sides\"".to_owned(),
        "from = \"not_fitted\"".to_owned(),
        "from = \"not_visible\"".to_owned(),
    ];
    let mut bus = section(&sections, "[bus.body]");
    // A DBC has no clusters; pure::arxml gives the key.
    bus.retain(|line| !line.starts_with("cluster"));
    let bus = bus.join("\n");
    let message = section(&sections, "[message.BLINKERS]").join("\n");
    let mut profiles = BTreeSet::new();
    for turn in [&enumerated, &pair, &lever, &both, &lamps, &stalk, &several, &of(&["fitted"])] {
        for hazard in &hazards {
            let shows_both = [&enumerated, &both, &lamps, &several].contains(&turn);
            let uses_blinkers = turn.contains("BLINKERS") || hazard.contains("BLINKERS");
            if hazard.contains("both_sides") && !shows_both {
                continue;
            }
            let blinkers =
                if uses_blinkers { format!("[message.BLINKERS]\n{message}") } else { String::new() };
            let profile = format!(
                "name = \"x\"\n[bus.body]\n{bus}\n[message.LAMPS]\ntimeout_ms = 100\n{blinkers}\n\
                 [turn]\n{rest}{turn}\n[[turn.fault_signal]]\n{faults}\n[hazard]\n{hazard}\n"
            );
            assert_accepted(&profile, &texts(GATEWAY.to_owned(), profile.clone()));
            profiles.insert(profile);
        }
    }
    assert_eq!(profiles.len(), 52);
}

#[test]
fn every_key_of_a_v2x_unit_is_accepted_in_each_of_its_forms() {
    let (_, profile) = halves();
    let sections = sections(&profile);
    let all = section(&sections, "[[v2i]]");
    let of = |keys: &[&str]| -> String {
        let has_key = |line: &&String| keys.contains(&line.split(" = ").next().unwrap());
        let lines: Vec<_> = all.iter().filter(has_key).map(|line| line.clone() + "\n").collect();
        assert_eq!(lines.len(), keys.len(), "{keys:?} are shown");
        lines.concat()
    };
    let one = of(&["id"]);
    let many = of(&["intersection", "group", "groups", "group_timeout_ms"]);
    let both = of(&["signal", "confidence"]);
    let texts_of = of(&["states", "not_available", "fault"]);
    let numbers = "states = \"movement_phase_state\"\n".to_owned();
    let arrow = numbers.clone() + &of(&["arrow"]);
    assert_eq!(all.len(), 11);
    let status = section(&sections, "[[v2i.status]]").join("\n");
    for (form, states) in
        [(&one, &texts_of), (&one, &numbers), (&one, &arrow), (&many, &texts_of), (&many, &numbers)]
    {
        let profile = format!(
            "name = \"x\"\nbus.body.dbc = \"../../dbc/my_car.dbc\"\nmessage.V2X.timeout_ms = 500\n\
             [[v2i]]\n{both}{form}{states}[[v2i.status]]\n{status}\n"
        );
        assert_accepted(&profile, &texts(GATEWAY.to_owned(), profile.clone()));
    }
}

#[test]
fn every_key_of_commands_is_accepted_in_each_of_its_forms() {
    let (_, profile) = halves();
    let sections = sections(&profile);
    let of = |name: &str, without: &[&str]| -> String {
        let lines = section(&sections, name);
        let is_kept = |line: &&String| !without.contains(&line.split(" = ").next().unwrap());
        lines.iter().filter(is_kept).map(|line| line.clone() + "\n").collect()
    };
    let message = of("[[command.message]]", &[]);
    let enabled = of("[[command.message]]", &["idle"]).replace("DOOR = 0", "DOOR = 0, HAZARD_REQUEST = 0");
    let bare = of("[[command.message]]", &["enable"]).replace("DOOR = 0", "DOOR = 0, ENABLE = 0");
    let turn = of("[command.message.turn]", &["hazard"]);
    let combined = of("[command.message.turn]", &["none"]);
    let level = of("[command.message.hazard]", &["button"]);
    let button = of("[command.message.hazard]", &[]);
    let driver = of("[[command.driver]]", &[]);
    let gateway = format!("{GATEWAY}[command]\ncontrol_mode = \"signal\"\n");
    let forms = [
        format!("{message}[command.message.turn]\n{turn}[command.message.hazard]\n{level}"),
        format!("{message}[command.message.turn]\n{turn}[command.message.hazard]\n{button}"),
        format!("{bare}[command.message.turn]\n{turn}[command.message.hazard]\n{level}"),
        format!("{enabled}[command.message.turn]\n{combined}"),
    ];
    for form in forms {
        let profile = format!(
            "name = \"x\"\nbus.body.dbc = \"../../dbc/my_car.dbc\"\nmessage.KIT_STATE.timeout_ms = 500\n\
             message.BLINKERS.timeout_ms = 500\nturn.fitted = false\n\
             hazard = {{ from = \"signal\", signal = \"BLINKERS.HAZARD\", on = [1], off = [0] }}\n\
             control_mode = {{ signal = \"KIT_STATE.MODE\", autonomous = [1], manual = [0] }}\n[[command.driver]]\n{driver}[[command.message]]\n{form}"
        );
        assert_accepted(&profile, &texts(gateway.clone(), profile.clone()));
    }
}

#[test]
fn every_key_of_a_provenance_is_accepted() {
    let (_, profile) = halves();
    let sections = sections(&profile);
    let about = section(&sections, "").join("\n");
    let provenance = section(&sections, "[[provenance]]").join("\n");
    let profile = format!(
        "{about}\nbus.body.dbc = \"../../dbc/my_car.dbc\"\nmessage.BLINKERS.timeout_ms = 500\n\
         turn = {{ signal = \"BLINKERS.TURN\", off = [0], left = [1], right = [2] }}\nhazard.from = \"not_visible\"\n\
         [[provenance]]\n{provenance}\n"
    );
    let settings =
        load_texts(&texts(GATEWAY.to_owned(), profile)).unwrap_or_else(|problems| panic!("{problems:?}"));
    let provenance = settings.provenance;
    assert_eq!((provenance.makes.len(), provenance.models.as_str()), (2, "Golf 7 and later"));
    let facts: Vec<_> =
        provenance.facts.iter().map(|fact| (fact.name.as_str(), fact.records.len())).collect();
    let expected =
        [("turn.off", 1), ("turn.left", 0), ("turn.right", 0), ("hazard", 0), ("message.BLINKERS.timing", 1)];
    assert_eq!(facts, expected);
    assert_eq!(
        provenance.records[0].source.to_string(),
        "dbc my_car.dbc of owner/name at 0123abc 1.0: by hand"
    );
}
