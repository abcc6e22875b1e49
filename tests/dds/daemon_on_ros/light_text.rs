//! Messages with traffic lights as short text, as tests expect them.

use serde_json::Value;

const COLORS: [&str; 5] = ["unknown", "red", "amber", "green", "white"];
#[rustfmt::skip]
const SHAPES: [&str; 11] = [
    "unknown", "circle", "left", "right", "up", "upLeft", "upRight", "down", "downLeft", "downRight", "cross",
];
const STATUSES: [&str; 4] = ["unknown", "off", "on", "flashing"];

/// `34806: green on circle, red on circle 0.5; 120666: …` in the order of the message; an id alone is one
/// without elements. Confidences of 1 are left out.
pub(crate) fn of(data: &Value) -> String {
    let (list, id, elements) = if data["traffic_lights"].is_array() {
        ("traffic_lights", "lanelet_way_id", "traffic_light_bulbs")
    } else if data["signals"].is_array() {
        ("signals", "traffic_signal_id", "elements")
    } else {
        ("traffic_light_groups", "traffic_light_group_id", "elements")
    };
    let items = data[list].as_array().unwrap_or_else(|| panic!("no lights: {data}")).iter();
    let items = items.map(|item| {
        let elements = item[elements].as_array().unwrap();
        let colon = if elements.is_empty() { "" } else { ": " };
        format!("{}{colon}{}", item[id], list_of(elements))
    });
    items.collect::<Vec<_>>().join("; ")
}

/// `green on circle, red on circle 0.5`
pub(crate) fn list_of(elements: &[Value]) -> String {
    elements.iter().map(element).collect::<Vec<_>>().join(", ")
}

fn element(element: &Value) -> String {
    let name = |key: &str, names: &[&'static str]| {
        let number = usize::try_from(element[key].as_u64().unwrap()).unwrap();
        *names.get(number).unwrap_or_else(|| panic!("no {key}: {element}"))
    };
    let (color, status, shape) = (name("color", &COLORS), name("status", &STATUSES), name("shape", &SHAPES));
    let confidence = element["confidence"].as_f64().unwrap();
    let confidence = if confidence < 1.0 { format!(" {confidence:.2}") } else { String::new() };
    format!("{color} {status} {shape}{confidence}")
}

/// A stamp in nanoseconds; that of the message when `data` is one.
pub(crate) fn nanos(data: &Value) -> i64 {
    let stamp = if data["stamp"].is_object() { &data["stamp"] } else { data };
    stamp["sec"].as_i64().unwrap() * 1_000_000_000 + stamp["nanosec"].as_i64().unwrap()
}
