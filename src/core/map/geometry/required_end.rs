//! The end of the required section of a turn, as upstream's two planners compute it
//! (docs/spec/turn-signal-decider.md, "Required end of a turn").

use std::iter::successors;

use super::polyline::{arc_lengths_m, back_pose, headed, length_m, without_repeats};
use super::spline::akima_points;
use super::{Point, Pose, wrapped};

/// Distance of the samples, metres.
const STEP_M: f64 = 1.0;
/// A sample this near to the end becomes the end, metres.
const MERGE_M: f64 = 0.1;
/// A line with a piece shorter than this is not resampled, metres.
const MIN_PIECE_M: f64 = 1e-6;
/// Longest line that is resampled, metres; no lanelet is near it, and it bounds memory.
const MAX_M: f64 = 100_000.0;

/// The last sample of the line that still faces `threshold_deg` or more away from its end; the end
/// when none does. `None` without two different finite points.
pub fn required_end(centerline: &[Point], threshold_deg: f64) -> Option<Pose> {
    let samples = headed(&resampled(centerline)?);
    let end = samples.last()?;
    let turned = samples.iter().rfind(|sample| deviates(sample.yaw_rad, end.yaw_rad, threshold_deg));
    Some(*turned.unwrap_or(end))
}

/// The start of the first piece of the line that faces within `threshold_deg` of its end: the rule of
/// upstream's path generator. `None` without two different finite points.
pub fn first_aligned(centerline: &[Point], threshold_deg: f64) -> Option<Pose> {
    if !centerline.iter().all(|point| point.is_finite()) {
        return None;
    }
    let poses = headed(&without_repeats(centerline));
    let end = poses.last().filter(|_| poses.len() > 1)?;
    poses.iter().find(|pose| !deviates(pose.yaw_rad, end.yaw_rad, threshold_deg)).copied()
}

fn deviates(yaw_rad: f64, end_rad: f64, threshold_deg: f64) -> bool {
    wrapped(yaw_rad - end_rad).abs() >= threshold_deg.to_radians()
}

/// The line at every metre and at its end.
fn resampled(centerline: &[Point]) -> Option<Vec<Point>> {
    if !centerline.iter().all(|point| point.is_finite()) {
        return None;
    }
    let queries = queries_m(length_m(centerline));
    let points = without_repeats(centerline);
    back_pose(&points)?;
    let arcs = arc_lengths_m(&points);
    let too_short = arcs.windows(2).any(|pair| matches!(pair, [from, to] if to - from < MIN_PIECE_M));
    if queries.len() < 2 || too_short {
        return Some(points);
    }
    Some(akima_points(&arcs, &points, &queries).unwrap_or(points))
}

fn queries_m(length_m: f64) -> Vec<f64> {
    if length_m >= MAX_M {
        return Vec::new();
    }
    let samples = successors(Some(0.0), |at_m| Some(at_m + STEP_M));
    let mut queries: Vec<f64> = samples.take_while(|at_m| *at_m < length_m).collect();
    match queries.last_mut() {
        Some(last) if length_m - *last < MERGE_M => *last = length_m,
        Some(_) | None => queries.push(length_m),
    }
    queries
}
