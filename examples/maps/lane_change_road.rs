//! Three lanes side by side, dashed between, for 300 m in three parts; then the left one turns left, the
//! middle one goes on, the right one turns right. Ids: left 101 on, middle 201 on, right 301 on; in the
//! intersection 111, 211, 311; behind it 112, 212, 312.

use super::curve::{Curve, Pose, arc, pose, straight};
use super::drawing::{Drawing, Lane, Marking};

const WIDTH_M: f64 = 3.5;
const PART_M: f64 = 100.0;

/// Makes a curve that continues from a pose.
type Continuation = fn(Pose) -> Curve;

pub(crate) fn draw(drawing: &mut Drawing) {
    let lanes: [(i64, f64, [Marking; 2], &str, Continuation); 3] = [
        (100, WIDTH_M, [Marking::Border, Marking::Dashed], "left", |from| arc(from, 12.0, 90.0)),
        (200, 0.0, [Marking::Dashed, Marking::Dashed], "straight", |from| straight(from, 24.0)),
        (300, -WIDTH_M, [Marking::Dashed, Marking::Border], "right", |from| arc(from, 12.0, -90.0)),
    ];
    for (base, y, [left, right], direction, continuation) in lanes {
        let mut from = pose(0.0, y, 0.0);
        for part in 1..=3 {
            let middle = straight(from, PART_M);
            from = middle.end();
            drawing.lane(Lane::new(base + part, &middle, left, right));
        }
        let middle = continuation(from);
        drawing.lane(Lane::turning(base + 11, &middle, direction));
        drawing.lane(Lane::new(base + 12, &straight(middle.end(), 60.0), Marking::Border, Marking::Border));
    }
}
