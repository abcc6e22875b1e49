//! The middle of a lanelet, made of its bounds as upstream's map loader makes it
//! (docs/spec/turn-signal-decider.md, "Lanelet centreline").

use super::Point;

/// A point of a bound, metres; height counts in the length of the bound.
pub type BoundPoint = [f64; 3];

/// Between two points of the middle lies at most this much of the longer bound, metres.
pub const RESOLUTION_M: f64 = 5.0;
/// More pieces than any lanelet has; bounds memory.
const MAX_PIECES: f64 = 100_000.0;

/// Middles of points at equal fractions of both bounds. `None` when a bound is empty or not finite.
pub fn centerline(left: &[BoundPoint], right: &[BoundPoint]) -> Option<Vec<Point>> {
    let finite = |bound: &[BoundPoint]| bound.iter().flatten().all(|value| value.is_finite());
    if left.is_empty() || right.is_empty() || !finite(left) || !finite(right) {
        return None;
    }
    let wanted = (total_m(left).max(total_m(right)) / RESOLUTION_M).ceil().clamp(1.0, MAX_PIECES);
    let mut middles = Vec::new();
    let mut done = 0.0;
    while done <= wanted {
        let ([lx, ly, _], [rx, ry, _]) =
            (at_fraction(left, done / wanted)?, at_fraction(right, done / wanted)?);
        middles.push(Point::new(f64::midpoint(lx, rx), f64::midpoint(ly, ry)));
        done += 1.0;
    }
    Some(middles)
}

fn total_m(bound: &[BoundPoint]) -> f64 {
    bound.windows(2).map(piece_m).sum()
}

fn piece_m(piece: &[BoundPoint]) -> f64 {
    let [[ax, ay, az], [bx, by, bz]] = piece else { return 0.0 };
    ((bx - ax).powi(2) + (by - ay).powi(2) + (bz - az).powi(2)).sqrt()
}

fn at_fraction(bound: &[BoundPoint], fraction: f64) -> Option<BoundPoint> {
    if fraction >= 1.0 {
        return bound.last().copied();
    }
    let mut rest_m = total_m(bound) * fraction;
    for piece in bound.windows(2) {
        let length_m = piece_m(piece);
        let [[ax, ay, az], [bx, by, bz]] = piece else { continue };
        if rest_m <= length_m && length_m > 0.0 {
            let share = rest_m / length_m;
            return Some([ax + (bx - ax) * share, ay + (by - ay) * share, az + (bz - az) * share]);
        }
        rest_m -= length_m;
    }
    bound.last().copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longer_bound_sets_the_number_of_points_and_height_counts() {
        let left = [[0.0, 2.0, 0.0], [10.0, 2.0, 0.0]];
        let right = [[0.0, 0.0, 0.0], [8.0, 0.0, 6.0], [8.0, 0.0, 7.0]];
        let middles = centerline(&left, &right).unwrap();
        assert_eq!(middles.len(), 4, "11 m make three pieces");
        assert_eq!(middles.first(), Some(&Point::new(0.0, 1.0)));
        assert_eq!(middles.last(), Some(&Point::new(9.0, 1.0)));
        let third = Point::new(f64::midpoint(10.0 / 3.0, 8.0 * 11.0 / 30.0), 1.0);
        assert!(middles[1].distance_m(third) < 1e-12);
    }

    #[test]
    fn a_bound_that_is_none_gives_no_middle() {
        assert_eq!(centerline(&[], &[[0.0; 3]]), None);
        assert_eq!(centerline(&[[f64::NAN, 0.0, 0.0]], &[[0.0; 3]]), None);
        assert_eq!(centerline(&[[1.0; 3]], &[[0.0; 3]]).unwrap().len(), 2);
    }
}
