//! `traffic_simulator_msgs/msg/TrafficLightArrayV1`: head by head, without a stamp.

use serde::{Deserialize, Serialize};

use super::array_element::{ArrayElement, StampPosition, elements};
use super::element::{TrafficLightElement, id};
use crate::core::compat::Compat;
use crate::core::time::WallStamp;
use crate::core::traffic_light::emission::LightState;

/// `traffic_simulator_msgs/msg/TrafficLightBulbV1`; numbers as in [`TrafficLightElement`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrafficLightBulbV1 {
    /// Revision of the numbers, always 0.
    pub enum_revision: u8,
    /// As [`TrafficLightElement::color`].
    pub color: u8,
    /// As [`TrafficLightElement::shape`].
    pub shape: u8,
    /// As [`TrafficLightElement::status`].
    pub status: u8,
    /// Confidence, 0 to 1.
    pub confidence: f32,
}

impl From<TrafficLightElement> for TrafficLightBulbV1 {
    fn from(element: TrafficLightElement) -> Self {
        let TrafficLightElement { color, shape, status, confidence } = element;
        Self { enum_revision: 0, color, shape, status, confidence }
    }
}

/// `traffic_simulator_msgs/msg/TrafficLightV1`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrafficLightV1 {
    /// Way id of the head.
    pub lanelet_way_id: i64,
    /// Ascending by the key of the bulb; none = dark.
    pub traffic_light_bulbs: Vec<TrafficLightBulbV1>,
}

/// `traffic_simulator_msgs/msg/TrafficLightArrayV1`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrafficLightArrayV1 {
    /// The heads, dark ones included.
    pub traffic_lights: Vec<TrafficLightV1>,
}

impl TrafficLightArrayV1 {
    /// The message that shows `heads`.
    pub fn new(heads: &[LightState], compat: Compat) -> Self {
        Self { traffic_lights: elements(heads, WallStamp::default(), compat) }
    }
}

impl ArrayElement for TrafficLightV1 {
    type Item = LightState;
    const STAMP: StampPosition = StampPosition::Nowhere;
    const ALIGNMENT: usize = 8;

    fn new(head: &LightState, _stamp: WallStamp, compat: Compat) -> Self {
        let bulb = |bulb| TrafficLightElement::new(bulb, head.confidence, compat).into();
        Self {
            lanelet_way_id: id(head.way_id, compat),
            traffic_light_bulbs: head.bulbs.iter().map(bulb).collect(),
        }
    }

    fn is_same(one: &LightState, other: &LightState) -> bool {
        one == other
    }
}
