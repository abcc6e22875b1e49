//! Tests bytes and JSON of messages about traffic lights, and the inputs decoded from received messages.

use super::element::element;
use super::golden::{STAMP, STAMP_BYTES, cdr, string, with_stamp};
use super::traffic_light_group_array::{groups_for_store, predicted_state};
use super::{LightsMessage, LightsType};
use gateway_base::time::WallStamp;
use lanelet2_map::light_map::{LampColor, MapLamp};
use ros_messages::autoware_perception_msgs::{
    PredictedTrafficLightState, TrafficLightElement, TrafficLightGroup, TrafficLightGroupArray,
};
use ros_messages::builtin_interfaces::Time;
use ros_messages::std_msgs;
use traffic_lights::bulb::{Bulb, BulbShape, BulbStatus, Color};
use traffic_lights::compat::Compat;
use traffic_lights::emission::{
    Emission, GroupElement, GroupState, LampMarker, LightState, LightsContent, LightsTopic, Prediction,
};
use traffic_lights::input::TrafficLightInput;
use traffic_lights::received::ReceivedState;
use traffic_lights::target::{LightChannel, StoreId, StoreLayer};

const RED: Bulb = Bulb { color: Color::Red, status: BulbStatus::SolidOn, shape: BulbShape::Circle };
const ARROW: Bulb = Bulb { color: Color::Green, status: BulbStatus::Flashing, shape: BulbShape::UpperLeft };
const STORE: StoreId = StoreId { channel: LightChannel::V2i, layer: StoreLayer::Detected };
/// 0.5 as `float32`.
const HALF: [u8; 4] = [0, 0, 0, 0x3F];
/// An id that does not fit 32 bits.
const LARGE: i64 = 0x0001_0000_0005;

fn emission(content: LightsContent) -> Emission {
    Emission { topic: LightsTopic::V2i, stamp: STAMP, content }
}

fn prediction() -> Prediction {
    let elements = vec![GroupElement { bulb: RED, confidence: 0.5 }];
    Prediction { at: STAMP, elements, reliability: 0.5, source: "MANUAL_OVERRIDE".into() }
}

fn groups() -> LightsContent {
    let element = |bulb| GroupElement { bulb, confidence: 0.5 };
    let (elements, predictions) = (vec![element(ARROW), element(RED)], vec![prediction()]);
    let dark = GroupState { relation_id: -2, ..GroupState::default() };
    LightsContent::groups([GroupState { relation_id: LARGE, elements, predictions }, dark])
}

fn only(content: LightsContent, lights: LightsType, compat: Compat) -> LightsMessage {
    let [message] = LightsMessage::of(&emission(content), lights, compat).try_into().unwrap();
    message
}

/// Returns the bytes of colour, shape and status with confidence 0.5; the next field is aligned to four.
fn element_bytes(color: u8, shape: u8, status: u8) -> Vec<u8> {
    [&[color, shape, status, 0][..], &HALF].concat()
}

fn header() -> Vec<u8> {
    [&STAMP_BYTES[..], &string("map", true)].concat()
}

#[test]
fn group_arrays_have_their_bytes() {
    let expected = with_stamp(
        &[
            vec![2, 0, 0, 0, 0, 0, 0, 0], // two groups; four fill up to the id's eight
            from_i64(LARGE),
            vec![2, 0, 0, 0],
            element_bytes(3, 5, 3),
            element_bytes(1, 1, 2),
            vec![1, 0, 0, 0],
            STAMP_BYTES.to_vec(),
            vec![1, 0, 0, 0],
            element_bytes(1, 1, 2),
            HALF.to_vec(),
            string("MANUAL_OVERRIDE", true),
            vec![0, 0, 0, 0], // fills up to the next id
            from_i64(-2),
            vec![0, 0, 0, 0],
            vec![0, 0, 0, 0],
        ]
        .concat(),
    );
    assert_eq!(cdr(&only(groups(), LightsType::GroupArray, Compat::Improved)), expected);
}

#[test]
fn upstreams_legacy_arrays_have_their_bytes_its_ids_and_its_diagonals() {
    let expected = with_stamp(
        &[
            vec![2, 0, 0, 0, 0, 0, 0, 0],
            from_i64(5),
            vec![2, 0, 0, 0],
            element_bytes(3, 0, 3),
            element_bytes(1, 1, 2),
            vec![0, 0, 0, 0],
            from_i64(-2),
            vec![0, 0, 0, 0],
        ]
        .concat(),
    );
    assert_eq!(cdr(&only(groups(), LightsType::SignalArray, Compat::Upstream)), expected);
}

#[test]
fn arrays_of_heads_have_their_bytes_and_show_dark_heads() {
    let head = |way_id, bulbs: &[Bulb]| LightState {
        way_id,
        bulbs: bulbs.iter().copied().collect(),
        confidence: 0.5,
    };
    let content = LightsContent::lights([head(34836, &[RED, ARROW]), head(34837, &[])]);
    let bulb = |color, shape, status| [&[0, color, shape, status][..], &HALF].concat();
    let expected = [
        vec![2, 0, 0, 0, 0, 0, 0, 0],
        from_i64(34836),
        vec![2, 0, 0, 0],
        bulb(3, 5, 3),
        bulb(1, 1, 2),
        vec![0, 0, 0, 0],
        from_i64(34837),
        vec![0, 0, 0, 0],
    ]
    .concat();
    assert_eq!(cdr(&only(content, LightsType::ArrayV1, Compat::Improved)), expected);
}

fn lamp(way_id: i64, color: LampColor, is_on: bool) -> LampMarker {
    LampMarker { way_id, lamp: MapLamp { color, position_m: [1.0, 2.0, -0.5] }, is_on }
}

#[test]
fn spheres_have_their_bytes() {
    let content = LightsContent::markers([lamp(2, LampColor::Red, true)]);
    let double = |number: f64| number.to_le_bytes().to_vec();
    let single = |number: f32| number.to_le_bytes().to_vec();
    let expected = [
        vec![1, 0, 0, 0],
        header(),
        string("bulb", true),
        vec![10, 0, 0, 0], // id
        vec![2, 0, 0, 0],  // SPHERE
        vec![0, 0, 0, 0],  // ADD
        vec![0, 0, 0, 0],  // fills up to the pose
        [1.0, 2.0, -0.5, 0.0, 0.0, 0.0, 1.0, 0.3, 0.3, 0.3].map(double).concat(),
        [1.0, 0.0, 0.0, 1.0].map(single).concat(),
        vec![0; 8],       // lifetime
        vec![0, 0, 0, 0], // frame_locked, and three up to the next field
        vec![0, 0, 0, 0], // points
        vec![0, 0, 0, 0], // colors
        string("", true), // texture_resource
        vec![0; 8],       // texture.header.stamp
        string("", true), // texture.header.frame_id
        string("", true), // texture.format
        vec![0, 0, 0, 0], // texture.data
        vec![0, 0, 0, 0], // uv_coordinates
        string("", true), // text
        string("", true), // mesh_resource
        string("", true), // mesh_file.filename
        vec![0, 0, 0, 0], // mesh_file.data
        vec![0],          // mesh_use_embedded_materials
    ]
    .concat();
    assert_eq!(cdr(&only(content, LightsType::MarkerArray, Compat::Improved)), expected);
}

#[test]
fn strings_have_their_bytes() {
    assert_eq!(cdr(&std_msgs::String { data: "grün".to_owned() }), string("grün", false));
}

#[test]
fn upstream_deletes_all_markers_first_and_lets_large_numbers_wrap() {
    let content = LightsContent::markers([lamp(1 << 30, LampColor::Yellow, false)]);
    let sent = LightsMessage::of(&emission(content.clone()), LightsType::MarkerArray, Compat::Upstream);
    let [LightsMessage::MarkerArray(deleted), LightsMessage::MarkerArray(spheres)] = &sent[..] else {
        panic!("{sent:?}")
    };
    assert_eq!((deleted.markers.len(), deleted.markers[0].action), (1, 3));
    assert_eq!((&*spheres.markers[0].ns, spheres.markers[0].id), ("bulb", 1));
    assert!((spheres.markers[0].color.a - 0.3).abs() < 1e-6);
    let LightsMessage::MarkerArray(spheres) = only(content, LightsType::MarkerArray, Compat::Improved) else {
        panic!("not markers")
    };
    assert_eq!((&*spheres.markers[0].ns, spheres.markers[0].id), ("bulb 1073741824", 1));
}

#[test]
fn content_that_is_not_for_a_type_is_not_sent() {
    for (content, fitting) in [
        (LightsContent::lights([]), &[LightsType::ArrayV1][..]),
        (LightsContent::groups([]), &[LightsType::SignalArray, LightsType::GroupArray]),
        (LightsContent::markers([]), &[LightsType::MarkerArray]),
    ] {
        let all =
            [LightsType::ArrayV1, LightsType::SignalArray, LightsType::GroupArray, LightsType::MarkerArray];
        for lights in all {
            let sent = LightsMessage::of(&emission(content.clone()), lights, Compat::Improved);
            assert_eq!(!sent.is_empty(), fitting.contains(&lights), "{content:?} as {lights:?}");
        }
    }
}

#[test]
fn json_has_the_field_names_of_the_messages() {
    let json = |message: &LightsMessage| serde_json::to_string(message).unwrap();
    let stamp = r#"{"sec":1700000000,"nanosec":123456789}"#;
    let arrow = r#"{"color":3,"shape":5,"status":3,"confidence":0.5}"#;
    let red = r#"{"color":1,"shape":1,"status":2,"confidence":0.5}"#;
    assert_eq!(
        json(&only(groups(), LightsType::GroupArray, Compat::Improved)),
        format!(
            r#"{{"stamp":{stamp},"traffic_light_groups":[{{"traffic_light_group_id":4294967301,"elements":[{arrow},{red}],"predictions":[{{"predicted_stamp":{stamp},"simultaneous_elements":[{red}],"reliability":0.5,"information_source":"MANUAL_OVERRIDE"}}]}},{{"traffic_light_group_id":-2,"elements":[],"predictions":[]}}]}}"#
        )
    );
    assert_eq!(
        json(&only(groups(), LightsType::SignalArray, Compat::Improved)),
        format!(
            r#"{{"stamp":{stamp},"signals":[{{"traffic_signal_id":4294967301,"elements":[{arrow},{red}]}},{{"traffic_signal_id":-2,"elements":[]}}]}}"#
        )
    );
    let head = LightState { way_id: 7, bulbs: [RED].into_iter().collect(), confidence: 0.5 };
    assert_eq!(
        json(&only(LightsContent::lights([head]), LightsType::ArrayV1, Compat::Improved)),
        r#"{"traffic_lights":[{"lanelet_way_id":7,"traffic_light_bulbs":[{"enum_revision":0,"color":1,"shape":1,"status":2,"confidence":0.5}]}]}"#
    );
    let markers = LightsContent::markers([lamp(1, LampColor::Green, true)]);
    let empty = r#""header":{"stamp":{"sec":0,"nanosec":0},"frame_id":""}"#;
    assert_eq!(
        json(&only(markers, LightsType::MarkerArray, Compat::Improved)),
        format!(
            r#"{{"markers":[{{"header":{{"stamp":{stamp},"frame_id":"map"}},"ns":"bulb","id":4,"type":2,"action":0,"pose":{{"position":{{"x":1.0,"y":2.0,"z":-0.5}},"orientation":{{"x":0.0,"y":0.0,"z":0.0,"w":1.0}}}},"scale":{{"x":0.3,"y":0.3,"z":0.3}},"color":{{"r":0.0,"g":1.0,"b":0.0,"a":1.0}},"lifetime":{{"sec":0,"nanosec":0}},"frame_locked":false,"points":[],"colors":[],"texture_resource":"","texture":{{{empty},"format":"","data":[]}},"uv_coordinates":[],"text":"","mesh_resource":"","mesh_file":{{"filename":"","data":[]}},"mesh_use_embedded_materials":false}}]}}"#
        )
    );
    assert_eq!(serde_json::to_string(&std_msgs::String { data: "a".into() }).unwrap(), r#"{"data":"a"}"#);
}

#[test]
fn a_group_array_is_read_back_as_it_was_sent() {
    let LightsMessage::GroupArray(sent) = only(groups(), LightsType::GroupArray, Compat::Improved) else {
        panic!("not groups")
    };
    let (read, _): (TrafficLightGroupArray, usize) =
        cdr_encoding::from_bytes::<_, byteorder::LittleEndian>(&cdr(&sent)).unwrap();
    assert_eq!(read, sent);
    let bulbs = [RED, ARROW].into_iter().collect();
    for (store, predictions) in [(STORE, vec![prediction()]), (StoreId::CONVENTIONAL, vec![])] {
        let both = ReceivedState { bulbs, confidence: 0.5, predictions };
        let states = vec![(LARGE, Some(both)), (-2, None)];
        let expected = TrafficLightInput::States { store, stamp: STAMP, states, rejected: 0 };
        assert_eq!(groups_for_store(&read, store), expected, "only the network predicts");
    }
}

#[test]
fn a_prediction_with_an_undefined_number_is_left_out_and_counted() {
    let good = predicted_state(&prediction(), Compat::Improved);
    let [element] = good.simultaneous_elements[..] else { panic!("{good:?}") };
    let of = |element| PredictedTrafficLightState { simultaneous_elements: vec![element], ..good.clone() };
    let stamp = Time { nanosec: 1_000_000_000, ..good.predicted_stamp };
    let source = "of its own".to_owned();
    let unknown = PredictedTrafficLightState { information_source: source.clone(), ..good.clone() };
    let predictions = vec![
        of(TrafficLightElement { color: 5, ..element }),
        of(TrafficLightElement { confidence: f32::NAN, ..element }),
        good.clone(),
        PredictedTrafficLightState { predicted_stamp: stamp, ..good.clone() },
        unknown,
    ];
    let group = TrafficLightGroup { traffic_light_group_id: 1, elements: vec![element], predictions };
    let message = TrafficLightGroupArray { stamp: STAMP.into(), traffic_light_groups: vec![group] };
    let kept = ReceivedState {
        bulbs: [RED].into_iter().collect(),
        confidence: 0.5,
        predictions: vec![prediction(), Prediction { source: source.into(), ..prediction() }],
    };
    let states = vec![(1, Some(kept))];
    let expected = TrafficLightInput::States { store: STORE, stamp: STAMP, states, rejected: 3 };
    assert_eq!(groups_for_store(&message, STORE), expected);
}

#[test]
fn a_group_with_an_undefined_number_is_left_out_as_a_whole() {
    let good = element(RED, 0.25, Compat::Improved);
    for undefined in [
        TrafficLightElement { color: 5, ..good },
        TrafficLightElement { shape: 11, ..good },
        TrafficLightElement { status: 4, ..good },
        TrafficLightElement { confidence: 1.5, ..good },
        TrafficLightElement { confidence: -0.5, ..good },
        TrafficLightElement { confidence: f32::NAN, ..good },
    ] {
        let group = |traffic_light_group_id, elements: &[TrafficLightElement]| TrafficLightGroup {
            traffic_light_group_id,
            elements: elements.to_vec(),
            predictions: vec![],
        };
        let traffic_light_groups = vec![group(1, &[good, undefined]), group(2, &[good])];
        let stamp = WallStamp::from_nanos(-1);
        let message = TrafficLightGroupArray { stamp: stamp.into(), traffic_light_groups };
        let bulbs = [RED].into_iter().collect();
        let kept = ReceivedState { bulbs, confidence: 0.25, predictions: vec![] };
        let expected =
            TrafficLightInput::States { store: STORE, stamp, states: vec![(2, Some(kept))], rejected: 1 };
        assert_eq!(groups_for_store(&message, STORE), expected, "{undefined:?}");
    }
}

fn from_i64(number: i64) -> Vec<u8> {
    number.to_le_bytes().to_vec()
}
