//! The status of vehicles: what opendbc's car state reads in packed frames is what the profile reports.

use serde_json::{Map, Value, json};
use signal_gateway::config::Settings;

use super::{Vehicle, ask, file_and_platform, log, vehicles};
use crate::pure::vehicles::playback::play_text;
use crate::pure::vehicles::{read_profile, status};
use crate::support::prerequisite::{opendbc_python, require};

/// The frames of a row come so often, and are read at the end.
const PERIOD_MS: u64 = 20;
const LENGTH_MS: u64 = 400;

/// The frames of a row, as a request to the packer.
fn request(vehicle: &Vehicle, signals: &str) -> Value {
    let mut messages: Map<String, Value> = Map::new();
    for word in signals.split_whitespace() {
        let (signal, value) = word.split_once('=').unwrap();
        let (message, signal) = signal.split_once('.').unwrap();
        let values = messages.entry(message).or_insert_with(|| json!({}));
        values[signal] = json!(value.parse::<f64>().unwrap());
    }
    let times = (0..LENGTH_MS).step_by(usize::try_from(PERIOD_MS).unwrap());
    let frames =
        times.flat_map(|ms| messages.iter().map(move |(message, values)| json!([ms, message, values])));
    let (file, platform) = file_and_platform(&vehicle.counterpart.cars[0]);
    json!({"dbc": file, "platform": platform, "length_ms": LENGTH_MS, "frames": frames.collect::<Vec<_>>()})
}

/// Whether our report is what opendbc reads.
fn agrees(part: &str, ours: &str, theirs: &Value) -> bool {
    let is_near = |key: &str, near: f64| {
        let number = |value: f64| if key == "speed" { value.abs() } else { value };
        let ours = ours.parse::<f64>();
        ours.is_ok_and(|ours| (number(ours) - number(theirs[key].as_f64().unwrap())).abs() <= near)
    };
    match part {
        "speed" => is_near("speed", 0.002),
        "yaw_rate" => is_near("yaw_rate", 0.0002),
        "steering" => is_near("steering", 0.006),
        "gear" => {
            let gear = match theirs["gear"].as_str().unwrap() {
                "drive" | "sport" | "manumatic" | "eco" => "DRIVE",
                "low" | "brake" => "LOW",
                "park" => "PARK",
                "reverse" => "REVERSE",
                "neutral" => "NEUTRAL",
                other => other,
            };
            ours == gear
        }
        "doors" => ours != "-" && ours.split(' ').any(|door| door == "OPENED") == theirs["door"],
        other => panic!("{other}"),
    }
}

#[test]
fn the_profiles_report_the_status_that_opendbc_reads() {
    let python = require!(opendbc_python());
    let (mut wrong, mut rows) = (Vec::new(), 0);
    for vehicle in vehicles() {
        let tried = &vehicle.counterpart.status;
        let requests: Vec<_> = tried.iter().map(|[signals, _]| request(&vehicle, signals)).collect();
        let settings =
            Settings { gateway: status::settings(vehicle.profile), ..read_profile(vehicle.profile) };
        for ([signals, part], answer) in tried.iter().zip(ask(&python, &requests)) {
            let playback = play_text(&settings, &log(&vehicle, &answer), "can0");
            let report = match part.as_str() {
                "speed" => "velocity",
                "yaw_rate" => "heading",
                part => part,
            };
            let reports = playback.status.iter().flat_map(|(_, output)| status::texts(*output));
            let ours = reports.rev().find(|(name, _)| *name == report);
            let ours = ours.map_or("-".to_owned(), |(_, text)| text);
            if !agrees(part, &ours, &answer["status"]) {
                wrong.push(format!("{} {signals}: {part} {ours}, not {}", vehicle.profile, answer["status"]));
            }
            rows += 1;
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    assert!(rows >= 150, "{rows} rows");
}
