//! The traffic lights of a lanelet2 map: heads and groups (docs/spec/traffic-lights.md, "Lights of a map").

use std::collections::{BTreeMap, BTreeSet};

use super::{GroupEntry, LampColor, LampSource, LightMap, MapLamp};
use crate::error::{MapError, id_tag, number_tag};
use crate::osm::{Osm, OsmElement, OsmKind, Way};
use crate::points::Points;

impl LightMap {
    /// Reads the lights. Without points, heads have no lamps.
    ///
    /// # Errors
    /// Returns [`MapError::BadTag`] for a `height` or `traffic_light_id` that is not a number.
    pub fn read(osm: &Osm, points: Option<&Points>, source: LampSource) -> Result<Self, MapError> {
        let drawings = Drawings::read(osm)?;
        let relations = || osm.relations.all().iter();
        let crosswalks =
            relations().filter(|relation| relation.is_lanelet() && relation.tags.is("subtype", "crosswalk"));
        let pedestrian: BTreeSet<i64> =
            crosswalks.flat_map(|lanelet| lanelet.members("regulatory_element", OsmKind::Relation)).collect();
        let groups = relations().filter(|relation| relation.is_regulatory("traffic_light"));
        let entries: Vec<GroupEntry> = groups
            .map(|group| GroupEntry {
                relation_id: group.id,
                way_ids: group.members("refers", OsmKind::Way).collect(),
                is_pedestrian: pedestrian.contains(&group.id),
            })
            .collect();
        let heads = osm.ways.all().iter().filter(|way| way.tags.is("type", "traffic_light"));
        let heads: Result<Vec<_>, MapError> =
            heads.map(|head| Ok((head.id, drawings.lamps(osm, points, head, source)?))).collect();
        Ok(Self::new(heads?, &entries))
    }
}

/// The `light_bulbs` ways by head, in the order of the file.
struct Drawings<'a>(BTreeMap<i64, Vec<&'a Way>>);

impl<'a> Drawings<'a> {
    fn read(osm: &'a Osm) -> Result<Self, MapError> {
        let mut drawings: BTreeMap<i64, Vec<&Way>> = BTreeMap::new();
        for way in osm.ways.all().iter().filter(|way| way.tags.is("type", "light_bulbs")) {
            let element = OsmElement { kind: OsmKind::Way, id: way.id };
            if let Some(head) = id_tag(&way.tags, "traffic_light_id", element)? {
                drawings.entry(head).or_default().push(way);
            }
        }
        Ok(Self(drawings))
    }

    fn lamps(
        &self,
        osm: &Osm,
        points: Option<&Points>,
        head: &Way,
        source: LampSource,
    ) -> Result<Vec<MapLamp>, MapError> {
        let height = number_tag(&head.tags, "height", OsmElement { kind: OsmKind::Way, id: head.id })?;
        let Some(points) = points else { return Ok(Vec::new()) };
        let position = |color| {
            let drawn = self.drawn(osm, head.id, color).and_then(|node| points.get(node));
            drawn.or_else(|| match source {
                LampSource::Drawn => None,
                LampSource::DrawnOrInferred => inferred(points, head, height?, color),
            })
        };
        let lamp = |color| Some(MapLamp { color, position_m: position(color)? });
        Ok(LampColor::ALL.into_iter().filter_map(lamp).collect())
    }

    /// Returns the first lamp of this colour that is not an arrow.
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
