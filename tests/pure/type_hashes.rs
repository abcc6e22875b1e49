//! The hashes of message types, computed anew from the definitions as REP-2016 has it: SHA-256 of a JSON text with the fields of
//! the type and of all types in it.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};
use signal_gateway::io::ros::topics::{SubscriptionKind, TypeName};
use signal_gateway::io::ros::type_hashes::{SERVICE_HASHES, TYPE_HASHES, type_hash};

/// Those of what is recorded, and of what is only read.
const DEFINITIONS: [&str; 2] =
    [include_str!("../../src/io/mcap/definitions.msg"), include_str!("type_hashes/definitions.msg")];

/// Services: request and response.
const SERVICES: &str = include_str!("type_hashes/services.srv");

/// Numbers of types in a description (`type_description_interfaces/msg/FieldType`).
const PRIMITIVES: [(&str, u32); 15] = [
    ("int8", 2),
    ("uint8", 3),
    ("int16", 4),
    ("uint16", 5),
    ("int32", 6),
    ("uint32", 7),
    ("int64", 8),
    ("uint64", 9),
    ("float32", 10),
    ("float64", 11),
    ("char", 3),
    ("bool", 15),
    ("byte", 16),
    ("string", 17),
    ("wstring", 18),
];
const NESTED: u32 = 1;
const ARRAY: u32 = 48;
const BOUNDED_SEQUENCE: u32 = 96;
const SEQUENCE: u32 = 144;

type Definitions = BTreeMap<String, Vec<Value>>;

/// The fields of each type.
fn definitions() -> Definitions {
    let texts = DEFINITIONS.iter().flat_map(|text| text.split("MSG: ").skip(1));
    let definition = |text: &str| {
        let (name, fields) = text.split_once('\n').unwrap();
        (name.to_owned(), fields.lines().filter_map(field).collect())
    };
    let mut definitions: Definitions = texts.map(definition).collect();
    for (name, text) in SERVICES.split("SRV: ").skip(1).map(|text| text.split_once('\n').unwrap()) {
        let (request, response) = text.split_once("---\n").unwrap();
        // Each service has these messages.
        let name = name.replace('/', "/srv/");
        let event = format!(
            "service_msgs/ServiceEventInfo info\n{name}_Request[<=1] request\n{name}_Response[<=1] response"
        );
        let service = format!(
            "{name}_Request request_message\n{name}_Response response_message\n{name}_Event event_message"
        );
        for (suffix, fields) in
            [("_Request", request), ("_Response", response), ("_Event", &event), ("", &service)]
        {
            definitions.insert(format!("{name}{suffix}"), fields.lines().filter_map(field).collect());
        }
    }
    definitions
}

/// A field; `None` for constants and empty lines.
fn field(line: &str) -> Option<Value> {
    let (type_name, name) = line.split_once(' ').filter(|(_, name)| !name.contains('='))?;
    let (base, size) = type_name.split_once('[').unwrap_or((type_name, ""));
    let (offset, capacity) = match size.strip_suffix(']') {
        None => (0, 0),
        Some("") => (SEQUENCE, 0),
        Some(bound) => match bound.strip_prefix("<=") {
            Some(bound) => (BOUNDED_SEQUENCE, bound.parse::<u32>().unwrap()),
            None => (ARRAY, bound.parse().unwrap()),
        },
    };
    let primitive = PRIMITIVES.iter().find(|(known, _)| *known == base).map(|(_, number)| *number);
    let nested = if primitive.is_some() { String::new() } else { full_name(base) };
    let id = primitive.unwrap_or(NESTED) + offset;
    let kind = json!({"type_id": id, "capacity": capacity, "string_capacity": 0, "nested_type_name": nested});
    Some(json!({"name": name, "type": kind}))
}

/// `package/msg/Name` of `package/Name`; those of services are full already.
fn full_name(name: &str) -> String {
    if name.contains("/srv/") { name.to_owned() } else { name.replace('/', "/msg/") }
}

fn hash(definitions: &Definitions, name: &str) -> String {
    let mut used = BTreeSet::new();
    add_used(definitions, name, &mut used);
    let described =
        |name: &String| json!({"type_name": full_name(name), "fields": definitions[name.as_str()]});
    let description = json!({
        "type_description": described(&name.to_owned()),
        "referenced_type_descriptions": used.iter().map(described).collect::<Vec<_>>(),
    });
    let digest = Sha256::digest(spaced(&description.to_string()));
    digest.iter().fold("RIHS01_".to_owned(), |text, byte| text + &format!("{byte:02x}"))
}

fn add_used(definitions: &Definitions, name: &str, used: &mut BTreeSet<String>) {
    for field in &definitions[name] {
        let nested = field["type"]["nested_type_name"].as_str().unwrap().replace("/msg/", "/");
        if !nested.is_empty() && used.insert(nested.clone()) {
            add_used(definitions, &nested, used);
        }
    }
}

/// JSON with a blank after each comma and colon; no name has either.
fn spaced(json: &str) -> String {
    json.replace(',', ", ").replace(':', ": ")
}

#[test]
fn the_hashes_are_those_of_the_definitions() {
    let definitions = definitions();
    for ((package, name), known) in TYPE_HASHES {
        assert_eq!(hash(&definitions, &format!("{package}/{name}")), known, "{package}/{name}");
    }
    for (name, known) in SERVICE_HASHES {
        assert_eq!(hash(&definitions, &format!("rcl_interfaces/srv/{name}")), known, "{name}");
    }
    // As every ROS 2 since Iron has it, and as it stands in the design document of rmw_zenoh.
    let add = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a";
    assert_eq!(hash(&definitions, "example_interfaces/srv/AddTwoInts"), add);
    let time = "RIHS01_b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197";
    assert_eq!(hash(&definitions, "builtin_interfaces/Time"), time);
}

#[test]
fn everything_that_is_read_has_a_hash() {
    use signal_gateway::core::turn_signal::planner_input::FactorTopic;
    let kinds = [
        SubscriptionKind::Camera,
        SubscriptionKind::Clock,
        SubscriptionKind::Command,
        SubscriptionKind::Odometry,
        SubscriptionKind::Route,
        SubscriptionKind::PlannedPath,
        SubscriptionKind::Factors(FactorTopic::GoalPlanner),
        SubscriptionKind::ModifiedGoal,
        SubscriptionKind::OperationMode,
        SubscriptionKind::Scenario,
        SubscriptionKind::HazardRequest,
        SubscriptionKind::OwnTurnCommand,
        SubscriptionKind::ControlMode,
    ];
    let lacks = |(package, name): &TypeName| type_hash(package, name).is_none();
    assert_eq!(kinds.map(SubscriptionKind::type_name).into_iter().filter(lacks).collect::<Vec<_>>(), []);
}
