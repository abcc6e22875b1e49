//! `autoware_perception_msgs/msg/TrafficSignalArray`: the legacy form of groups, without predictions.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

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
    /// When.
    pub stamp: Time,
    /// The groups.
    pub signals: Vec<TrafficSignal>,
}

impl TrafficSignalArray {
    /// The message that shows `groups`; predictions have no place in it.
    pub fn new(groups: &[Arc<GroupState>], stamp: WallStamp, compat: Compat) -> Self {
        let signal = |group: &Arc<GroupState>| TrafficSignal {
            traffic_signal_id: id(group.relation_id, compat),
            elements: TrafficLightElement::all(&group.elements, compat),
        };
        Self { stamp: stamp.into(), signals: groups.iter().map(signal).collect() }
    }
}
