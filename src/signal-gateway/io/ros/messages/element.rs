//! One lit bulb in the form shared by three messages, and its ROS numbers
//! (docs/spec/traffic-lights.md, "Bulbs and their numbers").

use ros_messages::autoware_perception_msgs::TrafficLightElement;
use traffic_lights::bulb::{Bulb, BulbShape, BulbStatus, Color};
use traffic_lights::compat::Compat;
use traffic_lights::emission::GroupElement;

pub(super) fn element(bulb: Bulb, confidence: f64, compat: Compat) -> TrafficLightElement {
    #[allow(clippy::cast_possible_truncation)] // the field is no wider
    let confidence = confidence as f32;
    TrafficLightElement {
        color: color(bulb.color),
        shape: shape(bulb.shape, compat),
        status: status(bulb.status),
        confidence,
    }
}

pub(super) fn group_elements(elements: &[GroupElement], compat: Compat) -> Vec<TrafficLightElement> {
    elements.iter().map(|shown| element(shown.bulb, shown.confidence, compat)).collect()
}

/// Returns the bulb that an element shows; `None` if one of its numbers is not a constant of the type, or the
/// confidence is not from 0 to 1.
pub(super) fn bulb(element: TrafficLightElement) -> Option<Bulb> {
    let color = Color::ALL.into_iter().find(|known| color(*known) == element.color)?;
    let shape = BulbShape::ALL.into_iter().find(|known| shape(*known, Compat::Improved) == element.shape)?;
    let status = BulbStatus::ALL.into_iter().find(|known| status(*known) == element.status)?;
    (0.0..=1.0).contains(&element.confidence).then_some(Bulb { color, status, shape })
}

fn color(color: Color) -> u8 {
    match color {
        Color::Unknown => TrafficLightElement::UNKNOWN,
        Color::Red => TrafficLightElement::RED,
        Color::Yellow => TrafficLightElement::AMBER,
        Color::Green => TrafficLightElement::GREEN,
        Color::White => TrafficLightElement::WHITE,
    }
}

/// Returns the constant of a shape. Upstream has none for the upper diagonals (Q7).
fn shape(shape: BulbShape, compat: Compat) -> u8 {
    match shape {
        BulbShape::UpperLeft | BulbShape::UpperRight if compat == Compat::Upstream => {
            TrafficLightElement::UNKNOWN
        }
        BulbShape::Unknown => TrafficLightElement::UNKNOWN,
        BulbShape::Circle => TrafficLightElement::CIRCLE,
        BulbShape::Left => TrafficLightElement::LEFT_ARROW,
        BulbShape::Right => TrafficLightElement::RIGHT_ARROW,
        BulbShape::Up => TrafficLightElement::UP_ARROW,
        BulbShape::UpperLeft => TrafficLightElement::UP_LEFT_ARROW,
        BulbShape::UpperRight => TrafficLightElement::UP_RIGHT_ARROW,
        BulbShape::Down => TrafficLightElement::DOWN_ARROW,
        BulbShape::LowerLeft => TrafficLightElement::DOWN_LEFT_ARROW,
        BulbShape::LowerRight => TrafficLightElement::DOWN_RIGHT_ARROW,
        BulbShape::Cross => TrafficLightElement::CROSS,
    }
}

fn status(status: BulbStatus) -> u8 {
    match status {
        BulbStatus::Unknown => TrafficLightElement::UNKNOWN,
        BulbStatus::SolidOff => TrafficLightElement::SOLID_OFF,
        BulbStatus::SolidOn => TrafficLightElement::SOLID_ON,
        BulbStatus::Flashing => TrafficLightElement::FLASHING,
    }
}

/// Returns an id as it is published: upstream passes ids between its processes as 32 bits (Q6).
#[allow(clippy::cast_possible_truncation)] // upstream truncates
pub(super) fn id(id: i64, compat: Compat) -> i64 {
    match compat {
        Compat::Improved => id,
        Compat::Upstream => i64::from(id as i32),
    }
}
