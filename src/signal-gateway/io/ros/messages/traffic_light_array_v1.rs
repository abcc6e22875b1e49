//! `traffic_simulator_msgs/msg/TrafficLightArrayV1`: one entry per head, including dark ones, without a
//! stamp.

use super::array_element::{ArrayElement, StampPosition};
use super::element::{element, id};
use gateway_base::time::WallStamp;
use ros_messages::traffic_simulator_msgs::TrafficLightV1;
use traffic_lights::compat::Compat;
use traffic_lights::emission::LightState;

impl ArrayElement for TrafficLightV1 {
    type Item = LightState;
    const STAMP: StampPosition = StampPosition::Nowhere;
    const ALIGNMENT: usize = 8;

    fn new(head: &LightState, _stamp: WallStamp, compat: Compat) -> Self {
        let bulb = |bulb| element(bulb, head.confidence, compat).into();
        Self {
            lanelet_way_id: id(head.way_id, compat),
            traffic_light_bulbs: head.bulbs.iter().map(bulb).collect(),
        }
    }
}
