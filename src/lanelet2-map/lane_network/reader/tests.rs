use super::*;
use crate::geometry::Pose;
use crate::lane_network::LaneId;
use crate::osm::{self, OsmError, OsmFault};
use crate::projector::{MgrsSquare, Projector};
use proptest::prelude::*;

const CROSSROADS: &str = include_str!("../../../../tests/maps/crossroads.osm");

fn read(text: &str, projector: &Projector) -> Result<LaneNetwork, MapError> {
    network(&osm::read(text.as_bytes()).unwrap(), projector)
}

fn network(osm: &Osm, projector: &Projector) -> Result<LaneNetwork, MapError> {
    LaneNetwork::read(osm, &Points::new(osm, projector)?)
}

fn road(osm: &str) -> LaneNetwork {
    read(osm, &Projector::Local).unwrap()
}

fn lane(road: &LaneNetwork, id: LaneId) -> &Lanelet {
    road.lane(id).unwrap()
}

/// A map of lanelets, each between two lines of points on a grid of ten metres by one metre.
struct Drawn {
    nodes: BTreeMap<(i32, i32), usize>,
    text: String,
}

impl Drawn {
    fn new() -> Self {
        Self { nodes: BTreeMap::new(), text: String::new() }
    }

    fn way(mut self, id: i64, corners: &[(i32, i32)], tags: &str) -> Self {
        let mut members = String::new();
        for corner in corners {
            let next = self.nodes.len() + 1;
            members += &format!("<nd ref='{}'/>", self.nodes.entry(*corner).or_insert(next));
        }
        self.text += &format!("<way id='{id}'>{members}{tags}</way>\n");
        self
    }

    fn lanelet(mut self, id: i64, left: i64, right: i64, more: &str) -> Self {
        let member = |way, role| format!("<member type='way' ref='{way}' role='{role}'/>");
        let (left, right) = (member(left, "left"), member(right, "right"));
        self.text +=
            &format!("<relation id='{id}'>{left}{right}<tag k='type' v='lanelet'/>{more}</relation>\n");
        self
    }

    fn road(&self) -> LaneNetwork {
        let node = |((x, y), id): (&(i32, i32), &usize)| {
            let tag = |key, value| format!("<tag k='{key}' v='{value}'/>");
            let (x, y) = (tag("local_x", x * 10), tag("local_y", *y));
            format!("<node id='{id}'>{x}{y}</node>\n")
        };
        let nodes: String = self.nodes.iter().map(node).collect();
        road(&format!("<osm>\n{nodes}{}</osm>", self.text))
    }
}

fn tag(key: &str, value: &str) -> String {
    format!("<tag k='{key}' v='{value}'/>")
}

fn sides(road: &LaneNetwork, id: LaneId) -> (bool, bool) {
    (lane(road, id).left.lane, lane(road, id).right.lane)
}

#[test]
fn a_map_of_a_crossing_is_a_road() {
    let road = road(CROSSROADS);
    let turn = lane(&road, 34645);
    assert_eq!((turn.turn_direction, turn.turn_signal_distance_m), (TurnDirection::Left, Some(25.0)));
    assert!(!turn.enables_exit_signal && turn.roundabouts.is_empty());
    let plain = lane(&road, 120_659);
    assert_eq!((plain.turn_direction, plain.turn_signal_distance_m), (TurnDirection::None, None));
    assert_eq!(road.lane(34806), None, "a traffic light");
    assert!(lane(&road, 34570).contains(Point::new(3773.0, 73740.0)));
    // A dashed line in between, and no line at all within the crossing: both have lanes beside them.
    let beside =
        [(34579, (false, true)), (34774, (true, false)), (34624, (false, true)), (34633, (true, false))];
    for (id, expected) in beside {
        assert_eq!(sides(&road, id), expected, "{id}");
    }
    let followers: [(i64, &[i64]); 5] = [
        (34579, &[120_659]),
        (120_660, &[34438]),
        (34468, &[34645, 34624]), // to the left, or straight on
        (34438, &[34633]),
        (34624, &[34411]),
    ];
    for (id, expected) in followers {
        assert_eq!(road.followers(id), expected, "{id}");
        assert!(expected.iter().all(|follower| road.predecessors(*follower).contains(&id)), "{id}");
    }
    assert!(road.followers(LaneId::MAX).is_empty());
}

/// The answers of lanelet2 1.2.3 for such a map, written to its binary format and read from it, as Autoware's
/// map message is.
#[test]
fn followers_and_predecessors_are_in_the_order_of_the_routing_graph() {
    let cases: [(i64, [&[i64]; 2]); 4] = [
        (1, [&[2, 3, 4], &[5, 6, 7]]),
        (40, [&[120, 17, 31, 59], &[3, 95, 77, 1000]]),
        (4_035_382, [&[4_035_380, 4_035_500, 4_036_001], &[4_030_013, 4_034_000, 4_035_381, 4_037_777]]),
        (34468, [&[34645, 34624, 120_659, 120_660], &[34411, 34579, 34774]]),
    ];
    for (middle, expected) in cases {
        for is_reversed in [false, true] {
            let arm = |drawn: Drawn, id: i64, left: [(i32, i32); 2]| {
                let (way, right) = (900_000 + 2 * id, left.map(|(x, y)| (x, y - 4)));
                drawn.way(way, &left, "").way(way + 1, &right, "").lanelet(id, way, way + 1, "")
            };
            let in_file = |ids: &'static [i64]| {
                let mut ids = ids.to_vec();
                ids.sort_unstable_by_key(|id| if is_reversed { -id } else { *id });
                (0..).step_by(10).zip(ids)
            };
            let mut drawn = arm(Drawn::new(), middle, [(0, 4), (1, 4)]);
            for (row, id) in in_file(expected[0]) {
                drawn = arm(drawn, id, [(1, 4), (2, 4 + row)]);
            }
            for (row, id) in in_file(expected[1]) {
                drawn = arm(drawn, id, [(-1, 4 + row), (0, 4)]);
            }
            let road = drawn.road();
            assert_eq!([road.followers(middle), road.predecessors(middle)], expected, "{middle}");
        }
    }
}

/// The centerline of a lanelet has a point every five metres, however few points its bounds have.
#[test]
fn a_small_map_cannot_have_a_centerline_of_millions_of_points() {
    let nodes: String = [(1, 0, 0), (2, 30_000_000, 0), (3, 0, 4), (4, 30_000_000, 4)]
        .map(|(id, x, y)| {
            format!(
                "<node id='{id}'>{}{}</node>",
                tag("local_x", &x.to_string()),
                tag("local_y", &y.to_string())
            )
        })
        .concat();
    let ways = [(5, 1, 2), (6, 3, 4)]
        .map(|(id, from, to)| format!("<way id='{id}'><nd ref='{from}'/><nd ref='{to}'/></way>"));
    let member = |way, role| format!("<member type='way' ref='{way}' role='{role}'/>");
    let lanelet = format!(
        "<relation id='7'>{}{}{}</relation>",
        member(6, "left"),
        member(5, "right"),
        tag("type", "lanelet")
    );
    let text = format!("<osm>{nodes}{}{lanelet}</osm>", ways.concat());
    let error = read(&text, &Projector::Local).unwrap_err().to_string();
    let start = "relation 7: with it, the lanelets have more than 4000024 points, the most for a map whose ways have 4: ";
    assert!(error.starts_with(start), "{error}");
}

#[test]
fn bounds_run_with_traffic_however_they_are_drawn() {
    let map = road(CROSSROADS);
    // Drawn from north to south, with `left` as for northbound traffic: read as southbound, the sides would
    // be swapped.
    let northbound = lane(&map, 34570);
    let ends = |line: &[Point]| [line[0], *line.last().unwrap()].map(|end| (end.x_m, end.y_m));
    assert_eq!(ends(&northbound.left_bound), [(3772.0, 73725.0), (3772.0, 73750.0)]);
    assert_eq!(ends(&northbound.right_bound), [(3775.0, 73725.0), (3775.0, 73750.0)]);
    assert_eq!(northbound.centerline.len(), 6);
    for (at, point) in (0_u32..).zip(&northbound.centerline) {
        assert!(point.distance_m(Point::new(3773.5, 73725.0 + 5.0 * f64::from(at))) < 1e-9, "{point:?}");
    }
    assert!((northbound.length_m() - 25.0).abs() < 1e-9);
    // Reversing any way of the file changes nothing.
    assert_eq!(map, road(&turn_ways(CROSSROADS)));
}

/// Returns the same file with the nodes of all ways in reverse.
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
fn lanes_on_either_side_come_in_five_kinds() {
    let solid = tag("type", "line_thin") + &tag("subtype", "solid");
    let shoulder = tag("subtype", "road_shoulder");
    // From right to left, all towards +x: shoulder 1, lanes 2 and 3, oncoming lane 4, kerb.
    let road = Drawn::new()
        .way(10, &[(0, 0), (2, 0)], "")
        .way(11, &[(0, 2), (2, 2)], "")
        .way(12, &[(0, 5), (2, 5)], &solid)
        .way(13, &[(0, 8), (2, 8)], "")
        .way(14, &[(0, 11), (2, 11)], "")
        .lanelet(1, 11, 10, &shoulder)
        .lanelet(2, 12, 11, "")
        .lanelet(3, 13, 12, "")
        .lanelet(4, 13, 14, "")
        .road();
    let beside = [1, 2, 3, 4].map(|lane| sides(&road, lane));
    assert_eq!(beside, [(false, false), (true, true), (true, true), (true, false)]);

    // A fork: 6 goes straight, 7 diverges to the left, and ends next to 6 or a metre away.
    let parting = |joined: bool| {
        let end = if joined { 3 } else { 4 };
        Drawn::new()
            .way(20, &[(0, 3), (1, 3)], "")
            .way(21, &[(0, 0), (1, 0)], "")
            .way(22, &[(1, 3), (2, 3)], "")
            .way(23, &[(1, 0), (2, 0)], "")
            .way(24, &[(1, 3), (2, 7)], "")
            .way(25, &[(1, 0), (2, end)], "")
            .lanelet(5, 20, 21, "")
            .lanelet(6, 22, 23, "")
            .lanelet(7, 24, 25, "")
    };
    assert_eq!([6, 7].map(|lane| sides(&parting(true).road(), lane)), [(true, false), (false, true)]);
    assert_eq!([6, 7].map(|lane| sides(&parting(false).road(), lane)), [(false, false); 2]);
}

#[test]
fn tags_of_roundabouts_and_hatchings_come_through() {
    let hatched = tag("type", "hatched_road_markings");
    let entry = tag("exit_turn_signal_right", "[41, 42]")
        + &tag("enable_exit_turn_signal", "true")
        + "<member type='relation' ref='50' role='regulatory_element'/>";
    let mut drawn = Drawn::new()
        .way(10, &[(0, 3), (1, 3)], "")
        .way(11, &[(0, 0), (1, 0)], "")
        .way(12, &[(0, 3), (1, 3), (1, 4)], &hatched)
        .lanelet(40, 10, 11, &entry)
        .lanelet(41, 10, 11, "")
        .lanelet(43, 10, 11, "");
    drawn.text += "<relation id='50'><member type='relation' ref='40' role='entry'/>\
        <member type='relation' ref='41' role='exit'/><member type='relation' ref='43' role='internal'/>\
        <tag k='type' v='regulatory_element'/><tag k='subtype' v='roundabout'/></relation>";
    let road = drawn.road();
    let lane = road.lane(40).unwrap();
    assert!(lane.left.is_hatched_only() && !lane.right.hatched && lane.enables_exit_signal);
    assert_eq!((&lane.exits_signalled_left[..], &lane.exits_signalled_right[..]), (&[][..], &[41, 42][..]));
    let roundabout = road.roundabouts_of(40).next().unwrap();
    assert_eq!((&roundabout.entries[..], &roundabout.exits[..]), (&[40][..], &[41][..]));
    assert_eq!(roundabout.internals, [43]);
}

/// Two lanes that share way 10 as their left bound, one of them eastwards.
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
    let road = road(OPPOSITE);
    let [east, west] = [lane(&road, 20), lane(&road, 21)];
    assert_eq!([20, 21].map(|id| sides(&road, id)), [(true, false), (true, false)]);
    assert_eq!(west.centerline.first(), Some(&Point::new(20.0, 1.5)));
    let hatched = [east.left, east.right, west.left, west.right].map(|side| side.hatched);
    assert_eq!(hatched, [true, false, true, true]);
    assert_eq!((&east.exits_signalled_left[..], &east.exits_signalled_right[..]), (&[7, -8][..], &[][..]));
    assert!(west.enables_exit_signal && !east.enables_exit_signal && west.roundabouts.is_empty());
    let roundabout = road.roundabouts_of(20).next().unwrap();
    assert_eq!((&roundabout.entries[..], &roundabout.exits[..]), (&[20][..], &[21][..]));
    assert!(roundabout.internals.is_empty());
    assert!(roundabout.contains(20) && roundabout.contains(21) && !roundabout.contains(30));
}

#[test]
fn projected_and_local_coordinates_agree() {
    // The fixture lies in 54SVE, and its latitudes are PROJ's.
    let square = Projector::Mgrs(MgrsSquare::parse("54SVE").unwrap());
    let projected = CROSSROADS.replace("k=\"local_x\"", "k=\"x\"");
    let map = read(&projected, &square).unwrap();
    assert_eq!(map.lanes().count(), road(CROSSROADS).lanes().count());
    for (one, two) in road(CROSSROADS).lanes().zip(map.lanes()) {
        for (one, two) in one.left_bound.iter().zip(&two.left_bound) {
            assert!(one.distance_m(*two) < 1e-5, "{one:?} {two:?}");
        }
    }
    // Local tags take precedence in MGRS maps if all nodes have them.
    let moved = CROSSROADS.replace("lat=\"35", "lat=\"36");
    assert_eq!(read(&moved, &square).unwrap(), road(CROSSROADS));
}

#[test]
fn a_map_that_cannot_be_used_is_refused_with_its_element() {
    let bad = |key, value: &str, expected| MapError::BadTag {
        element: OsmElement { kind: OsmKind::Relation, id: 20 },
        key,
        value: value.to_owned(),
        expected,
    };
    #[rustfmt::skip]
    let cases = [
        ("ref='11' role='right'", "ref='11' role='left'",
            MapError::Sides { lanelet: 20, role: "left", count: 2 }),
        ("ref='12' role='right'", "ref='12' role='center'",
            MapError::Sides { lanelet: 21, role: "right", count: 0 }),
        ("<nd ref='3'/>", "", MapError::ShortBound { way: 11, lanelet: 20 }),
        ("<tag k='local_x' v='0'/><tag k='local_y' v='3'/>", "", MapError::NoLocal(5)),
        ("v='-3'", "v='1e8'", MapError::TooFar(3)),
        ("[7, -8]", "[7; -8]", bad("exit_turn_signal_left", "[7; -8]", "a list of ids or `none`")),
        ("'none'", "'none, 1'", bad("exit_turn_signal_right", "none, 1", "a list of ids or `none`")),
        ("k='exit_turn_signal_right' v='none'", "k='turn_signal_distance' v='far'",
            bad("turn_signal_distance", "far", "a number")),
    ];
    for (part, other, expected) in cases {
        let text = OPPOSITE.replacen(part, other, 1);
        assert_eq!(read(&text, &Projector::Local).unwrap_err(), expected, "{part}");
    }
    let cut = OPPOSITE.replacen("</osm>", "", 1);
    assert_eq!(osm::read(cut.as_bytes()).unwrap_err(), OsmError { line: 19, fault: OsmFault::Truncated });
    let square = MgrsSquare::parse("54SVE").unwrap();
    let unprojected = OPPOSITE.replacen("<tag k='local_x' v='0'/>", "", 1);
    let error = read(&unprojected, &Projector::Mgrs(square)).unwrap_err();
    assert_eq!(error, MapError::NotProjected(1));
}

proptest! {
    #[test]
    fn no_change_of_a_map_panics(at in 0..OPPOSITE.len(), bytes in proptest::collection::vec(any::<u8>(), 0..6)) {
        let mut text = OPPOSITE.as_bytes().to_vec();
        text.splice(at..(at + bytes.len()).min(OPPOSITE.len()), bytes);
        let Ok(osm) = osm::read(&text) else { return Ok(()) };
        if let Ok(map) = network(&osm, &Projector::Local) {
            let ids: Vec<LaneId> = map.lanes().map(|lane| lane.id).collect();
            prop_assert_eq!(map.closest(ids.clone(), Pose::default()).is_some(), !ids.is_empty());
            prop_assert!(ids.iter().all(|id| map.followers(*id).iter().all(|next| ids.contains(next))));
        }
    }
}
