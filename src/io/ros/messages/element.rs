//! One lit bulb as three messages carry it, and how ROS numbers it
//! (docs/spec/traffic-lights.md, "Bulbs and their numbers").

use serde::{Deserialize, Serialize};

use crate::core::compat::Compat;
use crate::core::traffic_light::bulb::{Bulb, Color, Shape, Status};
use crate::core::traffic_light::emission::Element;

/// `autoware_perception_msgs/msg/TrafficLightElement`; the legacy `TrafficSignalElement` has the same
/// fields and constants.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrafficLightElement {
    /// `UNKNOWN`, or one of `RED` to `WHITE`.
    pub color: u8,
    /// `UNKNOWN`, or one of `CIRCLE` to `CROSS`.
    pub shape: u8,
    /// `UNKNOWN`, or one of `SOLID_OFF` to `FLASHING`.
    pub status: u8,
    /// 0 to 1.
    pub confidence: f32,
}

impl TrafficLightElement {
    /// Colour, shape or status not recognised.
    pub const UNKNOWN: u8 = 0;

    /// Colour.
    pub const RED: u8 = 1;
    /// Colour; also called yellow.
    pub const AMBER: u8 = 2;
    /// Colour.
    pub const GREEN: u8 = 3;
    /// Colour.
    pub const WHITE: u8 = 4;

    /// Shape.
    pub const CIRCLE: u8 = 1;
    /// Shape.
    pub const LEFT_ARROW: u8 = 2;
    /// Shape.
    pub const RIGHT_ARROW: u8 = 3;
    /// Shape.
    pub const UP_ARROW: u8 = 4;
    /// Shape.
    pub const UP_LEFT_ARROW: u8 = 5;
    /// Shape.
    pub const UP_RIGHT_ARROW: u8 = 6;
    /// Shape.
    pub const DOWN_ARROW: u8 = 7;
    /// Shape.
    pub const DOWN_LEFT_ARROW: u8 = 8;
    /// Shape.
    pub const DOWN_RIGHT_ARROW: u8 = 9;
    /// Shape.
    pub const CROSS: u8 = 10;

    /// Status.
    pub const SOLID_OFF: u8 = 1;
    /// Status.
    pub const SOLID_ON: u8 = 2;
    /// Status.
    pub const FLASHING: u8 = 3;

    /// The message that shows `bulb`.
    pub fn new(bulb: Bulb, confidence: f64, compat: Compat) -> Self {
        #[allow(clippy::cast_possible_truncation)] // the field is no wider
        let confidence = confidence as f32;
        Self {
            color: color(bulb.color),
            shape: shape(bulb.shape, compat),
            status: status(bulb.status),
            confidence,
        }
    }

    /// The bulb it shows, if its numbers are constants of the type and its confidence is in range.
    pub fn bulb(&self) -> Result<Bulb, Unfit> {
        let color = Color::ALL.into_iter().find(|known| color(*known) == self.color);
        let shape = Shape::ALL.into_iter().find(|known| shape(*known, Compat::Improved) == self.shape);
        let status = Status::ALL.into_iter().find(|known| status(*known) == self.status);
        if !(0.0..=1.0).contains(&self.confidence) {
            return Err(Unfit::Confidence(self.confidence));
        }
        Ok(Bulb {
            color: color.ok_or(Unfit::Color(self.color))?,
            status: status.ok_or(Unfit::Status(self.status))?,
            shape: shape.ok_or(Unfit::Shape(self.shape))?,
        })
    }

    pub(super) fn all(elements: &[Element], compat: Compat) -> Vec<Self> {
        elements.iter().map(|element| Self::new(element.bulb, element.confidence, compat)).collect()
    }
}

/// A number in a message that its type does not define.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Unfit {
    /// Not a colour.
    #[error("colour {0} is none of 0 to 4")]
    Color(u8),
    /// Not a shape.
    #[error("shape {0} is none of 0 to 10")]
    Shape(u8),
    /// Not a status.
    #[error("status {0} is none of 0 to 3")]
    Status(u8),
    /// Not a number from 0 to 1.
    #[error("confidence {0} is not from 0 to 1")]
    Confidence(f32),
}

fn color(color: Color) -> u8 {
    match color {
        Color::Green => TrafficLightElement::GREEN,
        Color::Yellow => TrafficLightElement::AMBER,
        Color::Red => TrafficLightElement::RED,
        Color::White => TrafficLightElement::WHITE,
        Color::Unknown => TrafficLightElement::UNKNOWN,
    }
}

/// Upstream has no number for the upper diagonals (Q7).
fn shape(shape: Shape, compat: Compat) -> u8 {
    match (shape, compat) {
        (Shape::UpperLeft | Shape::UpperRight, Compat::Upstream) | (Shape::Unknown, _) => {
            TrafficLightElement::UNKNOWN
        }
        (Shape::UpperLeft, Compat::Improved) => TrafficLightElement::UP_LEFT_ARROW,
        (Shape::UpperRight, Compat::Improved) => TrafficLightElement::UP_RIGHT_ARROW,
        (Shape::Circle, _) => TrafficLightElement::CIRCLE,
        (Shape::Cross, _) => TrafficLightElement::CROSS,
        (Shape::Right, _) => TrafficLightElement::RIGHT_ARROW,
        (Shape::Up, _) => TrafficLightElement::UP_ARROW,
        (Shape::Down, _) => TrafficLightElement::DOWN_ARROW,
        (Shape::LowerRight, _) => TrafficLightElement::DOWN_RIGHT_ARROW,
        (Shape::Left, _) => TrafficLightElement::LEFT_ARROW,
        (Shape::LowerLeft, _) => TrafficLightElement::DOWN_LEFT_ARROW,
    }
}

fn status(status: Status) -> u8 {
    match status {
        Status::SolidOn => TrafficLightElement::SOLID_ON,
        Status::SolidOff => TrafficLightElement::SOLID_OFF,
        Status::Flashing => TrafficLightElement::FLASHING,
        Status::Unknown => TrafficLightElement::UNKNOWN,
    }
}

/// An id as it is sent: upstream's travels as 32 bits between its processes (Q6).
#[allow(clippy::cast_possible_truncation)] // that is the behaviour
pub(super) fn id(id: i64, compat: Compat) -> i64 {
    match compat {
        Compat::Improved => id,
        Compat::Upstream => i64::from(id as i32),
    }
}
