//! The decider's route from `autoware_planning_msgs/msg/LaneletRoute`.

use std::sync::Arc;

use super::autoware_planning_msgs::{LaneletPrimitive, LaneletRoute, LaneletSegment};
use crate::core::turn_signal::planner_input::{PlannerInput, PlannerRoute};
use crate::core::turn_signal::route::Segment;

impl LaneletPrimitive {
    fn is_lanelet(&self) -> bool {
        self.primitive_type != "area"
    }
}

impl LaneletSegment {
    /// Returns the lanelets of the segment; `None` without one. The first lanelet replaces a preferred area.
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
