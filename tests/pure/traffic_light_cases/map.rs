//! Group M: the lights of a map. Even numbers are our own neighbours of the listed cases.

use lanelet2_map::light_map::{LampColor, LampSource, LightMap};
use lanelet2_map::osm;
use lanelet2_map::points::Points;
use lanelet2_map::projector::Projector;

const STANDARD: &str = include_str!("../../maps/standard.osm");
const CROSSROADS: &str = include_str!("../../maps/crossroads.osm");
/// The map's numbers and the expected ones have two decimals each.
const TOLERANCE_M: f64 = 0.021;

#[test]
fn ids_are_heads_groups_or_neither() {
    // (case, id, head?, group?) on the crossroads map; 120666 is not on the standard one
    let cases = [
        ("152", 34802, true, false),
        ("152", 34836, true, false),
        ("152", 34844, true, false),
        ("153", 120_659, false, false), // a lanelet
        ("154", 34806, false, true),
        ("155", 34806, false, true),
        ("156", 120_666, false, true),
        ("157", 1_000_003, false, false),
        ("158", 1_000_039, false, false),
        ("158", 34799, false, false), // lamps
        ("158", 34805, false, false), // a stop line
        ("158", 34836 - 1, false, false),
    ];
    let map = read(CROSSROADS, LampSource::Drawn);
    for (case, id, head, group) in cases {
        assert_eq!((map.head(id).is_some(), map.group(id).is_some()), (head, group), "{case}: {id}");
    }
    assert!(read(STANDARD, LampSource::Drawn).group(120_666).is_none());
}

#[test]
fn lights_of_a_map_are_those_a_group_refers_to() {
    let ids = |map: &str| {
        let map = read(map, LampSource::Drawn);
        let heads = map.heads().iter().filter(|head| !head.relation_ids.is_empty());
        heads.map(|head| head.way_id).collect::<Vec<_>>()
    };
    assert_eq!(ids(&without_lights()), Vec::<i64>::new(), "159");
    assert_eq!(ids(STANDARD), [34802, 34836], "160");
    assert_eq!(ids(CROSSROADS), [34802, 34836], "160");
}

#[test]
fn heads_and_groups_know_each_other_in_the_order_of_the_map() {
    let heads_of = |map: &LightMap, group| -> Vec<i64> {
        let heads = &map.group(group).unwrap().heads;
        heads.iter().map(|index| map.at(*index).unwrap().way_id).collect()
    };
    let groups_of = |map: &LightMap, head| map.at(map.head(head).unwrap()).unwrap().relation_ids.to_vec();
    let crossroads = read(CROSSROADS, LampSource::Drawn);
    assert_eq!(heads_of(&crossroads, 34806), [34836, 34802]);
    assert_eq!(heads_of(&crossroads, 120_666), [34836]);
    assert_eq!(groups_of(&crossroads, 34836), [34806, 120_666]);
    assert_eq!(groups_of(&crossroads, 34802), [34806]);
    assert_eq!(groups_of(&crossroads, 34844), Vec::<i64>::new());
    assert_eq!(groups_of(&read(STANDARD, LampSource::Drawn), 34836), [34806]);
}

#[test]
fn lamps_are_where_the_map_draws_or_lets_infer_them() {
    use LampSource::{Drawn, DrawnOrInferred};
    let bare = without_light_bulbs();
    let cases = [
        ("160", STANDARD, Drawn, 34802, "red", Some([3761.06, 73755.28, 5.34])),
        ("161", STANDARD, Drawn, 34802, "yellow", Some([3760.60, 73755.07, 5.35])),
        ("162", STANDARD, Drawn, 34802, "green", Some([3760.15, 73754.86, 5.34])),
        ("162", STANDARD, DrawnOrInferred, 34836, "red", Some([3769.15, 73737.92, 5.81])),
        ("163", STANDARD, Drawn, 34802, "pink", None),
        ("164", STANDARD, Drawn, 34844, "green", Some([3790.10, 73721.35, 5.64])),
        ("164", STANDARD, DrawnOrInferred, 1_000_003, "green", None),
        ("165", &bare, DrawnOrInferred, 34802, "yellow", Some([3760.60, 73755.07, 5.35])),
        ("166", &bare, DrawnOrInferred, 34802, "red", Some([3760.1575, 73754.8675, 5.3495])),
        ("166", &bare, DrawnOrInferred, 34802, "green", Some([3761.0525, 73755.3025, 5.3495])),
        ("167", &bare, Drawn, 34802, "green", None),
        ("167", &bare, Drawn, 34802, "yellow", None),
        ("167", &bare, Drawn, 34802, "red", None),
        ("167", &bare, Drawn, 34802, "pink", None),
        ("168", &bare, Drawn, 34836, "red", None),
    ];
    for (case, map, source, head, color, expected) in cases {
        let found = lamp(&read(map, source), head, color);
        let near = match (found, expected) {
            (Some(found), Some(expected)) => {
                (0..3).all(|axis| (found[axis] - expected[axis]).abs() < TOLERANCE_M)
            }
            (None, None) => true,
            (Some(_), None) | (None, Some(_)) => false,
        };
        assert!(near, "{case}: {head} {color}: {found:?}, {expected:?} expected");
    }
    let no_height = bare.replace("k=\"height\"", "k=\"tall\"");
    assert_eq!(lamp(&read(&no_height, DrawnOrInferred), 34802, "red"), None, "166: no height");
    let nowhere = LightMap::read(&osm::read(STANDARD.as_bytes()).unwrap(), None, DrawnOrInferred).unwrap();
    assert_eq!(lamp(&nowhere, 34802, "red"), None, "162: no coordinates");
    assert!(nowhere.head(34802).is_some(), "162: no coordinates");
}

fn read(map: &str, source: LampSource) -> LightMap {
    let osm = osm::read(map.as_bytes()).unwrap();
    let points = Points::new(&osm, &Projector::Local).unwrap();
    LightMap::read(&osm, Some(&points), source).unwrap()
}

fn lamp(map: &LightMap, head: i64, color: &str) -> Option<[f64; 3]> {
    let (head, color) = (map.at(map.head(head)?)?, LampColor::from_name(color)?);
    head.lamps.iter().find(|lamp| lamp.color == color).map(|lamp| lamp.position_m)
}

fn without_light_bulbs() -> String {
    STANDARD.replace("v=\"light_bulbs\"", "v=\"paint\"")
}

fn without_lights() -> String {
    STANDARD.replace("v=\"traffic_light\"", "v=\"street_lamp\"").replace("v=\"light_bulbs\"", "v=\"paint\"")
}
