//! One lane that turns left after 100 m and enters a roundabout 20 m behind the turn: 102 turns, 104 is the
//! entry, 105 the part of the ring that is driven, 106 the exit. The rest of the ring is not there.

use super::curve::{arc, pose, straight};
use super::drawing::{Drawing, Lane, Marking};

const ELEMENT: i64 = 900;

pub(crate) fn draw(drawing: &mut Drawing) {
    let before = straight(pose(0.0, 0.0, 0.0), 100.0);
    let turn = arc(before.end(), 12.0, 90.0);
    let between = straight(turn.end(), 20.0);
    let entry = arc(between.end(), 15.0, 60.0);
    let ring = arc(entry.end(), 20.0, -90.0);
    let exit = arc(ring.end(), 15.0, 60.0);
    let behind = straight(exit.end(), 80.0);
    drawing.lane(Lane::new(101, &before, Marking::Border, Marking::Border));
    drawing.lane(Lane::turning(102, &turn, "left"));
    drawing.lane(Lane::new(103, &between, Marking::Border, Marking::Border));
    for (id, middle) in [(104, &entry), (105, &ring), (106, &exit)] {
        let lane = Lane::new(id, middle, Marking::Virtual, Marking::Virtual);
        drawing.lane(Lane { elements: vec![ELEMENT], ..lane });
    }
    drawing.lane(Lane::new(107, &behind, Marking::Border, Marking::Border));
    drawing.roundabout(ELEMENT, [("entry", vec![104]), ("exit", vec![106]), ("internal", vec![105])]);
}
