//! The end of the required section of a turn, as computed by upstream's two planners
//! (docs/spec/turn-signal-decider.md, "Required end of a turn").

use std::iter::successors;

use super::polyline::{arc_lengths_m, at_arc, back_pose, headed, length_m, without_repeats};
use super::spline::{akima_points, natural_derivatives};
use super::{Point, Pose, wrapped};

const STEP_M: f64 = 1.0;
/// A sample this near to the end is replaced by the end, metres.
const MERGE_M: f64 = 0.1;
/// A line with a piece shorter than this is not resampled, metres.
const MIN_PIECE_M: f64 = 1e-6;
/// Minimum number of points of upstream's spline.
const MIN_KNOTS: usize = 4;
/// Maximum length of a line that is resampled, metres; far above any lanelet, it bounds memory.
const MAX_M: f64 = 100_000.0;

/// Returns the last sample of the line that still faces `threshold_deg` or more away from its end; the end if
/// there is none. `None` without two different finite points.
pub fn required_end(centerline: &[Point], threshold_deg: f64) -> Option<Pose> {
    let samples = headed(&resampled(centerline)?);
    let end = samples.last()?;
    let turned = samples.iter().rfind(|sample| deviates(sample.yaw_rad, end.yaw_rad, threshold_deg));
    Some(*turned.unwrap_or(end))
}

/// Returns the first point of the line at which the natural cubic spline through all of them faces within
/// `threshold_deg` of its end: the rule of upstream's path generator. A line of fewer than four points is
/// first divided into quarters. `None` without two different finite points.
pub fn first_aligned(centerline: &[Point], threshold_deg: f64) -> Option<Pose> {
    if !centerline.iter().all(|point| point.is_finite()) {
        return None;
    }
    let mut points = without_repeats(centerline);
    if points.len() < 2 {
        return None;
    }
    if points.len() < MIN_KNOTS {
        let quarter_m = length_m(&points) / 4.0;
        points = (0..=4_u32).filter_map(|quarter| at_arc(&points, quarter_m * f64::from(quarter))).collect();
    }
    let arcs = arc_lengths_m(&points);
    let along = |coordinate: fn(&Point) -> f64| {
        natural_derivatives(&arcs, &points.iter().map(coordinate).collect::<Vec<_>>())
    };
    let (eastward, northward) = (along(|point| point.x_m)?, along(|point| point.y_m)?);
    let headings = eastward.iter().zip(&northward).map(|(east, north)| north.atan2(*east));
    let end_rad = headings.clone().next_back()?;
    let poses = points.iter().zip(headings).map(|(position, yaw_rad)| Pose { position: *position, yaw_rad });
    poses.into_iter().find(|pose| !deviates(pose.yaw_rad, end_rad, threshold_deg))
}

fn deviates(yaw_rad: f64, end_rad: f64, threshold_deg: f64) -> bool {
    wrapped(yaw_rad - end_rad).abs() >= threshold_deg.to_radians()
}

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
