//! Tests bytes and JSON of the messages about the vehicle.

use super::golden::{STAMP, Wire, cdr, string, with_stamp};
use super::{ToRos as _, diagnostic_array};
use crate::process_status::catalogue::LOG;
use gateway_base::diagnostics::{Diagnostics, Level, Status};
use gateway_base::time::WallStamp;
use gateway_core::control_mode::ControlMode;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_status::doors::{DoorState, DoorStates};
use gateway_core::vehicle_status::gear::Gear;
use gateway_core::vehicle_status::steering::TireAngle;
use gateway_core::vehicle_status::velocity::Velocity;
use ros_messages::autoware_adapi_v1_msgs::DoorStatus;
use ros_messages::autoware_vehicle_msgs::{ControlModeReport, GearReport};
use ros_messages::diagnostic_msgs::DiagnosticArray;
use turn_signal::light_command::Numbered as _;

#[test]
fn every_turn_state_has_its_bytes() {
    for (state, byte) in
        [(TurnIndicators::Disable, 1), (TurnIndicators::EnableLeft, 2), (TurnIndicators::EnableRight, 3)]
    {
        assert_eq!(cdr(&state.to_ros(STAMP)), with_stamp(&[byte]));
    }
}

#[test]
fn every_hazard_state_has_its_bytes() {
    for (state, byte) in [(HazardLights::Disable, 1), (HazardLights::Enable, 2)] {
        assert_eq!(cdr(&state.to_ros(STAMP)), with_stamp(&[byte]));
    }
}

#[test]
fn a_stamp_before_the_epoch_is_negative_seconds_and_positive_nanoseconds() {
    let report = TurnIndicators::Disable.to_ros(WallStamp::from_nanos(-1));
    assert_eq!(cdr(&report), [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xC9, 0x9A, 0x3B, 1]);
}

#[test]
fn velocity_is_at_base_link_with_its_sign_and_no_lateral_part() {
    let velocity = Velocity { longitudinal_mps: -2.5, heading_rate_radps: 0.1 };
    let expected = Wire::default().stamp().text("base_link").singles(&[-2.5, 0.0, 0.1]);
    assert_eq!(cdr(&velocity.to_ros(STAMP)), expected.done());
}

#[test]
fn steering_angle_has_the_nearest_single_precision_number() {
    let report = TireAngle(-0.3).to_ros(STAMP);
    assert_eq!(cdr(&report), Wire::default().stamp().singles(&[-0.3]).done());
}

#[test]
fn every_gear_has_the_constant_of_its_name_and_none_has_the_zero() {
    const CONSTANTS: [(Gear, u8); 24] = [
        (Gear::Neutral, GearReport::NEUTRAL),
        (Gear::Drive, GearReport::DRIVE),
        (Gear::Drive2, GearReport::DRIVE_2),
        (Gear::Drive3, GearReport::DRIVE_3),
        (Gear::Drive4, GearReport::DRIVE_4),
        (Gear::Drive5, GearReport::DRIVE_5),
        (Gear::Drive6, GearReport::DRIVE_6),
        (Gear::Drive7, GearReport::DRIVE_7),
        (Gear::Drive8, GearReport::DRIVE_8),
        (Gear::Drive9, GearReport::DRIVE_9),
        (Gear::Drive10, GearReport::DRIVE_10),
        (Gear::Drive11, GearReport::DRIVE_11),
        (Gear::Drive12, GearReport::DRIVE_12),
        (Gear::Drive13, GearReport::DRIVE_13),
        (Gear::Drive14, GearReport::DRIVE_14),
        (Gear::Drive15, GearReport::DRIVE_15),
        (Gear::Drive16, GearReport::DRIVE_16),
        (Gear::Drive17, GearReport::DRIVE_17),
        (Gear::Drive18, GearReport::DRIVE_18),
        (Gear::Reverse, GearReport::REVERSE),
        (Gear::Reverse2, GearReport::REVERSE_2),
        (Gear::Park, GearReport::PARK),
        (Gear::Low, GearReport::LOW),
        (Gear::Low2, GearReport::LOW_2),
    ];
    for ((gear, constant), number) in CONSTANTS.into_iter().zip(1..) {
        assert_eq!(constant, number, "{}", gear.name());
        assert_eq!(cdr(&gear.to_ros(STAMP)), with_stamp(&[number]), "{}", gear.name());
    }
    assert_eq!(GearReport::NONE, 0);
}

#[test]
fn every_control_mode_has_its_bytes() {
    for mode in ControlMode::ALL {
        let bytes = cdr(&mode.to_ros(STAMP));
        let number = match mode {
            ControlMode::NoCommand => ControlModeReport::NO_COMMAND,
            ControlMode::Autonomous => ControlModeReport::AUTONOMOUS,
            ControlMode::AutonomousSteerOnly => ControlModeReport::AUTONOMOUS_STEER_ONLY,
            ControlMode::AutonomousVelocityOnly => ControlModeReport::AUTONOMOUS_VELOCITY_ONLY,
            ControlMode::Manual => ControlModeReport::MANUAL,
            ControlMode::Disengaged => ControlModeReport::DISENGAGED,
            ControlMode::NotReady => ControlModeReport::NOT_READY,
        };
        assert_eq!(bytes, with_stamp(&[number]), "{}", mode.name());
    }
}

#[test]
fn each_door_has_the_byte_of_its_state_in_order() {
    let states = [
        (DoorState::Unknown, DoorStatus::UNKNOWN),
        (DoorState::NotAvailable, DoorStatus::NOT_AVAILABLE),
        (DoorState::Opened, DoorStatus::OPENED),
        (DoorState::Closed, DoorStatus::CLOSED),
        (DoorState::Opening, DoorStatus::OPENING),
        (DoorState::Closing, DoorStatus::CLOSING),
    ];
    let doors: DoorStates = states.iter().map(|(state, _)| *state).collect();
    let bytes = states.map(|(_, constant)| constant);
    let expected = Wire::default().stamp().count(6).bytes(&bytes);
    assert_eq!(cdr(&doors.to_ros(STAMP)), expected.done());
    assert_eq!(bytes, [0, 1, 2, 3, 4, 5]);
}

fn diagnostics() -> DiagnosticArray {
    let status = |level, message: &str, values| Status {
        level,
        message: message.to_owned(),
        ..Status::new(&LOG, "turn", &[], values)
    };
    let statuses = vec![
        status(Level::Error, "veraltet für 1 s", vec![("bus", "can0".to_owned()), ("leer", String::new())]),
        status(Level::Ok, "", vec![]),
    ];
    diagnostic_array(&Diagnostics { node: "gw".to_owned(), statuses, refresh: true }, STAMP, "car")
}

#[test]
fn diagnostics_have_their_bytes_with_strings_aligned_to_four() {
    let expected = [
        with_stamp(&string("", true)), // frame_id
        vec![2, 0, 0, 0],              // two statuses
        vec![2, 0, 0, 0],              // ERROR is one byte; three fill up to the string
        string("gw: turn", true),
        string("veraltet für 1 s", true),
        string("car", true),
        vec![2, 0, 0, 0], // two values
        string("bus", true),
        string("can0", true),
        string("leer", true),
        string("", false), // the next field is a byte and follows at once
        vec![0],           // OK
        vec![0, 0],        // fills up to the string
        string("gw: turn", true),
        string("", true),
        string("car", true),
        vec![0, 0, 0, 0], // no value
    ]
    .concat();
    assert_eq!(cdr(&diagnostics()), expected);
}

#[test]
fn json_has_the_field_names_of_the_messages_and_levels_as_numbers() {
    let report = TurnIndicators::EnableLeft.to_ros(STAMP);
    assert_eq!(
        serde_json::to_string(&report).unwrap(),
        r#"{"stamp":{"sec":1700000000,"nanosec":123456789},"report":2}"#
    );
    let first = &serde_json::to_value(diagnostics()).unwrap()["status"][0];
    assert_eq!(
        first,
        &serde_json::json!({
            "level": 2, "name": "gw: turn", "message": "veraltet für 1 s", "hardware_id": "car",
            "values": [{"key": "bus", "value": "can0"}, {"key": "leer", "value": ""}],
        })
    );
}
