//! `visualization_msgs/msg/Marker` and what it consists of; Humble and Jazzy lay it out alike.

use serde::{Deserialize, Serialize};

use super::geometry::{Point, Pose, Vector3};
use super::stamp::{Duration, Header};

/// `std_msgs/msg/ColorRGBA`; each 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ColorRgba {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
    /// Opacity.
    pub a: f32,
}

/// `sensor_msgs/msg/CompressedImage`; empty here.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CompressedImage {
    /// Stamp and frame of the image.
    pub header: Header,
    /// `jpeg`, `png` and the like.
    pub format: String,
    /// The file.
    pub data: Vec<u8>,
}

/// `visualization_msgs/msg/UVCoordinate`; none here.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct UvCoordinate {
    /// 0 to 1.
    pub u: f32,
    /// 0 to 1.
    pub v: f32,
}

/// `visualization_msgs/msg/MeshFile`; empty here.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct MeshFile {
    /// Its name.
    pub filename: String,
    /// Its content.
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
    /// `SPHERE` here.
    pub r#type: i32,
    /// `ADD` or `DELETEALL` here.
    pub action: i32,
    /// Position and orientation.
    pub pose: Pose,
    /// Diameters, metres.
    pub scale: Vector3,
    /// Colour of the whole marker.
    pub color: ColorRgba,
    /// Zero: it stays until it is deleted.
    pub lifetime: Duration,
    /// Whether it moves with its frame.
    pub frame_locked: bool,
    /// None for a sphere.
    pub points: Vec<Point>,
    /// None for a sphere.
    pub colors: Vec<ColorRgba>,
    /// None for a sphere.
    pub texture_resource: String,
    /// None for a sphere.
    pub texture: CompressedImage,
    /// None for a sphere.
    pub uv_coordinates: Vec<UvCoordinate>,
    /// None for a sphere.
    pub text: String,
    /// None for a sphere.
    pub mesh_resource: String,
    /// None for a sphere.
    pub mesh_file: MeshFile,
    /// Of no meaning for a sphere.
    pub mesh_use_embedded_materials: bool,
}

impl Marker {
    /// Type.
    pub const SPHERE: i32 = 2;
    /// Action: add, or change what has the same `ns` and `id`.
    pub const ADD: i32 = 0;
    /// Action: delete all markers of the topic.
    pub const DELETEALL: i32 = 3;
}
