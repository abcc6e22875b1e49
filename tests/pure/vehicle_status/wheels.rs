//! Wheels that contradict each other, and other contradictions whose end could be their own effect.

mod drives;

use std::fmt::Write as _;

use gateway_base::diagnostics::Level;
use gateway_core::vehicle_report::Step;
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use signal_gateway::config::files::Disk;
use signal_gateway::config::{Overrides, load};

use super::car::{Car, Listener, PROFILE, RawFrame, settings};
use super::{DRIVE, NEUTRAL, assert_near};
use crate::pure::vehicles::playback::play_file;
use crate::support::clock::millis;
use crate::support::prerequisite::{require, shared_data};
use crate::support::virtual_gateway::StatusChange;

type Edits = Vec<(String, String)>;

/// The part of the profile from `begin` up to `end`, which an edit takes out.
fn part(begin: &str, end: &str) -> String {
    let (_, from) = PROFILE.split_once(begin).unwrap();
    format!("{begin}{}", from.split_once(end).unwrap().0)
}

/// Leaves out the second source of the speed and the yaw rate sensor: wheels and steering are left.
fn wheels_and_steering() -> Edits {
    let speedometer = part("[[velocity.source]]\nname = \"speedometer\"", "[[velocity.direction]]");
    let yaw_rate =
        part("[[velocity.heading_rate]]\nkind = \"yaw_rate\"", "[[velocity.heading_rate]]\nkind = \"st");
    vec![(speedometer, String::new()), (yaw_rate, String::new())]
}

/// Leaves out the front wheels as well.
fn rear_wheels_and_steering() -> Edits {
    let mut edits = wheels_and_steering();
    edits.push((part("front_left", "rear_left"), String::new()));
    edits
}

fn listener(edits: &Edits) -> Listener {
    let edits: Vec<_> = edits.iter().map(|(from, to)| (from.as_str(), to.as_str())).collect();
    Listener::new(settings(&edits, &[]))
}

/// Raw value of a wheel in the test car, 0.01 km/h.
fn kmh(speed: f64) -> u16 {
    (speed * 100.0).round() as u16
}

/// The changes of a report's status.
fn changes(listener: &Listener, report: StatusReport) -> impl Iterator<Item = &StatusChange> {
    listener.changes.iter().filter(move |change| change.task == report.name())
}

/// What the velocity says in each second: the number of reports, their speeds in km/h, and the messages of
/// its status.
fn seconds(listener: &Listener) -> String {
    let mut table = String::new();
    let mut status = "";
    for second in 0..millis(listener.now.mono) / 1000 {
        let mut count = 0;
        let mut speeds: Vec<String> = Vec::new();
        for (at, output) in &listener.outputs {
            if let VehicleStatusOutput::Velocity(Step::Publish(velocity, _)) = output
                && millis(*at) / 1000 == second
            {
                count += 1;
                let speed = format!("{:.0}", velocity.longitudinal_mps * 3.6);
                if speeds.last() != Some(&speed) {
                    speeds.push(speed);
                }
            }
        }
        let mut messages = Vec::new();
        for change in changes(listener, StatusReport::Velocity) {
            if change.ms() / 1000 == second {
                if change.ms() % 1000 > 0 && messages.is_empty() && second > 0 {
                    messages.push(status);
                }
                messages.push(&change.message);
                status = &change.message;
            }
        }
        if messages.is_empty() {
            messages.push(status);
        }
        writeln!(table, "{second} | {count} | {} | {}", speeds.join(", "), messages.join(" > ")).unwrap();
    }
    table
}

/// A straight drive with 10 km/h for 11 s; from 4 s to 8 s the wheels at these positions read another speed,
/// km/h.
fn ten_kmh_with(edits: &Edits, wheels: &[usize], reading_kmh: f64) -> Listener {
    let mut listener = listener(edits);
    let mut car = Car { speed_mps: 10.0 / 3.6, gear: DRIVE, ..Car::default() };
    listener.drive(
        &mut car,
        11_000,
        |_, _| {},
        |mut frame: RawFrame, now_ms| {
            if frame.id == 256 && (4_000..8_000).contains(&now_ms) {
                for wheel in wheels {
                    frame.set_word(*wheel, kmh(reading_kmh));
                }
            }
            Some(frame)
        },
    );
    listener
}

const CONTRADICT: &str = "invalid: the wheels contradict each other, and nothing tells which of them are right; check the sensors of \
     the wheels and their tyres; a wheel that locks or spins is no fault of theirs";

const AWAITED: &str = "starting: waiting for the first frame of WHEELS (100) on can0, at most 2 s > \
     direction: starting: waiting for the first frame of GEAR (104) on can0, at most 2 s";

/// The table of such a drive: `during` is the speed in the fifth second, before the contradiction has lasted
/// long enough.
fn contradicted_for_four_seconds(during: &str) -> String {
    let mut table = String::new();
    for second in 0..11 {
        let row = match second {
            0 => format!("50 | 10 | {AWAITED} > publishing"),
            4 => format!("50 | {during} | publishing"),
            5..=8 => format!("0 |  | {CONTRADICT}"),
            // The first report after the end shifts the rhythm.
            9 => "51 | 10 | publishing".to_owned(),
            _ => "50 | 10 | publishing".to_owned(),
        };
        writeln!(table, "{second} | {row}").unwrap();
    }
    table
}

#[test]
fn a_locked_rear_axle_is_withheld_from_the_fifth_to_the_ninth_second() {
    let listener = ten_kmh_with(&wheels_and_steering(), &[2, 3], 0.0);
    assert_eq!(seconds(&listener), contradicted_for_four_seconds("0"));
}

#[test]
fn a_spinning_rear_axle_is_withheld_from_the_fifth_to_the_ninth_second() {
    let listener = ten_kmh_with(&wheels_and_steering(), &[2, 3], 30.0);
    assert_eq!(seconds(&listener), contradicted_for_four_seconds("30"));
}

#[test]
fn one_wheel_of_a_single_axle_that_reads_0_is_not_believed() {
    for wheel in [2, 3] {
        let listener = ten_kmh_with(&rear_wheels_and_steering(), &[wheel], 0.0);
        assert_eq!(seconds(&listener), contradicted_for_four_seconds("5"));
    }
}

fn edited(edits: &[(&str, &str)], more: Edits) -> Edits {
    edits.iter().map(|(from, to)| ((*from).to_owned(), (*to).to_owned())).chain(more).collect()
}

/// Leaves out the second source of the speed.
fn without_speedometer() -> Edits {
    wheels_and_steering().into_iter().take(1).collect()
}

/// Drives with wheels that read something else.
fn drive_with(
    listener: &mut Listener,
    car: &mut Car,
    duration_ms: u64,
    reading: impl Fn([f64; 4]) -> [f64; 4],
) {
    let readings = reading(car.wheels_mps());
    listener.drive(
        car,
        duration_ms,
        |_, _| {},
        |mut frame, _| {
            if frame.id == 256 {
                (0..4).for_each(|wheel| frame.set_word(wheel, kmh(readings[wheel] * 3.6)));
            }
            Some(frame)
        },
    );
}

/// Replaces the speeds of some wheels.
fn with(mut speeds: [f64; 4], wheels: &[usize], change: impl Fn(f64) -> f64) -> [f64; 4] {
    for wheel in wheels {
        speeds[*wheel] = change(speeds[*wheel]);
    }
    speeds
}

/// What a profile reads.
struct Variant {
    name: &'static str,
    edits: Edits,
    wheels: &'static [usize],
    /// The steering or a sensor gives the heading rate.
    is_turn_known: bool,
}

fn variants() -> Vec<Variant> {
    let all = &[0, 1, 2, 3];
    let edit = |from: &str, to: &str| (from.to_owned(), to.to_owned());
    let wheels = "kind = \"wheels\"\nfront_left";
    let mut all_used = wheels_and_steering();
    all_used.push(edit(wheels, "kind = \"wheels\"\nuse = \"all\"\nfront_left"));
    let mut front = wheels_and_steering();
    front.push((part("rear_left", "[[velocity.source]]\nname = \"speed"), String::new()));
    front.push(edit(wheels, "kind = \"wheels\"\nuse = \"front_projected\"\nfront_left"));
    let mut rear_alone = rear_wheels_and_steering();
    rear_alone.push(edit(
        "[[velocity.heading_rate]]\nkind = \"steering\"\n",
        "[[velocity.heading_rate]]\nkind = \"wheels\"\n",
    ));
    rear_alone.push((part("[steering]", "[gear]"), String::new()));
    // A heading rate by a dead wheel is often beyond what a vehicle can do.
    rear_alone.push(edit("[velocity]\n", "[velocity]\nheading_rate_unknown = \"zero\"\n"));
    vec![
        Variant { name: "four wheels", edits: wheels_and_steering(), wheels: all, is_turn_known: true },
        Variant { name: "all wheels used", edits: all_used, wheels: all, is_turn_known: true },
        Variant { name: "everything", edits: Edits::new(), wheels: all, is_turn_known: true },
        Variant {
            name: "rear wheels",
            edits: rear_wheels_and_steering(),
            wheels: &[2, 3],
            is_turn_known: true,
        },
        Variant { name: "rear wheels alone", edits: rear_alone, wheels: &[2, 3], is_turn_known: false },
        Variant { name: "front wheels", edits: front, wheels: &[0, 1], is_turn_known: true },
    ]
}

#[test]
fn sensors_that_start_at_a_metre_a_second_contradict_nothing() {
    for variant in variants() {
        for (speed_mps, tire_rad) in [(0.6, 0.0), (0.95, 0.0), (1.05, 0.0), (0.95, 0.5), (1.3, 0.5)] {
            let mut listener = listener(&variant.edits);
            let mut car = Car { speed_mps, tire_rad, gear: DRIVE, ..Car::default() };
            drive_with(&mut listener, &mut car, 3_000, |speeds| {
                speeds.map(|speed| if speed < 1.0 { 0.0 } else { speed })
            });
            let message = listener.status(StatusReport::Velocity).1;
            let is_doubted = message.contains("contradict") || message.contains("as the others do");
            assert!(!is_doubted, "{}: {speed_mps} m/s, {tire_rad}: {message}", variant.name);
        }
    }
}

#[test]
fn a_dead_wheel_is_still_left_out_after_a_stop() {
    let mut listener = listener(&wheels_and_steering());
    let dead = |speeds| with(speeds, &[2], |_| 0.0);
    for (speed_mps, duration_ms) in [(3.0, 2_000), (0.0, 3_000), (3.0, 2_000)] {
        let mut car = Car { speed_mps, gear: DRIVE, ..Car::default() };
        drive_with(&mut listener, &mut car, duration_ms, dead);
    }
    for (at, output) in &listener.outputs {
        if let VehicleStatusOutput::Velocity(Step::Publish(velocity, _)) = output
            && millis(*at) >= 1_100
        {
            let is_standing = (2_000..5_000).contains(&millis(*at));
            assert_near(velocity.longitudinal_mps, if is_standing { 0.0 } else { 3.0 }, 0.01);
        }
    }
    let expected =
        "the rear left wheel does not move as the others do: check the sensor of the wheel and its tyre";
    assert_eq!(listener.status(StatusReport::Velocity), (Level::Warn, expected.to_owned()));
    let mut car = Car { speed_mps: 3.0, gear: DRIVE, ..Car::default() };
    listener.hold(&mut car, 1_100);
    assert_eq!(listener.status(StatusReport::Velocity).1, "publishing");
}

#[test]
fn no_zero_of_the_yaw_rate_is_found_while_a_locked_axle_reads_0() {
    let mut listener = listener(&without_speedometer());
    let mut car = Car { speed_mps: 3.0, tire_rad: 0.07, gear: DRIVE, ..Car::default() };
    listener.hold(&mut car, 1_000);
    drive_with(&mut listener, &mut car, 900, |speeds| with(speeds, &[2, 3], |_| 0.0));
    listener.hold(&mut car, 300);
    assert_near(listener.velocity().unwrap().1, car.heading_rate_radps(), 0.003);
}

#[test]
fn a_locked_axle_does_not_end_the_motion_of_a_vehicle_in_neutral() {
    let mut listener = listener(&wheels_and_steering());
    let mut car = Car { speed_mps: -3.0, gear: super::REVERSE, ..Car::default() };
    listener.hold(&mut car, 1_000);
    car.gear = NEUTRAL;
    drive_with(&mut listener, &mut car, 900, |speeds| with(speeds, &[2, 3], |_| 0.0));
    listener.hold(&mut car, 300);
    assert_near(listener.velocity().unwrap().0, -3.0, 0.01);
}

#[test]
fn a_wheel_that_is_left_out_gives_no_heading_rate() {
    let by_wheels = (
        "[[velocity.heading_rate]]\nkind = \"steering\"\n",
        "[[velocity.heading_rate]]\nkind = \"wheels\"\n",
    );
    let mut edits = wheels_and_steering();
    edits.extend(edited(&[by_wheels], Edits::new()));
    let mut listener = listener(&edits);
    let mut car = Car { speed_mps: 2.5, gear: DRIVE, ..Car::default() };
    drive_with(&mut listener, &mut car, 2_000, |speeds| with(speeds, &[2], |_| 0.0));
    assert_eq!(listener.velocity(), None);
    let expected = "heading rate: invalid: the rear left wheel does not move as the others do; check the sensor of the wheel and its tyre";
    assert_eq!(listener.status(StatusReport::Velocity), (Level::Error, expected.to_owned()));
}

#[test]
fn a_steering_ratio_is_not_made_of_a_contradicted_speed() {
    let edits = wheels_and_steering();
    let edits: Vec<_> = edits.iter().map(|(from, to)| (from.as_str(), to.as_str())).collect();
    let by_speed = ("steering_ratio = 16.0", "vgr_coef_a = 15.0\nvgr_coef_b = 0.05\nvgr_coef_c = 0.0");
    let mut listener = Listener::new(settings(&edits, &[by_speed]));
    let mut car = Car { speed_mps: 3.0, tire_rad: 0.05, gear: DRIVE, ..Car::default() };
    drive_with(&mut listener, &mut car, 8_000, |speeds| with(speeds, &[2, 3], |speed| speed + 8.0));
    let expected = "unknown: the steering ratio depends on the speed, which is unknown";
    assert_eq!(listener.status(StatusReport::Steering), (Level::Error, expected.to_owned()));
    let of_steering: Vec<_> = changes(&listener, StatusReport::Steering).map(StatusChange::ms).collect();
    assert_eq!(of_steering.last(), Some(&1_000));
    listener.hold(&mut car, 1_100);
    assert!(listener.tire().is_some() && listener.velocity().is_some());
}

#[test]
fn a_frozen_yaw_rate_is_not_used_again_when_the_vehicle_slows_down() {
    let mut listener = listener(&without_speedometer());
    let mut car = Car { speed_mps: 8.0, gear: DRIVE, ..Car::default() };
    let frozen = |mut frame: RawFrame, _| {
        if frame.id == 258 {
            frame.set_word(0, 100);
        }
        Some(frame)
    };
    listener.drive(
        &mut car,
        5_000,
        |car, ms| car.tire_rad = if ms % 2_000 < 1_000 { 0.0 } else { 0.05 },
        frozen,
    );
    let expected =
        "fallback heading rate of the steering: invalid: the yaw rate stays the same while the vehicle moves";
    assert!(listener.status(StatusReport::Velocity).1.starts_with(expected));
    car.speed_mps = 2.0;
    listener.drive(&mut car, 3_000, |_, _| {}, frozen);
    assert!(listener.status(StatusReport::Velocity).1.starts_with(expected));
    listener.hold(&mut car, 500);
    assert_eq!(listener.status(StatusReport::Velocity).1, "publishing");
}

#[test]
fn two_sources_of_the_speed_contradict_each_other_until_they_agree_for_a_second() {
    let mut listener = listener(&Edits::new());
    let mut car = Car { speed_mps: 8.0, gear: DRIVE, ..Car::default() };
    listener.drive(
        &mut car,
        8_000,
        |_, _| {},
        |mut frame, now_ms| {
            match frame.id {
                // A frame without a value, and a moment of agreement.
                256 if now_ms % 1_500 == 0 => frame.set_word(2, u16::MAX),
                257 if now_ms < 6_000 && now_ms % 1_500 > 100 => frame.set_word(0, 1_000),
                _ => {}
            }
            Some(frame)
        },
    );
    let table = seconds(&listener);
    let withheld = "0 |  | invalid: two sources of the speed differ by more than 30 % and 1 m/s";
    for second in 3..7 {
        let row = table.lines().nth(second).unwrap();
        assert!(row.starts_with(&format!("{second} | {withheld}")), "{table}");
    }
    assert!(table.lines().nth(7).unwrap().starts_with("7 | 51 | 29 | "), "{table}");
}

#[test]
fn a_speed_that_jumps_with_each_frame_is_withheld_all_the_time() {
    let mut listener = listener(&edited(&[], without_speedometer()));
    let mut car = Car { speed_mps: 3.0, gear: DRIVE, ..Car::default() };
    listener.hold(&mut car, 1_000);
    listener.drive(
        &mut car,
        4_000,
        |car, ms| car.speed_mps = if ms % 40 < 20 { 3.0 } else { 30.0 },
        |frame, _| Some(frame),
    );
    let table = seconds(&listener);
    for second in 2..5 {
        let expected = format!("{second} | 0 |  | invalid: the speed changes by more than 30 m/s²");
        assert!(table.lines().nth(second).unwrap().starts_with(&expected), "{table}");
    }
}

#[test]
fn a_gearbox_between_gears_is_invalid_whatever_the_next_source_says() {
    let gear = part("[gear]", "[[doors.door]]");
    let between = gear.replace("[gear]", "[[gear.source]]\nname = \"gearbox\"");
    let lever =
        "[[gear.source]]\nname = \"lever\"\nsignal = \"WIRE.FAULT\"\npark = [1]\nnot_available = [0]\n\n";
    let mut listener = listener(&vec![(gear, format!("{between}{lever}"))]);
    let mut car = Car { gear: 14, ..Car::default() };
    listener.hold(&mut car, 1_000);
    assert_eq!(listener.status(StatusReport::Gear).1, "shifting: GEAR.GEAR is between gears");
    listener.hold(&mut car, 1_500);
    let expected = "invalid: GEAR.GEAR stays between gears";
    assert_eq!(listener.status(StatusReport::Gear), (Level::Error, expected.to_owned()));
}

#[test]
fn a_speed_above_that_of_each_source_has_a_true_reason() {
    let below = ("kind = \"wheels\"\n", "kind = \"wheels\"\nbelow_mps = 1.0\n");
    let mut listener = listener(&edited(&[below], without_speedometer()));
    let mut car = Car { speed_mps: 3.0, gear: DRIVE, ..Car::default() };
    listener.hold(&mut car, 500);
    let expected = "unknown: each source counts only while it reads a lower speed";
    assert_eq!(listener.status(StatusReport::Velocity), (Level::Error, expected.to_owned()));
}

#[test]
fn recorded_drives_are_judged_as_made_ones() {
    let folder = require!(shared_data()).join("cases");
    let settings = load(&Disk, &folder.join("camp4_cfg.toml"), &Overrides::default()).unwrap();
    for (name, contradicted) in [("rear_locked.log", 0.0), ("rear_spin.log", 30.0)] {
        let mut counts = [0; 9];
        let playback = play_file(&settings, &folder.join(name));
        for (ms, output) in &playback.status {
            let VehicleStatusOutput::Velocity(Step::Publish(velocity, _)) = output else { continue };
            let second = usize::try_from(ms / 1000).unwrap();
            counts[second.min(8)] += 1;
            assert_near(velocity.longitudinal_mps * 3.6, if second == 4 { contradicted } else { 10.0 }, 0.01);
        }
        // The recording ends at 9.0 s, before the axles have agreed for a second.
        assert_eq!(
            counts.map(|count| count > 0),
            [true, true, true, true, true, false, false, false, false],
            "{name}"
        );
        let errors = playback
            .changes_of("velocity")
            .filter(|change| change.level == Level::Error && change.ms() > 100);
        let errors: Vec<_> = errors.map(|change| (change.ms() / 100, change.message.as_str())).collect();
        assert_eq!(errors, [(50, CONTRADICT)], "{name}");
    }
}
