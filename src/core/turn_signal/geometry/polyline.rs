//! Lines of points: lengths, headings, the nearest piece.

use super::{Point, Pose};

/// Length, metres.
pub fn length_m(points: &[Point]) -> f64 {
    points.windows(2).map(piece_length_m).sum()
}

/// Arc length of every point from the first one, metres.
pub fn arc_lengths_m(points: &[Point]) -> Vec<f64> {
    let mut total = 0.0;
    let mut arcs: Vec<f64> = points.iter().take(1).map(|_| 0.0).collect();
    arcs.extend(points.windows(2).map(|piece| {
        total += piece_length_m(piece);
        total
    }));
    arcs
}

/// The points with runs of coinciding ones reduced to their first.
pub fn without_repeats(points: &[Point]) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::with_capacity(points.len());
    for point in points {
        if kept.last().is_none_or(|last| !last.coincides(*point)) {
            kept.push(*point);
        }
    }
    kept
}

/// The points without those within `gap_m` of any kept before them.
pub fn without_near_earlier(points: &[Point], gap_m: f64) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::with_capacity(points.len());
    for point in points {
        if kept.iter().all(|earlier| earlier.distance_m(*point) >= gap_m) {
            kept.push(*point);
        }
    }
    kept
}

/// The first point, facing the second. `None` below two points.
pub fn front_pose(points: &[Point]) -> Option<Pose> {
    let [first, second, ..] = points else { return None };
    Some(Pose { position: *first, yaw_rad: first.heading_to_rad(*second) })
}

/// The last point, facing away from the last but one. `None` below two points.
pub fn back_pose(points: &[Point]) -> Option<Pose> {
    let [.., before, last] = points else { return None };
    Some(Pose { position: *last, yaw_rad: before.heading_to_rad(*last) })
}

/// Every point facing the next; the last one faces as the one before it. One point faces +x.
pub fn headed(points: &[Point]) -> Vec<Pose> {
    let mut poses: Vec<Pose> = points
        .iter()
        .zip(points.iter().skip(1))
        .map(|(here, next)| Pose { position: *here, yaw_rad: here.heading_to_rad(*next) })
        .collect();
    if let Some(last) = points.last() {
        let yaw_rad = poses.last().map_or(0.0, |before| before.yaw_rad);
        poses.push(Pose { position: *last, yaw_rad });
    }
    poses
}

/// The place of a line nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Arc length there, metres.
    pub arc_m: f64,
    /// Distance to it, metres.
    pub distance_m: f64,
    /// Direction of the line there, radians; zero on a single point.
    pub yaw_rad: f64,
}

/// The nearest place of `points` to `query`; the first of equally near ones. `None` without points.
pub fn nearest(points: &[Point], query: Point) -> Option<Projection> {
    let first = points.first()?;
    let yaw_rad = front_pose(points).map_or(0.0, |front| front.yaw_rad);
    let mut best = Projection { arc_m: 0.0, distance_m: first.distance_m(query), yaw_rad };
    let mut start_m = 0.0;
    for piece in points.windows(2) {
        let [from, to] = piece else { continue };
        let length_m = from.distance_m(*to);
        if length_m > 0.0 {
            let along_m = projection_m(*from, *to, query).clamp(0.0, length_m);
            let distance_m = from.toward(*to, along_m / length_m).distance_m(query);
            if distance_m < best.distance_m {
                best = Projection { arc_m: start_m + along_m, distance_m, yaw_rad: from.heading_to_rad(*to) };
            }
        }
        start_m += length_m;
    }
    Some(best)
}

/// The point at `arc_m`, held to the ends of the line. `None` without points.
pub fn at_arc(points: &[Point], arc_m: f64) -> Option<Point> {
    let mut rest_m = arc_m.max(0.0);
    for piece in points.windows(2) {
        let [from, to] = piece else { continue };
        let length_m = from.distance_m(*to);
        if rest_m <= length_m && length_m > 0.0 {
            return Some(from.toward(*to, rest_m / length_m));
        }
        rest_m -= length_m;
    }
    points.last().copied()
}

/// Signed projection of `query - from` on the direction `from` → `to`, metres, beyond both ends.
/// Zero for a piece without length.
pub fn projection_m(from: Point, to: Point, query: Point) -> f64 {
    let (dx, dy) = (to.x_m - from.x_m, to.y_m - from.y_m);
    let length_m = dx.hypot(dy);
    if length_m > 0.0 { ((query.x_m - from.x_m) * dx + (query.y_m - from.y_m) * dy) / length_m } else { 0.0 }
}

fn piece_length_m(piece: &[Point]) -> f64 {
    match piece {
        [from, to] => from.distance_m(*to),
        _ => 0.0,
    }
}
