//! The demo, which shows every outcome that a report can have.

use std::collections::BTreeMap;
use std::process::Command;

use serde_json::Value;

use crate::pure::vehicles::project;
use crate::support::vehicle_facts::VEHICLES;

/// Reports come every 100 ms; a longer pause is a stop.
const PAUSE_S: f64 = 0.105;

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
    let topic = line["topic"].as_str().unwrap().rsplit('/').next().unwrap();
    let data = &line["data"];
    if topic != "diagnostics" {
        let names = match topic {
            "turn_indicators_status" => ["", "DISABLE", "ENABLE_LEFT", "ENABLE_RIGHT"],
            _ => ["", "DISABLE", "ENABLE", ""],
        };
        let report = usize::try_from(data["report"].as_u64().unwrap()).unwrap();
        return vec![(t, topic.to_owned(), names[report].to_owned())];
    }
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
            let paused = subject.ends_with("_status") && t - last > PAUSE_S;
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
    let at_the_end = known.iter().filter(|(subject, (t, _))| subject.ends_with("_status") && *t > 44.8);
    assert_eq!(at_the_end.count(), 2, "both reports are published to the end");
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
