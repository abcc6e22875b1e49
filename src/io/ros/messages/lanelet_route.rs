//! `autoware_planning_msgs/msg/LaneletRoute`.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::bounded::at_most;
use super::geometry::Pose;
use super::stamp::Header;
use crate::core::turn_signal::planner_input::{PlannerInput, PlannerRoute};
use crate::core::turn_signal::route::Segment;

/// Most segments of a route.
pub(super) const MAX_SEGMENTS: usize = 10_000;
/// Most primitives of a segment.
pub(super) const MAX_PRIMITIVES: usize = 1_000;

/// `unique_identifier_msgs/msg/UUID`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Uuid {
    /// Big-endian: the first byte is the highest.
    pub uuid: [u8; 16],
}

/// `autoware_planning_msgs/msg/LaneletPrimitive`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LaneletPrimitive {
    /// Id of a lanelet or an area on the map.
    pub id: i64,
    /// `lane`, `area` or empty, which is a lanelet.
    pub primitive_type: String,
}

/// `autoware_planning_msgs/msg/LaneletSegment`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LaneletSegment {
    /// The primitive to drive on.
    pub preferred_primitive: LaneletPrimitive,
    /// All primitives side by side.
    #[serde(deserialize_with = "at_most::<_, _, MAX_PRIMITIVES>")]
    pub primitives: Vec<LaneletPrimitive>,
}

/// `autoware_planning_msgs/msg/LaneletRoute`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LaneletRoute {
    /// Time of the route, and the frame of the poses.
    pub header: Header,
    /// Pose at which the route starts.
    pub start_pose: Pose,
    /// Pose at which the route ends.
    pub goal_pose: Pose,
    /// Segments in the order of driving.
    #[serde(deserialize_with = "at_most::<_, _, MAX_SEGMENTS>")]
    pub segments: Vec<LaneletSegment>,
    /// Id of the route.
    pub uuid: Uuid,
    /// The goal may be moved.
    pub allow_modification: bool,
}

impl LaneletPrimitive {
    fn is_lanelet(&self) -> bool {
        self.primitive_type != "area"
    }
}

impl LaneletSegment {
    /// The lanelets of the segment; `None` without one. An area that is preferred is replaced by the first lanelet.
    fn lanes(&self) -> Option<Segment> {
        let lanelets = self.primitives.iter().filter(|primitive| primitive.is_lanelet());
        let mut lanes: Vec<i64> = lanelets.map(|primitive| primitive.id).collect();
        let preferred = Some(&self.preferred_primitive).filter(|primitive| primitive.is_lanelet());
        let preferred = preferred.map(|primitive| primitive.id).or_else(|| lanes.first().copied())?;
        if !lanes.contains(&preferred) {
            lanes.insert(0, preferred);
        }
        Some(Segment { preferred, lanes })
    }
}

impl From<LaneletRoute> for PlannerInput {
    fn from(message: LaneletRoute) -> Self {
        Self::Route(Arc::new(PlannerRoute {
            id: u128::from_be_bytes(message.uuid.uuid),
            start: message.start_pose.into(),
            goal: message.goal_pose.into(),
            segments: message.segments.iter().filter_map(LaneletSegment::lanes).collect(),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(preferred: (i64, &str), primitives: &[(i64, &str)]) -> LaneletSegment {
        let primitive = |(id, kind): (i64, &str)| LaneletPrimitive { id, primitive_type: kind.to_owned() };
        LaneletSegment {
            preferred_primitive: primitive(preferred),
            primitives: primitives.iter().copied().map(primitive).collect(),
        }
    }

    #[test]
    fn segments_are_taken_without_their_areas() {
        let lanes = |preferred, lanes: &[i64]| Some(Segment { preferred, lanes: lanes.to_vec() });
        let cases = [
            ("lanes", segment((2, "lane"), &[(1, "lane"), (2, "lane")]), lanes(2, &[1, 2])),
            ("no types", segment((1, ""), &[(1, ""), (2, "")]), lanes(1, &[1, 2])),
            ("not listed", segment((1, "lane"), &[(2, "lane")]), lanes(1, &[1, 2])),
            ("no list", segment((1, "lane"), &[]), lanes(1, &[1])),
            ("an area beside", segment((1, "lane"), &[(1, "lane"), (7, "area")]), lanes(1, &[1])),
            ("an area preferred", segment((7, "area"), &[(7, "area"), (1, "lane")]), lanes(1, &[1])),
            ("areas only", segment((7, "area"), &[(7, "area")]), None),
        ];
        for (name, segment, expected) in cases {
            assert_eq!(segment.lanes(), expected, "{name}");
        }
    }
}
