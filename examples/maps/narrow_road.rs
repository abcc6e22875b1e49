//! One lane and nothing beside it for 300 m (101 to 103); a hatched area touches the left
//! side of 102 from 110 to 190 m.

use super::curve::{pose, straight};
use super::drawing::{Drawing, HALF_WIDTH_M, Lane, Marking};

pub(crate) fn draw(drawing: &mut Drawing) {
    let mut from = pose(0.0, 0.0, 0.0);
    for id in 101..=103 {
        let middle = straight(from, 10.0).then(|on| straight(on, 80.0)).then(|on| straight(on, 10.0));
        from = middle.end();
        drawing.lane(Lane::new(id, &middle, Marking::Solid, Marking::Border));
    }
    drawing.hatched(&[[115.0, 5.0], [110.0, HALF_WIDTH_M], [190.0, HALF_WIDTH_M], [185.0, 5.0]]);
}
