//! Bytes and JSON of the messages about the vehicle.

use super::autoware_vehicle_msgs::{HazardLightsReport, TurnIndicatorsReport};
use super::diagnostic_msgs::DiagnosticArray;
use super::golden::{STAMP, cdr, string, with_stamp};
use crate::core::diagnostics::{Diagnostics, Level, Status};
use crate::core::time::WallStamp;
use crate::core::vehicle_lights::verdict::{HazardLights, TurnIndicators};

#[test]
fn every_turn_state_has_its_bytes() {
    for (state, byte) in
        [(TurnIndicators::Disable, 1), (TurnIndicators::EnableLeft, 2), (TurnIndicators::EnableRight, 3)]
    {
        assert_eq!(cdr(&TurnIndicatorsReport::new(state, STAMP)), with_stamp(&[byte]));
    }
}

#[test]
fn every_hazard_state_has_its_bytes() {
    for (state, byte) in [(HazardLights::Disable, 1), (HazardLights::Enable, 2)] {
        assert_eq!(cdr(&HazardLightsReport::new(state, STAMP)), with_stamp(&[byte]));
    }
}

#[test]
fn a_stamp_before_the_epoch_is_negative_seconds_and_positive_nanoseconds() {
    let report = TurnIndicatorsReport::new(TurnIndicators::Disable, WallStamp::from_nanos(-1));
    assert_eq!(cdr(&report), [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xC9, 0x9A, 0x3B, 1]);
}

fn diagnostics() -> DiagnosticArray {
    let status = |level, message: &str, values| Status::new("turn", level, message.to_owned(), values);
    let statuses = vec![
        status(Level::Error, "veraltet für 1 s", vec![("bus", "can0".to_owned()), ("leer", String::new())]),
        status(Level::Ok, "", vec![]),
    ];
    DiagnosticArray::new(&Diagnostics { node: "gw".to_owned(), statuses, refresh: true }, STAMP, "car")
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
    let report = TurnIndicatorsReport::new(TurnIndicators::EnableLeft, STAMP);
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
