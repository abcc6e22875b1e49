//! What holds for any inputs, in any order: also that only looking at changes changes nothing.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use super::model::Model;
use super::*;
use crate::core::map::light_map::GroupEntry;
use crate::core::time::WallStamp;
use crate::core::traffic_light::bulb::{Bulb, Color, Shape, Status};
use crate::core::traffic_light::emission::{Element, Prediction};

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
    (select(vec![1001, 1002, 2001, 9999]), vec(element(), 0..4))
        .prop_map(|(relation_id, elements)| GroupState { relation_id, elements, predictions: Vec::new() })
}

/// From the camera or not, its stamp in tenths of a second around the clock's, and its groups.
fn input() -> impl Strategy<Value = (bool, i64, Vec<GroupState>)> {
    (any::<bool>(), -70..70_i64, vec(group(), 0..4))
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
    map_of(&ON_MAP)
}

fn map_of(relation_ids: &[i64]) -> LightMap {
    let group = |relation_id| GroupEntry {
        relation_id,
        way_ids: vec![relation_id + 1],
        is_pedestrian: relation_id == 2001,
    };
    LightMap::new([], &relation_ids.iter().copied().map(group).collect::<Vec<_>>())
}

/// What happens to the arbiter. Messages share groups of a pool, as emissions do.
#[derive(Debug, Clone)]
enum Step {
    Map(&'static [i64]),
    /// Tenths of a second, positions in the pool.
    Perception(i64, Vec<usize>),
    /// Those of stamp and clock, likewise.
    External(i64, i64, Vec<usize>),
    /// From here on, this group of the pool is another one.
    Change(usize, GroupState),
}

const POOL: usize = 8;

fn step() -> impl Strategy<Value = Step> {
    let message = || prop_oneof![Just((0..POOL).collect()), vec(0..POOL, 0..POOL)];
    let maps = select(vec![&ON_MAP[..], &ON_MAP[..2], &[9999], &[]]);
    prop_oneof![
        1 => maps.prop_map(Step::Map),
        4 => (-70..70_i64, message()).prop_map(|(stamp, groups)| Step::Perception(stamp, groups)),
        4 => (-60..60_i64, -10..10_i64, message())
            .prop_map(|(stamp, clock, groups)| Step::External(stamp, clock, groups)),
        4 => (0..POOL, group()).prop_map(|(place, group)| Step::Change(place, group)),
    ]
}

proptest! {
    /// The same as judging all groups anew; and the very same content while it is equal.
    #[test]
    fn judging_what_changed_is_judging_all(
        settings in settings(),
        mut pool in vec(group().prop_map(Arc::new), POOL),
        sorted in any::<bool>(),
        steps in vec(step(), 1..40),
    ) {
        let (mut arbiter, mut model) = (Arbiter::new(settings), Model::new(settings));
        let mut held: Vec<(Groups, Vec<GroupState>)> = Vec::new();
        for (number, step) in (0..).zip(steps) {
            if sorted {
                pool.sort_by_key(|group| group.relation_id);
            }
            let of_pool = |places: &[usize]| places.iter().map(|at| Arc::clone(&pool[*at])).collect::<Vec<_>>();
            let at = |tenths| ArbiterStamp(tenths * 100_000_000);
            let (output, expected) = match step {
                Step::Map(relation_ids) => {
                    let map = map_of(relation_ids);
                    arbiter.map(&map);
                    model.map(&map);
                    held.clear();
                    continue;
                }
                Step::Change(place, mut group) => {
                    // Of each group the predictions tell which one it is.
                    group.predictions.push(Prediction {
                        at: WallStamp::from_nanos(number),
                        elements: Vec::new(),
                        reliability: 1.0,
                        source: "",
                    });
                    pool[place] = Arc::new(group);
                    continue;
                }
                Step::Perception(stamp, places) => {
                    let groups = of_pool(&places);
                    (arbiter.perception(at(stamp), &groups), model.perception(at(stamp), &groups))
                }
                Step::External(stamp, clock, places) => {
                    let (stamp, clock, groups) = (at(stamp), at(clock), of_pool(&places));
                    (arbiter.external(stamp, &groups, clock), model.external(stamp, &groups, clock))
                }
            };
            prop_assert_eq!(&output, &expected);
            let Ok(judged) = output else { continue };
            if let Some((last, copy)) = held.last() {
                let is_equal = copy.iter().eq(judged.groups.iter().map(|group| &**group));
                prop_assert_eq!(Arc::ptr_eq(last, &judged.groups), is_equal);
            }
            let copy = judged.groups.iter().map(|group| (**group).clone()).collect();
            held.push((judged.groups, copy));
        }
        for (shared, then) in held {
            prop_assert!(shared.iter().map(|group| &**group).eq(&then), "what was sent stays as it was sent");
        }
    }

    #[test]
    fn output_is_sorted_on_the_map_and_out_of_the_inputs(
        settings in settings(),
        inputs in vec(input(), 1..12),
    ) {
        let mut arbiter = Arbiter::new(settings);
        arbiter.map(&map());
        let mut given: Vec<Element> = Vec::new();
        for (is_perception, tenths, groups) in inputs {
            let (clock, stamp) = (ArbiterStamp(0), ArbiterStamp(tenths * 100_000_000));
            given.extend(groups.iter().flat_map(|group| &group.elements));
            let groups: Vec<_> = groups.into_iter().map(Arc::new).collect();
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
            for group in judged.groups.iter() {
                let mut shapes: Vec<_> = group.elements.iter().map(|element| element.bulb.shape).collect();
                shapes.sort();
                prop_assert!(shapes.is_sorted_by(|one, next| one < next), "a shape twice");
            }
        }
    }

    /// Stamps at the ends of their range have a distance, too.
    #[test]
    fn any_stamps_are_taken(stamps in vec((any::<bool>(), any::<i64>(), any::<i64>()), 1..6)) {
        let mut arbiter = Arbiter::new(ArbiterSettings::default());
        arbiter.map(&map());
        for (is_perception, stamp, clock) in stamps {
            let group = Arc::new(GroupState { relation_id: 1001, ..GroupState::default() });
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
