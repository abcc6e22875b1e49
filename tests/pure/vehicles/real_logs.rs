//! Recordings of real vehicles: the facts known of each, and the reports of the gateway.

use std::io::Read;
use std::path::Path;

use flate2::read::MultiGzDecoder;
use signal_gateway::core::diagnostics::Level;
use signal_gateway::core::validation::integrity::IntegrityCounts;

use crate::pure::vehicles::playback::{HAZARD, Playback, TURN, play_file, play_interface, play_text};
use crate::pure::vehicles::profile;
use crate::support::prerequisite::{require, shared_data};

/// Log and profile.
const RECORDINGS: [(&str, &str); 11] = [
    ("ford-falcon-fg-candump-2021-01-20_205722.log.gz", "ford_falcon_fg"),
    ("css-truck-j1939-00000001.candump.log.gz", "j1939_truck"),
    ("comma2k19-rav4-b0c9d232-seg40.candump.log.gz", "toyota_nodsu"),
    ("eld-civic-type-r-2019-turnonanddrive.log", "honda_civic_hatchback_2017"),
    ("eld-kona-turnonlog.log", "hyundai_kia"),
    ("eld-camaro-engineon.log", "gm_global_a"),
    ("eld-durango-keyon.log", "chrysler_pacifica_2017"),
    ("eld-gt350-engineoffthenonthenoff.log", "ford_lincoln"),
    ("eld-subaru-va-cruise.log", "subaru_outback_2015"),
    ("icsim-sample-can.log", "acura_ilx_2016"),
    ("savvycan-candump.log", "volvo_v40_2017"),
];

/// Stamps in the facts about recordings are given to hundredths of a second.
fn near(ms: u64, seconds: f64) -> bool {
    (std::time::Duration::from_millis(ms).as_secs_f64() - seconds).abs() <= 0.010
}

fn assert_changes(changes: &[(u64, &str)], expected: &[(f64, &str)]) {
    let agree = |(change, expected): (&(u64, &str), &(f64, &str))| {
        near(change.0, expected.0) && change.1 == expected.1
    };
    assert!(
        changes.len() == expected.len() && changes.iter().zip(expected).all(agree),
        "{changes:?}\nexpected {expected:?}"
    );
}

fn play_real(folder: &Path, log: &str) -> Playback {
    let (_, name) = RECORDINGS.iter().find(|(file, _)| *file == log).unwrap();
    play_file(profile(name), &folder.join("can-logs").join(log))
}

#[test]
fn the_falcon_stops_at_an_undefined_value_and_at_a_gap_and_comes_back() {
    let folder = require!(shared_data());
    let falcon = play_real(&folder, "ford-falcon-fg-candump-2021-01-20_205722.log.gz");
    assert_changes(
        &falcon.turn,
        &[
            (0.086, "DISABLE"),
            // Right for 6.4 s and 1.4 s, left for 2.3 s and 1.1 s.
            (63.988, "ENABLE_RIGHT"),
            (70.392, "DISABLE"),
            (72.933, "ENABLE_RIGHT"),
            (74.374, "DISABLE"),
            (75.644, "ENABLE_LEFT"),
            (77.935, "DISABLE"),
            (97.804, "ENABLE_LEFT"),
            (98.908, "DISABLE"),
            // 26 frames of 0x96.
            (108.75, "stops"),
            (111.22, "DISABLE"),
            // No frame for 5.8 s: valid for half a second of it.
            (116.321, "stops"),
            (121.618, "DISABLE"),
        ],
    );
    let statuses: Vec<_> = falcon.statuses_of(TURN);
    assert_eq!(
        statuses,
        [
            (Level::Error, "unknown: no frame of InstrumentCluster0x128 (128) on can0 yet"),
            (Level::Ok, "publishing"),
            (
                Level::Error,
                "invalid: InstrumentCluster0x128.TurnStalkSwitchSatus = 150 (0x96) is not a defined value"
            ),
            (Level::Ok, "publishing"),
            (Level::Error, "unknown: InstrumentCluster0x128 is stale, silent for more than 500 ms"),
            (Level::Ok, "publishing"),
        ]
    );
    assert!(falcon.hazard.is_empty());
    assert_eq!(
        falcon.statuses_of(HAZARD),
        [(Level::Error, "unknown: the vehicle profile binds no signal for it")]
    );
}

#[test]
fn the_truck_is_unknown_for_its_one_frame_of_not_available() {
    let folder = require!(shared_data());
    let truck = play_real(&folder, "css-truck-j1939-00000001.candump.log.gz");
    assert_changes(&truck.turn, &[(0.475, "DISABLE"), (387.54, "stops"), (388.48, "DISABLE")]);
    let never_received = (Level::Error, "unknown: no frame of OEL (0CFDCC27) on can0 yet");
    assert_eq!(
        truck.statuses_of(TURN),
        [
            never_received,
            (Level::Ok, "publishing"),
            (Level::Error, "unknown: OEL.TurnSignalSwitch = 15 (0xF) means not available"),
            (Level::Ok, "publishing"),
        ]
    );
    assert!(truck.hazard.is_empty(), "not available is never DISABLE");
    let not_available = (Level::Error, "unknown: OEL.HazardLightSwitch = 3 means not available");
    assert_eq!(truck.statuses_of(HAZARD), [never_received, not_available]);
    assert_eq!(truck.value(TURN, "frames"), "401");
}

#[test]
fn a_message_once_a_second_does_not_make_its_bus_look_silent() {
    let folder = require!(shared_data());
    for log in ["css-truck-j1939-00000001.candump.log.gz", "eld-camaro-engineon.log"] {
        let levels: Vec<_> =
            play_real(&folder, log).statuses_of("can0").into_iter().map(|(level, _)| level).collect();
        assert_eq!(levels, [Level::Warn, Level::Ok], "{log}");
    }
}

#[test]
fn eight_frames_in_a_minute_are_enough_for_an_event_message() {
    let folder = require!(shared_data());
    let rav4 = play_real(&folder, "comma2k19-rav4-b0c9d232-seg40.candump.log.gz");
    assert_changes(&rav4.turn, &[(8.461, "DISABLE")]);
    assert_changes(&rav4.hazard, &[(8.461, "DISABLE")]);
    for task in [TURN, HAZARD] {
        let levels: Vec<_> = rav4.statuses_of(task).into_iter().map(|(level, _)| level).collect();
        assert_eq!(levels, [Level::Error, Level::Ok], "{task}: unknown until the first frame only");
        assert_eq!(rav4.value(task, "frames"), "8");
    }
    assert!(rav4.end_ms > 59_900);
}

#[test]
fn the_lossy_civic_is_unknown_in_each_of_its_silences_and_never_wrong() {
    let folder = require!(shared_data());
    let log = "eld-civic-type-r-2019-turnonanddrive.log";
    let civic = play_real(&folder, log);
    let (frames, end) = frames_of(&folder.join("can-logs").join(log), "326#");
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
    // Of the counter's 26 breaks nine lie in silences, after which it restarts, one frame later; twelve are steps of
    // two, a lost frame (one of them while more is amiss); two repetitions and three others remain.
    let step = |pair: &[(u64, u8)]| ((pair[1].1 >> 4) + 4 - (pair[0].1 >> 4 & 3)) & 3;
    assert_eq!(frames.windows(2).filter(|pair| step(pair) != 1).count(), 26);
    let first = IntegrityCounts { trusted: 160, lost: 9, initial: 16, ..IntegrityCounts::default() };
    assert_eq!(counts, IntegrityCounts { repeated: 2, wrong_sequence: 3, syncing: 12, ..first });
    let statuses = civic.statuses_of(TURN);
    assert!(
        statuses.iter().all(|(level, text)| *level == Level::Ok || text.starts_with("unknown: ")),
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
fn vehicles_at_rest_show_no_indicator_from_the_first_frame_to_the_last() {
    let folder = require!(shared_data());
    for (log, frames) in [
        ("eld-camaro-engineon.log", "15"),
        ("eld-durango-keyon.log", "57"),
        ("eld-gt350-engineoffthenonthenoff.log", "112"),
        ("icsim-sample-can.log", "81"),
    ] {
        let playback = play_real(&folder, log);
        assert_eq!(playback.turn.len(), 1, "{log}: {:?}", playback.turn);
        assert_eq!(playback.turn[0].1, "DISABLE", "{log}");
        let levels: Vec<_> = playback.statuses_of(TURN).into_iter().map(|(level, _)| level).collect();
        // Of a counter the first frame proves nothing, which is one more status.
        let first = if log.starts_with("icsim") { 2 } else { 1 };
        assert_eq!(levels, [vec![Level::Error; first], vec![Level::Ok]].concat(), "{log}");
        assert_eq!(playback.value(TURN, "frames"), frames, "{log}");
        assert!(playback.hazard.is_empty(), "{log}");
    }
}

#[test]
fn dark_lamps_of_the_kona_are_off_and_the_lever_stands_in_until_they_were_observed() {
    let folder = require!(shared_data());
    let kona = play_real(&folder, "eld-kona-turnonlog.log");
    let [(lever_ms, "DISABLE")] = kona.turn[..] else { panic!("{:?}", kona.turn) };
    let [(lamps_ms, "DISABLE")] = kona.hazard[..] else { panic!("{:?}", kona.hazard) };
    assert!((1_029..=1_032).contains(&(lamps_ms - lever_ms)), "{lamps_ms} {lever_ms}");
    let levels: Vec<_> = kona.statuses_of(TURN).into_iter().map(|(level, _)| level).collect();
    assert_eq!(levels, [Level::Error, Level::Warn, Level::Ok]);
    assert_eq!((kona.value(TURN, "frames"), kona.value(TURN, "source")), ("98", "lamps"));
}

#[test]
fn protected_messages_of_undisturbed_recordings_are_valid_in_every_frame() {
    let folder = require!(shared_data());
    for (log, name, frames) in [
        ("icsim-sample-can.log", "acura_ilx_2016", 81),
        ("volvo-s60-2002-key-steering.csv", "volvo_s60_2002", 585),
    ] {
        let playback = play_interface(profile(name), &folder.join("can-logs").join(log), "can0");
        let expected = IntegrityCounts { initial: 1, trusted: frames - 1, ..IntegrityCounts::default() };
        assert_eq!(playback.checker, expected, "{log}");
        assert_eq!(playback.turn.len(), 1, "{log}: {:?}", playback.turn);
        assert_eq!(playback.turn[0].1, "DISABLE", "{log}");
    }
}

#[test]
fn a_profile_on_a_foreign_vehicle_publishes_nothing() {
    let folder = require!(shared_data());
    let playback = play_real(&folder, "savvycan-candump.log");
    assert!(playback.turn.is_empty() && playback.hazard.is_empty());
    assert_eq!(playback.statuses_of(TURN).len(), 1, "never received, reported once");
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

#[test]
fn dark_lamps_of_the_subaru_are_off_once_they_were_observed() {
    let folder = require!(shared_data());
    let subaru = play_real(&folder, "eld-subaru-va-cruise.log");
    let first_frame =
        subaru.changes_of(TURN).find(|change| change.message.contains("observing the lamps")).unwrap().ms();
    let [(turn_ms, "DISABLE")] = subaru.turn[..] else { panic!("{:?}", subaru.turn) };
    assert!((864..=866).contains(&(turn_ms - first_frame)), "{turn_ms} {first_frame}");
    assert_eq!(subaru.hazard, subaru.turn);
    assert_eq!(subaru.value(TURN, "frames"), "139");
}
