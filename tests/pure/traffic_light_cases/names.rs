//! Groups A to H: ids, names, keys and texts. Rows without a number are neighbours of numbered ones.

use std::fmt::Debug;
use std::str::FromStr;

use traffic_lights::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};
use traffic_lights::signal_id::{SignalIdError, parse_id};
use traffic_lights::target::{LightChannel, SignalTarget, StoreId, StoreLayer};
use traffic_lights::text::{TextError, TextErrorKind, parse_bulb, parse_bulbs};

/// The number of a case; 0 for a neighbour.
type Case = u32;

#[test]
fn a_signal_ids() {
    use LightChannel::{Conventional, V2i};
    use StoreLayer::{Detected, GroundTruth};
    let at = |id, channel, layer| Some(SignalTarget { id, store: StoreId { channel, layer } });
    let cases: &[(Case, &str, Option<SignalTarget>)] = &[
        (1, "34802", at(34802, Conventional, GroundTruth)),
        (0, "34802 v2i", at(34802, V2i, GroundTruth)),
        (0, "34802 conventional", at(34802, Conventional, GroundTruth)),
        (3, "34802    v2i", at(34802, V2i, GroundTruth)),
        (0, "34802 \t\n v2i", at(34802, V2i, GroundTruth)),
        (5, "34802 conventional_detected", at(34802, Conventional, Detected)),
        (0, "34802 v2i_detected", at(34802, V2i, Detected)),
        (7, "1", at(1, Conventional, GroundTruth)),
        (0, "0", at(0, Conventional, GroundTruth)),
        (9, "-1", at(-1, Conventional, GroundTruth)),
        (0, "+1 v2i", at(1, V2i, GroundTruth)),
        (0, "9223372036854775807", at(i64::MAX, Conventional, GroundTruth)),
        (0, "-9223372036854775808 v2i", at(i64::MIN, V2i, GroundTruth)),
        (0, "9223372036854775808", None),
        (0, "-9223372036854775809", None),
        (11, "invalid", None),
        (0, "", None),
        (0, " ", None),
        (0, " 34802", None),
        (0, "34802 ", None),
        (0, "34802 v2i ", None),
        (0, "34802 v2i detected", None),
        (0, "34802.0", None),
        (0, "0x10", None),
        (0, "+-1", None),
        (0, "34802v2i", None),
        (0, "34802 V2I", None),
        (0, "34802 invalid", None),
        (13, "34802 invalid_detected", None),
        (0, "34802 _detected", None),
        (0, "34802 detected", None),
        (0, "v2i 34802", None),
    ];
    for (case, text, expected) in cases {
        assert_eq!(SignalTarget::parse(text).ok(), *expected, "A {case}: {text:?}");
        let plain = expected.map(|target| target.id).filter(|_| !text.contains(char::is_whitespace));
        assert_eq!(parse_id(text).ok(), plain, "A {case}: {text:?} as a plain id");
    }
}

#[test]
fn a_channel_names() {
    let cases: &[(Case, &str, Option<LightChannel>)] = &[
        (15, "conventional", Some(LightChannel::Conventional)),
        (0, "v2i", Some(LightChannel::V2i)),
        (17, "invalid", None),
        (0, "Conventional", None),
        (0, "", None),
    ];
    for (case, name, channel) in cases {
        for (name, layer) in [
            ((*name).to_owned(), StoreLayer::GroundTruth),
            (format!("{name}_detected"), StoreLayer::Detected),
        ] {
            let expected = channel.map(|channel| StoreId { channel, layer });
            assert_eq!(name.parse().ok(), expected, "A {case}: {name:?}");
            match name.parse::<StoreId>() {
                Ok(store) => assert_eq!(store.to_string(), name),
                Err(error) => assert_eq!(error, SignalIdError::Channel(name)),
            }
        }
    }
}

#[test]
fn b_colors() {
    let cases: &[(Case, &str, Color)] = &[
        (0, "green", Color::Green),
        (0, "Green", Color::Green),
        (19, "yellow", Color::Yellow),
        (0, "Yellow", Color::Yellow),
        (0, "amber", Color::Yellow),
        (0, "red", Color::Red),
        (0, "Red", Color::Red),
        (21, "white", Color::White),
        (23, "unknown", Color::Unknown),
    ];
    for (case, text, color) in cases {
        assert_eq!(text.parse(), Ok(*color), "B {case}: {text:?}");
        assert_eq!(color.name().parse(), Ok(*color), "B {case}: printed");
    }
    assert_eq!(Color::ALL.map(Color::name), ["green", "yellow", "red", "white", "unknown"]);
    for text in ["wrong_color", "Amber", "White", "RED", "Unknown", "red ", " red", "", "solidOn"] {
        refused::<Color>("B 0", text, TextErrorKind::NotAColor);
    }
}

/// Asserts that a text is not a part of this type, and that the error shows the text.
fn refused<T: FromStr<Err = TextError> + Debug>(case: &str, text: &str, kind: TextErrorKind) {
    let error = text.parse::<T>().unwrap_err();
    assert_eq!((error.found.as_str(), error.kind), (text, kind), "{case}: {text:?}");
}

#[test]
fn c_statuses() {
    let cases: &[(Case, &str, BulbStatus)] = &[
        (25, "solidOn", BulbStatus::SolidOn),
        (0, "solidOff", BulbStatus::SolidOff),
        (0, "Blank", BulbStatus::SolidOff),
        (0, "none", BulbStatus::SolidOff),
        (27, "flashing", BulbStatus::Flashing),
        (0, "unknown", BulbStatus::Unknown),
    ];
    for (case, text, status) in cases {
        assert_eq!(text.parse(), Ok(*status), "C {case}: {text:?}");
        assert_eq!(status.name().parse(), Ok(*status), "C {case}: printed");
    }
    assert_eq!(BulbStatus::ALL.map(BulbStatus::name), ["solidOn", "solidOff", "flashing", "unknown"]);
    assert_eq!(BulbStatus::ALL.map(BulbStatus::is_lit), [true, false, true, false]);
    for (case, text) in [(29, "wrong_status"), (0, "off"), (0, "blank"), (0, "None"), (0, "solidon"), (0, "")]
    {
        refused::<BulbStatus>(&format!("C {case}"), text, TextErrorKind::NotAStatus);
    }
}

#[test]
fn d_shapes() {
    let cases: &[(Case, &str, BulbShape, bool, &str)] = &[
        (0, "circle", BulbShape::Circle, false, "circle"),
        (31, "cross", BulbShape::Cross, false, "cross"),
        (0, "left", BulbShape::Left, true, "left"),
        (33, "down", BulbShape::Down, true, "down"),
        (0, "up", BulbShape::Up, true, "up"),
        (0, "straight", BulbShape::Up, true, "up"),
        (35, "right", BulbShape::Right, true, "right"),
        (0, "lowerLeft", BulbShape::LowerLeft, true, "lowerLeft"),
        (37, "upperLeft", BulbShape::UpperLeft, true, "upperLeft"),
        (0, "lowerRight", BulbShape::LowerRight, true, "lowerRight"),
        (39, "upperRight", BulbShape::UpperRight, true, "upperRight"),
        (0, "unknown", BulbShape::Unknown, false, "unknown"),
    ];
    for (case, text, shape, is_arrow, printed) in cases {
        assert_eq!(text.parse(), Ok(*shape), "D {case}: {text:?}");
        assert_eq!((shape.is_arrow(), shape.name()), (*is_arrow, *printed), "D {case}: {text:?}");
    }
    assert!(BulbShape::ALL.iter().all(|shape| cases.iter().any(|(_, _, parsed, ..)| parsed == shape)));
    for (case, text) in [(41, "wrong_shape"), (0, "leftArrow"), (0, "Left"), (0, "upper"), (0, "upperleft")] {
        refused::<BulbShape>(&format!("D {case}"), text, TextErrorKind::NotAShape);
    }
}

#[test]
fn e_sort_keys() {
    use BulbStatus::{Flashing, SolidOff, SolidOn};
    use Color::{Green, Red, White, Yellow};
    let cases: &[(Case, Color, BulbStatus, BulbShape, u32)] = &[
        (0, Green, SolidOn, BulbShape::Circle, 0x0000_0000),
        (43, Yellow, SolidOn, BulbShape::Circle, 0x0100_0000),
        (0, Red, SolidOn, BulbShape::Circle, 0x0200_0000),
        (45, White, SolidOn, BulbShape::Circle, 0x0300_0000),
        (0, Color::Unknown, SolidOn, BulbShape::Circle, 0x0400_0000),
        (47, Green, SolidOff, BulbShape::Circle, 0x0001_0000),
        (0, Green, Flashing, BulbShape::Circle, 0x0002_0000),
        (49, Green, BulbStatus::Unknown, BulbShape::Circle, 0x0003_0000),
        (0, Green, SolidOn, BulbShape::Cross, 0x0000_0001),
        (51, Green, SolidOn, BulbShape::Left, 0x0000_0802),
        (0, Green, SolidOn, BulbShape::Down, 0x0000_0402),
        (53, Green, SolidOn, BulbShape::Up, 0x0000_0202),
        (0, Green, SolidOn, BulbShape::Right, 0x0000_0102),
        (55, Green, SolidOn, BulbShape::LowerLeft, 0x0000_0C02),
        (0, Green, SolidOn, BulbShape::UpperLeft, 0x0000_0A02),
        (57, Green, SolidOn, BulbShape::LowerRight, 0x0000_0502),
        (0, Green, SolidOn, BulbShape::UpperRight, 0x0000_0302),
        (59, Green, SolidOn, BulbShape::Unknown, 0x0000_0003),
        (0, Color::Unknown, BulbStatus::Unknown, BulbShape::LowerLeft, 0x0403_0C02),
    ];
    for (case, color, status, shape, key) in cases {
        let bulb = Bulb { color: *color, status: *status, shape: *shape };
        assert_eq!(bulb.key(), *key, "E {case}: {bulb}");
    }
}

/// One bulb, and the same text as a list: none = refused.
#[test]
fn f_texts() {
    let cases: &[(Case, &str, Option<&str>, Option<&str>)] = &[
        (61, "red flashing", Some("red flashing circle"), Some("red flashing circle")),
        (0, "red flashing circle", Some("red flashing circle"), Some("red flashing circle")),
        (63, "green solidOn right", Some("green solidOn right"), Some("green solidOn right")),
        (65, "red flashing wrong_shape", None, None),
        (0, "red wrong_status circle", None, None),
        (67, "wrong_color flashing circle", None, None),
        (0, "", Some("green solidOn circle"), Some("")),
        (0, "  \t", Some("green solidOn circle"), None),
        (0, "green", Some("green solidOn circle"), Some("green solidOn circle")),
        (0, "red right", Some("red solidOn right"), Some("red solidOn right")),
        (0, "yellow flashing", Some("yellow flashing circle"), Some("yellow flashing circle")),
        (0, "amber", Some("yellow solidOn circle"), Some("yellow solidOn circle")),
        (0, "none", Some("green solidOff circle"), Some("green solidOff circle")),
        (0, "Blank", Some("green solidOff circle"), Some("green solidOff circle")),
        (0, "solidOff", Some("green solidOff circle"), Some("green solidOff circle")),
        (0, "flashing", Some("green flashing circle"), Some("green flashing circle")),
        (0, "left", Some("green solidOn left"), Some("green solidOn left")),
        (0, "straight", Some("green solidOn up"), Some("green solidOn up")),
        (0, "upperLeft", Some("green solidOn upperLeft"), Some("green solidOn upperLeft")),
        (0, "unknown", Some("unknown solidOn circle"), Some("unknown solidOn circle")),
        (0, "unknown circle", Some("unknown solidOn circle"), Some("unknown solidOn circle")),
        (0, "unknown flashing", Some("unknown flashing circle"), Some("unknown flashing circle")),
        (0, "unknown unknown", Some("unknown unknown circle"), Some("unknown unknown circle")),
        (0, "unknown unknown unknown", Some("unknown unknown unknown"), Some("unknown unknown unknown")),
        (0, "unknown unknown unknown unknown", None, None),
        (0, "green unknown", Some("green unknown circle"), Some("green unknown circle")),
        (0, "green solidOn unknown", Some("green solidOn unknown"), Some("green solidOn unknown")),
        (0, "redflashingcircle", Some("red flashing circle"), Some("red flashing circle")),
        (0, "red\n\tflashing  right ", Some("red flashing right"), Some("red flashing right")),
        (0, "red, green right", None, Some("green solidOn right, red solidOn circle")),
        (0, "red ,green", None, Some("green solidOn circle, red solidOn circle")),
        (0, "red,green", None, Some("green solidOn circle, red solidOn circle")),
        (0, "red,red", None, Some("red solidOn circle")),
        (0, "red up, red left, red right", None, Some("red solidOn right, red solidOn up, red solidOn left")),
        (0, "red,", None, Some("red solidOn circle")),
        (0, "red , ", None, Some("red solidOn circle")),
        (0, "red,,green", None, None),
        (0, "red;green", None, None),
        (0, ",red", None, None),
        (0, " red", None, None),
        (0, " flashing", Some("green flashing circle"), None),
        (0, "right red", None, None),
        (0, "green right left", None, None),
        (0, "red red", None, None),
        (0, "r", None, None),
        (0, "leftArrow", None, None),
        (0, "RED", None, None),
    ];
    for (case, text, single, list) in cases {
        let bulb = parse_bulb(text).map(|bulb| bulb.to_string()).ok();
        assert_eq!(bulb.as_deref(), *single, "F {case}: {text:?}");
        let bulbs = parse_bulbs(text).map(|bulbs| bulbs.to_string()).ok();
        assert_eq!(bulbs.as_deref(), *list, "F {case}: {text:?} as a list");
    }
    assert!(parse_bulb("green solidOn right").unwrap().shape.is_arrow(), "F 63");
}

#[test]
fn g_printing() {
    let constructed = Bulb { color: Color::Red, status: BulbStatus::Flashing, shape: BulbShape::Circle };
    let arrow = Bulb { color: Color::Green, status: BulbStatus::SolidOn, shape: BulbShape::Right };
    let cases: &[(Case, Bulb, &str)] = &[
        (69, constructed, "red flashing circle"),
        (0, arrow, "green solidOn right"),
        (71, parse_bulb("red flashing circle").unwrap(), "red flashing circle"),
        (73, parse_bulb("red").unwrap(), "red solidOn circle"),
        (0, parse_bulb("Red Blank straight").unwrap(), "red solidOff up"),
        (75, parse_bulb("green right").unwrap(), "green solidOn right"),
    ];
    for (case, bulb, printed) in cases {
        assert_eq!(bulb.to_string(), *printed, "G {case}");
    }
}

#[test]
fn h_bulb_sets() {
    let constructed = [
        Bulb { color: Color::Red, status: BulbStatus::Flashing, shape: BulbShape::Circle },
        Bulb { color: Color::Green, status: BulbStatus::SolidOn, shape: BulbShape::Right },
    ];
    let parsed = ["red flashing circle", "green solidOn right"].map(|text| parse_bulb(text).unwrap());
    // 77, and the neighbour that inserts the bulbs themselves
    for bulbs in [parsed, constructed] {
        let set: BulbSet = bulbs.into_iter().chain(bulbs).collect();
        assert!(constructed.iter().all(|bulb| set.contains(*bulb)), "H 77");
        assert_eq!(set.len(), 2, "H 77: once each");
        let other = Bulb { status: BulbStatus::SolidOn, ..constructed[0] };
        assert!(!set.contains(other), "H 77: nothing else");
    }
}
