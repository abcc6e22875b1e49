//! Rules of the stores that are not among the numbered cases.

use super::*;
use crate::compat::Compat;
use crate::text::parse_bulbs;
use lanelet2_map::light_map::GroupEntry;

/// Relation 7 refers to heads 2 and 1; relation 2 has the same id as a head and refers to head 3.
fn stores(compat: Compat) -> Stores {
    let groups = [GroupEntry::new(7, [2, 1]), GroupEntry::new(2, [3])];
    Stores::new(Arc::new(LightMap::new([], &groups)), compat)
}

fn at(id: i64, layer: StoreLayer) -> SignalTarget {
    SignalTarget { id, store: StoreId { channel: LightChannel::V2i, layer } }
}

fn red() -> BulbSet {
    parse_bulbs("red").unwrap()
}

fn touched(stores: &Stores) -> Vec<usize> {
    let lights = stores.truth(LightChannel::V2i).lights().iter().enumerate();
    lights.filter(|(_, light)| light.bulbs.is_some()).map(|(head, _)| head).collect()
}

#[test]
fn an_id_of_a_way_and_a_relation_is_the_relation() {
    for (compat, detected) in [(Compat::Improved, (3, 2)), (Compat::Upstream, (2, 1))] {
        let mut stores = stores(compat);
        stores.write(at(2, StoreLayer::GroundTruth), LightChange::Set(red())).unwrap();
        assert_eq!(touched(&stores), [2], "truth: the relation");
        stores.write(at(2, StoreLayer::Detected), LightChange::Set(red())).unwrap();
        let entries = stores.detected(LightChannel::V2i).entries().map(|(key, entry)| (key, entry.head.0));
        assert_eq!(entries.collect::<Vec<_>>(), [detected], "{compat:?}");
    }
}

#[test]
fn upstream_keeps_a_detection_of_a_group_for_its_first_head() {
    let mut stores = stores(Compat::Upstream);
    stores.write(at(7, StoreLayer::Detected), LightChange::Set(red())).unwrap();
    let entries = stores.detected(LightChannel::V2i).entries().map(|(key, entry)| (key, entry.head.0));
    assert_eq!(entries.collect::<Vec<_>>(), [(7, 1)], "head 2, at position 1");
    assert_eq!(stores.bulbs(at(7, StoreLayer::Detected)).unwrap().collect::<Vec<_>>(), [red()]);
    stores.write(at(1, StoreLayer::Detected), LightChange::Clear).unwrap();
    assert_eq!(stores.detected(LightChannel::V2i).entries().count(), 1, "cleared by its own id only");
}

#[test]
fn only_upstream_makes_lights_by_comparing_or_clearing() {
    for (compat, made) in [(Compat::Improved, vec![]), (Compat::Upstream, vec![0, 1])] {
        let mut stores = stores(compat);
        assert_eq!(stores.matches(at(7, StoreLayer::GroundTruth), Expected::Dark), Ok(true));
        assert_eq!(touched(&stores), made, "{compat:?} compared");
        stores = self::stores(compat);
        stores.write(at(7, StoreLayer::GroundTruth), LightChange::Clear).unwrap();
        assert_eq!(touched(&stores), made, "{compat:?} cleared");
        let bulbs = stores.bulbs(at(7, StoreLayer::GroundTruth)).unwrap();
        assert_eq!(bulbs.collect::<Vec<_>>(), [BulbSet::EMPTY; 2]);
    }
}

#[test]
fn clearing_keeps_the_confidence_and_removing_does_not() {
    let mut stores = stores(Compat::Improved);
    for layer in [StoreLayer::GroundTruth, StoreLayer::Detected] {
        let target = at(1, layer);
        let confidence = |stores: &Stores| match layer {
            StoreLayer::GroundTruth => stores.truth(LightChannel::V2i).lights()[0].confidence.to_string(),
            StoreLayer::Detected => stores.detected(LightChannel::V2i).light(1).confidence.to_string(),
        };
        stores.write(target, LightChange::Confidence(0.25)).unwrap();
        stores.write(target, LightChange::Set(red())).unwrap();
        stores.write(target, LightChange::Clear).unwrap();
        assert_eq!(confidence(&stores), "0.25", "{layer:?}");
        stores.write(target, LightChange::Remove).unwrap();
        assert_eq!(confidence(&stores), "1", "{layer:?}");
    }
    assert_eq!(touched(&stores), [] as [usize; 0]);
}

#[test]
fn only_differences_are_changes() {
    for compat in [Compat::Improved, Compat::Upstream] {
        let mut stores = stores(compat);
        for layer in [StoreLayer::GroundTruth, StoreLayer::Detected] {
            let changes = [
                (LightChange::Set(red()), true),
                (LightChange::Add(red()), false),
                (LightChange::Confidence(1.0), false),
                (LightChange::Confidence(0.5), true),
                (LightChange::Clear, true),
                (LightChange::Clear, false),
                (LightChange::Set(BulbSet::EMPTY), layer == StoreLayer::Detected),
            ];
            for (change, expected) in changes {
                assert_eq!(
                    stores.write(at(1, layer), change),
                    Ok(expected),
                    "{compat:?} {layer:?} {change:?}"
                );
            }
        }
    }
}
