//! Reports on velocity, steering, gear, control mode and doors: what is published, and what is not.

// Physical values become raw ones, which are small.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss
)]
#![allow(clippy::wildcard_enum_match_arm, clippy::float_cmp)]

pub(crate) mod car;
mod closed_loop;
mod faults;
mod four_views;
mod kinematics;
mod truth;
mod views;
mod wheels;

use gateway_base::diagnostics::Level;
use gateway_base::time::MonoTime;
use gateway_core::control_mode::ControlMode;
use gateway_core::vehicle_report::Step;
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::doors::DoorState;
use gateway_core::vehicle_status::gear::Gear;
use gateway_core::vehicle_status::output::VehicleStatusOutput;

use car::{Car, Listener, RawFrame, settings};

const DRIVE: u8 = 3;
const NEUTRAL: u8 = 2;
const REVERSE: u8 = 1;
const PARK: u8 = 0;

fn driving(speed_mps: f64, tire_rad: f64) -> Car {
    Car { speed_mps, tire_rad, gear: if speed_mps < 0.0 { REVERSE } else { DRIVE }, ..Car::default() }
}

fn listener() -> Listener {
    Listener::new(settings(&[], &[]))
}

#[track_caller]
fn assert_near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "found {found}, expected {expected}");
}

#[test]
fn forward_and_backward_have_their_signs() {
    for (speed, tire) in [(10.0, 0.1), (3.0, -0.3), (-2.0, 0.3), (-1.5, -0.2), (0.0, 0.2)] {
        let mut listener = listener();
        let mut car = driving(speed, tire);
        listener.hold(&mut car, 500);
        let (found, rate) = listener.velocity().unwrap();
        assert_near(found, speed, 0.01);
        assert_near(rate, car.heading_rate_radps(), 0.002);
        assert_near(listener.tire().unwrap(), tire, 0.0002);
        let levels = [StatusReport::Velocity, StatusReport::Steering].map(|report| listener.status(report));
        assert!(levels.iter().all(|status| *status == (Level::Ok, "publishing".to_owned())), "{levels:?}");
    }
}

#[test]
fn velocity_follows_the_frames_at_50_hz_at_most_and_is_never_repeated() {
    let mut listener = listener();
    let mut car = driving(10.0, 0.0);
    listener.hold(&mut car, 2_000);
    let stamps = listener.velocity_stamps();
    assert!((98..=101).contains(&stamps.len()), "{}", stamps.len());
    assert!(stamps.windows(2).all(|pair| pair[0].as_nanos() < pair[1].as_nanos()));
    listener.pass_until(10_000);
    assert_eq!(listener.velocity_stamps().len(), stamps.len(), "not without frames");
    let (level, message) = listener.status(StatusReport::Velocity);
    assert_eq!(level, Level::Error);
    assert!(message.contains("WHEELS is stale, silent for more than 50 ms"), "{message}");
    assert_eq!(listener.velocity(), None);
}

#[test]
fn a_vehicle_that_rolls_without_a_gear_goes_on_as_before_until_it_stops() {
    let mut listener = listener();
    let mut car = driving(-2.0, 0.0);
    listener.hold(&mut car, 300);
    car.gear = NEUTRAL;
    listener.hold(&mut car, 300);
    assert_near(listener.velocity().unwrap().0, -2.0, 0.01);
    car.speed_mps = 0.0;
    listener.hold(&mut car, 300);
    assert_eq!(listener.velocity().unwrap().0, 0.0);
    car.speed_mps = 0.5;
    listener.hold(&mut car, 300);
    assert_eq!(listener.velocity(), None, "forward or backward?");
    let (level, message) = listener.status(StatusReport::Velocity);
    assert_eq!(level, Level::Error);
    assert!(message.starts_with("direction: unknown: the vehicle began to roll"), "{message}");
    car.gear = PARK;
    listener.hold(&mut car, 300);
    assert_eq!(listener.velocity(), None);
    car.gear = DRIVE;
    listener.hold(&mut car, 300);
    assert_near(listener.velocity().unwrap().0, 0.5, 0.01);
}

#[test]
fn without_a_gear_no_speed_is_published_unless_it_is_zero() {
    let mut listener = listener();
    let mut car = driving(5.0, 0.0);
    car.gear = 15;
    listener.hold(&mut car, 300);
    assert_eq!(listener.velocity(), None);
    let (_, message) = listener.status(StatusReport::Velocity);
    assert!(message.contains("direction: unknown: GEAR.GEAR = 15 (0xF) means not available"), "{message}");
    car.speed_mps = 0.0;
    listener.hold(&mut car, 300);
    assert_eq!(listener.velocity().map(|(speed, _)| speed), Some(0.0));
}

#[test]
fn the_zero_of_the_yaw_rate_is_found_at_standstill() {
    let mut listener = listener();
    let mut car = Car { yaw_zero_radps: 0.02, ..driving(0.0, 0.0) };
    listener.hold(&mut car, 300);
    assert_near(listener.velocity().unwrap().1, 0.02, 0.001);
    listener.hold(&mut car, 700);
    car.speed_mps = 10.0;
    listener.hold(&mut car, 300);
    assert_near(listener.velocity().unwrap().1, 0.0, 0.001);
    car.yaw_zero_radps = 0.5;
    car.speed_mps = 0.0;
    listener.hold(&mut car, 2_000);
    assert_near(listener.velocity().unwrap().1, 0.48, 0.002);
}

#[test]
fn a_faulty_yaw_rate_gives_way_to_the_steering_and_without_both_nothing_is_published() {
    let mut listener = listener();
    let mut car = Car { yaw_quality: 0, ..driving(8.0, 0.1) };
    listener.hold(&mut car, 300);
    assert_near(listener.velocity().unwrap().1, car.heading_rate_radps(), 0.002);
    let (level, message) = listener.status(StatusReport::Velocity);
    assert_eq!(level, Level::Warn);
    assert_eq!(
        message,
        "fallback heading rate of the steering: hardware fault: yaw rate sensor: YAW.QUALITY = 0"
    );
    car.calibrated = 2;
    listener.hold(&mut car, 300);
    assert_eq!((listener.velocity(), listener.tire()), (None, None));
    let (level, message) = listener.status(StatusReport::Velocity);
    assert_eq!(level, Level::Error);
    assert!(message.starts_with("heading rate: hardware fault: yaw rate sensor"), "{message}");

    let zero = [("[velocity]\n", "[velocity]\nheading_rate_unknown = \"zero\"\n")];
    let mut listener = Listener::new(settings(&zero, &[]));
    listener.hold(&mut car, 300);
    assert_near(listener.velocity().unwrap().0, 8.0, 0.01);
    assert_eq!(listener.velocity().unwrap().1, 0.0);
    let (level, message) = listener.status(StatusReport::Velocity);
    assert!(level == Level::Warn && message.starts_with("heading rate published as 0:"), "{message}");
}

#[test]
fn the_speedometer_takes_over_while_a_wheel_has_no_value() {
    for (raw, kind) in [(65535, "unknown"), (65534, "invalid"), (40000, "invalid")] {
        let mut listener = listener();
        let mut car = driving(8.0, 0.0);
        listener.drive(
            &mut car,
            300,
            |_, _| {},
            |mut frame, _| {
                if frame.id == 256 {
                    frame.set_word(2, raw);
                }
                Some(frame)
            },
        );
        assert_near(listener.velocity().unwrap().0, 8.0, 0.01);
        let (level, message) = listener.status(StatusReport::Velocity);
        assert_eq!(level, Level::Warn);
        assert!(
            message.starts_with(&format!("fallback speedometer: {kind}: WHEELS.RL = {raw}")),
            "{message}"
        );
    }
}

#[test]
fn a_part_that_is_older_than_the_skew_is_not_used() {
    let slow = [
        ("[turn]", "[message.YAW]\ntimeout_ms = 1000\n[turn]"),
        ("[[velocity.heading_rate]]\nkind = \"steering\"\n", ""),
    ];
    let mut listener = Listener::new(settings(&slow, &[]));
    let mut car = driving(8.0, 0.0);
    listener.hold(&mut car, 200);
    assert!(listener.velocity().is_some());
    listener.drive(&mut car, 90, |_, _| {}, |frame, _| Some(frame).filter(|frame| frame.id != 258));
    assert!(listener.velocity().is_some(), "100 ms");
    listener.drive(&mut car, 50, |_, _| {}, |frame, _| Some(frame).filter(|frame| frame.id != 258));
    assert_eq!(listener.velocity(), None);
    let (_, message) = listener.status(StatusReport::Velocity);
    assert_eq!(message, "heading rate: unknown: its last frame is much older than that of the speed");
}

#[test]
fn steering_needs_a_ratio_in_one_of_three_forms() {
    let ratio = "steering_ratio = 16.0";
    let mut listener = Listener::new(settings(&[], &[(ratio, "")]));
    let mut car = driving(8.0, 0.2);
    listener.hold(&mut car, 300);
    assert_eq!(listener.tire(), None);
    let status = listener.status(StatusReport::Steering);
    let expected = "not configured: [vehicle_geometry] steering_ratio is missing, and without this report \
                    Autoware's /api/vehicle/status never appears";
    assert_eq!(status, (Level::Warn, expected.to_owned()));
    // No dimension at all means the same.
    let geometry = "[vehicle_geometry]\nwheel_base_m = 2.7\nwheel_tread_m = 1.6\nsteering_ratio = 16.0\n";
    let mut bare = Listener::new(settings(&[], &[(geometry, "")]));
    bare.hold(&mut driving(8.0, 0.2), 300);
    assert_eq!(bare.status(StatusReport::Steering), status);
    let wheel_deg = (0.2_f64 * 16.0).to_degrees();
    let forms = [
        (
            "steering_table = [{ wheel_deg = -400.0, tire_deg = -30.0 }, { wheel_deg = 0.0, tire_deg = 0.0 }, \
             { wheel_deg = 200.0, tire_deg = 12.0 }]"
                .to_owned(),
            (wheel_deg / 200.0 * 12.0).to_radians(),
        ),
        (
            "vgr_coef_a = 15.713\nvgr_coef_b = 0.053\nvgr_coef_c = 0.042".to_owned(),
            3.2 / (15.713 + 0.053 * 64.0 - 0.042 * 3.2),
        ),
        ("steering_ratio = 12.8\nsteering_offset_deg = 1.0".to_owned(), 0.25 - 1_f64.to_radians()),
    ];
    for (form, expected) in forms {
        let mut listener = Listener::new(settings(&[], &[(ratio, &form)]));
        listener.hold(&mut car, 300);
        assert_near(listener.tire().unwrap(), expected, 0.001);
    }
    let table =
        "steering_table = [{ wheel_deg = -100.0, tire_deg = -6.0 }, { wheel_deg = 100.0, tire_deg = 6.0 }]";
    let mut listener = Listener::new(settings(&[], &[(ratio, table)]));
    listener.hold(&mut car, 300);
    assert_eq!(listener.tire(), None, "beyond the table");
    let mut listener =
        Listener::new(settings(&[], &[(ratio, "steering_ratio = 16.0\nmax_steer_angle_rad = 0.15")]));
    listener.hold(&mut car, 300);
    let (_, message) = listener.status(StatusReport::Steering);
    assert_eq!(message, "invalid: STEER.ANGLE is beyond what the vehicle can do");
}

#[test]
fn a_listed_ratio_is_published_with_a_warning_until_the_file_has_one() {
    let shown = |geometry: &str| {
        let mut listener = Listener::new(settings(&[], &[("steering_ratio = 16.0", geometry)]));
        let mut car = driving(8.0, 0.2);
        listener.hold(&mut car, 300);
        let status = listener.full_status(StatusReport::Steering);
        let value = |key| status.values.iter().find(|(of, _)| *of == key).map(|(_, value)| value.clone());
        let values = [value("ratio"), value("ratio_source")].map(Option::unwrap);
        (listener.tire().unwrap(), status.level, status.message.clone(), values)
    };
    let car = "car = \"Toyota RAV4 2018\"";
    let (tire, level, message, values) = shown(car);
    assert_near(tire, 0.2 * 16.0 / 16.88, 0.001);
    let expected = "publishing; the steering ratio 16.88 is from opendbc's list for Toyota RAV4 2017–2018, not \
                    measured on this car";
    assert_eq!((level, message.as_str()), (Level::Warn, expected));
    assert_eq!(values, ["16.88", "listed"]);
    for (geometry, origin) in [
        ("steering_ratio = 12.8".to_owned(), "configured"),
        (format!("{car}\nsteering_ratio = 12.8"), "configured"),
        (format!("{car}\nsteering_ratio = 12.8\nmeasured = \"3 turns\""), "measured"),
    ] {
        let (tire, level, message, values) = shown(&geometry);
        assert_near(tire, 0.25, 0.001);
        assert_eq!((level, message.as_str()), (Level::Ok, "publishing"));
        assert_eq!(values, ["12.8", origin]);
    }
}

#[test]
fn a_gear_between_two_others_is_withheld_and_invalid_after_a_while() {
    let mut listener = listener();
    let mut car = Car::default();
    listener.hold(&mut car, 300);
    let published = |listener: &Listener| listener.snapshot().vehicle_status.gear.unwrap().published;
    assert_eq!(published(&listener), Some(Gear::Park));
    car.gear = 14;
    listener.hold(&mut car, 1_000);
    assert_eq!(published(&listener), None);
    assert_eq!(
        listener.status(StatusReport::Gear),
        (Level::Warn, "shifting: GEAR.GEAR is between gears".to_owned())
    );
    listener.hold(&mut car, 1_500);
    assert_eq!(
        listener.status(StatusReport::Gear),
        (Level::Error, "invalid: GEAR.GEAR stays between gears".to_owned())
    );
    car.gear = REVERSE;
    listener.hold(&mut car, 200);
    assert_eq!(published(&listener), Some(Gear::Reverse));
    car.gear = 9;
    listener.hold(&mut car, 200);
    assert_eq!(published(&listener), None, "no made-up gear");
    assert_eq!(
        listener.status(StatusReport::Gear),
        (Level::Error, "invalid: GEAR.GEAR = 9 is not a defined value".to_owned())
    );
    let none = listener.outputs.iter().any(
        |(_, output)| matches!(output, VehicleStatusOutput::Gear(Step::Publish(gear, _)) if *gear as u8 == 0),
    );
    assert!(!none, "GearReport NONE is never sent");
}

#[test]
fn a_gearbox_that_shows_only_reverse_is_believed_no_further() {
    let gears = "park = [0]\nreverse = [1]\nneutral = [2]\ndrive = [3]\nbetween = [14]\nnot_available = [15]";
    for (otherwise, expected) in [("", None), ("\notherwise = \"drive\"", Some(Gear::Drive))] {
        let only = format!("reverse = [1]\nnot_reverse = [3]{otherwise}");
        let mut listener = Listener::new(settings(&[(gears, &only)], &[]));
        let mut car = driving(0.0, 0.0);
        let published = |listener: &Listener| listener.snapshot().vehicle_status.gear.unwrap().published;
        listener.hold(&mut car, 300);
        assert_eq!(published(&listener), expected);
        assert_ne!(listener.status(StatusReport::Gear).0, Level::Error);
        car.gear = REVERSE;
        listener.hold(&mut car, 300);
        assert_eq!(published(&listener), Some(Gear::Reverse));
    }
}

#[test]
fn autonomous_needs_every_bit_known_and_on() {
    // Steering, accelerator, brake, ready, override, fault; 2 is not a defined value.
    let modes = [
        ([1, 1, 1, 1, 0, 0], Some(ControlMode::Autonomous)),
        ([1, 0, 0, 1, 0, 0], Some(ControlMode::AutonomousSteerOnly)),
        ([0, 1, 1, 1, 0, 0], Some(ControlMode::AutonomousVelocityOnly)),
        ([0, 0, 0, 1, 0, 0], Some(ControlMode::Manual)),
        ([1, 1, 0, 1, 0, 0], Some(ControlMode::NotReady)),
        ([0, 0, 1, 1, 0, 0], Some(ControlMode::NotReady)),
        ([1, 1, 1, 0, 0, 0], Some(ControlMode::NotReady)),
        ([1, 1, 1, 1, 0, 1], Some(ControlMode::NotReady)),
        ([1, 1, 1, 1, 1, 0], Some(ControlMode::Disengaged)),
        ([2, 1, 1, 1, 0, 0], None),
        ([1, 1, 2, 1, 0, 0], None),
        ([1, 1, 1, 2, 0, 0], None),
        ([1, 1, 1, 1, 2, 0], None),
        ([0, 0, 0, 1, 0, 2], None),
    ];
    for (wire, expected) in modes {
        let mut listener = listener();
        let mut car = Car { wire, ..Car::default() };
        listener.hold(&mut car, 300);
        let snapshot = listener.snapshot().vehicle_status.control_mode.unwrap();
        assert_eq!(snapshot.published, expected, "{wire:?}");
        assert_eq!(snapshot.level == Level::Error, expected.is_none(), "{wire:?}");
        let not_ready = [("[control_mode]\n", "[control_mode]\non_unknown = \"not_ready\"\n")];
        let mut listener = Listener::new(settings(&not_ready, &[]));
        listener.hold(&mut car, 300);
        let snapshot = listener.snapshot().vehicle_status.control_mode.unwrap();
        assert_eq!(snapshot.published, expected.or(Some(ControlMode::NotReady)), "{wire:?}");
        assert_eq!(snapshot.level == Level::Error, expected.is_none(), "{wire:?}");
    }
}

#[test]
fn each_door_has_a_word_for_what_is_not_known() {
    let states = |listener: &Listener| {
        let doors = listener.snapshot().vehicle_status.doors.unwrap().published;
        doors.map(|doors| doors.into_iter().map(|door| door.state).collect::<Vec<_>>())
    };
    for (raw, expected) in [
        ([0, 1], [DoorState::Closed, DoorState::Opened]),
        ([1, 0], [DoorState::Opened, DoorState::Closed]),
        ([3, 0], [DoorState::NotAvailable, DoorState::Closed]),
        ([2, 0], [DoorState::Unknown, DoorState::Closed]),
        ([0, 3], [DoorState::Closed, DoorState::Unknown]),
    ] {
        let mut listener = listener();
        assert_eq!(states(&listener), None, "nothing received");
        let mut car = Car { doors: raw, ..Car::default() };
        listener.hold(&mut car, 300);
        assert_eq!(states(&listener), Some(expected.to_vec()), "{raw:?}");
        listener.pass_until(5_000);
        assert_eq!(states(&listener), None, "stale");
    }
}

#[test]
fn what_the_profile_does_not_describe_is_not_reported() {
    let (lights, _) = car::PROFILE.split_once("[velocity]").unwrap();
    let files = crate::support::files::MemoryFiles::vehicle(lights, car::DBC);
    let mut listener = Listener::new(files.settings());
    let mut car = driving(5.0, 0.0);
    listener.hold(&mut car, 300);
    assert_eq!(listener.outputs.len(), 0);
    let tasks: Vec<_> =
        listener.gateway.statuses(listener.now.mono).into_iter().map(|status| status.task).collect();
    assert!(!tasks.iter().any(|task| task == "velocity" || task == "gear"), "{tasks:?}");
}

#[test]
fn stamps_are_those_of_the_frames_with_the_speed() {
    let mut listener = listener();
    let mut car = driving(5.0, 0.0);
    listener.hold(&mut car, 300);
    listener.pass_until(305);
    listener.receive(car.frame(258));
    listener.receive(car.frame(259));
    let count = listener.velocity_stamps().len();
    listener.pass_until(312);
    listener.receive(car.frame(256));
    let stamps = listener.velocity_stamps();
    assert_eq!((stamps.len(), stamps.last()), (count + 1, Some(&listener.now.wall)));
    assert_eq!(listener.outputs.last().unwrap().0, MonoTime::from_millis(312));
    let wheels = RawFrame::words(256, [0; 4]);
    listener.receive(wheels);
    assert_eq!(listener.velocity_stamps().len(), count + 1, "at most 50 Hz");
}
