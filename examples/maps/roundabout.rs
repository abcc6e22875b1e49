//! A roundabout with four arms, driven clockwise: a ring of 20 m radius, arms of 75 m with curved lanes
//! in and out. Arm 1 comes from the west, 2 from the north, 3 from the east, 4 from the south, as they
//! are passed; ids are arm and role. One map has the tags for signals, one has none.

use super::curve::{Curve, Pose, arc, bend, pose, straight};
use super::drawing::{Drawing, HALF_WIDTH_M, Lane, Marking, Tag, tag};

const IN: i64 = 1;
const ENTRY: i64 = 2;
const EXIT: i64 = 3;
const OUT: i64 = 4;
/// Of the ring, from the entry to the next arm's exit.
const BETWEEN: i64 = 5;
/// Of the ring, from the exit to the entry.
const PAST: i64 = 6;
const ELEMENT: i64 = 900;

const RING_M: f64 = 20.0;
const ARM_M: f64 = 75.0;
const MOUTH_M: f64 = 45.0;
/// Lanes in and out meet the ring this far beside the middle of an arm, degrees.
const ASIDE_DEG: f64 = 25.0;

pub(crate) fn draw_tagged(drawing: &mut Drawing) {
    draw(drawing, true);
}

pub(crate) fn draw_untagged(drawing: &mut Drawing) {
    draw(drawing, false);
}

fn draw(drawing: &mut Drawing, is_tagged: bool) {
    for (quarters, arm) in [(0, 1), (3, 2), (2, 3), (1, 4)] {
        let [enters, leaves] = [180.0 - ASIDE_DEG, 180.0 + ASIDE_DEG].map(on_ring);
        let mouth = pose(-MOUTH_M, HALF_WIDTH_M, 0.0);
        let lanelets: [(i64, Curve, Vec<Tag>); 6] = [
            (IN, straight(mouth.moved(-ARM_M, 0.0), ARM_M), vec![]),
            (ENTRY, bend(mouth, enters), entry_tags(arm)),
            (EXIT, bend(leaves, pose(-MOUTH_M, -HALF_WIDTH_M, 180.0)), vec![]),
            (OUT, straight(pose(-MOUTH_M, -HALF_WIDTH_M, 180.0), ARM_M), vec![]),
            (
                BETWEEN,
                arc(enters, RING_M, 2.0 * ASIDE_DEG - 90.0),
                vec![tag("enable_exit_turn_signal", "true")],
            ),
            (PAST, arc(leaves, RING_M, -2.0 * ASIDE_DEG), vec![]),
        ];
        for (role, middle, tags) in lanelets {
            let middle = middle.quarters(quarters);
            let is_arm = role == IN || role == OUT;
            let right = if is_arm { Marking::Solid } else { Marking::Virtual };
            let left = if is_arm { Marking::Border } else { Marking::Virtual };
            let elements = if is_arm { vec![] } else { vec![ELEMENT] };
            let tags = if is_tagged { tags } else { vec![] };
            drawing.lane(Lane { elements, tags, ..Lane::new(id(arm, role), &middle, left, right) });
        }
    }
    let all = |roles: &[i64]| (1..=4).flat_map(|arm| roles.iter().map(move |role| id(arm, *role))).collect();
    let roles = [("entry", all(&[ENTRY])), ("exit", all(&[EXIT])), ("internal", all(&[BETWEEN, PAST]))];
    drawing.roundabout(ELEMENT, roles);
}

fn id(arm: i64, role: i64) -> i64 {
    100 * arm + role
}

/// On entry, the next exit is announced to the left, the last but one to the right.
fn entry_tags(arm: i64) -> Vec<Tag> {
    let exit_after = |count: i64| id((arm - 1 + count) % 4 + 1, EXIT);
    vec![
        tag("exit_turn_signal_left", format!("[{}]", exit_after(1))),
        tag("exit_turn_signal_right", format!("[{}, {}]", exit_after(3), exit_after(4))),
    ]
}

/// The pose on the ring in this direction from its middle, clockwise traffic.
fn on_ring(direction_deg: f64) -> Pose {
    pose(0.0, 0.0, direction_deg - 90.0).moved(0.0, RING_M)
}
