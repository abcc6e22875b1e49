//! Properties of the arbiter for any inputs in any order, and its agreement with the model.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use super::model::ArbiterModel;
use super::*;
use crate::bulb::{Bulb, BulbShape, BulbStatus, Color};
use crate::emission::{GroupElement, Prediction};
use gateway_base::time::WallStamp;
use lanelet2_map::light_map::GroupEntry;
use std::time::Duration;

const ON_MAP: [i64; 3] = [1001, 1002, 2001];

fn element() -> impl Strategy<Value = GroupElement> {
    (select(&Color::ALL[..]), select(&BulbStatus::ALL[..]), select(&BulbShape::ALL[..4]), 0..4_u8).prop_map(
        |(color, status, shape, confidence)| GroupElement {
            bulb: Bulb { color, status, shape },
            confidence: f64::from(confidence) / 4.0,
        },
    )
}

fn group() -> impl Strategy<Value = GroupState> {
    (select(vec![1001, 1002, 2001, 9999]), vec(element(), 0..4))
        .prop_map(|(relation_id, elements)| GroupState { relation_id, elements, predictions: Vec::new() })
}

/// Generates whether the input is from the camera, its stamp in tenths of a second relative to the clock, and
/// its groups.
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

fn map(relation_ids: &[i64]) -> LightMap {
    let group = |relation_id| GroupEntry {
        relation_id,
        way_ids: vec![relation_id + 1],
        is_pedestrian: relation_id == 2001,
    };
    LightMap::new([], &relation_ids.iter().copied().map(group).collect::<Vec<_>>())
}

/// An input of the arbiter. Messages share groups of a pool, like emissions.
#[derive(Debug, Clone)]
enum ArbiterStep {
    /// Tenths of a second, positions in the pool.
    Perception(i64, Vec<usize>),
    /// Tenths of a second of stamp and clock, positions in the pool.
    External(i64, i64, Vec<usize>),
    /// From now on, this group of the pool has another state.
    Change(usize, GroupState),
}

const POOL: usize = 8;

fn step() -> impl Strategy<Value = ArbiterStep> {
    let message = || prop_oneof![Just((0..POOL).collect()), vec(0..POOL, 0..POOL)];
    prop_oneof![
        4 => (-70..70_i64, message()).prop_map(|(stamp, groups)| ArbiterStep::Perception(stamp, groups)),
        4 => (-60..60_i64, -10..10_i64, message())
            .prop_map(|(stamp, clock, groups)| ArbiterStep::External(stamp, clock, groups)),
        4 => (0..POOL, group()).prop_map(|(index, group)| ArbiterStep::Change(index, group)),
    ]
}

proptest! {
    /// The result equals a merge of all groups, and is shared with the last one while it is equal.
    #[test]
    fn merging_changes_is_merging_all_groups(
        settings in settings(),
        relation_ids in select(vec![&ON_MAP[..], &ON_MAP[..2], &[9999], &[]]),
        mut pool in vec(group().prop_map(Arc::new), POOL),
        sorted in any::<bool>(),
        steps in vec(step(), 1..40),
    ) {
        let map = map(relation_ids);
        let (mut arbiter, mut model) = (Arbiter::new(settings, &map), ArbiterModel::new(settings, &map));
        let mut held: Vec<(Groups, Vec<GroupState>)> = Vec::new();
        for (number, step) in (0..).zip(steps) {
            if sorted {
                pool.sort_by_key(|group| group.relation_id);
            }
            let of_pool = |indices: &[usize]| indices.iter().map(|at| Arc::clone(&pool[*at])).collect::<Vec<_>>();
            let at = |tenths| ArbiterStamp(tenths * 100_000_000);
            let (output, expected) = match step {
                ArbiterStep::Change(index, mut group) => {
                    // The predictions make each group a different one.
                    group.predictions.push(Prediction {
                        at: WallStamp::from_nanos(number),
                        elements: Vec::new(),
                        reliability: 1.0,
                        source: "".into(),
                    });
                    pool[index] = Arc::new(group);
                    continue;
                }
                ArbiterStep::Perception(stamp, indices) => {
                    let groups = of_pool(&indices);
                    (Some(arbiter.perception(at(stamp), &groups)), Some(model.perception(at(stamp), &groups)))
                }
                ArbiterStep::External(stamp, clock, indices) => {
                    let (stamp, clock, groups) = (at(stamp), at(clock), of_pool(&indices));
                    (arbiter.external(stamp, &groups, clock), model.external(stamp, &groups, clock))
                }
            };
            prop_assert_eq!(&output, &expected);
            let Some(merged) = output else { continue };
            if let Some((last, copy)) = held.last() {
                let is_equal = copy.iter().eq(merged.iter().map(|group| &**group));
                prop_assert_eq!(Arc::ptr_eq(last, &merged), is_equal);
            }
            let copy = merged.iter().map(|group| (**group).clone()).collect();
            held.push((merged, copy));
        }
        for (shared, then) in held {
            prop_assert!(shared.iter().map(|group| &**group).eq(&then), "a sent list does not change");
        }
    }

    #[test]
    fn output_is_sorted_on_the_map_and_from_the_inputs(
        settings in settings(),
        inputs in vec(input(), 1..12),
    ) {
        let mut arbiter = Arbiter::new(settings, &map(&ON_MAP));
        let mut reported: Vec<GroupElement> = Vec::new();
        for (is_perception, tenths, groups) in inputs {
            let (clock, stamp) = (ArbiterStamp(0), ArbiterStamp(tenths * 100_000_000));
            reported.extend(groups.iter().flat_map(|group| &group.elements));
            let groups: Vec<_> = groups.into_iter().map(Arc::new).collect();
            let output = if is_perception {
                Some(arbiter.perception(stamp, &groups))
            } else {
                arbiter.external(stamp, &groups, clock)
            };
            let too_far = !is_perception && tenths.abs() > 50;
            prop_assert_eq!(output.is_none(), too_far);
            let Some(merged) = output else { continue };
            prop_assert!(merged.is_sorted_by(|one, next| one.relation_id < next.relation_id));
            prop_assert!(merged.iter().all(|group| ON_MAP.contains(&group.relation_id)));
            for element in merged.iter().flat_map(|group| &group.elements) {
                let unknown = Bulb { color: Color::Unknown, status: BulbStatus::Unknown, ..element.bulb };
                let made_up = GroupElement { bulb: unknown, confidence: 1.0 };
                prop_assert!(reported.contains(element) || settings.matching && *element == made_up);
            }
            for group in merged.iter() {
                let mut shapes: Vec<_> = group.elements.iter().map(|element| element.bulb.shape).collect();
                shapes.sort();
                prop_assert!(shapes.is_sorted_by(|one, next| one < next), "a shape twice");
            }
        }
    }

    /// Stamps at the ends of their range have a distance as well.
    #[test]
    fn any_stamps_are_compared_without_overflow(stamps in vec((any::<bool>(), any::<i64>(), any::<i64>()), 1..6)) {
        let mut arbiter = Arbiter::new(ArbiterSettings::default(), &map(&ON_MAP));
        for (is_perception, stamp, clock) in stamps {
            let group = Arc::new(GroupState { relation_id: 1001, ..GroupState::default() });
            let (stamp, clock) = (ArbiterStamp(stamp), ArbiterStamp(clock));
            if is_perception {
                prop_assert_eq!(arbiter.perception(stamp, &[group]).len(), 1);
            } else {
                let is_taken = arbiter.external(stamp, &[group], clock).is_some();
                prop_assert_eq!(is_taken, clock.distance(stamp) <= Duration::from_secs(5));
            }
        }
    }
}
