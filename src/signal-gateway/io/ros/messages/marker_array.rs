//! `visualization_msgs/msg/MarkerArray`: lamps as spheres for a viewer
//! (docs/spec/traffic-lights.md, "Markers").

use super::array_element::{ArrayElement, StampPosition};
use gateway_base::time::WallStamp;
use lanelet2_map::light_map::LampColor;
use ros_messages::geometry_msgs::{Pose, Vector3};
use ros_messages::std_msgs::{ColorRGBA, Header};
use ros_messages::visualization_msgs::{Marker, MarkerArray};
use traffic_lights::bulb::Color;
use traffic_lights::compat::Compat;
use traffic_lights::emission::LampMarker;

/// Frame of all markers.
pub(super) const FRAME: &str = "map";
/// Namespace of all lamps whose number fits the field.
const NAMESPACE: &str = "bulb";
/// Diameter of a lamp, metres.
const DIAMETER_M: f64 = 0.3;
/// Opacity of a lamp that is off.
const ALPHA_OFF: f32 = 0.3;
/// Upper bound (exclusive) of the lamp numbers in a head.
const NUMBERS_PER_HEAD: i64 = 4;

/// Creates the message that deletes all earlier markers. Upstream sends it before each array of spheres; a
/// single publisher that always draws all lamps does not need it (Q19).
pub(super) fn delete_all(stamp: WallStamp) -> MarkerArray {
    let header = Header::new(stamp, FRAME);
    MarkerArray { markers: vec![Marker { header, action: Marker::DELETEALL, ..Marker::default() }] }
}

impl ArrayElement for Marker {
    type Item = LampMarker;
    const STAMP: StampPosition = StampPosition::Elements;
    const ALIGNMENT: usize = 4;

    fn new(marker: &LampMarker, stamp: WallStamp, compat: Compat) -> Self {
        let (number, [r, g, b]) = match marker.lamp.color {
            LampColor::Green => (Color::Green as u8, [0.0, 1.0, 0.0]),
            LampColor::Yellow => (Color::Yellow as u8, [1.0, 1.0, 0.0]),
            LampColor::Red => (Color::Red as u8, [1.0, 0.0, 0.0]),
        };
        let (ns, id) = name(marker.way_id, number, compat);
        Self {
            header: Header::new(stamp, FRAME),
            ns,
            id,
            r#type: Self::SPHERE,
            action: Self::ADD,
            pose: Pose { position: marker.lamp.position_m.into(), ..Pose::default() },
            scale: Vector3 { x: DIAMETER_M, y: DIAMETER_M, z: DIAMETER_M },
            color: ColorRGBA { r, g, b, a: if marker.is_on { 1.0 } else { ALPHA_OFF } },
            ..Self::default()
        }
    }
}

/// Returns namespace and id of a lamp's marker: the way id times four plus the lamp's number. Larger ids get
/// their own namespace. Upstream's ids wrap around, so lamps of different heads can replace each other (Q6).
fn name(way_id: i64, number: u8, compat: Compat) -> (String, i32) {
    let id = way_id.wrapping_mul(NUMBERS_PER_HEAD).wrapping_add(i64::from(number));
    let fitting = way_id
        .checked_mul(NUMBERS_PER_HEAD)
        .and_then(|first| first.checked_add(i64::from(number)))
        .and_then(|id| i32::try_from(id).ok());
    #[allow(clippy::cast_possible_truncation)] // upstream truncates
    match (fitting, compat) {
        (Some(id), _) => (NAMESPACE.to_owned(), id),
        (None, Compat::Upstream) => (NAMESPACE.to_owned(), id as i32),
        (None, Compat::Improved) => (format!("{NAMESPACE} {way_id}"), i32::from(number)),
    }
}
