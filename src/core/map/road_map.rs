//! A whole lanelet2 map: lanelets, how they lie to each other, roundabouts and lights.

use std::collections::{BTreeMap, BTreeSet};

use super::error::{MAX_POINTS, MapError};
use super::index::LaneletTree;
use super::lanelet::{
    Bound, LaneChange, Lanelet, LaneletIndex, Roundabout, RoundaboutIndex, Said, is_for_vehicles, is_one_way,
};
use super::light_roads::{LampSource, LightRoads};
use super::osm::{self, Kind, Osm, Relation, Way};
use super::points::Points;
use super::polyline::{Polyline, centerline, centerline_parts};
use super::projector::Projector;
use super::topology::{Neighbour, Topology};

/// A map, ready for questions. Lanelets are in the order of the file.
#[derive(Debug, Clone)]
pub struct RoadMap {
    lanelets: Vec<Lanelet>,
    by_id: BTreeMap<i64, LaneletIndex>,
    roundabouts: Vec<Roundabout>,
    topology: Topology,
    tree: LaneletTree,
    lights: LightRoads,
}

impl RoadMap {
    /// Reads the text of an `.osm` file.
    ///
    /// # Errors
    /// [`MapError`], with the element that is wrong.
    pub fn read(osm: &[u8], projector: &Projector) -> Result<Self, MapError> {
        Self::new(&osm::read(osm)?, projector)
    }

    /// Makes a map of primitives.
    ///
    /// # Errors
    /// [`MapError`], with the element that is wrong.
    pub fn new(osm: &Osm, projector: &Projector) -> Result<Self, MapError> {
        let points = Points::new(osm, projector)?;
        let lights = LightRoads::read(osm, Some(&points), LampSource::DrawnOrInferred)?;
        let relations = osm.relations.all();
        let roundabouts: Vec<_> = relations
            .iter()
            .filter(|relation| relation.is_regulatory("roundabout"))
            .map(Roundabout::read)
            .collect();
        let mut builder = Builder {
            osm,
            points: &points,
            hatched: hatched_nodes(osm),
            roundabouts: roundabouts
                .iter()
                .enumerate()
                .map(|(at, roundabout)| (roundabout.relation_id, RoundaboutIndex(at)))
                .collect(),
            points_so_far: 0,
        };
        let lanelets: Result<Vec<_>, _> = relations
            .iter()
            .filter(|relation| relation.is_lanelet())
            .map(|relation| builder.lanelet(relation))
            .collect();
        let lanelets = lanelets?;
        Ok(Self {
            by_id: lanelets.iter().enumerate().map(|(at, lanelet)| (lanelet.id, LaneletIndex(at))).collect(),
            topology: Topology::new(&lanelets),
            tree: LaneletTree::new(&lanelets),
            lanelets,
            roundabouts,
            lights,
        })
    }

    /// All lanelets, in the order of the file; [`LaneletIndex`] points here.
    pub fn lanelets(&self) -> &[Lanelet] {
        &self.lanelets
    }

    /// The lanelet at this position.
    pub fn lanelet(&self, index: LaneletIndex) -> Option<&Lanelet> {
        self.lanelets.get(index.0)
    }

    /// The lanelet with this id.
    pub fn index_of(&self, id: i64) -> Option<LaneletIndex> {
        self.by_id.get(&id).copied()
    }

    /// All roundabouts, in the order of the file; [`RoundaboutIndex`] points here.
    pub fn roundabouts(&self) -> &[Roundabout] {
        &self.roundabouts
    }

    /// The roundabout at this position.
    pub fn roundabout(&self, index: RoundaboutIndex) -> Option<&Roundabout> {
        self.roundabouts.get(index.0)
    }

    /// The traffic lights.
    pub fn lights(&self) -> &LightRoads {
        &self.lights
    }

    /// Lanelets for vehicles that begin where this one ends, in the order of the file.
    pub fn followers(&self, index: LaneletIndex) -> &[LaneletIndex] {
        self.lanelet(index).map_or(&[], |of| self.topology.followers(of))
    }

    /// Lanelets for vehicles that end where this one begins, in the order of the file.
    pub fn previous(&self, index: LaneletIndex) -> &[LaneletIndex] {
        self.lanelet(index).map_or(&[], |of| self.topology.previous(of))
    }

    /// The lanelet for vehicles in the same direction on the left, beyond a shared bound.
    pub fn left_of(&self, index: LaneletIndex) -> Option<Neighbour> {
        self.topology.left_of(self.lanelet(index)?)
    }

    /// The lanelet for vehicles in the same direction on the right, beyond a shared bound.
    pub fn right_of(&self, index: LaneletIndex) -> Option<Neighbour> {
        self.topology.right_of(self.lanelet(index)?)
    }

    /// Lanelets for vehicles in the other direction beyond the left bound.
    pub fn opposite_left(&self, index: LaneletIndex) -> &[LaneletIndex] {
        self.lanelet(index).map_or(&[], |of| self.topology.opposite_left(of))
    }

    /// Lanelets for vehicles in the other direction beyond the right bound.
    pub fn opposite_right(&self, index: LaneletIndex) -> &[LaneletIndex] {
        self.lanelet(index).map_or(&[], |of| self.topology.opposite_right(of))
    }

    /// The lanelets that hold a place (x, y in metres), on their bounds too, in the order of the file.
    pub fn lanelets_at(&self, place: [f64; 2]) -> Vec<LaneletIndex> {
        self.tree.holding(&self.lanelets, place)
    }

    /// The lanelet nearest to a place (x, y in metres) among those wanted, and its distance in metres,
    /// 0 inside; of several the first in the file.
    pub fn nearest_lanelet(
        &self,
        place: [f64; 2],
        wanted: impl Fn(&Lanelet) -> bool,
    ) -> Option<(LaneletIndex, f64)> {
        self.tree.nearest(&self.lanelets, place, wanted)
    }
}

struct Builder<'a> {
    osm: &'a Osm,
    points: &'a Points,
    /// Positions of nodes on polygons of hatched road markings.
    hatched: BTreeSet<usize>,
    roundabouts: BTreeMap<i64, RoundaboutIndex>,
    points_so_far: usize,
}

impl<'a> Builder<'a> {
    fn lanelet(&mut self, relation: &Relation) -> Result<Lanelet, MapError> {
        let (left_way, right_way) = (self.side(relation, "left")?, self.side(relation, "right")?);
        self.points_so_far = self.points_so_far.saturating_add(left_way.nodes.len() + right_way.nodes.len());
        self.check_size(relation)?;
        let (left, right) = (self.line(left_way, relation)?, self.line(right_way, relation)?);
        let (invert_left, invert_right) = align(&left, &right);
        let left = self.bound(left_way, relation, left, invert_left)?;
        let right = self.bound(right_way, relation, right, invert_right)?;
        let parts = usize::try_from(centerline_parts(&left.line, &right.line)).unwrap_or(usize::MAX);
        self.points_so_far = self.points_so_far.saturating_add(parts);
        self.check_size(relation)?;
        let no_line = MapError::ShortBound { way: left_way.id, lanelet: relation.id };
        let centerline = centerline(&left.line, &right.line).ok_or(no_line)?;
        let Said { turn_direction, turn_signal_distance_m, exit_signals } = Said::read(relation)?;
        let elements = relation.members("regulatory_element", Kind::Relation);
        let tags = &relation.tags;
        Ok(Lanelet {
            id: relation.id,
            left,
            right,
            centerline,
            subtype: tags.get("subtype").unwrap_or_default().into(),
            location: tags.get("location").map(Into::into),
            turn_direction,
            turn_signal_distance_m,
            exit_signals,
            enable_exit_turn_signal: tags.is("enable_exit_turn_signal", "true"),
            for_vehicles: is_for_vehicles(tags),
            one_way: is_one_way(tags),
            roundabouts: elements.filter_map(|id| self.roundabouts.get(&id).copied()).collect(),
        })
    }

    fn check_size(&self, relation: &Relation) -> Result<(), MapError> {
        if self.points_so_far > MAX_POINTS {
            return Err(MapError::TooLarge { lanelet: relation.id });
        }
        Ok(())
    }

    fn side(&self, relation: &Relation, role: &'static str) -> Result<&'a Way, MapError> {
        let mut ways = relation.members(role, Kind::Way).filter_map(|id| self.osm.ways.get(id));
        match (ways.next(), ways.next()) {
            (Some(way), None) => Ok(way),
            _ => {
                let count = relation.members(role, Kind::Way).count();
                Err(MapError::Sides { lanelet: relation.id, role, count })
            }
        }
    }

    /// As drawn.
    fn line(&self, way: &Way, of: &Relation) -> Result<Polyline, MapError> {
        let points = way.nodes.iter().filter_map(|node| self.points.get(*node)).collect();
        Polyline::new(points).ok_or(MapError::ShortBound { way: way.id, lanelet: of.id })
    }

    fn bound(&self, way: &Way, of: &Relation, line: Polyline, inverted: bool) -> Result<Bound, MapError> {
        let no_line = MapError::ShortBound { way: way.id, lanelet: of.id };
        let (Some(first), Some(last)) = (way.nodes.first(), way.nodes.last()) else { return Err(no_line) };
        let lane_change = LaneChange::over(&way.tags);
        Ok(Bound {
            way_id: way.id,
            inverted,
            line: if inverted { line.reversed() } else { line },
            ends: if inverted { [*last, *first] } else { [*first, *last] },
            lane_change: if inverted { lane_change.inverted() } else { lane_change },
            hatched: way.nodes.iter().any(|node| self.hatched.contains(node)),
        })
    }
}

/// Whether to turn the left and the right bound so that each sees the other on its proper side: by the
/// middle of the other one, the left one first, as lanelet2 does.
fn align(left: &Polyline, right: &Polyline) -> (bool, bool) {
    let invert_left = left.nearest(right.middle()).is_left;
    let turned;
    let left = if invert_left {
        turned = left.clone().reversed();
        &turned
    } else {
        left
    };
    (invert_left, !right.nearest(left.middle()).is_left)
}

fn hatched_nodes(osm: &Osm) -> BTreeSet<usize> {
    let hatched = osm.ways.all().iter().filter(|way| way.tags.is("type", "hatched_road_markings"));
    hatched.flat_map(|way| way.nodes.iter().copied()).collect()
}

#[cfg(test)]
mod tests;
