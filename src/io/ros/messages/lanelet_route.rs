//! `autoware_planning_msgs/msg/LaneletRoute`.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::bounded::at_most;
use super::geometry::Pose;
use super::stamp::Header;
use crate::core::turn_signal::planner_input::{PlannerInput, PlannerRoute};
use crate::core::turn_signal::route::Segment;

/// Segments of a route.
pub(super) const MAX_SEGMENTS: usize = 10_000;
/// Primitives of a segment.
pub(super) const MAX_PRIMITIVES: usize = 1_000;

/// `unique_identifier_msgs/msg/UUID`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Uuid {
    /// First byte highest.
    pub uuid: [u8; 16],
}

/// `autoware_planning_msgs/msg/LaneletPrimitive`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LaneletPrimitive {
    /// Of a lanelet or an area on the map.
    pub id: i64,
    /// `lane`, nothing, or `area`.
    pub primitive_type: String,
}

/// `autoware_planning_msgs/msg/LaneletSegment`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LaneletSegment {
    /// The one to be on.
    pub preferred_primitive: LaneletPrimitive,
    /// All side by side.
    #[serde(deserialize_with = "at_most::<_, _, MAX_PRIMITIVES>")]
    pub primitives: Vec<LaneletPrimitive>,
}

/// `autoware_planning_msgs/msg/LaneletRoute`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LaneletRoute {
    /// When it was made, and the frame of the poses.
    pub header: Header,
    /// Where it starts.
    pub start_pose: Pose,
    /// Where it ends.
    pub goal_pose: Pose,
    /// In the order of driving.
    #[serde(deserialize_with = "at_most::<_, _, MAX_SEGMENTS>")]
    pub segments: Vec<LaneletSegment>,
    /// Another route has another one.
    pub uuid: Uuid,
    /// The goal may be moved.
    pub allow_modification: bool,
}

impl LaneletPrimitive {
    /// Type of what is not a lanelet.
    pub const AREA: &'static str = "area";

    fn is_lanelet(&self) -> bool {
        self.primitive_type != Self::AREA
    }
}

impl LaneletSegment {
    /// Without areas; `None` when nothing is left. Where an area is preferred, the first lanelet is.
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
