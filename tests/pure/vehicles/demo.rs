//! The demo, which shows every outcome that a report can have.

use std::collections::BTreeMap;
use std::process::Command;

use serde_json::Value;

use crate::pure::vehicles::project;

/// Seconds, topic or diagnostic task, and its value from then on; within 50 ms.
const CHANGES: [(f64, &str, &str); 31] = [
    (0.0, "turn_indicators", "ERROR unknown: no frame of BCM_TurnIndicators (2A5) on can0 yet"),
    (0.0, "hazard_lights", "ERROR unknown: no frame of BCM_Hazard (2C1) on can0 yet"),
    (0.0, "can0", "WARN up, but no frame of the vehicle profile yet"),
    (0.0, "can0", "OK receiving"),
    (0.0, "turn_indicators_status", "DISABLE"),
    (0.0, "turn_indicators", "OK publishing"),
    (0.05, "hazard_lights_status", "DISABLE"),
    (0.05, "hazard_lights", "OK publishing"),
    // Defined values.
    (4.0, "turn_indicators_status", "ENABLE_LEFT"),
    (9.0, "turn_indicators_status", "DISABLE"),
    (11.0, "turn_indicators_status", "ENABLE_RIGHT"),
    (16.0, "turn_indicators_status", "DISABLE"),
    (18.05, "hazard_lights_status", "ENABLE"),
    (22.05, "hazard_lights_status", "DISABLE"),
    // Undefined.
    (24.0, "turn_indicators_status", "silent"),
    (
        24.0,
        "turn_indicators",
        "ERROR invalid: BCM_TurnIndicators.TurnIndicatorState = 5 is not a defined value",
    ),
    (26.5, "turn_indicators_status", "DISABLE"),
    (26.5, "turn_indicators", "OK publishing"),
    // Not available.
    (28.0, "turn_indicators_status", "silent"),
    (28.0, "turn_indicators", "ERROR unknown: BCM_TurnIndicators.TurnIndicatorState = 7 means not available"),
    (30.5, "turn_indicators_status", "DISABLE"),
    (30.5, "turn_indicators", "OK publishing"),
    // A fault beside a defined value.
    (32.0, "turn_indicators_status", "ENABLE_LEFT"),
    (
        32.0,
        "turn_indicators",
        "ERROR hardware fault: turn lamp (BCM_TurnIndicators.TurnLampFault = 1), still published",
    ),
    (35.0, "turn_indicators_status", "DISABLE"),
    (35.0, "turn_indicators", "OK publishing"),
    // Silence.
    (36.7, "turn_indicators_status", "silent"),
    (36.7, "turn_indicators", "ERROR unknown: BCM_TurnIndicators is stale, silent for more than 250 ms"),
    (39.0, "turn_indicators_status", "ENABLE_RIGHT"),
    (39.0, "turn_indicators", "OK publishing"),
    (41.0, "turn_indicators_status", "DISABLE"),
];

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
    let agree = |((t, subject, value), expected): (&(f64, String, String), &(f64, &str, &str))| {
        // Of a pause only the last report before it is known.
        let tolerance = if value == "silent" { 0.100 } else { 0.050 };
        (t - expected.0).abs() <= tolerance && subject == expected.1 && value == expected.2
    };
    assert_eq!(changes.len(), CHANGES.len(), "{changes:#?}");
    let differ = changes.iter().zip(&CHANGES).find(|pair| !agree(*pair));
    assert_eq!(differ, None);
}

#[test]
fn the_same_recording_gives_the_same_bytes() {
    let first = replay_demo();
    assert!(first.len() > 50_000);
    assert!(first == replay_demo());
}
