//! Tests of confidences, truncated ids, predictions of several heads, markers.

use std::sync::Arc;

use super::*;
use crate::compat::Compat;
use crate::store::LightChange;
use crate::target::{SignalTarget, StoreId, StoreLayer};
use crate::text::parse_bulbs;
use lanelet2_map::light_map::{GroupEntry, LightMap, MapLamp};

const WIDE: i64 = (1 << 32) + 21;

/// Relation 7 refers to heads 1 and 2; head 2 is in relation 8 too; relation 9 refers to a wide id.
fn stores(compat: Compat) -> Stores {
    let lamp = |color| MapLamp { color, position_m: [1.0, 2.0, 3.0] };
    let lamps = [(1, vec![lamp(LampColor::Green), lamp(LampColor::Red)])];
    let groups = [GroupEntry::new(7, [1, 2]), GroupEntry::new(8, [2]), GroupEntry::new(9, [WIDE])];
    Stores::new(Arc::new(LightMap::new(lamps, &groups)), compat)
}

fn write(stores: &mut Stores, id: i64, layer: StoreLayer, state: &str, confidence: f64) {
    let target = SignalTarget { id, store: StoreId { channel: LightChannel::V2i, layer } };
    stores.write(target, LightChange::Set(parse_bulbs(state).unwrap())).unwrap();
    stores.write(target, LightChange::Confidence(confidence)).unwrap();
}

fn sent(stores: &Stores, one_group_per_head: bool) -> Vec<(i64, String)> {
    let text = |group: &GroupState| {
        let elements = group.elements.iter();
        elements
            .map(|element| format!("{} {}", element.bulb, element.confidence))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let groups: Vec<_> = if one_group_per_head {
        groups_by_head(stores, LightChannel::V2i, None)
    } else {
        all(groups(stores, LightChannel::V2i, None, &heads(stores)))
    };
    groups.iter().map(|group| (group.relation_id, text(group))).collect()
}

fn heads(stores: &Stores) -> BTreeSet<HeadIndex> {
    (0..).map(HeadIndex).take(stores.map.heads().len()).collect()
}

fn all<T>(items: Vec<(i64, Vec<T>)>) -> Vec<T> {
    items.into_iter().flat_map(|(_, items)| items).collect()
}

fn listed(expected: &[(i64, &str)]) -> Vec<(i64, String)> {
    expected.iter().map(|(id, text)| (*id, (*text).to_owned())).collect()
}

#[test]
fn heads_of_a_relation_are_one_group_with_the_highest_confidence() {
    let mut stores = stores(Compat::Improved);
    write(&mut stores, 1, StoreLayer::GroundTruth, "red", 0.4);
    write(&mut stores, 2, StoreLayer::GroundTruth, "red, green right", 0.6);
    let second = "green solidOn right 0.6, red solidOn circle 0.6";
    assert_eq!(sent(&stores, false), listed(&[(7, second), (8, second)]));
    assert_eq!(sent(&stores, true), listed(&[(7, "red solidOn circle 0.4"), (7, second), (8, second)]));
    // A detection hides the truth of that head only, even if it is dark.
    write(&mut stores, 2, StoreLayer::Detected, "", 0.9);
    assert_eq!(sent(&stores, false), listed(&[(7, "red solidOn circle 0.4")]));
    assert_eq!(sent(&stores, true), listed(&[(7, "red solidOn circle 0.4")]));
}

#[test]
fn upstream_cuts_ids_and_misses_their_detections() {
    for (compat, expected) in [
        (Compat::Improved, vec![(9, "green solidOn circle 1")]),
        (Compat::Upstream, vec![(9, "red solidOn circle 1"), (9, "green solidOn circle 1")]),
    ] {
        let mut stores = stores(compat);
        write(&mut stores, WIDE, StoreLayer::GroundTruth, "red", 1.0);
        write(&mut stores, WIDE, StoreLayer::Detected, "green", 1.0);
        assert_eq!(sent(&stores, true), listed(&expected), "{compat:?}");
        let way_id = if compat == Compat::Improved { WIDE } else { 21 };
        assert_eq!(all(lights(&stores, LightChannel::V2i, &heads(&stores)))[0].way_id, way_id);
    }
}

#[test]
fn upstream_replaces_a_detection_that_was_appended_before() {
    let map = Arc::new(LightMap::new([], &[GroupEntry::new(5, [30])]));
    let mut stores = Stores::new(map, Compat::Upstream);
    write(&mut stores, 5, StoreLayer::Detected, "red", 1.0);
    assert_eq!(sent(&stores, true), listed(&[(5, "red solidOn circle 1")]));
    write(&mut stores, 30, StoreLayer::Detected, "green", 1.0);
    assert_eq!(sent(&stores, true), listed(&[(5, "green solidOn circle 1")]));
}

#[test]
fn lamps_are_drawn_of_touched_heads_and_solid_off_counts_as_on() {
    let mut stores = stores(Compat::Improved);
    let drawn = |stores: &Stores, channels: &[LightChannel]| {
        let markers = all(markers(stores, channels, &heads(stores))).into_iter();
        markers.map(|marker| (marker.way_id, marker.lamp.color, marker.is_on)).collect::<Vec<_>>()
    };
    assert_eq!(drawn(&stores, &LightChannel::ALL), []);
    write(&mut stores, 1, StoreLayer::GroundTruth, "red solidOff, green left", 1.0);
    assert_eq!(drawn(&stores, &LightChannel::ALL), [(1, LampColor::Green, false), (1, LampColor::Red, true)]);
    assert_eq!(drawn(&stores, &[LightChannel::Conventional]), []);
}
