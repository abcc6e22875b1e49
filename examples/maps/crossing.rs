//! Four arms of 100 m around a box of 24 m, one lane in and one out, with traffic lights. Arm 1 comes
//! from the west, 2 from the south, 3 from the east, 4 from the north; ids are arm and role. From the
//! south, the left turn is announced 20 m before it.

use super::curve::{arc, pose, straight};
use super::drawing::{Drawing, HALF_WIDTH_M, Lane, Marking, tag};

const IN: i64 = 1;
const OUT: i64 = 2;
const LEFT: i64 = 11;
const STRAIGHT: i64 = 12;
const RIGHT: i64 = 13;
const LIGHT: i64 = 50;

const ARM_M: f64 = 100.0;
const BOX_M: f64 = 12.0;

pub(crate) fn draw(drawing: &mut Drawing) {
    for quarters in 0..4 {
        let base = 100 * (i64::from(quarters) + 1);
        let at_box = pose(-BOX_M, HALF_WIDTH_M, 0.0);
        let incoming = straight(at_box.moved(-ARM_M, 0.0), ARM_M).quarters(quarters);
        let outgoing = straight(pose(-BOX_M, -HALF_WIDTH_M, 180.0), ARM_M).quarters(quarters);
        drawing.lane(Lane::new(base + IN, &incoming, Marking::Border, Marking::Solid));
        drawing.lane(Lane::new(base + OUT, &outgoing, Marking::Border, Marking::Solid));
        let lanelets = [
            (LEFT, arc(at_box, BOX_M - HALF_WIDTH_M, 90.0), "left"),
            (STRAIGHT, straight(at_box, 2.0 * BOX_M), "straight"),
            (RIGHT, arc(at_box, BOX_M + HALF_WIDTH_M, -90.0), "right"),
        ];
        for (role, middle, direction) in lanelets {
            let middle = middle.quarters(quarters);
            let mut lane =
                Lane { elements: vec![base + LIGHT], ..Lane::turning(base + role, &middle, direction) };
            if base + role == 211 {
                lane.tags.push(tag("turn_signal_distance", "20"));
            }
            drawing.lane(lane);
        }
        // The light hangs beyond the box, as viewed from the arm.
        let beyond = at_box.moved(2.0 * BOX_M, 0.0);
        let head = [beyond.moved(0.0, 0.6), beyond.moved(0.0, -0.6)];
        let stop = at_box.moved(-1.0, 0.0);
        let stop_line = [stop.moved(0.0, HALF_WIDTH_M), stop.moved(0.0, -HALF_WIDTH_M)];
        let [head, stop_line] = [head, stop_line].map(|line| line.map(|end| end.quarters(quarters).at));
        drawing.traffic_light(base + LIGHT, head, stop_line);
    }
}
