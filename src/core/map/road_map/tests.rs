use super::*;
use crate::core::map::lanelet::{ExitSignals, TurnDirection};
use crate::core::map::osm::{Element, OsmError};
use crate::core::map::projection::MgrsSquare;
use proptest::prelude::*;

const CROSSROADS: &str = include_str!("../../../../tests/maps/crossroads.osm");

fn crossroads() -> RoadMap {
    RoadMap::read(CROSSROADS.as_bytes(), &Projector::Local).unwrap()
}

fn ids(map: &RoadMap, indices: &[LaneletIndex]) -> Vec<i64> {
    indices.iter().map(|index| map.lanelet(*index).unwrap().id).collect()
}

fn near(one: [f64; 3], two: [f64; 3]) -> bool {
    one.iter().zip(two).all(|(one, two)| (one - two).abs() < 1e-9)
}

#[test]
fn bounds_run_with_traffic_however_they_are_drawn() {
    let map = crossroads();
    // Drawn from north to south, with the left of northbound traffic as `left`: taken as southbound
    // traffic's would be wrong side round.
    let northbound = map.lanelet(map.index_of(34570).unwrap()).unwrap();
    assert!(northbound.left.inverted && northbound.right.inverted);
    let ends = |bound: &Bound| [bound.line.points()[0], *bound.line.points().last().unwrap()];
    assert_eq!(ends(&northbound.left), [[3772.0, 73725.0, 0.5], [3772.0, 73750.0, 0.5]]);
    assert_eq!(ends(&northbound.right), [[3775.0, 73725.0, 0.5], [3775.0, 73750.0, 0.5]]);
    let eastbound = map.lanelet(map.index_of(34579).unwrap()).unwrap();
    assert!(!eastbound.left.inverted && !eastbound.right.inverted);
    // Turning any way of the file round changes nothing but the flag.
    let turned = RoadMap::read(turn_ways(CROSSROADS).as_bytes(), &Projector::Local).unwrap();
    for (one, two) in map.lanelets().iter().zip(turned.lanelets()) {
        assert_eq!((&one.left.line, &one.right.line), (&two.left.line, &two.right.line), "{}", one.id);
        assert_eq!((one.left.ends, one.right.ends), (two.left.ends, two.right.ends), "{}", one.id);
        assert_eq!(one.left.inverted, !two.left.inverted, "{}", one.id);
    }
}

/// The same file with the nodes of all ways the other way round.
fn turn_ways(map: &str) -> String {
    let (mut text, mut nodes) = (String::new(), Vec::new());
    for line in map.lines() {
        if line.trim().starts_with("<nd ") {
            nodes.push(line);
        } else {
            nodes.drain(..).rev().for_each(|node| text.extend([node, "\n"]));
            text.extend([line, "\n"]);
        }
    }
    text
}

#[test]
fn centerlines_are_generated_of_the_bounds() {
    let map = crossroads();
    let northbound = map.lanelet(map.index_of(34570).unwrap()).unwrap();
    let points = northbound.centerline.points();
    assert_eq!(points.len(), 6);
    for (at, point) in (0_u32..).zip(points) {
        assert!(near(*point, [3773.5, 73725.0 + 5.0 * f64::from(at), 0.5]), "{point:?}");
    }
    assert!((northbound.centerline.length_m() - 25.0).abs() < 1e-9);
}

#[test]
fn tags_say_what_a_lanelet_is() {
    let map = crossroads();
    let left = map.lanelet(map.index_of(34645).unwrap()).unwrap();
    assert_eq!((left.turn_direction, left.turn_signal_distance_m), (TurnDirection::Left, Some(25.0)));
    assert_eq!((&*left.subtype, left.location.as_deref()), ("road", Some("urban")));
    assert!(
        left.for_vehicles && left.one_way && !left.enable_exit_turn_signal && left.roundabouts.is_empty()
    );
    let plain = map.lanelet(map.index_of(120_659).unwrap()).unwrap();
    assert_eq!((plain.turn_direction, plain.turn_signal_distance_m), (TurnDirection::None, None));
    assert_eq!(map.index_of(34806), None);
    assert!(map.lights().lights().group(34806).is_some());
}

#[test]
fn lanelets_follow_each_other_by_shared_ends_and_lie_beside_by_shared_bounds() {
    let map = crossroads();
    let followers: [(i64, &[i64]); 5] = [
        (34579, &[120_659]),
        (120_660, &[34438]),
        (34468, &[34624, 34645]), // straight on, or to the left
        (34438, &[34633]),
        (34624, &[34411]),
    ];
    for (of, expected) in followers {
        assert_eq!(ids(&map, map.followers(map.index_of(of).unwrap())), expected, "{of}");
        for follower in map.followers(map.index_of(of).unwrap()) {
            assert!(ids(&map, map.previous(*follower)).contains(&of), "{of}");
        }
    }
    let beside = |neighbour: Option<Neighbour>| {
        neighbour.map(|found| (map.lanelet(found.lanelet).unwrap().id, found.routable))
    };
    let sides = [
        (34579, None, Some((34774, true))), // over a dashed line
        (34774, Some((34579, true)), None),
        (34624, None, Some((34633, false))), // no line in the crossing
        (34633, Some((34624, false)), None),
    ];
    for (of, left, right) in sides {
        let index = map.index_of(of).unwrap();
        assert_eq!((beside(map.left_of(index)), beside(map.right_of(index))), (left, right), "{of}");
    }
    assert!(map.followers(LaneletIndex(usize::MAX)).is_empty());
}

/// Two lanes that share way 10 as the left bound of each, one of them eastwards.
const OPPOSITE: &str = "<osm>
<node id='1'><tag k='local_x' v='0'/><tag k='local_y' v='0'/></node>
<node id='2'><tag k='local_x' v='20'/><tag k='local_y' v='0'/></node>
<node id='3'><tag k='local_x' v='0'/><tag k='local_y' v='-3'/></node>
<node id='4'><tag k='local_x' v='20'/><tag k='local_y' v='-3'/></node>
<node id='5'><tag k='local_x' v='0'/><tag k='local_y' v='3'/></node>
<node id='6'><tag k='local_x' v='20'/><tag k='local_y' v='3'/></node>
<way id='10'><nd ref='1'/><nd ref='2'/><tag k='type' v='line_thin'/><tag k='subtype' v='solid'/></way>
<way id='11'><nd ref='3'/><nd ref='4'/></way>
<way id='12'><nd ref='5'/><nd ref='6'/></way>
<way id='13'><nd ref='5'/><nd ref='6'/><nd ref='2'/><tag k='type' v='hatched_road_markings'/></way>
<relation id='20'><member type='way' ref='10' role='left'/><member type='way' ref='11' role='right'/>
  <member type='relation' ref='30' role='regulatory_element'/>
  <tag k='type' v='lanelet'/><tag k='exit_turn_signal_left' v='[7, -8]'/><tag k='exit_turn_signal_right' v='none'/></relation>
<relation id='21'><member type='way' ref='10' role='left'/><member type='way' ref='12' role='right'/>
  <tag k='type' v='lanelet'/><tag k='enable_exit_turn_signal' v='true'/></relation>
<relation id='30'><member type='relation' ref='20' role='entry'/><member type='relation' ref='21' role='exit'/>
  <tag k='type' v='regulatory_element'/><tag k='subtype' v='roundabout'/></relation>
</osm>";

#[test]
fn opposite_lanes_hatched_markings_and_roundabouts_are_known() {
    let map = RoadMap::read(OPPOSITE.as_bytes(), &Projector::Local).unwrap();
    let [east, west] = [LaneletIndex(0), LaneletIndex(1)];
    assert_eq!((map.opposite_left(east), map.opposite_left(west)), ([west].as_slice(), [east].as_slice()));
    assert!(map.opposite_right(east).is_empty() && map.left_of(east).is_none());
    let [east, west] = [east, west].map(|index| map.lanelet(index).unwrap());
    assert_eq!((east.left.inverted, west.left.inverted, west.right.inverted), (false, true, true));
    assert_eq!(west.centerline.points().first(), Some(&[20.0, 1.5, 0.0]));
    let hatched = [&east.left, &east.right, &west.left, &west.right].map(|bound| bound.hatched);
    assert_eq!(hatched, [true, false, true, true]);
    let signals = ExitSignals { left: Some(vec![7, -8]), right: None };
    assert_eq!((&east.exit_signals, west.enable_exit_turn_signal), (&signals, true));
    let roundabout = map.roundabout(east.roundabouts[0]).unwrap();
    assert_eq!((roundabout.relation_id, roundabout.entries.as_slice()), (30, [20].as_slice()));
    assert_eq!((roundabout.exits.as_slice(), roundabout.internals.len()), ([21].as_slice(), 0));
    assert!(roundabout.has(20) && roundabout.has(21) && !roundabout.has(30) && west.roundabouts.is_empty());
}

#[test]
fn places_are_found_in_and_near_lanelets() {
    let map = RoadMap::read(OPPOSITE.as_bytes(), &Projector::Local).unwrap();
    let at = |place| ids(&map, &map.lanelets_at(place));
    assert_eq!((at([5.0, -1.0]), at([5.0, 1.0]), at([5.0, 0.0])), (vec![20], vec![21], vec![20, 21]));
    assert_eq!((at([5.0, -3.5]), at([f64::NAN, 0.0])), (vec![], vec![]));
    let nearest = |place, wanted: &dyn Fn(&Lanelet) -> bool| {
        map.nearest_lanelet(place, wanted).map(|(index, distance_m)| (index.0, distance_m))
    };
    assert_eq!(nearest([23.0, 7.0], &|_| true), Some((1, 5.0)));
    assert_eq!(nearest([23.0, 7.0], &|lanelet| lanelet.id == 20), Some((0, 3.0_f64.hypot(7.0))));
    assert_eq!(nearest([5.0, 1.0], &|_| true), Some((1, 0.0)));
    assert_eq!(nearest([5.0, 0.0], &|_| true), Some((0, 0.0)), "the first of two");
    assert_eq!((nearest([0.0, 0.0], &|_| false), nearest([f64::INFINITY, 0.0], &|_| true)), (None, None));
}

#[test]
fn projected_and_local_coordinates_agree() {
    // The fixture lies in 54SVE, and its latitudes are PROJ's.
    let square = MgrsSquare::parse("54SVE").unwrap();
    let projected = CROSSROADS.replace("k=\"local_x\"", "k=\"x\"");
    let map = RoadMap::read(projected.as_bytes(), &Projector::Mgrs(square)).unwrap();
    for (one, two) in crossroads().lanelets().iter().zip(map.lanelets()) {
        for (one, two) in one.left.line.points().iter().zip(two.left.line.points()) {
            let far = (0..3).map(|axis| (one[axis] - two[axis]).abs()).fold(0.0, f64::max);
            assert!(far < 1e-5, "{one:?} {two:?}");
        }
    }
    // Local tags win in MGRS maps if all nodes have them.
    let moved = CROSSROADS.replace("lat=\"35", "lat=\"36");
    let map = RoadMap::read(moved.as_bytes(), &Projector::Mgrs(square)).unwrap();
    assert_eq!(map.lanelets(), crossroads().lanelets());
}

#[test]
fn what_is_wrong_is_told_with_its_element() {
    let relation = |id| Element { kind: Kind::Relation, id };
    let bad = |key, value: &str, expected| MapError::BadTag {
        element: relation(20),
        key,
        value: value.to_owned(),
        expected,
    };
    let cases = [
        (
            "ref='11' role='right'",
            "ref='11' role='left'",
            MapError::Sides { lanelet: 20, role: "left", count: 2 },
        ),
        (
            "ref='12' role='right'",
            "ref='12' role='center'",
            MapError::Sides { lanelet: 21, role: "right", count: 0 },
        ),
        ("<nd ref='3'/>", "", MapError::ShortBound { way: 11, lanelet: 20 }),
        ("<tag k='local_x' v='0'/><tag k='local_y' v='3'/>", "", MapError::NoLocal { node: 5 }),
        ("v='-3'", "v='1e8'", MapError::TooFar { node: 3 }),
        ("[7, -8]", "[7; -8]", bad("exit_turn_signal_left", "[7; -8]", "a list of ids or `none`")),
        ("'none'", "'none, 1'", bad("exit_turn_signal_right", "none, 1", "a list of ids or `none`")),
        (
            "k='exit_turn_signal_right' v='none'",
            "k='turn_signal_distance' v='far'",
            bad("turn_signal_distance", "far", "a number"),
        ),
        ("</osm>", "", MapError::Osm(OsmError::Truncated { line: 19 })),
    ];
    for (part, other, expected) in cases {
        let text = OPPOSITE.replacen(part, other, 1);
        assert_eq!(RoadMap::read(text.as_bytes(), &Projector::Local).unwrap_err(), expected, "{part}");
    }
    let square = MgrsSquare::parse("54SVE").unwrap();
    let unprojected = OPPOSITE.replacen("<tag k='local_x' v='0'/>", "", 1);
    let error = RoadMap::read(unprojected.as_bytes(), &Projector::Mgrs(square)).unwrap_err();
    assert_eq!(error, MapError::NotProjected { node: 1 });
}

proptest! {
    #[test]
    fn no_change_of_a_map_panics(at in 0..OPPOSITE.len(), bytes in proptest::collection::vec(any::<u8>(), 0..6)) {
        let mut text = OPPOSITE.as_bytes().to_vec();
        text.splice(at..(at + bytes.len()).min(OPPOSITE.len()), bytes);
        if let Ok(map) = RoadMap::read(&text, &Projector::Local) {
            for at in 0..map.lanelets().len() {
                let found = map.nearest_lanelet([1.0, 1.0], |_| true);
                prop_assert!(found.is_some());
                map.followers(LaneletIndex(at));
            }
        }
    }
}
