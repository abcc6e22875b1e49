//! `autoware_perception_msgs/msg/TrafficSignalArray`: the legacy form of groups, without predictions.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::array_element::{ArrayElement, StampPosition, elements};
use super::element::{TrafficLightElement, id};
use super::stamp::Time;
use crate::core::compat::Compat;
use crate::core::time::WallStamp;
use crate::core::traffic_light::emission::GroupState;

/// `autoware_perception_msgs/msg/TrafficSignal`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrafficSignal {
    /// Id of the regulatory element.
    pub traffic_signal_id: i64,
    /// `TrafficSignalElement[]`, ascending by the key of the bulb.
    pub elements: Vec<TrafficLightElement>,
}

/// `autoware_perception_msgs/msg/TrafficSignalArray`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrafficSignalArray {
    /// Time of the states.
    pub stamp: Time,
    /// States of the groups.
    pub signals: Vec<TrafficSignal>,
}

impl TrafficSignalArray {
    /// The message that shows `groups`, without their predictions.
    pub fn new(groups: &[Arc<GroupState>], stamp: WallStamp, compat: Compat) -> Self {
        Self { stamp: stamp.into(), signals: elements(groups, stamp, compat) }
    }
}

impl ArrayElement for TrafficSignal {
    type Item = Arc<GroupState>;
    const STAMP: StampPosition = StampPosition::Message;
    const ALIGNMENT: usize = 8;

    fn new(group: &Arc<GroupState>, _stamp: WallStamp, compat: Compat) -> Self {
        Self {
            traffic_signal_id: id(group.relation_id, compat),
            elements: TrafficLightElement::all(&group.elements, compat),
        }
    }

    fn is_same(one: &Arc<GroupState>, other: &Arc<GroupState>) -> bool {
        Arc::ptr_eq(one, other) || one.elements == other.elements && one.relation_id == other.relation_id
    }
}
