//! What holds for any inputs, in any order.

use proptest::prelude::*;
use proptest::sample::select;

use super::*;
use crate::core::map::light_map::GroupEntry;
use crate::core::traffic_light::bulb::{Bulb, Color, Shape, Status};
use crate::core::traffic_light::emission::Element;

const ON_MAP: [i64; 3] = [1001, 1002, 2001];

fn element() -> impl Strategy<Value = Element> {
    (select(&Color::ALL[..]), select(&Status::ALL[..]), select(&Shape::ALL[..4]), 0..4_u8).prop_map(
        |(color, status, shape, confidence)| Element {
            bulb: Bulb { color, status, shape },
            confidence: f64::from(confidence) / 4.0,
        },
    )
}

fn group() -> impl Strategy<Value = GroupState> {
    (select(vec![1001, 1002, 2001, 9999]), proptest::collection::vec(element(), 0..4))
        .prop_map(|(relation_id, elements)| GroupState { relation_id, elements, predictions: Vec::new() })
}

/// From the camera or not, its stamp in tenths of a second around the clock's, and its groups.
fn input() -> impl Strategy<Value = (bool, i64, Vec<GroupState>)> {
    (any::<bool>(), -70..70_i64, proptest::collection::vec(group(), 0..4))
}

fn settings() -> impl Strategy<Value = ArbiterSettings> {
    let priority = select(vec![Priority::Confidence, Priority::External, Priority::Perception]);
    (priority, any::<bool>()).prop_map(|(priority, matching)| ArbiterSettings {
        priority,
        matching,
        ..ArbiterSettings::default()
    })
}

fn map() -> LightMap {
    let group = |relation_id| GroupEntry {
        relation_id,
        way_ids: vec![relation_id + 1],
        is_pedestrian: relation_id == 2001,
    };
    LightMap::new([], &ON_MAP.map(group))
}

proptest! {
    #[test]
    fn output_is_sorted_on_the_map_and_out_of_the_inputs(
        settings in settings(),
        inputs in proptest::collection::vec(input(), 1..12),
    ) {
        let mut arbiter = Arbiter::new(settings);
        arbiter.map(&map());
        let mut given: Vec<Element> = Vec::new();
        for (is_perception, tenths, groups) in inputs {
            let (clock, stamp) = (ArbiterStamp(0), ArbiterStamp(tenths * 100_000_000));
            given.extend(groups.iter().flat_map(|group| &group.elements));
            let output = if is_perception {
                arbiter.perception(stamp, &groups)
            } else {
                arbiter.external(stamp, &groups, clock)
            };
            let too_far = !is_perception && tenths.abs() > 50;
            prop_assert_eq!(output.is_err(), too_far);
            let Ok(judged) = output else { continue };
            prop_assert_eq!(judged.stamp, stamp);
            prop_assert_eq!(judged.newer_input, arbiter.latest_input() > Some(stamp));
            prop_assert!(judged.groups.is_sorted_by(|one, next| one.relation_id < next.relation_id));
            prop_assert!(judged.groups.iter().all(|group| ON_MAP.contains(&group.relation_id)));
            prop_assert!(judged.off_map.is_empty() || judged.off_map == [9999]);
            for element in judged.groups.iter().flat_map(|group| &group.elements) {
                let unknown = Bulb { color: Color::Unknown, status: Status::Unknown, ..element.bulb };
                let made_up = Element { bulb: unknown, confidence: 1.0 };
                prop_assert!(given.contains(element) || settings.matching && *element == made_up);
            }
            for group in &judged.groups {
                let mut shapes: Vec<_> = group.elements.iter().map(|element| element.bulb.shape).collect();
                shapes.sort();
                prop_assert!(shapes.is_sorted_by(|one, next| one < next), "a shape twice");
            }
        }
    }

    /// Stamps at the ends of their range have a distance, too.
    #[test]
    fn any_stamps_are_taken(stamps in proptest::collection::vec((any::<bool>(), any::<i64>(), any::<i64>()), 1..6)) {
        let mut arbiter = Arbiter::new(ArbiterSettings::default());
        arbiter.map(&map());
        for (is_perception, stamp, clock) in stamps {
            let group = GroupState { relation_id: 1001, ..GroupState::default() };
            let (stamp, clock) = (ArbiterStamp(stamp), ArbiterStamp(clock));
            let output = if is_perception {
                arbiter.perception(stamp, &[group])
            } else {
                arbiter.external(stamp, &[group], clock)
            };
            prop_assert_eq!(output.is_err(), !is_perception && clock.distance(stamp) > Duration::from_secs(5));
        }
    }
}
