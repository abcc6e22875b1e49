//! `autoware_perception_msgs/msg/TrafficSignalArray`: the legacy form of groups, without predictions.

use std::sync::Arc;

use super::array_element::{ArrayElement, StampPosition, elements};
use super::autoware_perception_msgs::{TrafficLightElement, TrafficSignal, TrafficSignalArray};
use super::element::id;
use crate::core::compat::Compat;
use crate::core::time::WallStamp;
use crate::core::traffic_light::emission::GroupState;

impl TrafficSignalArray {
    /// Creates the message that shows `groups`, without their predictions.
    pub fn new(groups: &[Arc<GroupState>], stamp: WallStamp, compat: Compat) -> Self {
        Self { stamp: stamp.into(), signals: elements(groups, stamp, compat) }
    }
}

impl ArrayElement for TrafficSignal {
    type Item = Arc<GroupState>;
    const STAMP: StampPosition = StampPosition::Message;
    const ALIGNMENT: usize = 8;

    fn new(group: &Arc<GroupState>, _stamp: WallStamp, compat: Compat) -> Self {
        let elements = TrafficLightElement::all(&group.elements, compat);
        Self {
            traffic_signal_id: id(group.relation_id, compat),
            elements: elements.into_iter().map(Into::into).collect(),
        }
    }

    fn is_same(one: &Arc<GroupState>, other: &Arc<GroupState>) -> bool {
        Arc::ptr_eq(one, other) || one.elements == other.elements && one.relation_id == other.relation_id
    }
}
