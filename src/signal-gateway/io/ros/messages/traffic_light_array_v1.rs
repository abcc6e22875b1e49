//! `traffic_simulator_msgs/msg/TrafficLightArrayV1`: head by head, without a stamp.

use super::array_element::{ArrayElement, StampPosition, elements};
use super::autoware_perception_msgs::TrafficLightElement;
use super::element::id;
use super::traffic_simulator_msgs::{TrafficLightArrayV1, TrafficLightV1};
use gateway_base::time::WallStamp;
use traffic_lights::compat::Compat;
use traffic_lights::emission::LightState;

impl TrafficLightArrayV1 {
    /// Creates the message that shows `heads`, dark ones included.
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
