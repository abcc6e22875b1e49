//! The centreline of a lanelet, computed from its bounds as in upstream's map loader
//! (docs/spec/turn-signal-decider.md, "Lanelet centreline").

use super::Point;

/// Spacing of generated centrelines in Autoware's map loader, metres.
const RESOLUTION_M: f64 = 5.0;

/// Returns the points midway between two bounds (x, y, z in metres) at equal fractions of their lengths,
/// which include height.
pub fn centerline(left: &[[f64; 3]], right: &[[f64; 3]]) -> Vec<Point> {
    let parts = centerline_parts(left, right);
    divided(left, parts)
        .zip(divided(right, parts))
        .map(|(left, right)| {
            let [x_m, y_m, z_m] = [0, 1, 2].map(|axis| f64::midpoint(left[axis], right[axis]));
            Point { x_m, y_m, z_m }
        })
        .collect()
}

/// Returns the number of parts of the centreline of these bounds: one for each five metres of the longer
/// bound, at least one.
pub fn centerline_parts(left: &[[f64; 3]], right: &[[f64; 3]]) -> u32 {
    let length_m = |bound| arcs_m(bound).last().copied().unwrap_or_default();
    let parts = (length_m(left).max(length_m(right)) / RESOLUTION_M).ceil().clamp(1.0, f64::from(u32::MAX));
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // between 1 and u32::MAX
    let parts = parts as u32;
    parts
}

/// Returns x, y and z at the fractions 0/parts, 1/parts, … 1 of the length, which includes height.
fn divided(line: &[[f64; 3]], parts: u32) -> impl Iterator<Item = [f64; 3]> {
    let arcs_m = arcs_m(line);
    let length_m = arcs_m.last().copied().unwrap_or_default();
    (0..=parts).map(move |part| interpolate(line, &arcs_m, length_m * f64::from(part) / f64::from(parts)))
}

fn arcs_m(line: &[[f64; 3]]) -> Vec<f64> {
    let mut arc_m = 0.0;
    let rest = line.iter().zip(line.iter().skip(1)).map(|([ax, ay, az], [bx, by, bz])| {
        arc_m += (bx - ax).hypot(by - ay).hypot(bz - az);
        arc_m
    });
    std::iter::once(0.0).chain(rest).collect()
}

fn interpolate(line: &[[f64; 3]], arcs_m: &[f64], arc_m: f64) -> [f64; 3] {
    let after = arcs_m.partition_point(|&arc| arc <= arc_m).clamp(1, line.len().max(2) - 1);
    let around = (line.get(after - 1), line.get(after), arcs_m.get(after - 1), arcs_m.get(after));
    let (Some(from), Some(to), Some(begin), Some(end)) = around else { return [0.0; 3] };
    let share = if end > begin { ((arc_m - begin) / (end - begin)).clamp(0.0, 1.0) } else { 0.0 };
    [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longer_bound_sets_the_number_of_points_and_height_counts() {
        let left = [[0.0, 2.0, 0.0], [10.0, 2.0, 0.0]];
        let right = [[0.0, 0.0, 0.0], [8.0, 0.0, 6.0], [8.0, 0.0, 7.0]];
        let middles = centerline(&left, &right);
        assert_eq!(middles.len(), 4, "11 m make three pieces");
        assert_eq!(middles.first(), Some(&Point::new(0.0, 1.0)));
        assert_eq!(middles.last(), Some(&Point::new(9.0, 1.0)));
        let third = Point::new(f64::midpoint(10.0 / 3.0, 8.0 * 11.0 / 30.0), 1.0);
        assert!(middles[1].distance_m(third) < 1e-12);
        assert_eq!(centerline(&[[1.0; 3]; 2], &[[0.0; 3]; 2]).len(), 2, "bounds without length");
    }

    #[test]
    fn a_centerline_takes_equal_shares_of_both_bounds() {
        // 12 m on the left and 6 m on the right: three parts.
        let left = [[0.0, 2.0, 0.0], [9.0, 2.0, 0.0], [12.0, 2.0, 0.0]];
        let middle = centerline(&left, &[[0.0, 0.0, 0.0], [6.0, 0.0, 3.0]]);
        let expected = [0.0, 3.0, 6.0, 9.0].map(|x_m| Point::new(x_m, 1.0));
        assert!(middle.iter().zip(expected).all(|(one, two)| one.distance_m(two) < 1e-9), "{middle:?}");
        let count = |length_m: f64| {
            let bound = [[0.0; 3], [length_m, 0.0, 0.0]];
            centerline(&bound, &bound).len()
        };
        assert_eq!([middle.len(), count(0.0), count(5.0), count(5.01), count(25.0)], [4, 2, 2, 3, 6]);
    }
}
