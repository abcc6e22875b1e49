//! Heads and groups of a map, and the expansion of an id of either kind
//! (docs/spec/traffic-lights.md, "Ids and groups").

use std::collections::BTreeMap;
use std::sync::Arc;

mod reader;

/// A signal head, by position in [`LightMap::heads`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct HeadIndex(pub u32);

/// A signal head from the map.
#[derive(Debug, Clone, PartialEq)]
pub struct Head {
    /// Id of the head's way in the map.
    pub way_id: i64,
    /// The groups that refer to it, in the order of the map.
    pub relation_ids: Arc<[i64]>,
    /// Positions of its lamps; only for drawing.
    pub lamps: Vec<MapLamp>,
}

/// A lamp of a head.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapLamp {
    /// Colour of the lamp.
    pub color: LampColor,
    /// x, y, z in the map frame, metres.
    pub position_m: [f64; 3],
}

/// The colours of lamps in a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LampColor {
    /// The lamp for "go".
    Green,
    /// The lamp in the middle.
    Yellow,
    /// The lamp for "stop".
    Red,
}

impl LampColor {
    /// All colours, in sort order.
    pub const ALL: [Self; 3] = [Self::Green, Self::Yellow, Self::Red];

    /// Returns the colour with this name in maps.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "green" => Some(Self::Green),
            "yellow" => Some(Self::Yellow),
            "red" => Some(Self::Red),
            _ => None,
        }
    }
}

/// The sources of the positions of lamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LampSource {
    /// Only the `light_bulbs` ways of the map.
    #[default]
    Drawn,
    /// These ways, and for colours without one a position derived from the head: its lower edge divided by
    /// four, red at the far end, at half of the height.
    DrawnOrInferred,
}

/// The traffic lights of a map. Heads are sorted by way id.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LightMap {
    heads: Vec<Head>,
    groups: BTreeMap<i64, LightGroup>,
}

/// A traffic-flow group: a regulatory element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightGroup {
    /// The heads of the group, in the order of the map.
    pub heads: Vec<HeadIndex>,
    /// True if a crosswalk obeys the group.
    pub is_pedestrian: bool,
}

/// One group of a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroupEntry {
    /// Id of the regulatory element.
    pub relation_id: i64,
    /// Way ids of the heads of the group, in the order of the map.
    pub way_ids: Vec<i64>,
    /// True if a crosswalk obeys the group.
    pub is_pedestrian: bool,
}

impl GroupEntry {
    /// Creates a group of these heads that is not for pedestrians.
    pub fn new(relation_id: i64, way_ids: impl Into<Vec<i64>>) -> Self {
        Self { relation_id, way_ids: way_ids.into(), is_pedestrian: false }
    }
}

impl LightMap {
    /// Combines heads without a group, given with their lamps, and groups in the order of the map's
    /// regulatory-element layer. A head that appears only in a group has no lamps.
    pub fn new(lamps: impl IntoIterator<Item = (i64, Vec<MapLamp>)>, groups: &[GroupEntry]) -> Self {
        let mut known: BTreeMap<i64, (Vec<i64>, Vec<MapLamp>)> =
            lamps.into_iter().map(|(way_id, lamps)| (way_id, (Vec::new(), lamps))).collect();
        for group in groups {
            for way_id in &group.way_ids {
                let (relation_ids, _) = known.entry(*way_id).or_default();
                if !relation_ids.contains(&group.relation_id) {
                    relation_ids.push(group.relation_id);
                }
            }
        }
        let heads: Vec<_> = known
            .into_iter()
            .map(|(way_id, (relation_ids, lamps))| Head { way_id, relation_ids: relation_ids.into(), lamps })
            .collect();
        let mut map = Self { heads, groups: BTreeMap::new() };
        for group in groups {
            let heads = group.way_ids.iter().filter_map(|way_id| map.head(*way_id)).collect();
            map.groups.insert(group.relation_id, LightGroup { heads, is_pedestrian: group.is_pedestrian });
        }
        map
    }

    /// Returns all heads, ascending by way id; [`HeadIndex`] is a position in this list.
    pub fn heads(&self) -> &[Head] {
        &self.heads
    }

    /// Returns all groups, ascending by relation id.
    pub fn groups(&self) -> impl Iterator<Item = (i64, &LightGroup)> {
        self.groups.iter().map(|(relation_id, group)| (*relation_id, group))
    }

    /// Returns the head at this position.
    pub fn at(&self, index: HeadIndex) -> Option<&Head> {
        self.heads.get(usize::try_from(index.0).ok()?)
    }

    /// Returns the head with this way id.
    pub fn head(&self, way_id: i64) -> Option<HeadIndex> {
        let found = self.heads.binary_search_by_key(&way_id, |head| head.way_id).ok()?;
        u32::try_from(found).ok().map(HeadIndex)
    }

    /// Returns the group with this relation id.
    pub fn group(&self, relation_id: i64) -> Option<&LightGroup> {
        self.groups.get(&relation_id)
    }
}
