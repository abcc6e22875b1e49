//! The demo, which shows every outcome that a report can have.

use std::collections::BTreeMap;
use std::process::Command;

use serde_json::Value;

use crate::pure::vehicles::project;
use crate::support::vehicle_facts::VEHICLES;

/// Reports come every 100 ms at least; a longer pause is a stop.
const PAUSE_S: f64 = 0.105;

/// Puts the value of a message into words.
type InWords = fn(&Value) -> String;

/// Topics of the reports, and their values in words.
const TOPICS: [(&str, InWords); 7] = [
    ("/vehicle/status/turn_indicators_status", |data| {
        named(data, "report", &[(1, "DISABLE"), (2, "ENABLE_LEFT"), (3, "ENABLE_RIGHT")])
    }),
    ("/vehicle/status/hazard_lights_status", |data| named(data, "report", &[(1, "DISABLE"), (2, "ENABLE")])),
    ("/vehicle/status/velocity_status", |data| {
        sign(data, "longitudinal_velocity", 0.1, ["standing", "forward", "backward"])
    }),
    ("/vehicle/status/steering_status", |data| {
        sign(data, "steering_tire_angle", 0.05, ["straight", "left", "right"])
    }),
    ("/vehicle/status/gear_status", |data| {
        named(data, "report", &[(2, "DRIVE"), (20, "REVERSE"), (22, "PARK")])
    }),
    ("/vehicle/status/control_mode", |data| named(data, "mode", &[(1, "AUTONOMOUS"), (4, "MANUAL")])),
    ("/vehicle/doors/status", |data| {
        let doors = data["doors"].as_array().unwrap().iter();
        doors.map(|door| named(door, "status", &[(2, "O"), (3, "C")])).collect()
    }),
];

fn named(data: &Value, key: &str, names: &[(u64, &str)]) -> String {
    let number = data[key].as_u64().unwrap();
    names
        .iter()
        .find(|(of, _)| *of == number)
        .map_or_else(|| number.to_string(), |(_, name)| (*name).to_owned())
}

/// Near zero, above, or below.
fn sign(data: &Value, key: &str, least: f64, [zero, above, below]: [&str; 3]) -> String {
    let value = data[key].as_f64().unwrap();
    (if value > least {
        above
    } else if value < -least {
        below
    } else {
        zero
    })
    .to_owned()
}

fn replay_demo() -> Vec<u8> {
    let output = Command::new(env!("CARGO_BIN_EXE_signal-gateway"))
        .args(["replay", "--json", "--config"])
        .arg(project().join("config/demo.toml"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

/// The time, topic or task, and the value of each JSON line; a diagnostics line may hold several.
fn values(line: &Value) -> Vec<(f64, String, String)> {
    let t = line["t"].as_f64().unwrap();
    let data = &line["data"];
    let path = line["topic"].as_str().unwrap();
    if let Some((_, value)) = TOPICS.iter().find(|(topic, _)| *topic == path) {
        return vec![(t, path.to_owned(), value(data))];
    }
    assert_eq!(path, "/diagnostics");
    let status = |status: &Value| {
        let level = ["OK", "WARN", "ERROR"][usize::try_from(status["level"].as_u64().unwrap()).unwrap()];
        let task = status["name"].as_str().unwrap().strip_prefix("signal_gateway: ").unwrap();
        (t, task.to_owned(), format!("{level} {}", status["message"].as_str().unwrap()))
    };
    data["status"].as_array().unwrap().iter().map(status).collect()
}

/// Only value is another value than before; a report that pauses is `silent` from then on.
fn changes(json: &str) -> Vec<(f64, String, String)> {
    let lines = json.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let mut known: BTreeMap<String, (f64, String)> = BTreeMap::new();
    let mut changes = Vec::new();
    for (t, subject, value) in lines.flat_map(|line| values(&line)) {
        if let Some((last, before)) = known.get(&subject) {
            let paused = subject.starts_with('/') && t - last > PAUSE_S;
            if paused {
                changes.push((*last, subject.clone(), "silent".to_owned()));
            }
            if paused || *before != value {
                changes.push((t, subject.clone(), value.clone()));
            }
        } else {
            changes.push((t, subject.clone(), value.clone()));
        }
        known.insert(subject, (t, value));
    }
    let at_the_end = known.iter().filter(|(subject, (t, _))| subject.starts_with('/') && *t > 59.8);
    assert_eq!(at_the_end.count(), TOPICS.len(), "all reports are published to the end");
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    changes
}

#[test]
fn the_demo_shows_every_outcome_of_a_report() {
    let json = String::from_utf8(replay_demo()).unwrap();
    let changes = changes(&json);
    let expected = &VEHICLES["demo_vehicle"].demo;
    assert_eq!(changes.len(), expected.len(), "{changes:#?}");
    for (change @ (t, subject, value), expected) in changes.iter().zip(expected) {
        let (second, expected) = expected.split_once(' ').unwrap();
        // Of a pause only the last report before it is known.
        let tolerance = if value == "silent" { 0.100 } else { 0.050 };
        let is_near = (t - second.parse::<f64>().unwrap()).abs() <= tolerance;
        assert!(is_near && expected == format!("{subject} {value}"), "{change:?}, not {second} {expected}");
    }
}

#[test]
fn the_same_recording_gives_the_same_bytes() {
    let first = replay_demo();
    assert!(first.len() > 50_000);
    assert!(first == replay_demo());
}
