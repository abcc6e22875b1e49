//! One lane with a chicane after 100 m: 102 turns left within 8.3 m, 103 right within 7.5 m, then 104
//! straight on.

use super::curve::{Curve, Pose, arc, pose, straight};
use super::drawing::{Drawing, Lane, Marking};

/// Bend of either turn, degrees.
const BEND_DEG: f64 = 40.0;

pub(crate) fn draw(drawing: &mut Drawing) {
    let before = straight(pose(0.0, 0.0, 0.0), 100.0);
    let left = turn(before.end(), 8.3, BEND_DEG);
    let right = turn(left.end(), 7.5, -BEND_DEG);
    let behind = straight(right.end(), 80.0);
    drawing.lane(Lane::new(101, &before, Marking::Border, Marking::Border));
    drawing.lane(Lane::turning(102, &left, "left"));
    drawing.lane(Lane::turning(103, &right, "right"));
    drawing.lane(Lane::new(104, &behind, Marking::Border, Marking::Border));
}

fn turn(from: Pose, length_m: f64, turn_deg: f64) -> Curve {
    arc(from, length_m / turn_deg.to_radians().abs(), turn_deg)
}
