//! One lane, turn after turn: left and right with 12 m between; a left turn split into three lanelets;
//! a right turn whose lanelet goes on straight for 40 m.

use super::curve::{Curve, Pose, arc, pose, straight};
use super::drawing::{Drawing, Lane, Marking, tag};

/// Makes a curve that continues from a pose.
type Continuation = fn(Pose) -> Curve;

pub(crate) fn draw(drawing: &mut Drawing) {
    let lanelets: [(i64, &str, Continuation); 12] = [
        (101, "", |from| straight(from, 100.0)),
        (102, "left", |from| arc(from, 10.0, 90.0)),
        (103, "", |from| straight(from, 12.0)),
        (104, "right", |from| arc(from, 10.0, -90.0)),
        (105, "", |from| straight(from, 100.0)),
        (106, "left", |from| arc(from, 20.0, 30.0)),
        (107, "left", |from| arc(from, 20.0, 30.0)),
        (108, "left", |from| arc(from, 20.0, 30.0)),
        (109, "", |from| straight(from, 100.0)),
        (110, "right", |from| arc(from, 10.0, -90.0).then(|from| straight(from, 40.0))),
        (111, "", |from| straight(from, 60.0)),
        (112, "straight", |from| straight(from, 24.0)),
    ];
    let mut from = pose(0.0, 0.0, 0.0);
    for (id, direction, continuation) in lanelets {
        let middle = continuation(from);
        from = middle.end();
        let lane = Lane::new(id, &middle, Marking::Border, Marking::Border);
        let turns = (!direction.is_empty()).then(|| tag("turn_direction", direction));
        drawing.lane(Lane { tags: turns.into_iter().collect(), ..lane });
    }
}
