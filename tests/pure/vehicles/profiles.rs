//! Each shipped profile: frames written by hand from public facts, and the reports they must give.

use std::collections::{BTreeMap, BTreeSet};

use gateway_base::diagnostics::{Level, Status};
use gateway_base::time::MonoTime;
use gateway_core::vehicle_lights::binding::TurnBinding;

use crate::pure::vehicles::payload::frame;
use crate::pure::vehicles::playback::{HAZARD, TURN};
use crate::pure::vehicles::protection::protect;
use crate::pure::vehicles::{profile, profile_names};
use crate::support::clock::at_ms;
use crate::support::prerequisite::{require, shared_data};
use crate::support::vehicle_facts::{DbcOrigin, LabelledFrames, VEHICLES};
use crate::support::virtual_gateway::VirtualGateway;

/// The outcome of the two reports after the frames, as the facts give it.
fn outcome(profile_name: &str, frames: &str) -> [String; 2] {
    let settings = profile(profile_name).gateway.clone();
    let mut gateway = VirtualGateway::starting_at(MonoTime::from_millis(5), settings);
    let mut sent = BTreeMap::new();
    // A counter is checked from the second frame on.
    for _ in 0..2 {
        for text in frames.split(';') {
            let (times, text) = text.split_once('*').unwrap_or(("1", text));
            let plain = frame(text);
            for _ in 0..times.trim().parse::<u32>().unwrap() {
                let count = sent.entry(plain.id().number()).or_insert(0_u8);
                let frame = protect(&VEHICLES[profile_name], &plain, *count);
                *count = count.wrapping_add(1);
                gateway.receive(frame.id(), frame.data());
                if times != "1" {
                    gateway.now = at_ms(gateway.ms() + 50);
                }
            }
        }
    }
    let last = |states: Vec<&'static str>| states.last().copied().filter(|state| *state != "stops");
    let (turn, hazard) = (last(gateway.turn_states()), last(gateway.hazard_states()));
    [(TURN, turn), (HAZARD, hazard)].map(|(task, published)| {
        let Status { level, message, .. } = gateway.status(task);
        let is_fault = message.starts_with("hardware fault: ");
        match (published, level) {
            (Some(report), Level::Ok) => report.to_owned(),
            (Some(report), Level::Warn) if message.starts_with("fallback ") => format!("{report} +fallback"),
            (Some(report), Level::Error) if is_fault => format!("{report} +fault"),
            (None, Level::Warn) if message.starts_with("not visible: ") => "not visible".to_owned(),
            (None, Level::Warn) if message.starts_with("starting: ") => "unknown".to_owned(),
            (None, Level::Error) if message.starts_with("unknown: ") => "unknown".to_owned(),
            (None, Level::Error) if is_fault => "fault".to_owned(),
            (None, Level::Error) if message.starts_with("invalid: ") => match message.split(" = ").nth(1) {
                Some(rest) if rest.ends_with(" is not a defined value") => {
                    format!("invalid {}", rest.trim_end_matches(" is not a defined value"))
                }
                _ if message.ends_with(" = 1 at once is not defined") => "invalid at once".to_owned(),
                _ => message.clone(),
            },
            _ => format!("{published:?} {level} {message}"),
        }
    })
}

#[test]
fn every_profile_has_its_facts() {
    let profiles: BTreeSet<_> = profile_names().into_iter().collect();
    let lone: Vec<_> = profiles.symmetric_difference(&VEHICLES.keys().cloned().collect()).cloned().collect();
    assert!(lone.is_empty(), "in config/vehicles or in tests/vehicles, but not in both: {lone:?}");
    for (name, vehicle) in &*VEHICLES {
        let is_of_opendbc = matches!(vehicle.dbc, DbcOrigin::Opendbc);
        assert!(!is_of_opendbc || !vehicle.opendbc.is_empty(), "{name} has no counterpart to its DBC");
    }
}

#[test]
fn each_payload_gives_the_report_that_public_facts_demand() {
    let mut wrong = Vec::new();
    for (profile, vehicle) in &*VEHICLES {
        for [frames, turn, hazard] in &vehicle.reports {
            let outcome = outcome(profile, frames);
            if outcome != [turn.as_str(), hazard] {
                wrong.push(format!("{profile} {frames}: {outcome:?}, not {:?}", [turn, hazard]));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn every_shipped_profile_is_tried_off_left_and_right() {
    for (name, vehicle) in &*VEHICLES {
        let has_lights = !matches!(profile(name).gateway.lights.turn, TurnBinding::LeftOut);
        for state in ["DISABLE", "ENABLE_LEFT", "ENABLE_RIGHT"] {
            let is_tried = vehicle.reports.iter().any(|[_, turn, _]| turn == state);
            assert_eq!(is_tried, has_lights, "{name} {state}");
        }
    }
}

#[test]
fn labelled_frames_of_real_vehicles_give_their_labels() {
    let folder = require!(shared_data());
    for (profile, vehicle) in &*VEHICLES {
        let Some(LabelledFrames { file, id, frames }) = &vehicle.labelled else { continue };
        let rows = std::fs::read_to_string(folder.join("can-logs").join(file)).unwrap();
        for [label, turn, hazard] in frames {
            // Label, identifier, two flags, length in hexadecimal, bytes.
            let row = rows.lines().find(|row| row.starts_with(&format!("{label},{id} ")));
            let cells: Vec<_> = row.unwrap_or_else(|| panic!("{label}")).split(',').skip(4).collect();
            let byte = |cell: &str| u8::from_str_radix(cell, 16).unwrap();
            let bytes = cells[1..].iter().take(byte(cells[0]).into()).enumerate();
            let text = bytes.fold(format!("{id} {}", byte(cells[0])), |text, (index, cell)| {
                format!("{text} {}|8@1={}", index * 8, byte(cell))
            });
            assert_eq!(outcome(profile, &text), [turn.as_str(), hazard], "{profile} {label}");
        }
    }
}
