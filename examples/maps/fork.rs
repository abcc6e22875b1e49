//! A lane that forks at 100 m, 103 to the left of 102, and merges again at 280 m, without turn
//! directions: no signal is required here.

use super::curve::{Curve, bend, pose, straight};
use super::drawing::{Drawing, Lane, Marking};

pub(crate) fn draw(drawing: &mut Drawing) {
    let on_main = |x| pose(x, 0.0, 0.0);
    let on_side = |x| pose(x, 8.0, 0.0);
    let lanelets: [(i64, Curve); 8] = [
        (101, straight(on_main(0.0), 100.0)),
        (102, straight(on_main(100.0), 60.0)),
        (103, bend(on_main(100.0), on_side(160.0))),
        (104, straight(on_main(160.0), 60.0)),
        (105, straight(on_side(160.0), 60.0)),
        (106, straight(on_main(220.0), 60.0)),
        (107, bend(on_side(220.0), on_main(280.0))),
        (108, straight(on_main(280.0), 100.0)),
    ];
    for (id, middle) in lanelets {
        drawing.lane(Lane::new(id, &middle, Marking::Border, Marking::Border));
    }
}
