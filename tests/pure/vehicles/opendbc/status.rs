//! The status of vehicles: what opendbc's car state reads in packed frames is what the profile reports.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};
use signal_gateway::config::Settings;

use super::{Vehicle, ask, file_and_platform, log, vehicles};
use crate::pure::vehicles::playback::play_text;
use crate::pure::vehicles::{read_profile, status};
use crate::support::prerequisite::{opendbc_python, require};

/// The frames of a row come so often, and are read at the end.
const PERIOD_MS: u64 = 20;
const LENGTH_MS: u64 = 400;

/// Parts of the status, and what is compared of each.
const PARTS: [(&str, &str); 5] = [
    (
        "speed",
        "Only the amount is compared, since `vEgoRaw` of opendbc is positive in reverse on most platforms. opendbc takes \
         the mean of four wheels and the profile that of the rear axle, so all wheels of a row turn at one speed.",
    ),
    (
        "steering",
        "`steeringAngleDeg` is the angle of the steering wheel. The report is the tire angle, read with a ratio of 1.",
    ),
    ("yaw_rate", "opendbc reads `yawRate` on few platforms."),
    (
        "gear",
        "D, S and M are DRIVE here, and B and L are LOW. Without a fingerprint opendbc takes the gearbox of some platforms as \
         manual and reads the reverse light alone, which then is the one value that is compared.",
    ),
    ("doors", "opendbc says whether any door is open, the report says which."),
];

/// Values of a sweep, from 0 to the largest.
const STEPS: u32 = 12;

/// The largest value of the sweep of this value: some 54 m/s, 0.5 rad/s and 450° of the steering wheel.
fn largest(part: &str, value: f64) -> f64 {
    match part {
        "speed" => 6.0 * value,
        "yaw_rate" => 2.5 * value,
        _ => 450.0_f64.copysign(value),
    }
}

/// A row as it is and, where it has values after a `~`, with these in steps from 0 to the largest.
fn sweep(signals: &str, part: &str) -> Vec<String> {
    let at = |step: Option<u32>| {
        let words = signals.split_whitespace().map(|word| match (word.split_once('~'), step) {
            (Some((signal, value)), Some(step)) => {
                let largest = largest(part, value.parse().unwrap());
                format!("{signal}={}", largest * f64::from(step) / f64::from(STEPS))
            }
            _ => word.replace('~', "="),
        });
        words.collect::<Vec<_>>().join(" ")
    };
    let steps = signals.contains('~').then_some(0..=STEPS).into_iter().flatten();
    std::iter::once(None).chain(steps.map(Some)).map(at).collect()
}

/// The signals that are tried, each with the part of the status that is read from them.
fn tried(vehicle: &Vehicle) -> Vec<(String, &'static str)> {
    let rows = vehicle.counterpart.status.iter().flat_map(|[signals, part]| {
        let (name, _) = PARTS.iter().find(|(name, _)| name == part).unwrap();
        sweep(signals, name).into_iter().map(move |signals| (signals, *name))
    });
    rows.collect()
}

/// The section of the document: how many values are compared, and what cannot be.
pub(super) fn section() -> String {
    let mut text = "\n## Status\n\nNumber of values of each part of the status that opendbc's car state and our report read alike, \
                    for the profiles whose platform has a car state. Speed, steering and yaw rate are swept from 0 to their \
                    largest value, with both signs.\n\n"
        .to_owned();
    writeln!(
        text,
        "| profiles |{}|",
        PARTS.map(|(name, _)| format!(" {} ", name.replace('_', " "))).join("|")
    )
    .unwrap();
    text += "|---|---|---|---|---|---|\n";
    let mut rows: Vec<(String, Vec<&str>)> = Vec::new();
    for vehicle in vehicles() {
        let tried = tried(&vehicle);
        if tried.is_empty() {
            continue;
        }
        let counts = PARTS.map(|(part, _)| match tried.iter().filter(|(_, name)| *name == part).count() {
            0 => "–".to_owned(),
            count => count.to_string(),
        });
        let counts = counts.join(" | ");
        match rows.iter_mut().find(|(known, _)| *known == counts) {
            Some((_, profiles)) => profiles.push(vehicle.profile),
            None => rows.push((counts, vec![vehicle.profile])),
        }
    }
    for (counts, profiles) in rows {
        writeln!(text, "| {} | {counts} |", profiles.join(", ")).unwrap();
    }
    text += "\n";
    for (name, note) in PARTS {
        writeln!(text, "- **{}**: {note}", name.replace('_', " ")).unwrap();
    }
    text += "- No car state has a word for \"not available\": opendbc reads such a code as a number, the profile withholds the \
             report. Those codes are therefore not packed here; the facts of each profile try them.\n";
    text
}

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
        // Half a step of the coarsest signal that opendbc reads where the profile reads wheels, Tesla's of
        // 0.08 km/h.
        "speed" => is_near("speed", 0.0115),
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
    let mut wrong = Vec::new();
    for vehicle in vehicles() {
        let tried = tried(&vehicle);
        let requests: Vec<_> = tried.iter().map(|(signals, _)| request(&vehicle, signals)).collect();
        let settings =
            Settings { gateway: status::settings(vehicle.profile), ..read_profile(vehicle.profile) };
        for ((signals, part), answer) in tried.iter().zip(ask(&python, &requests)) {
            let playback = play_text(&settings, &log(&vehicle, &answer), "can0");
            let report = match *part {
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
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}
