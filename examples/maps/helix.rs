//! One lane: 60 m straight on, up two rounds of a helix to the left of 15 m radius, 40 m straight on, a left
//! turn, 40 m straight on. The second round (106 to 109) lies 6 m above the first one (102 to 105).

use super::curve::{Curve, Pose, arc, pose, straight};
use super::drawing::{Drawing, Lane, Marking, tag};

/// Rise of a quarter of a round, metres.
const QUARTER_RISE_M: f64 = 1.5;

pub(crate) fn draw(drawing: &mut Drawing) {
    let (mut from, mut height_m) = (pose(0.0, 0.0, 0.0), 0.0);
    for id in 101..=112 {
        let middle = piece(id, from);
        let end_m = if (102..=109).contains(&id) { height_m + QUARTER_RISE_M } else { height_m };
        let lane = Lane::new(id, &middle, Marking::Border, Marking::Border);
        let turns = (id == 111).then(|| tag("turn_direction", "left"));
        drawing.lane(Lane { heights_m: [height_m, end_m], tags: turns.into_iter().collect(), ..lane });
        (from, height_m) = (middle.end(), end_m);
    }
}

fn piece(id: i64, from: Pose) -> Curve {
    match id {
        101 => straight(from, 60.0),
        102..=109 => arc(from, 15.0, 90.0),
        111 => arc(from, 10.0, 90.0),
        _ => straight(from, 40.0),
    }
}
