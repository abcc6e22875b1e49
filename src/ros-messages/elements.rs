//! Traffic light elements, which have the same fields in several messages.

use crate::autoware_perception_msgs::{TrafficLightElement, TrafficSignalElement};
use crate::traffic_simulator_msgs::TrafficLightBulbV1;

impl From<TrafficLightElement> for TrafficSignalElement {
    fn from(element: TrafficLightElement) -> Self {
        let TrafficLightElement { color, shape, status, confidence } = element;
        Self { color, shape, status, confidence }
    }
}

impl From<TrafficLightElement> for TrafficLightBulbV1 {
    fn from(element: TrafficLightElement) -> Self {
        let TrafficLightElement { color, shape, status, confidence } = element;
        Self { enum_revision: 0, color, shape, status, confidence }
    }
}
