//! Areas and crossings: inside a lane, across a bound, lateral distance to a bound.

use super::{Point, Pose, cross};

/// Returns whether `point` lies inside the closed ring `ring` or on its edge (up to rounding). A ring of
/// fewer than three points has no inside.
pub fn contains(ring: &[Point], point: Point) -> bool {
    let Some(last) = ring.last().filter(|_| ring.len() >= 3) else { return false };
    let (mut inside, mut from) = (false, *last);
    for to in ring.iter().copied() {
        if on_segment(from, to, point) {
            return true;
        }
        if (from.y_m > point.y_m) != (to.y_m > point.y_m) {
            let x_m = from.x_m + (point.y_m - from.y_m) / (to.y_m - from.y_m) * (to.x_m - from.x_m);
            inside ^= point.x_m < x_m;
        }
        from = to;
    }
    inside
}

/// Returns whether an area with border `ring` and the line `line` share a point: the line crosses the border
/// or lies inside.
pub fn touches(ring: &[Point], line: &[Point]) -> bool {
    let crosses = line.windows(2).any(|piece| match piece {
        [a, b] => edges(ring).any(|(c, d)| segments_meet(*a, *b, c, d)),
        _ => false,
    });
    crosses || line.iter().any(|point| contains(ring, *point))
}

/// Returns the smallest |t| for which `corner + t * (sideways of the vehicle)` lies on `bound`, metres;
/// `None` if the line through the corner along the vehicle's lateral axis misses it.
pub fn sideways_distance_m(vehicle: Pose, corner: Point, bound: &[Point]) -> Option<f64> {
    let (sin, cos) = vehicle.yaw_rad.sin_cos();
    // Coordinates in the vehicle's axes, with the corner as origin: x forward, y to the left.
    let local = |point: &Point| {
        let (dx, dy) = (point.x_m - corner.x_m, point.y_m - corner.y_m);
        (dx * cos + dy * sin, dy * cos - dx * sin)
    };
    let hits = bound.windows(2).filter_map(|piece| {
        let [from, to] = piece else { return None };
        let ((ax, ay), (bx, by)) = (local(from), local(to));
        if ax.min(bx) > 0.0 || ax.max(bx) < 0.0 {
            return None;
        }
        if (bx - ax).abs() < f64::EPSILON {
            let spans_corner = ay.min(by) <= 0.0 && ay.max(by) >= 0.0;
            return Some(if spans_corner { 0.0 } else { ay.abs().min(by.abs()) });
        }
        Some((ay + (by - ay) * (-ax / (bx - ax))).abs())
    });
    hits.min_by(f64::total_cmp)
}

fn edges(ring: &[Point]) -> impl Iterator<Item = (Point, Point)> {
    ring.iter().copied().zip(ring.iter().copied().cycle().skip(1)).take(ring.len())
}

fn within_box(from: Point, to: Point, point: Point) -> bool {
    point.x_m >= from.x_m.min(to.x_m)
        && point.x_m <= from.x_m.max(to.x_m)
        && point.y_m >= from.y_m.min(to.y_m)
        && point.y_m <= from.y_m.max(to.y_m)
}

fn on_segment(from: Point, to: Point, point: Point) -> bool {
    cross(from, to, point) == 0.0 && within_box(from, to, point)
}

fn segments_meet(a: Point, b: Point, c: Point, d: Point) -> bool {
    let (c_side, d_side) = (cross(a, b, c), cross(a, b, d));
    let (a_side, b_side) = (cross(c, d, a), cross(c, d, b));
    let apart = |one: f64, other: f64| (one > 0.0 && other < 0.0) || (one < 0.0 && other > 0.0);
    apart(c_side, d_side) && apart(a_side, b_side)
        || c_side == 0.0 && within_box(a, b, c)
        || d_side == 0.0 && within_box(a, b, d)
        || a_side == 0.0 && within_box(c, d, a)
        || b_side == 0.0 && within_box(c, d, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Vec<Point> {
        [(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)].map(|(x, y)| Point::new(x, y)).to_vec()
    }

    #[test]
    fn edges_belong_to_the_inside() {
        for (x, y, inside) in
            [(1.0, 1.0, true), (0.0, 1.0, true), (4.0, 2.0, true), (4.1, 1.0, false), (2.0, -0.1, false)]
        {
            assert_eq!(contains(&square(), Point::new(x, y)), inside, "{x} {y}");
        }
        assert!(!contains(&square()[..2], Point::new(1.0, 0.0)));
    }

    #[test]
    fn lines_touch_by_crossing_meeting_or_lying_inside() {
        let line = |ends: [(f64, f64); 2]| ends.map(|(x, y)| Point::new(x, y));
        for (ends, touch) in [
            ([(-1.0, 1.0), (5.0, 1.0)], true),
            ([(1.0, 0.5), (2.0, 0.5)], true),
            ([(-1.0, 2.0), (5.0, 2.0)], true),
            ([(-1.0, 2.1), (5.0, 2.1)], false),
            ([(4.0, 2.0), (9.0, 9.0)], true),
            ([(5.0, 0.0), (5.0, 2.0)], false),
        ] {
            assert_eq!(touches(&square(), &line(ends)), touch, "{ends:?}");
        }
    }

    #[test]
    fn sideways_is_square_to_the_vehicle() {
        let bound = [Point::new(-10.0, 3.0), Point::new(10.0, 5.0)];
        let vehicle = Pose::new(0.0, 0.0, 0.0);
        let got = sideways_distance_m(vehicle, Point::new(0.0, 1.0), &bound).unwrap();
        assert!((got - 3.0).abs() < 1e-12);
        let turned = Pose::new(0.0, 0.0, std::f64::consts::FRAC_PI_2);
        assert_eq!(sideways_distance_m(turned, Point::new(0.0, 9.0), &bound), None);
    }
}
