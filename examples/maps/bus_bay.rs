//! One lane with a bay on either side from 100 to 160 m (hard shoulders 151 left, 152 right), and a left
//! turn at 250 m: 101 to 104, then 111 and 112.

use super::curve::{Point, arc, pose, straight};
use super::drawing::{Drawing, HALF_WIDTH_M, Lane, Marking};

/// Depth of a bay, metres.
const BAY_M: f64 = 3.0;
/// Begin and end of the bay, metres.
const BAY: [f64; 2] = [100.0, 160.0];
/// Length of its mouths, metres.
const MOUTH_M: f64 = 12.0;

pub(crate) fn draw(drawing: &mut Drawing) {
    let mut from = pose(0.0, 0.0, 0.0);
    for (id, length_m) in [(101, 100.0), (102, 60.0), (103, 40.0), (104, 50.0)] {
        let middle = straight(from, length_m);
        from = middle.end();
        let edge = if id == 102 { Marking::Dashed } else { Marking::Border };
        drawing.lane(Lane::new(id, &middle, edge, edge));
    }
    let turn = arc(from, 12.0, 90.0);
    drawing.lane(Lane::turning(111, &turn, "left"));
    drawing.lane(Lane::new(112, &straight(turn.end(), 80.0), Marking::Border, Marking::Border));

    let [begin, end] = BAY;
    let edge: [Point; 2] = [[begin, HALF_WIDTH_M], [end, HALF_WIDTH_M]];
    let (mouth, deep) = (HALF_WIDTH_M + 0.2, HALF_WIDTH_M + BAY_M);
    let curb = [[begin, mouth], [begin + MOUTH_M, deep], [end - MOUTH_M, deep], [end, mouth]];
    drawing.shoulder(151, (&curb, Marking::Border), (&edge, Marking::Dashed));
    let mirrored = |[x, y]: Point| [x, -y];
    let (edge, curb) = (edge.map(mirrored), curb.map(mirrored));
    drawing.shoulder(152, (&edge, Marking::Dashed), (&curb, Marking::Border));
}
