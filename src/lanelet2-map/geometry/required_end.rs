//! The end of the required section of a turn, as computed by upstream's two planners
//! (docs/spec/turn-signal-decider.md, "Required end of a turn").

use super::polyline::{
    arc_lengths_m, at_arc, back_pose, headed, length_m, spatial_arc_lengths_m, without_repeats,
};
use super::sampling::queries_m;
use super::spline::{akima_points, natural_derivatives};
use super::{Point, Pose, wrapped};

const STEP_M: f64 = 1.0;
/// A line with a piece shorter than this is not resampled, metres.
const MIN_PIECE_M: f64 = 1e-6;
/// Minimum number of points of upstream's spline.
const MIN_KNOTS: usize = 4;

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
/// first divided into quarters. `None` without two different finite points, and if only the end is aligned.
pub fn first_aligned(centerline: &[Point], threshold_deg: f64) -> Option<Pose> {
    if !centerline.iter().all(|point| point.is_finite()) {
        return None;
    }
    let mut points = without_repeats(centerline);
    if points.len() < MIN_KNOTS {
        points = quarters(&points)?;
    }
    let arcs = spatial_arc_lengths_m(&points);
    let along = |coordinate: fn(&Point) -> f64| {
        natural_derivatives(&arcs, &points.iter().map(coordinate).collect::<Vec<_>>())
    };
    let (eastward, northward) = (along(|point| point.x_m)?, along(|point| point.y_m)?);
    let headings = eastward.iter().zip(&northward).map(|(east, north)| north.atan2(*east));
    let end_rad = headings.clone().next_back()?;
    let poses = points.iter().zip(headings).map(|(position, yaw_rad)| Pose { position: *position, yaw_rad });
    let mut before_end = poses.take(points.len() - 1);
    before_end.find(|pose| !deviates(pose.yaw_rad, end_rad, threshold_deg))
}

/// Returns the points at the quarters of a line, on the cubic through its points; a last quarter below 10 cm
/// is left out. `None` without two different points.
fn quarters(points: &[Point]) -> Option<Vec<Point>> {
    let length_m = length_m(points);
    let queries = queries_m(length_m, length_m / 4.0);
    let quarters = akima_points(&arc_lengths_m(points), points, &queries)?;
    // Heights are interpolated on straight lines.
    let heights = queries.iter().filter_map(|at_m| at_arc(points, *at_m));
    Some(quarters.into_iter().zip(heights).map(|(quarter, at)| quarter.at_height(at.z_m)).collect())
}

fn deviates(yaw_rad: f64, end_rad: f64, threshold_deg: f64) -> bool {
    wrapped(yaw_rad - end_rad).abs() >= threshold_deg.to_radians()
}

fn resampled(centerline: &[Point]) -> Option<Vec<Point>> {
    if !centerline.iter().all(|point| point.is_finite()) {
        return None;
    }
    let queries = queries_m(length_m(centerline), STEP_M);
    let points = without_repeats(centerline);
    back_pose(&points)?;
    let arcs = arc_lengths_m(&points);
    let too_short = arcs.windows(2).any(|pair| matches!(pair, [from, to] if to - from < MIN_PIECE_M));
    if queries.len() < 2 || too_short {
        return Some(points);
    }
    Some(akima_points(&arcs, &points, &queries).unwrap_or(points))
}
