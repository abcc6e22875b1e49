//! The modified Akima cubic: a smooth line through knots with little overshoot
//! (docs/spec/turn-signal-decider.md, "Required end of a turn").

use super::Point;

/// Below this, the weights of a node are noise, and the mean of its slopes is used.
const MIN_WEIGHT: f64 = 1e-5;

/// Returns the values at `queries` of the cubic through (`knots`, `values`). Queries outside the knots
/// continue the first or last piece. `None` if there are fewer than two knots, the knots do not increase, or
/// the lengths differ.
pub fn akima(knots: &[f64], values: &[f64], queries: &[f64]) -> Option<Vec<f64>> {
    let pieces = pieces(knots, values, &slopes(knots, values)?);
    let last = pieces.last()?;
    let value_at = |query: &f64| {
        // The first piece whose end is not reached yet; knots increase.
        let passed = pieces.partition_point(|piece| piece.to <= *query);
        pieces.get(passed).unwrap_or(last).value_at(*query)
    };
    Some(queries.iter().map(value_at).collect())
}

/// Returns the points at the arc lengths `queries_m` of the cubic through `points` at the arc lengths
/// `arcs_m`; `None` as for [`akima`].
pub fn akima_points(arcs_m: &[f64], points: &[Point], queries_m: &[f64]) -> Option<Vec<Point>> {
    let along = |coordinate: fn(&Point) -> f64| {
        akima(arcs_m, &points.iter().map(coordinate).collect::<Vec<_>>(), queries_m)
    };
    let (xs, ys, zs) = (along(|point| point.x_m)?, along(|point| point.y_m)?, along(|point| point.z_m)?);
    Some(xs.into_iter().zip(ys).zip(zs).map(|((x_m, y_m), z_m)| Point { x_m, y_m, z_m }).collect())
}

/// Returns the derivatives at the knots of the natural cubic spline through (`knots`, `values`): the
/// smoothest line through all of them, which is straight at both ends. `None` as for [`akima`].
pub fn natural_derivatives(knots: &[f64], values: &[f64]) -> Option<Vec<f64>> {
    let slopes = slopes(knots, values)?;
    let spans: Vec<f64> = differences(knots).collect();
    // Second derivatives at the inner knots, by elimination; at the ends they are zero.
    let mut rows: Vec<(f64, f64)> = vec![(0.0, 0.0)];
    for (span, slope) in spans.windows(2).zip(slopes.windows(2)) {
        let ([before, after], [slope_before, slope_after]) = (span, slope) else { continue };
        let (factor, rest) = rows.last().copied().unwrap_or_default();
        let diagonal = 2.0 * (before + after) - before * factor;
        rows.push((after / diagonal, (6.0 * (slope_after - slope_before) - before * rest) / diagonal));
    }
    let mut second = vec![0.0];
    for (factor, rest) in rows.iter().skip(1).rev() {
        second.push(rest - factor * second.last().copied().unwrap_or_default());
    }
    second.push(0.0);
    second.reverse();
    let bends = second.iter().zip(second.iter().skip(1));
    let pieces = spans.iter().zip(&slopes).zip(bends);
    let mut derivatives: Vec<f64> = pieces
        .clone()
        .map(|((span, slope), (here, next))| slope - span * (2.0 * here + next) / 6.0)
        .collect();
    derivatives.extend(
        pieces
            .clone()
            .next_back()
            .map(|((span, slope), (here, next))| slope + span * (here + 2.0 * next) / 6.0),
    );
    Some(derivatives)
}

/// A cubic on [`from`, `to`] in powers of the distance from `from`.
struct Piece {
    from: f64,
    to: f64,
    coefficients: [f64; 4],
}

impl Piece {
    fn value_at(&self, query: f64) -> f64 {
        let [constant, linear, square, cube] = self.coefficients;
        let t = query - self.from;
        constant + t * (linear + t * (square + t * cube))
    }
}

fn differences(values: &[f64]) -> impl Iterator<Item = f64> {
    values.iter().zip(values.iter().skip(1)).map(|(from, to)| to - from)
}

/// Returns the slope of each piece; `None` if there are fewer than two knots, the knots do not increase, or
/// the lengths differ.
fn slopes(knots: &[f64], values: &[f64]) -> Option<Vec<f64>> {
    let is_rising = knots.windows(2).all(|pair| matches!(pair, [from, to] if from < to));
    let slopes = differences(values).zip(differences(knots)).map(|(rise, span)| rise / span);
    (knots.len() == values.len() && knots.len() >= 2 && is_rising).then(|| slopes.collect())
}

fn pieces(knots: &[f64], values: &[f64], slopes: &[f64]) -> Vec<Piece> {
    let spans = knots.iter().zip(knots.iter().skip(1));
    let derivatives = derivatives(slopes);
    let ends = derivatives.iter().zip(derivatives.iter().skip(1));
    spans
        .zip(values)
        .zip(slopes)
        .zip(ends)
        .map(|((((from, to), value), slope), (start, end))| {
            let h = to - from;
            let square = (3.0 * slope - 2.0 * start - end) / h;
            let cube = (start + end - 2.0 * slope) / (h * h);
            Piece { from: *from, to: *to, coefficients: [*value, *start, square, cube] }
        })
        .collect()
}

/// Returns the derivative at each knot, one more than the number of slopes.
fn derivatives(slopes: &[f64]) -> Vec<f64> {
    let nodes = slopes.len() + 1;
    let slope = |at: usize| slopes.get(at).copied().unwrap_or_default();
    (0..nodes)
        .map(|node| match node {
            0 => slope(0),
            node if node + 1 == nodes => slope(node - 1),
            node if node == 1 || node + 2 == nodes => f64::midpoint(slope(node - 1), slope(node)),
            node => {
                let before = (slope(node + 1) - slope(node)).abs();
                let after = (slope(node - 1) - slope(node - 2)).abs();
                if before + after < MIN_WEIGHT {
                    f64::midpoint(slope(node - 1), slope(node))
                } else {
                    (before * slope(node - 1) + after * slope(node)) / (before + after)
                }
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_stays_straight_and_goes_on() {
        let values = akima(&[0.0, 1.0, 4.0], &[1.0, 3.0, 9.0], &[-1.0, 0.5, 4.0, 6.0]).unwrap();
        for (value, expected) in values.iter().zip([-1.0, 2.0, 9.0, 13.0]) {
            assert!((value - expected).abs() < 1e-12, "{value} {expected}");
        }
    }

    #[test]
    fn knots_are_met_and_bad_ones_refused() {
        let (knots, values) = ([0.0, 1.0, 2.5, 3.0, 7.0, 8.0], [0.0, 2.0, -1.0, 4.0, 4.0, 5.0]);
        for (got, value) in akima(&knots, &values, &knots).unwrap().iter().zip(values) {
            assert!((got - value).abs() < 1e-12);
        }
        assert_eq!(akima(&[0.0], &[1.0], &[0.0]), None);
        assert_eq!(akima(&[0.0, 0.0], &[1.0, 2.0], &[0.0]), None);
        assert_eq!(akima(&[0.0, 1.0], &[1.0], &[0.0]), None);
        assert_eq!(akima(&[0.0, f64::NAN], &[1.0, 2.0], &[0.0]), None);
    }
}
