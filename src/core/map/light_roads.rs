//! Traffic lights as a lanelet2 map has them: heads, groups and the lanelets that obey them
//! (docs/spec/traffic-lights.md, "Lights of a map").
//!
//! All lists are in the order of the file.

use std::collections::{BTreeMap, BTreeSet};

use super::error::{MapError, id_tag, number_tag};
use super::light_map::{GroupEntry, Lamp, LampColor, LightMap};
use super::osm::{Element, Kind, Osm, Relation, Way};
use super::points::Points;

/// Where lamps may come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LampSource {
    /// Only the `light_bulbs` ways of the map.
    #[default]
    Drawn,
    /// Those, and for colours without one a place on the head: its lower edge divided by four, red at
    /// the far end, half of the height up.
    DrawnOrInferred,
}

/// The traffic lights of a map and the roads they are for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LightRoads {
    lights: LightMap,
    /// Groups by lanelet, in the order of the lanelet's members.
    lanelets: BTreeMap<i64, Vec<i64>>,
}

impl LightRoads {
    /// Finds the lights. Without points, no lamp has a place.
    ///
    /// # Errors
    /// [`MapError::BadTag`] for a `height` or `traffic_light_id` that is not a number.
    pub fn read(osm: &Osm, points: Option<&Points>, source: LampSource) -> Result<Self, MapError> {
        let drawings = Drawings::read(osm)?;
        let mut lanelets: BTreeMap<i64, Vec<i64>> = BTreeMap::new();
        let mut pedestrian = BTreeSet::new();
        for lanelet in osm.relations.all().iter().filter(|relation| relation.is_lanelet()) {
            for id in lanelet.members("regulatory_element", Kind::Relation) {
                if osm.relations.get(id).is_some_and(is_group) {
                    lanelets.entry(lanelet.id).or_default().push(id);
                    if lanelet.tags.is("subtype", "crosswalk") {
                        pedestrian.insert(id);
                    }
                }
            }
        }
        let mut entries = Vec::new();
        for group in osm.relations.all().iter().filter(|relation| is_group(relation)) {
            entries.push(GroupEntry {
                relation_id: group.id,
                way_ids: group.members("refers", Kind::Way).collect(),
                is_pedestrian: pedestrian.contains(&group.id),
            });
        }
        let heads = osm.ways.all().iter().filter(|way| way.tags.is("type", "traffic_light"));
        let heads: Result<Vec<_>, MapError> =
            heads.map(|head| Ok((head.id, drawings.lamps(osm, points, head, source)?))).collect();
        Ok(Self { lights: LightMap::new(heads?, &entries), lanelets })
    }

    /// Heads and groups.
    pub fn lights(&self) -> &LightMap {
        &self.lights
    }

    /// Relation ids of the groups that a lanelet obeys, in the order of its members.
    pub fn groups_of(&self, lanelet: i64) -> &[i64] {
        self.lanelets.get(&lanelet).map_or(&[], Vec::as_slice)
    }
}

/// The `light_bulbs` ways by head, in the order of the file.
struct Drawings<'a>(BTreeMap<i64, Vec<&'a Way>>);

impl<'a> Drawings<'a> {
    fn read(osm: &'a Osm) -> Result<Self, MapError> {
        let mut by_head: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for way in osm.ways.all().iter().filter(|way| way.tags.is("type", "light_bulbs")) {
            let element = Element { kind: Kind::Way, id: way.id };
            if let Some(head) = id_tag(&way.tags, "traffic_light_id", element)? {
                by_head.entry(head).or_default().push(way);
            }
        }
        Ok(Self(by_head))
    }

    fn lamps(
        &self,
        osm: &Osm,
        points: Option<&Points>,
        head: &Way,
        source: LampSource,
    ) -> Result<Vec<Lamp>, MapError> {
        let height = number_tag(&head.tags, "height", Element { kind: Kind::Way, id: head.id })?;
        let Some(points) = points else { return Ok(Vec::new()) };
        let place = |color| {
            let drawn = self.drawn(osm, head.id, color).and_then(|node| points.get(node));
            drawn.or_else(|| match source {
                LampSource::Drawn => None,
                LampSource::DrawnOrInferred => inferred(points, head, height?, color),
            })
        };
        let lamp = |color| Some(Lamp { color, position_m: place(color)? });
        Ok(LampColor::ALL.into_iter().filter_map(lamp).collect())
    }

    /// The first lamp of this colour that is not an arrow.
    fn drawn(&self, osm: &Osm, head: i64, color: LampColor) -> Option<usize> {
        let ways = self.0.get(&head)?;
        ways.iter().flat_map(|way| way.nodes.iter().copied()).find(|&at| {
            osm.nodes.all().get(at).is_some_and(|node| {
                node.tags.get("arrow").is_none()
                    && node.tags.get("color").and_then(LampColor::from_name) == Some(color)
            })
        })
    }
}

fn inferred(points: &Points, head: &Way, height_m: f64, color: LampColor) -> Option<[f64; 3]> {
    let share = match color {
        LampColor::Red => 0.25,
        LampColor::Yellow => 0.5,
        LampColor::Green => 0.75,
    };
    let [x1, y1, z1] = points.get(*head.nodes.first()?)?;
    let [x2, y2, _] = points.get(*head.nodes.last()?)?;
    let between = |first: f64, last: f64| share * first + (1.0 - share) * last;
    Some([between(x1, x2), between(y1, y2), z1 + height_m / 2.0])
}

fn is_group(relation: &Relation) -> bool {
    relation.is_regulatory("traffic_light")
}
