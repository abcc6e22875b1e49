//! Conversion between poses in the plane and poses of `geometry_msgs`.

use lanelet2_map::geometry as plane;
use ros_messages::geometry_msgs::{Point, Pose, Quaternion};

/// Converts a pose in the plane to an upright pose, at height 0 of the map if its height is unknown.
pub(super) fn upright_pose(plane::Pose { position, yaw_rad }: plane::Pose) -> Pose {
    let (sin, cos) = (yaw_rad / 2.0).sin_cos();
    let z = if position.z_m.is_finite() { position.z_m } else { 0.0 };
    Pose {
        position: Point { x: position.x_m, y: position.y_m, z },
        orientation: Quaternion { x: 0.0, y: 0.0, z: sin, w: cos },
    }
}

/// Projects a pose to the plane; the point keeps its height.
pub(super) fn plane_pose(Pose { position: Point { x, y, z }, orientation }: Pose) -> plane::Pose {
    plane::Pose { position: plane::Point::new(x, y).at_height(z), yaw_rad: orientation.yaw_rad() }
}
