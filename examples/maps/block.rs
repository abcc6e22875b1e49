//! One lane that forks after 60 m: 102 leads straight on; 103 to 110 lead once around a block, a left turn
//! and 20 m straight on at each corner, and meet the fork again, on top of the last 20 m of the way in.

use super::curve::{arc, pose, straight};
use super::drawing::{Drawing, Lane, Marking};

pub(crate) fn draw(drawing: &mut Drawing) {
    let way_in = straight(pose(0.0, 0.0, 0.0), 60.0);
    let mut from = way_in.end();
    let straight_on = straight(from, 60.0);
    drawing.lane(Lane::new(101, &way_in, Marking::Border, Marking::Border));
    drawing.lane(Lane::new(102, &straight_on, Marking::Border, Marking::Border));
    for turn in (103..=109).step_by(2) {
        let corner = arc(from, 10.0, 90.0);
        let side = straight(corner.end(), 20.0);
        drawing.lane(Lane::turning(turn, &corner, "left"));
        drawing.lane(Lane::new(turn + 1, &side, Marking::Border, Marking::Border));
        from = side.end();
    }
}
