//! The shipped maps are what `examples/make_maps.rs` makes, and are read as they are described.

use std::path::{Path, PathBuf};

use signal_gateway::core::map::lanelet::{Lanelet, TurnDirection};
use signal_gateway::core::map::polyline::Polyline;
use signal_gateway::core::map::projector::Projector;
use signal_gateway::core::map::road_map::RoadMap;

#[path = "../../../examples/maps/mod.rs"]
mod generator;

use TurnDirection::{Left, Right, Straight};
use generator::{ALL, MAP_FILE, PROJECTOR, PROJECTOR_FILE};

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("config/maps").join(name)
}

fn map(name: &str) -> RoadMap {
    let projector = Projector::parse(&std::fs::read_to_string(folder(name).join(PROJECTOR_FILE)).unwrap());
    RoadMap::read(&std::fs::read(folder(name).join(MAP_FILE)).unwrap(), &projector.unwrap()).unwrap()
}

fn lanelet(map: &RoadMap, id: i64) -> &Lanelet {
    map.lanelet(map.index_of(id).unwrap_or_else(|| panic!("no lanelet {id}"))).unwrap()
}

fn followers(map: &RoadMap, id: i64) -> Vec<i64> {
    let followers = map.followers(map.index_of(id).unwrap());
    followers.iter().map(|index| map.lanelet(*index).unwrap().id).collect()
}

/// Left and right neighbour, if a lane change to it is allowed.
fn beside(map: &RoadMap, id: i64) -> [Option<i64>; 2] {
    let index = map.index_of(id).unwrap();
    [map.left_of(index), map.right_of(index)].map(|neighbour| {
        let neighbour = neighbour.filter(|neighbour| neighbour.routable)?;
        Some(map.lanelet(neighbour.lanelet).unwrap().id)
    })
}

fn ends(line: &Polyline) -> [[f64; 2]; 2] {
    let points: Vec<[f64; 2]> = line.points().iter().map(|[x, y, _]| [*x, *y]).collect();
    [points[0], points[points.len() - 1]]
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

/// Routes that must be drivable, and how many lanelets and roads lead on from nowhere to nowhere.
#[test]
fn lanelets_follow_each_other_as_described() {
    type Described = (&'static str, usize, &'static [&'static [i64]]);
    let described: [Described; 8] = [
        ("bus_bay", 8, &[&[101, 102, 103, 104, 111, 112]]),
        ("consecutive_turns", 12, &[&[101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111, 112]]),
        (
            "crossing",
            20,
            &[
                &[101, 111, 402],
                &[101, 112, 302],
                &[101, 113, 202],
                &[201, 211, 102],
                &[201, 212, 402],
                &[201, 213, 302],
                &[301, 311, 202],
                &[301, 312, 102],
                &[301, 313, 402],
                &[401, 411, 302],
                &[401, 412, 202],
                &[401, 413, 102],
            ],
        ),
        ("fork", 8, &[&[101, 102, 104, 106, 108], &[101, 103, 105, 107, 108]]),
        (
            "lane_change_road",
            15,
            &[&[101, 102, 103, 111, 112], &[201, 202, 203, 211, 212], &[301, 302, 303, 311, 312]],
        ),
        ("narrow_road", 3, &[&[101, 102, 103]]),
        ("roundabout", 24, &[RING, LEFT_TURN]),
        ("roundabout_untagged", 24, &[RING, LEFT_TURN]),
    ];
    assert_eq!(described.map(|(name, ..)| name), ALL.map(|map| map.name));
    for (name, count, routes) in described {
        let map = map(name);
        assert_eq!(map.lanelets().len(), count, "{name}");
        for pair in routes.iter().flat_map(|route| route.windows(2)) {
            assert!(followers(&map, pair[0]).contains(&pair[1]), "{name}: {} to {}", pair[0], pair[1]);
            // Where one ends the other begins: the bounds are oriented along traffic.
            let [[_, end], [begin, _]] = [pair[0], pair[1]].map(|id| ends(&lanelet(&map, id).centerline));
            let gap_m = (end[0] - begin[0]).hypot(end[1] - begin[1]);
            assert!(gap_m < 0.01, "{name}: {gap_m} m between {} and {}", pair[0], pair[1]);
        }
        // Nothing leads on by accident.
        let mut links: Vec<_> = routes.iter().flat_map(|route| route.windows(2)).collect();
        links.sort_unstable();
        links.dedup();
        let found: usize = map.lanelets().iter().map(|lanelet| followers(&map, lanelet.id).len()).sum();
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
        ("crossing", 211, Left, Some(20.0)),
        ("crossing", 411, Left, None),
        ("consecutive_turns", 102, Left, None),
        ("consecutive_turns", 103, TurnDirection::None, None),
        ("consecutive_turns", 107, Left, None),
        ("consecutive_turns", 110, Right, None),
        ("lane_change_road", 111, Left, None),
        ("lane_change_road", 311, Right, None),
        ("bus_bay", 111, Left, None),
        ("fork", 103, TurnDirection::None, None),
    ] {
        let map = map(name);
        let found = lanelet(&map, id);
        assert_eq!(
            (found.turn_direction, found.turn_signal_distance_m),
            (direction, signal_m),
            "{name} {id}"
        );
        // A lanelet that is tagged left bends left.
        let points = found.centerline.points();
        let yaw = |from: usize| {
            (points[from + 1][1] - points[from][1]).atan2(points[from + 1][0] - points[from][0])
        };
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
    assert_eq!(beside(&road, 102), [None, Some(202)]);
    assert_eq!(beside(&road, 202), [Some(102), Some(302)]);
    assert_eq!(beside(&road, 302), [Some(202), None]);
    let crossing = map("crossing");
    let opposite = crossing.opposite_right(crossing.index_of(101).unwrap());
    assert_eq!(opposite.iter().map(|index| crossing.lanelet(*index).unwrap().id).collect::<Vec<_>>(), [102]);
    let narrow = map("narrow_road");
    let hatched = |id| [lanelet(&narrow, id).left.hatched, lanelet(&narrow, id).right.hatched];
    assert_eq!([101, 102, 103].map(hatched), [[false, false], [true, false], [false, false]]);
    let bay = map("bus_bay");
    for id in [151, 152] {
        assert_eq!(&*lanelet(&bay, id).subtype, "road_shoulder");
    }
    assert_eq!(lanelet(&bay, 151).right.way_id, lanelet(&bay, 102).left.way_id);
    assert_eq!(lanelet(&bay, 152).left.way_id, lanelet(&bay, 102).right.way_id);
}

#[test]
fn roundabouts_have_their_roles_and_one_has_tags() {
    for (name, is_tagged) in [("roundabout", true), ("roundabout_untagged", false)] {
        let map = map(name);
        let [roundabout] = map.roundabouts() else { panic!("{name}") };
        assert_eq!(roundabout.entries, [102, 202, 302, 402], "{name}");
        assert_eq!(roundabout.exits, [103, 203, 303, 403], "{name}");
        assert_eq!(roundabout.internals, [105, 106, 205, 206, 305, 306, 405, 406], "{name}");
        for lanelet in map.lanelets() {
            assert_eq!(lanelet.roundabouts.len(), usize::from(roundabout.has(lanelet.id)), "{name}");
            assert_eq!(lanelet.enable_exit_turn_signal, is_tagged && lanelet.id % 100 == 5, "{name}");
        }
        let signals = &lanelet(&map, 202).exit_signals;
        let expected = is_tagged.then(|| [vec![303], vec![103, 203]]);
        assert_eq!(
            [&signals.left, &signals.right],
            [0, 1].map(|side| expected.as_ref().map(|ids| ids[side].clone())).each_ref()
        );
    }
}

#[test]
fn the_lights_of_the_crossing_are_for_who_comes() {
    let map = map("crossing");
    for arm in 1..=4 {
        for role in [11, 12, 13] {
            assert_eq!(map.lights().groups_of(100 * arm + role), [100 * arm + 50]);
        }
        assert!(map.lights().groups_of(100 * arm + 1).is_empty());
    }
    assert_eq!(map.lights().lights().heads().len(), 4);
}
