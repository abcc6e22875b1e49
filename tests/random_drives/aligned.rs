//! The aligned start of a centreline, by docs/spec/turn-signal-decider.md, "Path generator", a second time.

use lanelet2_map::geometry::Point;

/// The derivatives at the knots of the natural cubic spline, by all equations at once: second derivatives
/// agree where two pieces meet, and are zero at both ends.
fn derivatives(knots: &[f64], values: &[f64]) -> Vec<f64> {
    let last = knots.len() - 1;
    let mut rows = vec![vec![0.0; knots.len() + 1]; knots.len()];
    for piece in 0..last {
        let length = knots[piece + 1] - knots[piece];
        let bend = 3.0 * (values[piece + 1] - values[piece]) / (length * length);
        for (here, there) in [(piece, piece + 1), (piece + 1, piece)] {
            rows[here][here] += 2.0 / length;
            rows[here][there] += 1.0 / length;
            rows[here][last + 1] += bend;
        }
    }
    solved(rows)
}

/// Solves linear equations, each with its right side at its end, by Gauss and Jordan.
fn solved(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    for column in 0..rows.len() {
        let pivot = (column..rows.len())
            .max_by(|one, two| rows[*one][column].abs().total_cmp(&rows[*two][column].abs()));
        rows.swap(column, pivot.unwrap());
        let scale = rows[column][column];
        rows[column].iter_mut().for_each(|value| *value /= scale);
        let pivot = rows[column].clone();
        for (index, row) in rows.iter_mut().enumerate() {
            let factor = row[column];
            if index != column {
                row.iter_mut().zip(&pivot).for_each(|(value, pivot)| *value -= factor * pivot);
            }
        }
    }
    rows.iter().map(|row| row[row.len() - 1]).collect()
}

fn chords_m(line: &[Point]) -> Vec<f64> {
    let mut arcs_m = vec![0.0];
    for pair in line.windows(2) {
        arcs_m.push(arcs_m[arcs_m.len() - 1] + (pair[1].x_m - pair[0].x_m).hypot(pair[1].y_m - pair[0].y_m));
    }
    arcs_m
}

/// The points that divide a line of two or three points into quarters, on the modified Akima cubic through
/// them: at the middle of three points, its slope is the mean of both pieces.
fn quarters(line: &[Point]) -> Vec<Point> {
    let arcs_m = chords_m(line);
    let length_m = arcs_m[line.len() - 1];
    let mut shares = vec![0.0, 0.25, 0.5, 0.75, 1.0];
    if length_m / 4.0 < 0.1 {
        shares.remove(3);
    }
    let along = |coordinate: fn(&Point) -> f64, at_m: f64| {
        let piece = usize::from(line.len() > 2 && at_m >= arcs_m[1]);
        let rise = |piece: usize| coordinate(&line[piece + 1]) - coordinate(&line[piece]);
        let slope = |piece: usize| rise(piece) / (arcs_m[piece + 1] - arcs_m[piece]);
        let slope_at = |index: usize| match index {
            0 => slope(0),
            index if index + 1 == line.len() => slope(index - 1),
            index => f64::midpoint(slope(index - 1), slope(index)),
        };
        let span_m = arcs_m[piece + 1] - arcs_m[piece];
        let t = (at_m - arcs_m[piece]) / span_m;
        // Hermite's four polynomials.
        (2.0 * t * t * t - 3.0 * t * t + 1.0) * coordinate(&line[piece])
            + (t * t * t - 2.0 * t * t + t) * span_m * slope_at(piece)
            + (3.0 * t * t - 2.0 * t * t * t) * coordinate(&line[piece + 1])
            + (t * t * t - t * t) * span_m * slope_at(piece + 1)
    };
    let at = |share: f64| {
        let at_m = share * length_m;
        Point::new(along(|point| point.x_m, at_m), along(|point| point.y_m, at_m))
    };
    shares.into_iter().map(at).collect()
}

/// The aligned start by the rule, and how far the headings of its points are from the threshold at least,
/// degrees.
pub(crate) fn by_the_rule(line: &[Point], threshold_deg: f64) -> (Option<Point>, f64) {
    let line = if line.len() < 4 { quarters(line) } else { line.to_vec() };
    let arcs_m = chords_m(&line);
    let eastward = derivatives(&arcs_m, &line.iter().map(|point| point.x_m).collect::<Vec<_>>());
    let northward = derivatives(&arcs_m, &line.iter().map(|point| point.y_m).collect::<Vec<_>>());
    let last = line.len() - 1;
    // The angle between two tangents, by their products.
    let turned_deg = |index: usize| {
        let cross = eastward[index] * northward[last] - northward[index] * eastward[last];
        let dot = eastward[index] * eastward[last] + northward[index] * northward[last];
        cross.abs().atan2(dot).to_degrees()
    };
    let found = (0..last).find(|index| turned_deg(*index) < threshold_deg);
    let margins = (0..found.map_or(last, |found| found + 1)).map(|index| turned_deg(index) - threshold_deg);
    (found.map(|found| line[found]), margins.map(f64::abs).fold(f64::INFINITY, f64::min))
}
