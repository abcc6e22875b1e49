//! One lane with two side streets to the left: over the crossing of the first one, from 100 to 124 m, leads
//! 112, straight on; into the second one leads 121, from 148 m on.

use super::curve::{arc, pose, straight};
use super::drawing::{Drawing, Lane, Marking};

/// Radius of a turn into a side street, metres.
const RADIUS_M: f64 = 8.0;

pub(crate) fn draw(drawing: &mut Drawing) {
    let mut from = pose(0.0, 0.0, 0.0);
    let streets = [(101, 100.0, 110), (102, 24.0, 120)];
    for (before, length_m, crossing) in streets {
        let road = straight(from, length_m);
        let left = arc(road.end(), RADIUS_M, 90.0);
        let over = straight(road.end(), 24.0);
        drawing.lane(Lane::new(before, &road, Marking::Border, Marking::Border));
        drawing.lane(Lane::turning(crossing + 1, &left, "left"));
        drawing.lane(Lane::turning(crossing + 2, &over, "straight"));
        let street = straight(left.end(), 60.0);
        drawing.lane(Lane::new(crossing + 3, &street, Marking::Border, Marking::Border));
        from = over.end();
    }
    drawing.lane(Lane::new(103, &straight(from, 60.0), Marking::Border, Marking::Border));
}
