//! Groups K (contents) and N, with every neighbour; and architectures.

use gateway_base::time::WallStamp;
use lanelet2_map::light_map::{LampColor, MapLamp};
use ros_messages::autoware_perception_msgs::{TrafficLightElement, TrafficSignalElement};
use ros_messages::builtin_interfaces::Time;
use signal_gateway::io::ros::messages::{LightsMessage, LightsType};
use traffic_lights::architecture::{Architecture, ArchitectureError};
use traffic_lights::bulb::{Bulb, BulbShape, BulbStatus, Color};
use traffic_lights::compat::Compat;
use traffic_lights::emission::{
    Emission, GroupElement, GroupState, LampMarker, LightState, LightsContent, LightsTopic,
};

const BOTH: [Compat; 2] = [Compat::Improved, Compat::Upstream];
const NOW: WallStamp = WallStamp::from_nanos(12_345_000_000_678);

/// `red solidOn circle, yellow flashing circle` in the order of keys.
const BULBS: [Bulb; 2] = [
    Bulb { color: Color::Yellow, status: BulbStatus::Flashing, shape: BulbShape::Circle },
    Bulb { color: Color::Red, status: BulbStatus::SolidOn, shape: BulbShape::Circle },
];

fn sent(content: LightsContent, lights: LightsType, compat: Compat) -> Vec<LightsMessage> {
    let emission = Emission { topic: LightsTopic::V2i, stamp: NOW, content };
    LightsMessage::of(&emission, lights, compat)
}

/// K 133, and the contents of 135 to 141.
#[test]
fn group_k_one_group_with_both_bulbs_in_order() {
    let elements = BULBS.map(|bulb| GroupElement { bulb, confidence: 0.7 }).to_vec();
    let content = LightsContent::groups([GroupState { relation_id: 34806, elements, predictions: vec![] }]);
    let now = Time { sec: 12_345, nanosec: 678 };
    let expected = [
        (2, 3), // AMBER, FLASHING
        (1, 2), // RED, SOLID_ON
    ];
    for compat in BOTH {
        let (ids, elements) = match &sent(content.clone(), LightsType::SignalArray, compat)[..] {
            [LightsMessage::SignalArray(array)] => {
                assert_eq!(array.stamp, now, "133");
                let ids: Vec<_> = array.signals.iter().map(|signal| signal.traffic_signal_id).collect();
                let element = |element: &TrafficSignalElement| {
                    let TrafficSignalElement { color, shape, status, confidence } = *element;
                    TrafficLightElement { color, shape, status, confidence }
                };
                (ids, array.signals[0].elements.iter().map(element).collect::<Vec<_>>())
            }
            other => panic!("133: {other:?}"),
        };
        assert_eq!(ids, [34806], "133");
        check("133", &elements, &expected);
        match &sent(content.clone(), LightsType::GroupArray, compat)[..] {
            [LightsMessage::GroupArray(array)] => {
                let [group] = &array.traffic_light_groups[..] else { panic!("139: {array:?}") };
                assert_eq!((array.stamp, group.traffic_light_group_id), (now, 34806), "139");
                check("139", &group.elements, &expected);
            }
            other => panic!("139: {other:?}"),
        }
    }
}

fn check(case: &str, elements: &[TrafficLightElement], expected: &[(u8, u8)]) {
    let found: Vec<_> = elements.iter().map(|element| (element.color, element.status)).collect();
    assert_eq!(found, expected, "{case}");
    for element in elements {
        assert_eq!(element.shape, 1, "{case}: a circle");
        assert!((element.confidence - 0.7).abs() < 1e-6, "{case}");
    }
}

/// K 143: the two messages, and the spheres alone.
#[test]
fn group_k_markers_are_three_spheres_of_which_the_red_one_is_bright() {
    let lamp =
        |color, position_m, is_on| LampMarker { way_id: 34836, lamp: MapLamp { color, position_m }, is_on };
    let content = LightsContent::markers([
        lamp(LampColor::Green, [3770.02, 73738.34, 5.80], false),
        lamp(LampColor::Yellow, [3769.60, 73738.12, 5.81], false),
        lamp(LampColor::Red, [3769.15, 73737.92, 5.81], true),
    ]);
    for compat in BOTH {
        let mut messages = sent(content.clone(), LightsType::MarkerArray, compat);
        let Some(LightsMessage::MarkerArray(spheres)) = messages.pop() else { panic!("143: nothing") };
        match (&messages[..], compat) {
            ([], Compat::Improved) => {}
            ([LightsMessage::MarkerArray(wipe)], Compat::Upstream) => {
                assert_eq!(
                    (wipe.markers.len(), wipe.markers[0].action),
                    (1, 3),
                    "143: one marker, DELETEALL"
                );
            }
            other => panic!("143: {other:?}"),
        }
        assert_eq!(spheres.markers.len(), 3, "143");
        for (marker, (alpha, x)) in
            spheres.markers.iter().zip([(0.3, 3770.02), (0.3, 3769.60), (1.0, 3769.15)])
        {
            let (add, sphere) = (0, 2);
            assert_eq!((marker.action, marker.r#type, &*marker.ns), (add, sphere, "bulb"), "143");
            assert_eq!(marker.id >> 2, 34836, "143");
            assert!((marker.color.a - alpha).abs() < 1e-6, "143: {marker:?}");
            assert!((marker.pose.position.x - x).abs() < 0.01, "143: {marker:?}");
            assert_eq!((marker.scale.x, marker.scale.y, marker.scale.z), (0.3, 0.3, 0.3), "143");
            assert_eq!((marker.pose.orientation.x, marker.pose.orientation.w), (0.0, 1.0), "143");
            assert_eq!(marker.header.frame_id, "map", "143");
        }
    }
}

/// The numbers of one bulb in every message: colour, shape, status.
fn numbers(bulb: Bulb, compat: Compat) -> [u8; 3] {
    let head = LightState { way_id: 1, bulbs: [bulb].into_iter().collect(), confidence: 1.0 };
    let lights = sent(LightsContent::lights([head]), LightsType::ArrayV1, compat);
    let [LightsMessage::ArrayV1(array)] = &lights[..] else { panic!("{lights:?}") };
    let shown = array.traffic_lights[0].traffic_light_bulbs[0];
    let elements = vec![GroupElement { bulb, confidence: 1.0 }];
    let group = GroupState { relation_id: 1, elements, predictions: vec![] };
    let groups = sent(LightsContent::groups([group]), LightsType::GroupArray, compat);
    let [LightsMessage::GroupArray(array)] = &groups[..] else { panic!("{groups:?}") };
    let element = array.traffic_light_groups[0].elements[0];
    assert_eq!((shown.color, shown.shape, shown.status), (element.color, element.shape, element.status));
    assert_eq!(shown.enum_revision, 0);
    [element.color, element.shape, element.status]
}

/// N 175 to 191 and all between: colour, its number; status, its number; shape, its number in either mode.
#[test]
fn group_n_numbers_of_colours_states_and_shapes() {
    let bulb = BULBS[0];
    let colors =
        [(Color::Red, 1), (Color::Yellow, 2), (Color::Green, 3), (Color::White, 4), (Color::Unknown, 0)];
    let states = [
        (BulbStatus::SolidOff, 1),
        (BulbStatus::SolidOn, 2),
        (BulbStatus::Flashing, 3),
        (BulbStatus::Unknown, 0),
    ];
    let shapes = [
        (BulbShape::Circle, 1, 1),
        (BulbShape::Left, 2, 2),
        (BulbShape::Right, 3, 3),
        (BulbShape::Up, 4, 4),
        (BulbShape::UpperLeft, 5, 0),
        (BulbShape::UpperRight, 6, 0),
        (BulbShape::Down, 7, 7),
        (BulbShape::LowerLeft, 8, 8),
        (BulbShape::LowerRight, 9, 9),
        (BulbShape::Cross, 10, 10),
        (BulbShape::Unknown, 0, 0),
    ];
    assert_eq!(
        (colors.len(), states.len(), shapes.len()),
        (Color::ALL.len(), BulbStatus::ALL.len(), BulbShape::ALL.len())
    );
    for compat in BOTH {
        for (color, number) in colors {
            assert_eq!(numbers(Bulb { color, ..bulb }, compat)[0], number, "175 to 179: {color:?}");
        }
        for (status, number) in states {
            assert_eq!(numbers(Bulb { status, ..bulb }, compat)[2], number, "181, 183: {status:?}");
        }
        for (shape, ours, upstreams) in shapes {
            let number = if compat == Compat::Improved { ours } else { upstreams };
            assert_eq!(
                numbers(Bulb { shape, ..bulb }, compat)[1],
                number,
                "185 to 191: {shape:?}, {compat:?}"
            );
        }
    }
}

/// Q6: ids of 64 bits survive, or are cut to 32.
#[test]
fn large_ids_are_kept_and_upstream_cuts_them() {
    for (id, upstreams) in [(2_147_483_647, 2_147_483_647), (2_147_483_648, -2_147_483_648), (1 << 40, 0)] {
        for (compat, expected) in [(Compat::Improved, id), (Compat::Upstream, upstreams)] {
            let head = LightState { way_id: id, bulbs: BULBS.into_iter().collect(), confidence: 1.0 };
            let lights = sent(LightsContent::lights([head]), LightsType::ArrayV1, compat);
            let [LightsMessage::ArrayV1(array)] = &lights[..] else { panic!("{lights:?}") };
            assert_eq!(array.traffic_lights[0].lanelet_way_id, expected, "{id} {compat:?}");
        }
    }
}

/// docs/spec/traffic-lights.md, "Architectures":
/// text, upstream's V2I type, upstream's camera type, and the improved type of both.
#[test]
fn architectures_choose_the_message_or_are_refused() {
    let (signals, groups) = (Some(LightsType::SignalArray), Some(LightsType::GroupArray));
    for (text, v2i, camera, ours) in [
        ("awf/universe", None, None, None),
        ("awf/universe/20230906", signals, signals, signals),
        ("awf/auto", signals, None, None),
        ("awf/universe/20230905", signals, None, None),
        ("awf/universe/20230907", None, None, None),
        ("awf/universe/20240604", None, None, None),
        ("awf/universe/20240605", groups, groups, groups),
        ("awf/universe/20250130", groups, groups, groups),
        ("awf/universe/20250230", groups, groups, groups), // no calendar is kept
        ("tier4/proposal", groups, groups, None),
        ("awf/universe/20251301", groups, groups, None),
        ("awf/universe/20250132", groups, groups, None),
        ("awf/universe/2025013", groups, groups, None),
        ("awf/universe/+2025013", signals, None, None),
        ("awf/universe/202501300", groups, groups, None),
        ("AWF/universe/20250130", signals, None, None),
        (" awf/universe/20250130", signals, None, None),
        ("", signals, None, None),
    ] {
        let upstream = Architecture::parse(text, Compat::Upstream).unwrap();
        assert_eq!((upstream.v2i().ok(), upstream.camera().ok()), (v2i, camera), "{text:?}");
        let improved = Architecture::parse(text, Compat::Improved);
        let chosen = improved.as_ref().ok().map(|parsed| (parsed.v2i().ok(), parsed.camera().ok()));
        assert_eq!(chosen, ours.map(|lights| (Some(lights), Some(lights))), "{text:?}");
    }
    let refused = |text: &str| Architecture::parse(text, Compat::Improved).unwrap_err();
    assert_eq!(refused("awf/auto"), ArchitectureError::Malformed("awf/auto".to_owned()));
    let between = "awf/universe/20240101";
    assert_eq!(refused(between), ArchitectureError::Unsupported(between.to_owned()));
    let upstream = |text| Architecture::parse(text, Compat::Upstream).unwrap();
    assert_eq!(upstream("awf/auto").camera(), Err(ArchitectureError::InvalidArgument("awf/auto".to_owned())));
    assert_eq!(upstream(between).v2i(), Err(ArchitectureError::Semantic(between.to_owned())));
}
