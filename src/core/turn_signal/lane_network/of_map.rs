//! The road as a map tells it (docs/spec/turn-signal-decider.md, "Map facts").

use std::collections::BTreeMap;

use super::{Lane, LaneId, LaneNetwork, Roadside, Roundabout};
use crate::core::map::lanelet::{Lanelet, LaneletIndex};
use crate::core::map::polyline::Polyline;
use crate::core::map::road_map::RoadMap;
use crate::core::turn_signal::geometry::Point;
use crate::core::turn_signal::signal::Side;

/// The subtype of lanelets that are shoulders. They are not for vehicles, so no neighbours.
const SHOULDER: &str = "road_shoulder";

impl LaneNetwork {
    /// The road of a map: all of its lanelets, also those that are not for vehicles, since a shoulder
    /// can be where a vehicle pulls out.
    pub fn of_map(map: &RoadMap) -> Self {
        let surveyor = Surveyor { map, shoulders: shoulders(map) };
        let lanes = map.lanelets().iter().enumerate();
        let roundabouts = map.roundabouts().iter().map(|roundabout| Roundabout {
            entries: roundabout.entries.clone(),
            exits: roundabout.exits.clone(),
            internals: roundabout.internals.clone(),
        });
        Self::new(lanes.map(|(at, lanelet)| surveyor.lane(LaneletIndex(at), lanelet)), roundabouts.collect())
    }
}

struct Surveyor<'a> {
    map: &'a RoadMap,
    /// Shoulders by the ways they lie between.
    shoulders: BTreeMap<i64, Vec<LaneId>>,
}

impl Surveyor<'_> {
    fn lane(&self, index: LaneletIndex, lanelet: &Lanelet) -> Lane {
        let followers = self.lanelets(self.map.followers(index)).map(|follower| follower.id).collect();
        let beside = |side, hatched| Roadside { hatched, lane: self.has_lane(index, lanelet, side) };
        Lane {
            id: lanelet.id,
            centerline: points(&lanelet.centerline),
            left_bound: points(&lanelet.left.line),
            right_bound: points(&lanelet.right.line),
            turn_direction: lanelet.turn_direction,
            turn_signal_distance_m: lanelet.turn_signal_distance_m,
            followers,
            left: beside(Side::Left, lanelet.left.hatched),
            right: beside(Side::Right, lanelet.right.hatched),
            roundabouts: lanelet.roundabouts.iter().map(|roundabout| roundabout.0).collect(),
            exits_signalled_left: lanelet.exit_signals.left.clone().unwrap_or_default(),
            exits_signalled_right: lanelet.exit_signals.right.clone().unwrap_or_default(),
            enables_exit_signal: lanelet.enable_exit_turn_signal,
        }
    }

    /// A neighbour, a shoulder, an opposite lane or a sibling on that side.
    fn has_lane(&self, index: LaneletIndex, lanelet: &Lanelet, side: Side) -> bool {
        let (way_id, opposite) = match side {
            Side::Left => (lanelet.left.way_id, self.map.opposite_left(index)),
            Side::Right => (lanelet.right.way_id, self.map.opposite_right(index)),
        };
        let is_other = |shoulder: &LaneId| *shoulder != lanelet.id;
        self.neighbour(index, side).is_some()
            || self.shoulders.get(&way_id).is_some_and(|beside| beside.iter().any(is_other))
            || opposite.iter().any(|other| *other != index)
            || self.has_sibling(index, lanelet, side)
    }

    /// Routable or not.
    fn neighbour(&self, index: LaneletIndex, side: Side) -> Option<LaneletIndex> {
        let neighbour = match side {
            Side::Left => self.map.left_of(index),
            Side::Right => self.map.right_of(index),
        };
        neighbour.map(|neighbour| neighbour.lanelet)
    }

    /// A lanelet that begins with this one and ends beside it: their inner bounds meet there, as they
    /// do when what follows the two lies side by side.
    fn has_sibling(&self, index: LaneletIndex, lanelet: &Lanelet, side: Side) -> bool {
        let meets = |sibling: &Lanelet| match side {
            Side::Left => sibling.right.ends[1] == lanelet.left.ends[1],
            Side::Right => sibling.left.ends[1] == lanelet.right.ends[1],
        };
        let roots = self.map.previous(index).iter();
        let siblings = roots.flat_map(|root| self.lanelets(self.map.followers(*root)));
        siblings.filter(|sibling| sibling.id != lanelet.id).any(meets)
    }

    fn lanelets<'a>(&'a self, indices: &'a [LaneletIndex]) -> impl Iterator<Item = &'a Lanelet> {
        indices.iter().filter_map(|index| self.map.lanelet(*index))
    }
}

fn shoulders(map: &RoadMap) -> BTreeMap<i64, Vec<LaneId>> {
    let mut shoulders: BTreeMap<i64, Vec<LaneId>> = BTreeMap::new();
    for shoulder in map.lanelets().iter().filter(|lanelet| &*lanelet.subtype == SHOULDER) {
        for bound in [&shoulder.left, &shoulder.right] {
            shoulders.entry(bound.way_id).or_default().push(shoulder.id);
        }
    }
    shoulders
}

/// Seen from above.
fn points(line: &Polyline) -> Vec<Point> {
    line.points().iter().map(|[x_m, y_m, _]| Point::new(*x_m, *y_m)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::map::lanelet::TurnDirection;
    use crate::core::map::projector::Projector;

    const CROSSROADS: &str = include_str!("../../../../tests/maps/crossroads.osm");

    fn road(osm: &str) -> LaneNetwork {
        LaneNetwork::of_map(&RoadMap::read(osm.as_bytes(), &Projector::Local).unwrap())
    }

    /// A map of lanelets, each between two lines of points on a grid of ten metres by one.
    struct Drawn {
        nodes: BTreeMap<(i32, i32), usize>,
        text: String,
    }

    impl Drawn {
        fn new() -> Self {
            Self { nodes: BTreeMap::new(), text: String::new() }
        }

        fn way(mut self, id: i64, places: &[(i32, i32)], tags: &str) -> Self {
            let mut members = String::new();
            for place in places {
                let next = self.nodes.len() + 1;
                members += &format!("<nd ref='{}'/>", self.nodes.entry(*place).or_insert(next));
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
        road.lane(id).map(|lane| (lane.left.lane, lane.right.lane)).unwrap()
    }

    #[test]
    fn a_map_of_a_crossing_is_a_road() {
        let road = road(CROSSROADS);
        let turn = road.lane(34645).unwrap();
        assert_eq!((turn.turn_direction, turn.turn_signal_distance_m), (TurnDirection::Left, Some(25.0)));
        assert_eq!((road.followers(34468), road.predecessors(34624)), (&[34624, 34645][..], &[34468][..]));
        let northbound = road.lane(34570).unwrap();
        assert_eq!(northbound.centerline.len(), 6);
        assert_eq!(northbound.centerline[1], Point::new(3773.5, 73730.0));
        assert_eq!(northbound.left_bound[0], Point::new(3772.0, 73725.0), "turned with the traffic");
        assert!(northbound.contains(Point::new(3773.0, 73740.0)));
        // A dashed line between, and no line at all within the crossing: both are lanes beside.
        for (lane, expected) in [(34579, (false, true)), (34774, (true, false)), (34624, (false, true))] {
            assert_eq!(sides(&road, lane), expected, "{lane}");
        }
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
        let seen = [1, 2, 3, 4].map(|lane| sides(&road, lane));
        assert_eq!(seen, [(false, false), (true, true), (true, true), (true, false)]);

        // A road that parts: 6 goes straight, 7 away to the left, and ends beside 6 or a metre off.
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
        assert_eq!(
            (&lane.exits_signalled_left[..], &lane.exits_signalled_right[..]),
            (&[][..], &[41, 42][..])
        );
        let roundabout = road.roundabouts_of(40).next().unwrap();
        assert_eq!((&roundabout.entries[..], &roundabout.exits[..]), (&[40][..], &[41][..]));
        assert_eq!(roundabout.internals, [43]);
    }
}
