//! Every shipped vehicle, simulated from its own profile: what its lights do is what the gateway
//! reports, and what breaks is found.

use std::fmt::Write;
use std::time::Duration;

use gateway_base::diagnostics::Level;
use gateway_base::time::WallStamp;
use gateway_core::vehicle_lights::binding::{HazardSource, LightsBinding, TurnBinding};
use signal_gateway::config::Settings;
use signal_gateway::desk;
use signal_gateway::report::vehicle::CandumpLog;
use vehicle_bringup::simulated_vehicle::SimulationSettings;
use vehicle_bringup::simulated_vehicle::request;

use crate::pure::vehicles::playback::{Playback, TURN, play_log};
use crate::pure::vehicles::{profile, profile_names, read_profile};
use crate::support::virtual_gateway::StatusChange;

/// A log of the vehicle; each line of the script is a time in seconds and a request.
fn drive(settings: &Settings, script: &str, seconds: u64) -> String {
    let plan = settings.vehicle_plan().unwrap();
    let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.clone()).collect();
    let start = WallStamp::from_nanos(1_700_000_000_000_000_000);
    let candump = CandumpLog { interfaces, start };
    let requests = script.lines().filter_map(|line| request::line(line).unwrap());
    let script = requests.map(|(at, request)| (at.unwrap(), request)).collect();
    let (mut log, length) = (String::new(), Duration::from_secs(seconds));
    let ended = desk::vehicle::run(plan, SimulationSettings::default(), script, length, |output, at| {
        candump.line(output, at).map_or(Ok(()), |line| writeln!(log, "{line}"))
    });
    ended.unwrap();
    log
}

fn play(name: &str, script: &str, seconds: u64) -> Playback {
    play_settings(profile(name), script, seconds)
}

fn play_settings(settings: &Settings, script: &str, seconds: u64) -> Playback {
    play_log(settings, &drive(settings, script, seconds))
}

/// The report of the moment, by the list of its changes.
fn at<'a>(changes: &[(u64, &'a str)], ms: u64) -> &'a str {
    changes.iter().rev().find(|(since, _)| *since <= ms).map_or("never", |(_, report)| report)
}

/// What the turn report can show of a vehicle: whether each state is known from what it sends.
fn shows_turn(lights: &LightsBinding) -> bool {
    matches!(lights.turn, TurnBinding::From(_))
}

/// Signs of hazard lights; a profile may have none.
fn shows_hazard(lights: &LightsBinding) -> bool {
    lights.hazard.sources().iter().any(|named| match &named.source {
        HazardSource::Signal { .. } | HazardSource::Button { .. } => true,
        HazardSource::BothSides => lights.turn.sources().iter().any(|named| named.source.shows_both()),
    })
}

#[test]
fn what_each_shipped_vehicle_shows_is_what_is_reported() {
    let script = "10 stalk left\n20 stalk off\n30 stalk right\n40 stalk off\n50 hazard on\n60 hazard off";
    let (mut turns, mut hazards) = (0, 0);
    for name in profile_names() {
        let lights = &profile(&name).gateway.lights;
        if !shows_turn(lights) {
            continue;
        }
        let playback = play(&name, script, 70);
        let turn: Vec<_> = [9, 19, 29, 39, 49].iter().map(|s| at(&playback.turn, s * 1000)).collect();
        let expected = ["DISABLE", "ENABLE_LEFT", "DISABLE", "ENABLE_RIGHT", "DISABLE"];
        assert_eq!(turn, expected, "{name}: {:?}", playback.turn);
        let is_error = |change: &&StatusChange| change.level == Level::Error && change.task == TURN;
        let errors: Vec<_> = playback.changes.iter().filter(is_error).collect();
        assert!(errors.is_empty(), "{name}: an error at the start of a sound vehicle: {errors:?}");
        turns += 1;
        if shows_hazard(lights) {
            let hazard: Vec<_> = [49, 59, 69].iter().map(|s| at(&playback.hazard, s * 1000)).collect();
            assert_eq!(hazard, ["DISABLE", "ENABLE", "DISABLE"], "{name}: {:?}", playback.hazard);
            hazards += 1;
        }
    }
    assert_eq!((turns, hazards), (47, 27), "profiles whose lights follow from the frames that are sent");
}

#[test]
fn a_tap_flashes_three_times() {
    for name in ["pacmod", "hyundai_i30_2014", "vw_mqb"] {
        let playback = play(name, "10 tap left", 20);
        let on = playback.turn.iter().position(|(_, report)| *report == "ENABLE_LEFT").unwrap();
        let (since, until) = (playback.turn[on].0, playback.turn[on + 1].0);
        assert!((9_900..10_700).contains(&since), "{name}: {:?}", playback.turn);
        // Lamps are held for a while after the last flash.
        assert!((11_900..13_200).contains(&until), "{name}: {:?}", playback.turn);
    }
}

#[test]
fn reports_end_when_nothing_usable_is_received() {
    let table = [
        ("pacmod", "fault report not_available", "not available"),
        ("pacmod", "fault report fault", "fault"),
        ("pacmod", "fault report undefined", "invalid"),
        ("pacmod", "fault drop", "stale"),
        ("pacmod", "fault silent", "stale"),
        ("new_eagle_dbw", "fault freeze-counter", "repeated counter"),
        ("tesla_model3", "fault drop 1 ID3F5VCFRONT_lighting", "stale"),
        ("subaru_global", "fault corrupt", "wrong checksum"),
        ("subaru_global", "fault freeze-counter Dashlights", "repeated counter"),
    ];
    for (name, fault, text) in table {
        let playback = play(name, &format!("5 stalk left\n10 {fault}\n15 clear"), 25);
        assert_eq!(at(&playback.turn, 9_900), "ENABLE_LEFT", "{name} {fault}");
        assert_eq!(at(&playback.turn, 14_900), "stops", "{name} {fault}: {:?}", playback.turn);
        assert_eq!(at(&playback.turn, 24_900), "ENABLE_LEFT", "{name} {fault}: {:?}", playback.turn);
        let is_reported = |text: &str| {
            playback.changes.iter().any(|change| {
                change.task == TURN
                    && (10_000..15_000).contains(&change.ms())
                    && change.message.contains(text)
            })
        };
        let changes: Vec<_> =
            playback.changes.iter().map(|change| (change.ms(), change.message.as_str())).collect();
        assert!(is_reported(text), "{name} {fault}: {changes:?}");
    }
}

#[test]
fn some_lost_frames_change_nothing_and_constant_contents_are_accepted() {
    let quiet = play("pacmod", "5 stalk left\n10 fault drop 0.3\n20 stalk off", 30);
    assert_eq!(quiet.turn.len(), 3, "{:?}", quiet.turn);
    assert!((20_000..21_500).contains(&quiet.turn[2].0), "{:?}", quiet.turn);
    let standing = play("new_eagle_dbw", "5 stalk left\n10 fault freeze-contents\n15 stalk off", 20);
    assert_eq!(at(&standing.turn, 19_900), "ENABLE_LEFT", "{:?}", standing.turn);
    let lying = play("pacmod", "5 stalk left\n10 fault false-report right\n15 clear", 20);
    assert_eq!((at(&lying.turn, 14_900), at(&lying.turn, 19_900)), ("ENABLE_RIGHT", "ENABLE_LEFT"));
}

#[test]
fn a_broken_bulb_is_found() {
    for (name, text) in [("tesla_model3", "left front turn lamp"), ("hyundai_i30_2014", "bulb")] {
        let playback = play(name, "5 stalk left\n10 fault bulb left", 20);
        assert_eq!(at(&playback.turn, 19_900), "ENABLE_LEFT", "{name}");
        let found = |task: &str| {
            playback.changes.iter().any(|change| change.task == task && change.message.contains(text))
        };
        let changes: Vec<_> =
            playback.changes.iter().map(|change| (change.ms(), change.message.as_str())).collect();
        assert!(found(TURN), "{name}: {changes:?}");
    }
}

#[test]
fn the_side_of_a_broken_bulb_does_not_depend_on_the_words_of_a_text() {
    let mut settings = read_profile("tesla_model3");
    for signal in &mut settings.gateway.lights.turn_faults.signals {
        signal.text = signal.text.replace("left", "linke").replace("right", "rechte");
    }
    let playback = play_settings(&settings, "5 stalk left\n10 fault bulb left", 20);
    let names = |side: &str| playback.changes.iter().any(|change| change.message.contains(side));
    assert!(names("linke front turn lamp") && !names("rechte front turn lamp"), "{:?}", playback.changes);
}

#[test]
fn bus_off_is_seen_and_ends() {
    let playback = play("pacmod", "5 stalk left\n10 fault bus-off 5", 20);
    let bus = |from: u64, to: u64| {
        let changes = playback.changes.iter().filter(move |change| (from..to).contains(&change.ms()));
        changes.map(|change| change.message.clone()).collect::<Vec<_>>()
    };
    assert!(bus(9_900, 10_100).iter().any(|message| message.contains("bus-off")), "{:?}", bus(9_000, 16_000));
    assert_eq!((at(&playback.turn, 14_900), at(&playback.turn, 19_900)), ("stops", "ENABLE_LEFT"));
}

#[test]
fn the_same_script_gives_the_same_log_and_another_seed_another_one() {
    let settings = profile("subaru_global");
    let script = "1 fault drop 0.5\n1 fault corrupt 0.5\n2 stalk left";
    let log = drive(settings, script, 10);
    assert_eq!(log, drive(settings, script, 10));
    assert_ne!(log, drive(settings, "1 fault drop 0.5\n1 fault corrupt 0.4\n2 stalk left", 10));
    // Which frames are lost does not depend on which ones are wrong.
    let stamps = |log: &str| log.lines().map(|line| line[..20].to_owned()).collect::<Vec<_>>();
    assert_eq!(stamps(&log), stamps(&drive(settings, "1 fault drop 0.5\n2 stalk left", 10)));
}
