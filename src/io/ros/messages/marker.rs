//! `visualization_msgs/msg/Marker` and what it consists of; Humble and Jazzy lay it out alike.

use serde::{Deserialize, Serialize};

use super::geometry::{Point, Pose, Vector3};
use super::stamp::{Duration, Header};

/// `std_msgs/msg/ColorRGBA`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ColorRgba {
    /// Share of red, 0 to 1.
    pub r: f32,
    /// Share of green, 0 to 1.
    pub g: f32,
    /// Share of blue, 0 to 1.
    pub b: f32,
    /// Opacity, 1 = opaque.
    pub a: f32,
}

/// `sensor_msgs/msg/CompressedImage`; empty here.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CompressedImage {
    /// Stamp and frame of the image.
    pub header: Header,
    /// `jpeg`, `png` and the like.
    pub format: String,
    /// The compressed file.
    pub data: Vec<u8>,
}

/// `visualization_msgs/msg/UVCoordinate`; none here.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct UvCoordinate {
    /// Column of the texture, 0 to 1.
    pub u: f32,
    /// Row of the texture, 0 to 1.
    pub v: f32,
}

/// `visualization_msgs/msg/MeshFile`; empty here.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct MeshFile {
    /// Name of the file.
    pub filename: String,
    /// Content of the file.
    pub data: Vec<u8>,
}

/// `visualization_msgs/msg/Marker`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Marker {
    /// Stamp, and frame of the pose.
    pub header: Header,
    /// Names the marker together with `id`.
    pub ns: String,
    /// Names the marker together with `ns`.
    pub id: i32,
    /// Shape; here `ARROW` 0, `SPHERE` 2, `TEXT_VIEW_FACING` 9.
    pub r#type: i32,
    /// Here `ADD` 0, which also changes a marker with the same `ns` and `id`, or `DELETEALL` 3.
    pub action: i32,
    /// Position and orientation.
    pub pose: Pose,
    /// Diameters of a sphere, length, width and height of an arrow, metres; z is the height of letters.
    pub scale: Vector3,
    /// Colour of the whole marker.
    pub color: ColorRgba,
    /// After it the viewer deletes the marker; zero: never.
    pub lifetime: Duration,
    /// True if the marker moves with its frame.
    pub frame_locked: bool,
    /// None here.
    pub points: Vec<Point>,
    /// None here.
    pub colors: Vec<ColorRgba>,
    /// None here.
    pub texture_resource: String,
    /// None here.
    pub texture: CompressedImage,
    /// None here.
    pub uv_coordinates: Vec<UvCoordinate>,
    /// The letters of a text.
    pub text: String,
    /// None here.
    pub mesh_resource: String,
    /// None here.
    pub mesh_file: MeshFile,
    /// Of no meaning here.
    pub mesh_use_embedded_materials: bool,
}
