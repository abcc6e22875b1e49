//! The reports on the vehicle's status as `replay` prints and records them, read back by readers of other
//! makes.

use std::collections::BTreeSet;
use std::fs;

use serde_json::{Value, json};

use crate::support::mcap::McapReaders;
use crate::support::prerequisite::require;
use crate::support::program::run;
use crate::support::status_vehicle;

/// The value with its fractions as single precision, which text and recording write with different digits.
#[allow(clippy::cast_possible_truncation)] // that is its purpose
fn with_singles(value: &Value) -> Value {
    match value {
        Value::Number(number) if number.is_f64() => json!(number.as_f64().unwrap() as f32),
        Value::Array(elements) => elements.iter().map(with_singles).collect(),
        Value::Object(fields) => {
            fields.iter().map(|(name, value)| (name.clone(), with_singles(value))).collect()
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => value.clone(),
    }
}

#[test]
fn the_status_of_the_vehicle_is_recorded_and_replayed_as_autoware_reads_it() {
    let readers = require!(McapReaders::find());
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("bench.toml", status_vehicle::PROFILE),
        ("bench.dbc", status_vehicle::DBC),
        ("drive.log", &status_vehicle::drive()),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let replayed =
        run(folder.path(), &["replay", "drive.log", "--profile", "bench.toml", "--json", "--mcap", "bag"]);
    replayed.assert(0, "");
    let published = replayed.json();
    let messages = readers.messages(&folder.path().join("bag"));
    let of = |topic: &str| -> Vec<Value> {
        let of_topic = published.iter().filter(|line| line["topic"] == topic);
        let lines: Vec<Value> = of_topic.map(|line| with_singles(&line["data"])).collect();
        let recorded: Vec<_> = messages.iter().filter(|message| message["topic"] == topic).collect();
        assert!(recorded.iter().map(|message| with_singles(&message["fields"])).eq(lines.clone()), "{topic}");
        lines
    };
    let stamps = |messages: &[Value], path: &str| -> BTreeSet<(i64, i64)> {
        let stamp = |message: &Value| {
            let stamp = message.pointer(path).unwrap();
            (stamp["sec"].as_i64().unwrap() - 1_700_000_000, stamp["nanosec"].as_i64().unwrap())
        };
        messages.iter().map(stamp).collect()
    };
    let with_value = |messages: &[Value], key: &str, value: f32| {
        messages.iter().filter(|message| message[key] == json!(value)).count()
    };

    // Each of at most 50 Hz, none twice, and none in the second in which there is no value. Before and after
    // it the rhythm begins with the first frame, so that the second is not left out.
    let velocity = of("/vehicle/status/velocity_status");
    assert_eq!((velocity.len(), stamps(&velocity, "/header/stamp").len()), (251, 251));
    assert!(velocity.iter().all(|message| message["header"]["frame_id"] == "base_link"));
    assert!(stamps(&velocity, "/header/stamp").iter().all(|(second, _)| *second != 2));
    assert_eq!(with_value(&velocity, "lateral_velocity", 0.0), 251);
    for (speed, rate, count) in [(10.0, 5.0_f32, 100), (-2.0, -2.0, 101), (0.0, 0.0, 50)] {
        assert_eq!(with_value(&velocity, "longitudinal_velocity", speed), count, "{speed}");
        assert_eq!(with_value(&velocity, "heading_rate", rate.to_radians()), count, "{rate}");
    }
    let steering = of("/vehicle/status/steering_status");
    assert_eq!((steering.len(), stamps(&steering, "/stamp").len()), (251, 251));
    for (angle, count) in [(2.0_f32, 100), (-1.0, 101), (0.0, 50)] {
        assert_eq!(with_value(&steering, "steering_tire_angle", angle.to_radians()), count, "{angle}");
    }

    // Ten a second, each state from its first frame on.
    let changes = |topic: &str, key: &str| -> Vec<(i64, Value)> {
        let mut changes: Vec<(i64, Value)> = Vec::new();
        for message in of(topic) {
            if changes.last().is_none_or(|(_, last)| *last != message[key]) {
                changes
                    .push((message["stamp"]["sec"].as_i64().unwrap() - 1_700_000_000, message[key].clone()));
            }
        }
        changes
    };
    assert_eq!(
        changes("/vehicle/status/gear_status", "report"),
        vec![(0, json!(2)), (3, json!(20)), (5, json!(22))]
    );
    assert_eq!(changes("/vehicle/status/control_mode", "mode"), vec![(0, json!(1)), (3, json!(4))]);
    let doors = |left: u8, right: u8| json!([{"status": left}, {"status": right}]);
    assert_eq!(
        changes("/vehicle/doors/status", "doors"),
        vec![(0, doors(3, 3)), (2, doors(1, 3)), (3, doors(3, 3)), (5, doors(4, 2))]
    );
    assert_eq!(of("/vehicle/status/gear_status").len(), 52);
}
