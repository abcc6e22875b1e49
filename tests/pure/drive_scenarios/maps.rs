//! The shipped maps are what `examples/make_maps.rs` makes, and are read as they are described.

use std::path::{Path, PathBuf};

use lanelet2_map::geometry::Point;
use lanelet2_map::lane_network::{LaneNetwork, Lanelet, TurnDirection};
use lanelet2_map::light_map::{LampSource, LightMap};
use lanelet2_map::osm;
use lanelet2_map::points::Points;
use lanelet2_map::projector::Projector;

#[path = "../../../examples/maps/mod.rs"]
mod generator;

use TurnDirection::{Left, Right, Straight};
use generator::{ALL, MAP_FILE, PROJECTOR, PROJECTOR_FILE};

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("config/maps").join(name)
}

pub(super) fn map(name: &str) -> LaneNetwork {
    let projector = Projector::parse(&std::fs::read_to_string(folder(name).join(PROJECTOR_FILE)).unwrap());
    let osm = osm::read(&std::fs::read(folder(name).join(MAP_FILE)).unwrap()).unwrap();
    LaneNetwork::read(&osm, &Points::new(&osm, &projector.unwrap()).unwrap()).unwrap()
}

fn lanelet(map: &LaneNetwork, id: i64) -> &Lanelet {
    map.lane(id).unwrap_or_else(|| panic!("no lanelet {id}"))
}

/// A lane on the left, a lane on the right.
fn beside(map: &LaneNetwork, id: i64) -> [bool; 2] {
    let lanelet = lanelet(map, id);
    [lanelet.left.lane, lanelet.right.lane]
}

fn ends(line: &[Point]) -> [Point; 2] {
    [line[0], line[line.len() - 1]]
}

#[test]
fn the_shipped_maps_are_what_the_generator_makes() {
    let shipped = std::fs::read_dir(folder("")).unwrap();
    let mut names: Vec<_> = shipped.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort_unstable();
    assert_eq!(names, ALL.map(|map| map.name));
    for map in ALL {
        let text = std::fs::read_to_string(folder(map.name).join(MAP_FILE)).unwrap();
        let hint = "run: cargo run --example make_maps -- config/maps";
        assert!(text == map.osm(), "{}: {hint}", map.name);
        let projector = std::fs::read_to_string(folder(map.name).join(PROJECTOR_FILE)).unwrap();
        assert_eq!(projector, PROJECTOR, "{}: {hint}", map.name);
    }
}

/// Routes that must be drivable, and the numbers of lanelets and of connections.
#[test]
fn lanelets_follow_each_other_as_described() {
    type Described = (&'static str, usize, &'static [&'static [i64]]);
    #[rustfmt::skip]
    let described: [Described; 13] = [
        ("block", 10, &[&[101, 102], &[101, 103, 104, 105, 106, 107, 108, 109, 110, 102], &[110, 103]]),
        ("bus_bay", 8, &[&[101, 102, 103, 104, 111, 112]]),
        ("chicane", 4, &[&[101, 102, 103, 104]]),
        ("consecutive_turns", 12, &[&[101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111, 112]]),
        ("crossing", 20, &[
            &[101, 111, 402], &[101, 112, 302], &[101, 113, 202], &[201, 211, 102], &[201, 212, 402],
            &[201, 213, 302], &[301, 311, 202], &[301, 312, 102], &[301, 313, 402], &[401, 411, 302],
            &[401, 412, 202], &[401, 413, 102],
        ]),
        ("fork", 8, &[&[101, 102, 104, 106, 108], &[101, 103, 105, 107, 108]]),
        ("helix", 12, &[&[101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111, 112]]),
        ("lane_change_road", 15,
            &[&[101, 102, 103, 111, 112], &[201, 202, 203, 211, 212], &[301, 302, 303, 311, 312]]),
        ("narrow_road", 3, &[&[101, 102, 103]]),
        ("roundabout", 24, &[RING, LEFT_TURN]),
        ("roundabout_untagged", 24, &[RING, LEFT_TURN]),
        ("side_streets", 9, &[&[101, 112, 102, 122, 103], &[101, 111, 113], &[102, 121, 123]]),
        ("turn_before_roundabout", 7, &[&[101, 102, 103, 104, 105, 106, 107]]),
    ];
    assert_eq!(described.map(|(name, ..)| name), ALL.map(|map| map.name));
    for (name, count, routes) in described {
        let map = map(name);
        assert_eq!(map.lanes().count(), count, "{name}");
        for pair in routes.iter().flat_map(|route| route.windows(2)) {
            assert!(map.followers(pair[0]).contains(&pair[1]), "{name}: {} to {}", pair[0], pair[1]);
            // Where one ends the other begins: the bounds are oriented along traffic.
            let [[_, end], [begin, _]] = [pair[0], pair[1]].map(|id| ends(&lanelet(&map, id).centerline));
            let gap_m = end.distance_m(begin);
            assert!(gap_m < 0.01, "{name}: {gap_m} m between {} and {}", pair[0], pair[1]);
        }
        // Nothing leads on by accident.
        let mut links: Vec<_> = routes.iter().flat_map(|route| route.windows(2)).collect();
        links.sort_unstable();
        links.dedup();
        let found: usize = map.lanes().map(|lanelet| lanelet.followers.len()).sum();
        // Six per arm: in, ring, out, round the arm.
        let expected = if name.starts_with("roundabout") { 24 } else { links.len() };
        assert_eq!(found, expected, "{name}");
    }
}

/// From the west all around and out again.
const RING: &[i64] = &[101, 102, 105, 206, 205, 306, 305, 406, 405, 103, 104];
/// From the west to the north.
const LEFT_TURN: &[i64] = &[101, 102, 105, 203, 204];

#[test]
fn turns_are_tagged_where_they_are() {
    for (name, id, direction, signal_m) in [
        ("crossing", 111, Left, None),
        ("crossing", 112, Straight, None),
        ("crossing", 113, Right, None),
        ("side_streets", 112, Straight, None),
        ("side_streets", 121, Left, None),
        ("crossing", 211, Left, Some(20.0)),
        ("crossing", 411, Left, None),
        ("chicane", 102, Left, None),
        ("chicane", 103, Right, None),
        ("consecutive_turns", 102, Left, None),
        ("consecutive_turns", 103, TurnDirection::None, None),
        ("consecutive_turns", 107, Left, None),
        ("consecutive_turns", 110, Right, None),
        ("lane_change_road", 111, Left, None),
        ("lane_change_road", 311, Right, None),
        ("bus_bay", 111, Left, None),
        ("fork", 103, TurnDirection::None, None),
        ("helix", 111, Left, None),
        ("turn_before_roundabout", 102, Left, None),
    ] {
        let map = map(name);
        let found = lanelet(&map, id);
        let tags = (found.turn_direction, found.turn_signal_distance_m);
        assert_eq!(tags, (direction, signal_m), "{name} {id}");
        // A lanelet that is tagged left bends left.
        let points = &found.centerline;
        let yaw = |from: usize| points[from].heading_to_rad(points[from + 1]);
        let mut bend = yaw(points.len() - 2) - yaw(0);
        if bend.abs() > std::f64::consts::PI {
            bend -= std::f64::consts::TAU.copysign(bend);
        }
        match direction {
            Left => assert!(bend > 0.3, "{name} {id}: {bend}"),
            Right => assert!(bend < -0.3, "{name} {id}: {bend}"),
            Straight => assert!(bend.abs() < 1e-9, "{name} {id}: {bend}"),
            TurnDirection::None => {}
        }
    }
}

#[test]
fn lanes_lie_beside_each_other_where_they_do() {
    let road = map("lane_change_road");
    assert_eq!([102, 202, 302].map(|id| beside(&road, id)), [[false, true], [true, true], [true, false]]);
    for (left, right) in [(102, 202), (202, 302)] {
        assert_eq!(lanelet(&road, left).right_bound, lanelet(&road, right).left_bound);
    }
    let crossing = map("crossing");
    assert_eq!(beside(&crossing, 101), [false, true], "the oncoming lane");
    let mut oncoming = lanelet(&crossing, 102).right_bound.clone();
    oncoming.reverse();
    assert_eq!(lanelet(&crossing, 101).right_bound, oncoming);
    let narrow = map("narrow_road");
    let hatched = |id| [lanelet(&narrow, id).left.hatched, lanelet(&narrow, id).right.hatched];
    assert_eq!([101, 102, 103].map(hatched), [[false, false], [true, false], [false, false]]);
    let bay = map("bus_bay");
    assert_eq!(
        [101, 102].map(|id| beside(&bay, id)),
        [[false, false], [true, true]],
        "shoulders on both sides"
    );
    assert_eq!(lanelet(&bay, 151).right_bound, lanelet(&bay, 102).left_bound);
    assert_eq!(lanelet(&bay, 152).left_bound, lanelet(&bay, 102).right_bound);
}

#[test]
fn roundabouts_have_their_roles_and_one_has_tags() {
    for (name, is_tagged) in [("roundabout", true), ("roundabout_untagged", false)] {
        let map = map(name);
        let [roundabout] = map.roundabouts() else { panic!("{name}") };
        assert_eq!(roundabout.entries, [102, 202, 302, 402], "{name}");
        assert_eq!(roundabout.exits, [103, 203, 303, 403], "{name}");
        assert_eq!(roundabout.internals, [105, 106, 205, 206, 305, 306, 405, 406], "{name}");
        for lanelet in map.lanes() {
            assert_eq!(lanelet.roundabouts.len(), usize::from(roundabout.contains(lanelet.id)), "{name}");
            assert_eq!(lanelet.enables_exit_signal, is_tagged && lanelet.id % 100 == 5, "{name}");
        }
        let entry = lanelet(&map, 202);
        let expected = if is_tagged { [vec![303], vec![103, 203]] } else { [vec![], vec![]] };
        assert_eq!([&entry.exits_signalled_left, &entry.exits_signalled_right], expected.each_ref());
    }
}

#[test]
fn the_crossing_has_a_light_for_each_arm() {
    let osm = osm::read(&std::fs::read(folder("crossing").join(MAP_FILE)).unwrap()).unwrap();
    let lights = LightMap::read(&osm, None, LampSource::Drawn).unwrap();
    let groups: Vec<_> = lights.groups().map(|(id, group)| (id, group.heads.len())).collect();
    assert_eq!(groups, [(150, 1), (250, 1), (350, 1), (450, 1)]);
    assert_eq!(lights.heads().len(), 4);
}
