//! One lit bulb as three messages carry it, and how ROS numbers it
//! (docs/spec/traffic-lights.md, "Bulbs and their numbers").

use serde::{Deserialize, Serialize};

use crate::core::compat::Compat;
use crate::core::traffic_light::bulb::{Bulb, BulbShape, BulbStatus, Color};
use crate::core::traffic_light::emission::GroupElement;

/// `autoware_perception_msgs/msg/TrafficLightElement`; the legacy `TrafficSignalElement` has the same
/// fields and constants.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrafficLightElement {
    /// `UNKNOWN` 0, `RED` 1, `AMBER` 2, `GREEN` 3, `WHITE` 4.
    pub color: u8,
    /// `UNKNOWN` 0, `CIRCLE` 1, eight arrows 2 to 9, `CROSS` 10.
    pub shape: u8,
    /// `UNKNOWN` 0, `SOLID_OFF` 1, `SOLID_ON` 2, `FLASHING` 3.
    pub status: u8,
    /// Confidence, 0 to 1.
    pub confidence: f32,
}

impl TrafficLightElement {
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

    /// The bulb that the element shows; `None` when one of its numbers is not a constant of the type, or the
    /// confidence is not from 0 to 1.
    pub fn bulb(&self) -> Option<Bulb> {
        let color = Color::ALL.into_iter().find(|known| color(*known) == self.color)?;
        let shape = BulbShape::ALL.into_iter().find(|known| shape(*known, Compat::Improved) == self.shape)?;
        let status = BulbStatus::ALL.into_iter().find(|known| status(*known) == self.status)?;
        (0.0..=1.0).contains(&self.confidence).then_some(Bulb { color, status, shape })
    }

    pub(super) fn all(elements: &[GroupElement], compat: Compat) -> Vec<Self> {
        elements.iter().map(|element| Self::new(element.bulb, element.confidence, compat)).collect()
    }
}

/// The constant of the message, named in the comments, for a colour.
fn color(color: Color) -> u8 {
    match color {
        Color::Unknown => 0, // UNKNOWN
        Color::Red => 1,     // RED
        Color::Yellow => 2,  // AMBER
        Color::Green => 3,   // GREEN
        Color::White => 4,   // WHITE
    }
}

/// The constant for a shape. Upstream has no number for the upper diagonals (Q7).
fn shape(shape: BulbShape, compat: Compat) -> u8 {
    match shape {
        BulbShape::UpperLeft | BulbShape::UpperRight if compat == Compat::Upstream => 0,
        BulbShape::Unknown => 0,    // UNKNOWN
        BulbShape::Circle => 1,     // CIRCLE
        BulbShape::Left => 2,       // LEFT_ARROW
        BulbShape::Right => 3,      // RIGHT_ARROW
        BulbShape::Up => 4,         // UP_ARROW
        BulbShape::UpperLeft => 5,  // UP_LEFT_ARROW
        BulbShape::UpperRight => 6, // UP_RIGHT_ARROW
        BulbShape::Down => 7,       // DOWN_ARROW
        BulbShape::LowerLeft => 8,  // DOWN_LEFT_ARROW
        BulbShape::LowerRight => 9, // DOWN_RIGHT_ARROW
        BulbShape::Cross => 10,     // CROSS
    }
}

/// The constant for a status.
fn status(status: BulbStatus) -> u8 {
    match status {
        BulbStatus::Unknown => 0,  // UNKNOWN
        BulbStatus::SolidOff => 1, // SOLID_OFF
        BulbStatus::SolidOn => 2,  // SOLID_ON
        BulbStatus::Flashing => 3, // FLASHING
    }
}

/// An id as it is sent: upstream's travels as 32 bits between its processes (Q6).
#[allow(clippy::cast_possible_truncation)] // upstream truncates
pub(super) fn id(id: i64, compat: Compat) -> i64 {
    match compat {
        Compat::Improved => id,
        Compat::Upstream => i64::from(id as i32),
    }
}
