//! The ROS 2 messages this gateway sends, field by field as their `.msg` files define them.
//!
//! One `Serialize` serves two readers: CDR on the wire (fields in order) and JSON for people and
//! scripts (fields by name; `level` is a number). Sources: `builtin_interfaces`, `std_msgs` and
//! `diagnostic_msgs` of `common_interfaces`; `autoware_vehicle_msgs` 1.12.

use serde::{Deserialize, Serialize};

use crate::core::diagnostics::{Diagnostics, Status};
use crate::core::time::WallStamp;
use crate::core::vehicle_lights::verdict::{HazardLights, TurnIndicators};

/// `builtin_interfaces/msg/Time`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Time {
    /// Seconds since 1970-01-01 UTC.
    pub sec: i32,
    /// 0 to 999 999 999.
    pub nanosec: u32,
}

impl From<WallStamp> for Time {
    fn from(stamp: WallStamp) -> Self {
        Self { sec: stamp.sec(), nanosec: stamp.nanosec() }
    }
}

/// `std_msgs/msg/Header`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// When.
    pub stamp: Time,
    /// In which frame of reference; empty here.
    pub frame_id: String,
}

/// `autoware_vehicle_msgs/msg/TurnIndicatorsReport`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TurnIndicatorsReport {
    /// Receive time of the frame that carried the state.
    pub stamp: Time,
    /// One of the constants below; there is no 0 and no "unknown".
    pub report: u8,
}

impl TurnIndicatorsReport {
    /// No side.
    pub const DISABLE: u8 = 1;
    /// Left.
    pub const ENABLE_LEFT: u8 = 2;
    /// Right.
    pub const ENABLE_RIGHT: u8 = 3;

    /// The message that says `state`.
    pub fn new(state: TurnIndicators, stamp: WallStamp) -> Self {
        let report = match state {
            TurnIndicators::Disable => Self::DISABLE,
            TurnIndicators::EnableLeft => Self::ENABLE_LEFT,
            TurnIndicators::EnableRight => Self::ENABLE_RIGHT,
        };
        Self { stamp: stamp.into(), report }
    }
}

/// `autoware_vehicle_msgs/msg/HazardLightsReport`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HazardLightsReport {
    /// Receive time of the frame that carried the state.
    pub stamp: Time,
    /// One of the constants below; there is no 0 and no "unknown".
    pub report: u8,
}

impl HazardLightsReport {
    /// Off.
    pub const DISABLE: u8 = 1;
    /// On.
    pub const ENABLE: u8 = 2;

    /// The message that says `state`.
    pub fn new(state: HazardLights, stamp: WallStamp) -> Self {
        let report = match state {
            HazardLights::Disable => Self::DISABLE,
            HazardLights::Enable => Self::ENABLE,
        };
        Self { stamp: stamp.into(), report }
    }
}

/// `diagnostic_msgs/msg/KeyValue`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// What the value is of.
    pub key: String,
    /// The value as text.
    pub value: String,
}

/// `diagnostic_msgs/msg/DiagnosticStatus`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// OK 0, WARN 1, ERROR 2, STALE 3; a `byte` in the `.msg` file.
    pub level: u8,
    /// `<node>: <task>`.
    pub name: String,
    /// One line for a person.
    pub message: String,
    /// What hardware it is about.
    pub hardware_id: String,
    /// What an operator needs beside it.
    pub values: Vec<KeyValue>,
}

impl DiagnosticStatus {
    /// The message that says `status` about `hardware_id`.
    pub fn new(status: &Status, hardware_id: &str) -> Self {
        let values = status.values.iter();
        Self {
            level: status.level as u8,
            name: status.name.clone(),
            message: status.message.clone(),
            hardware_id: hardware_id.to_owned(),
            values: values
                .map(|(key, value)| KeyValue { key: (*key).to_owned(), value: value.clone() })
                .collect(),
        }
    }
}

/// `diagnostic_msgs/msg/DiagnosticArray`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticArray {
    /// When the statuses were made.
    pub header: Header,
    /// The statuses.
    pub status: Vec<DiagnosticStatus>,
}

impl DiagnosticArray {
    /// The message that says `diagnostics` about `hardware_id`.
    pub fn new(diagnostics: &Diagnostics, stamp: WallStamp, hardware_id: &str) -> Self {
        Self {
            header: Header { stamp: stamp.into(), frame_id: String::new() },
            status: diagnostics
                .statuses
                .iter()
                .map(|status| DiagnosticStatus::new(status, hardware_id))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::diagnostics::Level;

    /// Little-endian CDR as RustDDS writes it, without the four bytes of encapsulation header.
    fn cdr(message: &impl Serialize) -> Vec<u8> {
        cdr_encoding::to_vec::<_, byteorder::LittleEndian>(message).unwrap()
    }

    const STAMP: WallStamp = WallStamp::from_nanos(1_700_000_000_123_456_789);
    // 1 700 000 000 = 0x6553F100, 123 456 789 = 0x075BCD15.
    const STAMP_BYTES: [u8; 8] = [0x00, 0xF1, 0x53, 0x65, 0x15, 0xCD, 0x5B, 0x07];

    fn with_stamp(rest: &[u8]) -> Vec<u8> {
        [&STAMP_BYTES, rest].concat()
    }

    /// A CDR string by hand: length with the terminating zero, text, zero, and what fills up to
    /// the next multiple of four when `padded`.
    fn string(text: &str, padded: bool) -> Vec<u8> {
        let length = u8::try_from(text.len() + 1).unwrap();
        let mut bytes = vec![length, 0, 0, 0];
        bytes.extend(text.as_bytes());
        bytes.push(0);
        while padded && bytes.len() % 4 != 0 {
            bytes.push(0);
        }
        bytes
    }

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
        let status = |level, message: &str, values| Status {
            name: "gw: turn".to_owned(),
            level,
            message: message.to_owned(),
            values,
        };
        let statuses = vec![
            status(
                Level::Error,
                "veraltet für 1 s",
                vec![("bus", "can0".to_owned()), ("leer", String::new())],
            ),
            status(Level::Ok, "", vec![]),
        ];
        DiagnosticArray::new(&Diagnostics { statuses, refresh: true }, STAMP, "car")
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
}
