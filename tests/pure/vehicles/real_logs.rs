//! Recordings of real vehicles: the facts known of each, and the reports of the gateway.

use std::io::Read;
use std::path::Path;

use can_signal::validation::integrity::IntegrityCounts;
use flate2::read::MultiGzDecoder;
use gateway_base::diagnostics::Level;

use crate::pure::vehicles::playback::{Playback, TURN, play_file, play_interface, play_text};
use crate::pure::vehicles::profile;
use crate::support::prerequisite::{require, shared_data};
use crate::support::vehicle_facts::{IntegrityFacts, Recording, VEHICLES};

#[test]
fn each_recording_gives_what_is_known_of_it() {
    let folder = require!(shared_data());
    for (name, vehicle) in &*VEHICLES {
        for recording in vehicle.recording.iter().filter(|recording| recording.is_judged()) {
            let path = folder.join("can-logs").join(&recording.file);
            let playback = match &recording.interface {
                Some(interface) => play_interface(profile(name), &path, interface),
                None => play_file(profile(name), &path),
            };
            check(&playback, recording, &format!("{name}, {}", recording.file));
        }
    }
}

fn check(playback: &Playback, recording: &Recording, case: &str) {
    let text = |ms: u64, change: &str| format!("{}.{:03} {change}", ms / 1000, ms % 1000);
    let reports = |changes: &[(u64, &str)]| changes.iter().map(|(ms, state)| text(*ms, state)).collect();
    for (subject, expected) in &recording.changes {
        let changes: Vec<_> = match subject.as_str() {
            "turn_indicators_status" => reports(&playback.turn),
            "hazard_lights_status" => reports(&playback.hazard),
            task => playback
                .changes_of(task)
                .map(|change| text(change.ms(), &format!("{} {}", change.level, change.message)))
                .collect(),
        };
        assert_eq!(changes, *expected, "{case}: {subject}");
    }
    for (task, values) in &recording.values {
        for (key, expected) in values {
            assert_eq!(playback.value(task, key), expected, "{case}: {key} of {task}");
        }
    }
    if let Some(IntegrityFacts { initial, trusted }) = recording.integrity {
        let expected = IntegrityCounts { initial, trusted, ..IntegrityCounts::default() };
        assert_eq!(playback.checker, expected, "{case}");
    }
    assert_eq!(playback.end_ms, recording.length_ms.unwrap_or(playback.end_ms), "{case}: length");
}

#[test]
fn the_lossy_civic_is_unknown_in_each_of_its_silences_and_never_wrong() {
    let folder = require!(shared_data());
    let log = "eld-civic-type-r-2019-turnonanddrive.log";
    let log = folder.join("can-logs").join(log);
    let civic = play_file(profile("honda_civic_hatchback_2017"), &log);
    let (frames, end) = frames_of(&log, "326#");
    // Published from a trusted frame until there was none for half a second.
    let mut expected = Vec::new();
    let trusted: Vec<_> = trusted(&frames).into_iter().chain([end]).collect();
    for pair in trusted.windows(2) {
        expected.push((pair[0] / 1000, "DISABLE"));
        if pair[1] > pair[0] + 500_000 {
            expected.push(((pair[0] + 500_000) / 1000, "stops"));
        }
    }
    expected.dedup_by_key(|(_, state)| *state);
    assert_eq!(civic.turn, expected);
    assert_eq!(civic.turn_states(), ["DISABLE"].into());
    // Whatever else is rejected: in no silence of the message is anything published.
    let mut silences = 0;
    for pair in frames.windows(2).filter(|pair| pair[1].0 > pair[0].0 + 500_000) {
        let (from, until) = ((pair[0].0 + 500_000) / 1000, pair[1].0 / 1000);
        let state = civic.turn.iter().rfind(|(ms, _)| *ms <= from).unwrap().1;
        let inside = civic.turn.iter().filter(|(ms, _)| (from + 1..until).contains(ms));
        assert_eq!((state, inside.count()), ("stops", 0), "{from} ms");
        silences += 1;
    }
    assert_eq!(silences, 15);
    assert_eq!(expected.iter().filter(|(_, state)| *state == "stops").count(), 8);
    let counts = civic.checker;
    assert_eq!((trusted.len() as u64 - 1, counts.trusted, counts.lost), (160, 160, 9));
    // Of the counter's 26 breaks nine lie in silences, after which it restarts, one frame later; twelve are
    // steps of two, a lost frame (one of them while more is amiss); two repetitions and three others remain.
    let step = |pair: &[(u64, u8)]| ((pair[1].1 >> 4) + 4 - (pair[0].1 >> 4 & 3)) & 3;
    assert_eq!(frames.windows(2).filter(|pair| step(pair) != 1).count(), 26);
    let first = IntegrityCounts { trusted: 160, lost: 9, initial: 16, ..IntegrityCounts::default() };
    assert_eq!(counts, IntegrityCounts { repeated: 2, wrong_sequence: 3, syncing: 12, ..first });
    let statuses = civic.statuses_of(TURN);
    let kinds = ["starting: ", "unknown: "];
    assert!(
        statuses
            .iter()
            .all(|(level, text)| { *level == Level::Ok || kinds.iter().any(|kind| text.starts_with(kind)) }),
        "{statuses:?}"
    );
    assert_eq!(civic.value(TURN, "frames"), "193");
}

/// Times of the valid frames. Their two bits of counter are one or two ahead of the frame
/// before, at most half a second ago; after any other step, or a longer silence, that must be so twice.
fn trusted(frames: &[(u64, u8)]) -> Vec<u64> {
    let mut needed = 0;
    let judge = |pair: &[(u64, u8)]| {
        let [(before, old), (at, new)] = *pair else { return None };
        if at > before + 500_000 {
            needed = 1;
            return None;
        }
        let step = ((new >> 4) + 4 - (old >> 4 & 3)) & 3;
        match step {
            1 | 2 if needed == 0 => return Some(at),
            1 | 2 => needed -= 1,
            _ => needed = 1,
        }
        None
    };
    frames.windows(2).filter_map(judge).collect()
}

/// Microseconds since the log's first line of each line with this frame, and its last byte; and of
/// the log's last line.
fn frames_of(log: &Path, frame: &str) -> (Vec<(u64, u8)>, u64) {
    let text = std::fs::read_to_string(log).unwrap();
    let us = |line: &str| {
        let (seconds, rest) = line.trim_start_matches('(').split_once('.').unwrap();
        seconds.parse::<u64>().unwrap() * 1_000_000 + rest[..6].parse::<u64>().unwrap()
    };
    let start = us(text.lines().next().unwrap());
    let with_frame = text.lines().filter(|line| line.split(' ').nth(2).unwrap().starts_with(frame));
    let last_byte = |line: &str| u8::from_str_radix(&line[line.len() - 2..], 16).unwrap();
    let frames = with_frame.map(|line| (us(line) - start, last_byte(line))).collect();
    (frames, us(text.lines().last().unwrap()) - start)
}

#[test]
fn a_profile_on_a_foreign_vehicle_publishes_nothing() {
    let folder = require!(shared_data());
    let playback = play_file(profile("volvo_v40_2017"), &folder.join("can-logs/savvycan-candump.log"));
    assert!(playback.turn.is_empty() && playback.hazard.is_empty());
    assert_eq!(playback.statuses_of(TURN).len(), 2, "awaited, then never received");
}

#[test]
fn of_the_two_kona_buses_only_the_bound_one_is_used() {
    let folder = require!(shared_data());
    let path = folder.join("can-logs/hyundai-kona-ev-2019-pcan-ccan-power-cycle.csv.gz");
    let mut csv = String::new();
    MultiGzDecoder::new(std::fs::File::open(path).unwrap()).read_to_string(&mut csv).unwrap();
    let candump = candump_of(&csv);
    let settings = profile("hyundai_kia");
    for interface in ["can0", "can1"] {
        let mine = candump.lines().filter(|line| line.contains(&format!("{interface} 541#"))).count();
        let kona = play_text(settings, &candump, interface);
        assert!(mine > 20, "both buses carry 0x541");
        assert_eq!(kona.value(TURN, "frames"), mine.to_string(), "{interface}");
    }
    let kona = play_text(settings, &candump, "can0");
    assert_eq!(kona.turn_states(), ["DISABLE"].into());
    assert!(kona.statuses_of(TURN).iter().all(|(_, message)| !message.starts_with("invalid")));
}

/// The CSV of the Kona log (microseconds, id, extended, bus, length, bytes) as candump writes it.
fn candump_of(csv: &str) -> String {
    let line = |line: &str| {
        let fields: Vec<_> = line.split(',').collect();
        let us: u64 = fields[0].parse().unwrap();
        let width = if fields[2] == "true" { 8 } else { 3 };
        let id = u32::from_str_radix(fields[1], 16).unwrap();
        let length: usize = fields[4].parse().unwrap();
        let data = fields[5..5 + length].concat();
        format!("({}.{:06}) can{} {id:0width$X}#{data}\n", us / 1_000_000, us % 1_000_000, fields[3])
    };
    csv.lines().skip(1).map(line).collect()
}
