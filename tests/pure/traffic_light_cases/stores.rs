//! Groups I, J and L: composed states, queries, detections over truth. Rows without a number are
//! neighbours of numbered ones.

use std::sync::Arc;

use lanelet2_map::light_map::{GroupEntry, LightMap};
use traffic_lights::bulb::{BulbSet, BulbStatus, Color};
use traffic_lights::compat::Compat;
use traffic_lights::refusal::ActionRefusal;
use traffic_lights::store::{Expected, LightChange, Stores};
use traffic_lights::target::{LightChannel, SignalTarget, StoreId};
use traffic_lights::text::{parse_bulb, parse_bulbs};

use super::scene::{BOTH, Scene, target};

const TRUTHS: [&str; 2] = ["34836 conventional", "34836 v2i"];
const DETECTED: &str = "34836 conventional_detected";

fn stores(compat: Compat) -> Stores {
    let heads = [34802, 34836, 34844].map(|way_id| (way_id, Vec::new()));
    Stores::new(Arc::new(LightMap::new(heads, &[GroupEntry::new(34806, [34836, 34802])])), compat)
}

/// The bulbs of a target: those of a head joined by `, `, heads by `; `.
fn text(stores: &Stores, at: SignalTarget) -> String {
    let heads: Vec<_> = stores.bulbs(at).unwrap().map(|bulbs| bulbs.to_string()).collect();
    heads.join("; ")
}

fn set(stores: &mut Stores, at: SignalTarget, state: &str) {
    stores.write(at, LightChange::Set(parse_bulbs(state).unwrap())).unwrap();
}

#[test]
fn i_colours_are_added_and_never_cleared() {
    for (compat, at) in BOTH.into_iter().flat_map(|compat| TRUTHS.map(|at| (compat, target(at)))) {
        let mut stores = stores(compat);
        for (case, color) in [(79, "green"), (0, "yellow"), (81, "red"), (0, "white"), (83, "unknown")] {
            stores.write(at, LightChange::Add(parse_bulbs(color).unwrap())).unwrap();
            assert!(text(&stores, at).contains(color), "I {case}");
        }
        let all = "green solidOn circle, yellow solidOn circle, red solidOn circle, white solidOn circle, \
                   unknown solidOn circle";
        assert_eq!(text(&stores, at), all);
    }
}

#[test]
fn i_composed_states() {
    let cases = [
        (85, "Green solidOn circle", "green solidOn circle"),
        (87, "Red solidOn circle", "red solidOn circle"),
        (89, "Yellow solidOn circle", "yellow solidOn circle"),
        (91, "white solidOn circle", "white solidOn circle"),
        (93, "green solidOn circle", "green solidOn circle"),
        (95, "green Blank circle", "green solidOff circle"),
        (97, "green flashing circle", "green flashing circle"),
        (99, "green solidOn circle", "green solidOn circle"),
        (101, "green solidOn left", "green solidOn left"),
        (103, "green solidOn up", "green solidOn up"),
        (105, "green solidOn lowerLeft", "green solidOn lowerLeft"),
        (107, "green solidOn lowerRight", "green solidOn lowerRight"),
        (109, "green solidOn straight", "green solidOn up"),
        (0, "", ""),
    ];
    for (compat, at) in BOTH.into_iter().flat_map(|compat| TRUTHS.map(|at| (compat, target(at)))) {
        let mut stores = stores(compat);
        for (case, state, expected) in cases {
            set(&mut stores, at, state);
            assert_eq!(text(&stores, at), expected, "I {case} {compat:?}");
        }
        for state in ["green solidOn circle", "red solidOn circle"] {
            stores.write(at, LightChange::Add(parse_bulbs(state).unwrap())).unwrap();
        }
        assert_eq!(text(&stores, at), "green solidOn circle, red solidOn circle", "I 111");
        let group = SignalTarget { id: 34806, ..at };
        set(&mut stores, SignalTarget { id: 34802, ..at }, "red");
        let both = "green solidOn circle, red solidOn circle; red solidOn circle";
        assert_eq!(text(&stores, group), both, "heads in the order of the map");
    }
}

#[test]
fn j_changes_are_counted() {
    // 113: upstream always reports a change, since each frame sends again; so do we, with the same content as
    // long as nothing changed.
    let mut stores = stores(Compat::Improved);
    let at = target("34836");
    set(&mut stores, at, "red");
    let before = stores.changes(StoreId::CONVENTIONAL);
    set(&mut stores, at, "red");
    assert_eq!(stores.changes(StoreId::CONVENTIONAL), before);
    set(&mut stores, at, "green");
    assert_ne!(stores.changes(StoreId::CONVENTIONAL), before);
    assert_eq!(stores.changes(StoreId::V2I), 0);
}

#[test]
fn j_comparison() {
    let cases = [
        (119, "green solidOn circle", "green solidOn circle", true),
        (121, "green solidOn circle", "yellow solidOn circle", false),
        (123, "green solidOn circle", "amber solidOn circle", false),
        (125, "green Blank circle", "green solidOff circle", true),
        (127, "green Blank circle", "green none circle", true),
        (0, "red, green right", "red", true),
        (0, "red", "red flashing", false),
    ];
    for (compat, at) in BOTH.into_iter().flat_map(|compat| TRUTHS.map(|at| (compat, target(at)))) {
        for (case, state, other, expected) in cases {
            let mut stores = stores(compat);
            set(&mut stores, at, state);
            let other = [parse_bulb(other).unwrap()].into_iter().collect();
            assert_eq!(stores.matches(at, Expected::Contains(other)), Ok(expected), "J {case}");
            let exactly = expected && text(&stores, at) == BulbSet::to_string(&other);
            assert_eq!(stores.matches(at, Expected::Exactly(other)), Ok(exactly), "J {case}, exactly");
        }
    }
}

#[test]
fn j_dark() {
    // A light set to `none` is dark in improved mode and not for upstream (Q13).
    for (state, improved, upstream) in [
        (None, true, true),
        (Some("none"), true, false),
        (Some(""), true, true),
        (Some("green"), false, false),
    ] {
        for (compat, expected) in [(Compat::Improved, improved), (Compat::Upstream, upstream)] {
            let mut stores = stores(compat);
            if let Some(state) = state {
                set(&mut stores, target("34836"), state);
            }
            assert_eq!(stores.matches(target("34806"), Expected::Dark), Ok(expected), "{state:?} {compat:?}");
        }
    }
}

#[test]
fn j_the_last_set_counts() {
    for (case, at) in [(129, TRUTHS[0]), (131, TRUTHS[1])] {
        for compat in BOTH {
            let mut stores = stores(compat);
            set(&mut stores, target(at), "red solidOn circle");
            set(&mut stores, target(at), "yellow flashing circle");
            assert_eq!(text(&stores, target(at)), "yellow flashing circle", "J {case}");
        }
    }
}

#[test]
fn l_detections() {
    for compat in BOTH {
        let mut stores = stores(compat);
        let at = target(DETECTED);
        for state in ["red circle", "green up"] {
            stores.write(at, LightChange::Add(parse_bulbs(state).unwrap())).unwrap();
        }
        assert_eq!(text(&stores, at), "green solidOn up, red solidOn circle");
        assert_eq!(stores.write(at, LightChange::Clear), Ok(true), "L 147");
        assert_eq!(stores.write(at, LightChange::Clear), Ok(false), "L 147");
        let detected = |stores: &Stores| {
            let entries = stores.detected(LightChannel::Conventional).entries();
            entries.filter_map(|(key, entry)| Some((key, entry.light.bulbs?))).collect::<Vec<_>>()
        };
        assert_eq!(detected(&stores), [], "L 147");
        set(&mut stores, at, "red solidOn circle");
        assert_eq!(detected(&stores).len(), 1, "L 149");
        set(&mut stores, at, "unknown unknown circle");
        let bulb = detected(&stores)[0].1.iter().next().unwrap();
        assert_eq!((bulb.color, bulb.status), (Color::Unknown, BulbStatus::Unknown), "L 151");
        assert!(stores.truth(LightChannel::Conventional).lights().iter().all(|light| light.bulbs.is_none()));
    }
}

#[test]
fn l_a_detection_without_truth_is_sent_for_all_relations() {
    for compat in BOTH {
        let hand = [(0, super::scene::set("21 conventional_detected", "red"))];
        Scene::of(compat, Vec::new(), &hand).check("L 149", &[(0, "gt21=- det=21:R int=200:R")]);
    }
}

#[test]
fn unknown_ids_are_refused_and_change_nothing() {
    for compat in BOTH {
        let mut stores = stores(compat);
        for text in ["1000003", "1000003 v2i_detected", "120659 conventional_detected"] {
            let at = target(text);
            let refusal = Err(ActionRefusal::UnknownId(at.id));
            assert_eq!(stores.write(at, LightChange::Set(BulbSet::EMPTY)), refusal, "{text}");
            assert_eq!(stores.matches(at, Expected::Dark), refusal, "{text}");
        }
        assert_eq!(stores.changes(StoreId::CONVENTIONAL), 0);
    }
}
