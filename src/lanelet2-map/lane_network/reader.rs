//! The lane network of an `.osm` file (docs/spec/turn-signal-decider.md, "Map facts").

use std::collections::{BTreeMap, BTreeSet};

use super::graph_order::graph_order;
use super::tags::is_for_vehicles;
use super::topology::{Bound, DrawnLanelet, connected};
use super::{LaneNetwork, Lanelet, Roadside, Roundabout, TurnDirection};
use crate::error::{MIN_POINTS, MapError, POINTS_FOR_NODE, id_list_tag, number_tag};
use crate::geometry::Point;
use crate::geometry::centerline::{centerline, centerline_parts};
use crate::geometry::polyline::is_on_left;
use crate::osm::{Osm, OsmElement, OsmKind, Relation, Way};
use crate::points::Points;

/// The subtype of shoulder lanelets. They are not for vehicles, so they are not neighbours.
const SHOULDER: &str = "road_shoulder";

impl LaneNetwork {
    /// Creates the network of all lanelets of a map, including those that are not for vehicles, since a
    /// vehicle can pull out from a shoulder. Of the nodes, only the points are used.
    ///
    /// # Errors
    /// Returns a [`MapError`] with the faulty element.
    pub fn read(osm: &Osm, points: &Points) -> Result<Self, MapError> {
        let relations = || osm.relations.all().iter();
        let elements = || relations().filter(|relation| relation.is_regulatory("roundabout"));
        let mut builder = NetworkBuilder {
            osm,
            points,
            hatched: hatched_nodes(osm),
            roundabouts: elements().zip(0..).map(|(element, at)| (element.id, at)).collect(),
            points_so_far: 0,
            way_nodes: osm.ways.all().iter().map(|way| way.nodes.len()).sum(),
        };
        let lanelets = relations().filter(|relation| relation.is_lanelet());
        let mut drawn = lanelets.map(|relation| builder.lanelet(relation)).collect::<Result<Vec<_>, _>>()?;
        let order = graph_order(drawn.iter().map(|drawn| drawn.lane.id));
        let places: BTreeMap<_, _> = order.into_iter().zip(0_usize..).collect();
        drawn.sort_by_key(|drawn| places.get(&drawn.lane.id).copied());
        Ok(Self::new(connected(drawn), elements().map(roundabout).collect()))
    }
}

struct NetworkBuilder<'a> {
    osm: &'a Osm,
    points: &'a Points,
    /// Positions of nodes on polygons of hatched road markings.
    hatched: BTreeSet<usize>,
    /// Positions of the roundabouts by the ids of their regulatory elements.
    roundabouts: BTreeMap<i64, usize>,
    points_so_far: usize,
    way_nodes: usize,
}

impl<'a> NetworkBuilder<'a> {
    fn lanelet(&mut self, relation: &Relation) -> Result<DrawnLanelet, MapError> {
        let ways = [self.way(relation, "left")?, self.way(relation, "right")?];
        self.count_points(relation, ways.iter().map(|way| way.nodes.len()).sum())?;
        let [mut left, mut right] = [self.line(ways[0], relation)?, self.line(ways[1], relation)?];
        // Each bound is turned so that the other lies on its proper side, the left bound first, as in
        // lanelet2.
        let turns_left = is_on_left(&from_above(&left), middle(&right));
        if turns_left {
            left.reverse();
        }
        let turns_right = !is_on_left(&from_above(&right), middle(&left));
        if turns_right {
            right.reverse();
        }
        let parts = centerline_parts(&left, &right);
        self.count_points(relation, usize::try_from(parts).unwrap_or(usize::MAX))?;
        let (tags, element) = (&relation.tags, OsmElement { kind: OsmKind::Relation, id: relation.id });
        let exits = |key| id_list_tag(tags, key, element).map(Option::unwrap_or_default);
        let elements = relation.members("regulatory_element", OsmKind::Relation);
        let beside = |way: &Way| Roadside {
            hatched: way.nodes.iter().any(|node| self.hatched.contains(node)),
            lane: false,
        };
        let lane = Lanelet {
            id: relation.id,
            centerline: centerline(&left, &right),
            left_bound: from_above(&left),
            right_bound: from_above(&right),
            turn_direction: TurnDirection::from_tag(tags.get("turn_direction")),
            unknown_direction: TurnDirection::unknown(tags.get("turn_direction")),
            turn_signal_distance_m: number_tag(tags, "turn_signal_distance", element)?,
            followers: Vec::new(),
            left: beside(ways[0]),
            right: beside(ways[1]),
            roundabouts: elements.filter_map(|id| self.roundabouts.get(&id).copied()).collect(),
            exits_signalled_left: exits("exit_turn_signal_left")?,
            exits_signalled_right: exits("exit_turn_signal_right")?,
            enables_exit_signal: tags.is("enable_exit_turn_signal", "true"),
        };
        Ok(DrawnLanelet {
            lane,
            left: bound(ways[0], turns_left),
            right: bound(ways[1], turns_right),
            is_for_vehicles: is_for_vehicles(tags),
            is_shoulder: tags.is("subtype", SHOULDER),
        })
    }

    fn count_points(&mut self, relation: &Relation, more: usize) -> Result<(), MapError> {
        self.points_so_far = self.points_so_far.saturating_add(more);
        let nodes = self.way_nodes;
        let most = MIN_POINTS.saturating_add(nodes.saturating_mul(POINTS_FOR_NODE));
        if self.points_so_far > most {
            return Err(MapError::TooLarge { lanelet: relation.id, most, nodes });
        }
        Ok(())
    }

    /// Returns the only way on this side of a lanelet.
    fn way(&self, relation: &Relation, role: &'static str) -> Result<&'a Way, MapError> {
        let mut ways = relation.members(role, OsmKind::Way).filter_map(|id| self.osm.ways.get(id));
        match (ways.next(), ways.next()) {
            (Some(way), None) => Ok(way),
            _ => {
                let count = relation.members(role, OsmKind::Way).count();
                Err(MapError::Sides { lanelet: relation.id, role, count })
            }
        }
    }

    /// Returns the points of a bound as drawn, at least two.
    fn line(&self, way: &Way, of: &Relation) -> Result<Vec<[f64; 3]>, MapError> {
        let points: Vec<_> = way.nodes.iter().filter_map(|node| self.points.get(*node)).collect();
        if points.len() < 2 {
            return Err(MapError::ShortBound { way: way.id, lanelet: of.id });
        }
        Ok(points)
    }
}

fn bound(way: &Way, is_inverted: bool) -> Bound {
    let [first, last] = [way.nodes.first(), way.nodes.last()].map(|node| node.copied().unwrap_or_default());
    let ends = if is_inverted { [last, first] } else { [first, last] };
    Bound { way_id: way.id, is_inverted, ends }
}

fn roundabout(element: &Relation) -> Roundabout {
    let members = |role| element.members(role, OsmKind::Relation).collect();
    Roundabout { entries: members("entry"), exits: members("exit"), internals: members("internal") }
}

fn hatched_nodes(osm: &Osm) -> BTreeSet<usize> {
    let hatched = osm.ways.all().iter().filter(|way| way.tags.is("type", "hatched_road_markings"));
    hatched.flat_map(|way| way.nodes.iter().copied()).collect()
}

fn from_above(line: &[[f64; 3]]) -> Vec<Point> {
    line.iter().map(|[x_m, y_m, _]| Point::new(*x_m, *y_m)).collect()
}

/// Returns the middle point of the list, or the point half-way between the two middle points.
fn middle(line: &[[f64; 3]]) -> Point {
    match line {
        [[ax, ay, _], [bx, by, _]] => Point::new(f64::midpoint(*ax, *bx), f64::midpoint(*ay, *by)),
        many => many.get(many.len() / 2).map_or(Point::default(), |[x_m, y_m, _]| Point::new(*x_m, *y_m)),
    }
}

#[cfg(test)]
mod tests;
