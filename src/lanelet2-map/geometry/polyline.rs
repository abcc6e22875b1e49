//! Lines of points: lengths, headings, the nearest piece.

use super::{Point, Pose, cross};

/// Returns the length in metres.
pub fn length_m(points: &[Point]) -> f64 {
    points.windows(2).map(piece_length_m).sum()
}

/// Returns the arc length of every point from the first one, metres.
pub fn arc_lengths_m(points: &[Point]) -> Vec<f64> {
    cumulated_m(points, Point::distance_m)
}

/// Like [`arc_lengths_m`], with the differences of height where they are known.
pub fn spatial_arc_lengths_m(points: &[Point]) -> Vec<f64> {
    cumulated_m(points, Point::spatial_distance_m)
}

fn cumulated_m(points: &[Point], between_m: fn(Point, Point) -> f64) -> Vec<f64> {
    let mut total = 0.0;
    let mut arcs: Vec<f64> = points.iter().take(1).map(|_| 0.0).collect();
    arcs.extend(points.iter().zip(points.iter().skip(1)).map(|(from, to)| {
        total += between_m(*from, *to);
        total
    }));
    arcs
}

/// Returns the points, with only the first of each run of coinciding points.
pub fn without_repeats(points: &[Point]) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::with_capacity(points.len());
    for point in points {
        if kept.last().is_none_or(|last| !last.coincides(*point)) {
            kept.push(*point);
        }
    }
    kept
}

/// Returns the points without those within `gap_m` of any earlier point that was kept.
pub fn without_near_earlier(points: &[Point], gap_m: f64) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::with_capacity(points.len());
    for point in points {
        if kept.iter().all(|earlier| earlier.distance_m(*point) >= gap_m) {
            kept.push(*point);
        }
    }
    kept
}

/// Returns the first point, facing the second. `None` for fewer than two points.
pub fn front_pose(points: &[Point]) -> Option<Pose> {
    let [first, second, ..] = points else { return None };
    Some(Pose { position: *first, yaw_rad: first.heading_to_rad(*second) })
}

/// Returns the last point, with the heading from the point before it. `None` for fewer than two points.
pub fn back_pose(points: &[Point]) -> Option<Pose> {
    let [.., before, last] = points else { return None };
    Some(Pose { position: *last, yaw_rad: before.heading_to_rad(*last) })
}

/// Returns every point facing the next; the last has the heading of the previous point. A single point faces
/// +x.
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

/// The position on a line that is nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Index of its piece, which is the index of the piece's first point.
    pub piece: usize,
    /// Arc length of the position, metres.
    pub arc_m: f64,
    /// Distance to the position, metres.
    pub distance_m: f64,
    /// Direction of the line at the position, radians; zero for a single point.
    pub yaw_rad: f64,
    /// Height of the line at the position, metres; NaN if unknown.
    pub z_m: f64,
}

/// Returns the position on the line through `points` that is nearest to `query`; of equally near positions,
/// the first. `None` without points.
pub fn nearest(points: &[Point], query: Point) -> Option<Projection> {
    let first = *points.first()?;
    let mut best = (first.squared_distance(query), None, first);
    let (mut start_m, mut from) = (0.0, first);
    for (piece, to) in points.iter().copied().skip(1).enumerate() {
        let length_m = from.distance_m(to);
        if length_m > 0.0 {
            let (dx_m, dy_m) = (to.x_m - from.x_m, to.y_m - from.y_m);
            let along_m = ((query.x_m - from.x_m) * dx_m + (query.y_m - from.y_m) * dy_m) / length_m;
            let along_m = along_m.clamp(0.0, length_m);
            let here = from.toward(to, along_m / length_m);
            let squared = here.squared_distance(query);
            if squared < best.0 {
                best = (squared, Some((piece, start_m + along_m, from, to)), here);
            }
        }
        start_m += length_m;
        from = to;
    }
    let (_, on, here) = best;
    let (distance_m, z_m) = (here.distance_m(query), here.z_m);
    Some(match on {
        Some((piece, arc_m, from, to)) => {
            Projection { piece, arc_m, distance_m, yaw_rad: from.heading_to_rad(to), z_m }
        }
        None => {
            let yaw_rad = front_pose(points).map_or(0.0, |front| front.yaw_rad);
            Projection { piece: 0, arc_m: 0.0, distance_m, yaw_rad, z_m }
        }
    })
}

/// Returns whether `query` lies to the left of a line. At a corner both of its pieces count: the inside of
/// the bend is the area on that side of both.
pub fn is_on_left(points: &[Point], query: Point) -> bool {
    let points = without_repeats(points);
    let piece = |at: usize| Some((*points.get(at)?, *points.get(at + 1)?));
    let left_of = |at: usize| piece(at).map(|(from, to)| cross(from, to, query) > 0.0);
    let Some(nearest) = nearest(&points, query).map(|projection| projection.piece) else { return false };
    let Some((from, to)) = piece(nearest) else { return false };
    let along_m = projection_m(from, to, query);
    let (before, after) = if along_m <= 0.0 {
        (nearest.checked_sub(1), Some(nearest))
    } else if along_m >= from.distance_m(to) {
        (Some(nearest), Some(nearest + 1))
    } else {
        (None, None)
    };
    match (before.and_then(left_of), after.and_then(left_of)) {
        (Some(one), Some(other)) => {
            let bends_left = before
                .and_then(piece)
                .zip(after.and_then(piece))
                .is_some_and(|((first, corner), (_, last))| cross(first, corner, last) > 0.0);
            if bends_left { one && other } else { one || other }
        }
        _ => left_of(nearest).unwrap_or_default(),
    }
}

/// Returns the index of the pose nearest to a point, the first of equally near poses; 0 without poses.
pub fn nearest_index(poses: &[Pose], query: Point) -> usize {
    let far = |pose: &Pose| pose.position.squared_distance(query);
    let nearest = poses.iter().enumerate().min_by(|(_, one), (_, other)| far(one).total_cmp(&far(other)));
    nearest.map_or(0, |(index, _)| index)
}

/// Returns the point at `arc_m`, clamped to the ends of the line. `None` without points.
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

/// Returns the signed projection of `query - from` on the direction `from` → `to`, metres, which may lie
/// beyond both ends. Zero for a piece of zero length.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_known_at_corners_too() {
        let point = |(x, y): (f64, f64)| Point::new(x, y);
        // To the east, then to the north: a bend to the left.
        let bend = [(0.0, 0.0), (10.0, 0.0), (10.0, 0.0), (10.0, 10.0)].map(point);
        let cases = [
            ((5.0, 1.0), 0, 5.0, 1.0, true),
            ((5.0, -1.0), 0, 5.0, 1.0, false),
            ((13.0, -4.0), 0, 10.0, 5.0, false), // outside of the corner
            ((11.0, -1e-3), 0, 10.0, 1.0, false),
            ((9.0, 2.0), 2, 12.0, 1.0, true),
            ((12.0, 3.0), 2, 13.0, 2.0, false),
            ((-3.0, 4.0), 0, 0.0, 5.0, true),
        ];
        for (query, piece, arc_m, distance_m, left) in cases {
            let found = nearest(&bend, point(query)).unwrap();
            assert_eq!((found.piece, is_on_left(&bend, point(query))), (piece, left), "{query:?}");
            assert!((found.arc_m - arc_m).abs() < 1e-9, "{query:?}: {found:?}");
            assert!((found.distance_m - distance_m).abs() < 1e-5, "{query:?}: {found:?}");
        }
        let mirrored = bend.map(|point| Point::new(point.x_m, -point.y_m));
        assert!(is_on_left(&mirrored, point((13.0, 4.0))));
    }

    #[test]
    fn lengths_and_points_are_measured_along_the_line() {
        let line = [(0.0, 0.0), (3.0, 0.0), (3.0, 0.0), (3.0, 7.0)].map(|(x, y)| Point::new(x, y));
        assert_eq!((length_m(&line), arc_lengths_m(&line)), (10.0, vec![0.0, 3.0, 3.0, 10.0]));
        for (arc_m, x, y) in
            [(-1.0, 0.0, 0.0), (1.5, 1.5, 0.0), (3.0, 3.0, 0.0), (5.0, 3.0, 2.0), (11.0, 3.0, 7.0)]
        {
            assert_eq!(at_arc(&line, arc_m), Some(Point::new(x, y)), "{arc_m}");
        }
    }
}
