//! A smooth line through a stretch of joined centrelines, sampled at equal steps
//! (docs/spec/turn-signal-decider.md, "Distance path").

use std::f64::consts::FRAC_PI_2;
use std::iter::successors;

use super::polyline::{arc_lengths_m, at_arc};
use super::spline::akima_points;
use super::{Point, wrapped};

/// Samples nearer to each other than this become one, metres.
const MERGE_M: f64 = 0.1;
/// Maximum number of samples of a line; far above those of any lanelet or path, it bounds memory.
const MAX_SAMPLES: f64 = 100_000.0;
/// Points nearer than this to the one before are the same point, metres.
const SAME_M: f64 = 0.001;
/// The same, where the line turns back by a right angle or more, metres.
const SAME_TURNING_BACK_M: f64 = 0.05;

/// A point of a line that a smooth line is drawn through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knot {
    /// Where it is.
    pub point: Point,
    /// Two pieces of the line, such as lanelets, meet at it.
    pub is_joint: bool,
}

/// Returns the points of joined pieces of line between two arc lengths, metres, with the points at these arc
/// lengths themselves. Points that are the same become one, which is a joint. If `to_m` is the smaller one,
/// there are only the two points, in the order of the line, or in the order given if they lie on one piece.
pub fn knots_between(line: &[Point], from_m: f64, to_m: f64) -> Vec<Knot> {
    let arcs = arc_lengths_m(line);
    let inside = line.iter().zip(&arcs).filter(|(_, at_m)| from_m < **at_m && **at_m < to_m);
    let inside = inside.map(|(point, _)| *point);
    let piece = |at: f64| arcs.partition_point(|at_m| *at_m <= at);
    let is_in_order = from_m <= to_m || piece(from_m) == piece(to_m);
    let [first, last] =
        if is_in_order { [from_m, to_m] } else { [to_m, from_m] }.map(|at_m| at_arc(line, at_m));
    let mut knots: Vec<Knot> = Vec::new();
    let mut before_rad = 0.0;
    for point in first.into_iter().chain(inside).chain(last) {
        let Some(last) = knots.last_mut() else {
            knots.push(Knot { point, is_joint: false });
            continue;
        };
        let (gap_m, yaw_rad) = (last.point.spatial_distance_m(point), last.point.heading_to_rad(point));
        let turns_back = wrapped(before_rad - yaw_rad).abs() >= FRAC_PI_2;
        if gap_m < SAME_M || turns_back && gap_m < SAME_TURNING_BACK_M {
            last.is_joint = true;
        } else {
            knots.push(Knot { point, is_joint: false });
            before_rad = yaw_rad;
        }
    }
    knots
}

/// Returns samples of the smooth line through `knots`: one every `step_m` metres, one at each joint, and the
/// last knot. A step next to a joint or to the end gives way to it. The knots themselves if there are not
/// two.
pub fn resampled(knots: &[Knot], step_m: f64) -> Vec<Point> {
    let points: Vec<Point> = knots.iter().map(|knot| knot.point).collect();
    let arcs = arc_lengths_m(&points);
    let mut queries = queries_m(arcs.last().copied().unwrap_or_default(), step_m);
    for (at_m, _) in arcs.iter().zip(knots).filter(|(_, knot)| knot.is_joint) {
        let next = queries.partition_point(|query| query <= at_m);
        let Some(after) = queries.get(next).copied() else { continue };
        match next.checked_sub(1).and_then(|before| queries.get_mut(before)) {
            Some(before) if at_m - *before < MERGE_M => *before = *at_m,
            Some(_) => {
                if after - at_m < MERGE_M {
                    queries.remove(next);
                }
                queries.insert(next, *at_m);
            }
            None => {}
        }
    }
    akima_points(&arcs, &points, &queries).unwrap_or(points)
}

/// Returns the arc lengths from 0 to `length_m` in steps of `step_m`, metres, and the length itself, which a
/// last step nearer than 10 cm becomes. None for a line of too many steps.
pub fn queries_m(length_m: f64, step_m: f64) -> Vec<f64> {
    if length_m > step_m * MAX_SAMPLES {
        return Vec::new();
    }
    let samples = successors(Some(0.0), |at_m| Some(at_m + step_m));
    let mut queries: Vec<f64> = samples.take_while(|at_m| *at_m < length_m).collect();
    match queries.last_mut() {
        Some(last) if length_m - *last < MERGE_M => *last = length_m,
        Some(_) | None => queries.push(length_m),
    }
    queries
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(xs: &[f64]) -> Vec<Point> {
        xs.iter().map(|x| Point::new(*x, 0.0)).collect()
    }

    fn xs(points: impl IntoIterator<Item = Point>) -> Vec<f64> {
        points.into_iter().map(|point| (point.x_m * 1e6).round() / 1e6).collect()
    }

    #[test]
    fn lines_are_cut_and_what_is_the_same_becomes_one() {
        let (one, other) = (line(&[0.0, 5.0, 10.0]), line(&[10.0005, 20.0]));
        let knots = knots_between(&[one.clone(), other].concat(), 2.0, 14.0);
        assert_eq!(xs(knots.iter().map(|knot| knot.point)), [2.0, 5.0, 10.0, 14.0]);
        assert_eq!(knots.iter().filter(|knot| knot.is_joint).count(), 1);
        // A joint that turns back by less than 5 cm.
        let knots = knots_between(&[one.clone(), line(&[9.97, 20.0])].concat(), 0.0, 99.0);
        assert_eq!(xs(knots.iter().map(|knot| knot.point)), [0.0, 5.0, 10.0, 20.0]);
        let knots = knots_between(&[one.clone(), line(&[9.9, 20.0])].concat(), 0.0, 99.0);
        assert_eq!(xs(knots.iter().map(|knot| knot.point)), [0.0, 5.0, 10.0, 9.9, 20.0]);
        assert!(knots_between(&[], 0.0, 9.0).is_empty());
        for (from_m, to_m, expected) in [(7.0, 3.0, [3.0, 7.0]), (4.0, 3.0, [4.0, 3.0])] {
            let knots = knots_between(&one, from_m, to_m);
            assert_eq!(xs(knots.iter().map(|knot| knot.point)), expected);
        }
    }

    #[test]
    fn samples_lie_at_steps_at_joints_and_at_the_end() {
        let sampled = |joint_m: f64, end_m: f64| {
            let (one, other) = (line(&[0.0, joint_m]), line(&[joint_m, end_m]));
            xs(resampled(&knots_between(&[one, other].concat(), 0.0, end_m), 2.0))
        };
        assert_eq!(sampled(3.0, 6.05), [0.0, 2.0, 3.0, 4.0, 6.05]);
        assert_eq!(sampled(2.05, 5.0), [0.0, 2.05, 4.0, 5.0]);
        assert_eq!(sampled(3.95, 5.0), [0.0, 2.0, 3.95, 5.0]);
        assert_eq!(xs(resampled(&[], 2.0)), [0.0; 0]);
    }
}
