//! Q1 to Q14: required ends of turns; variations of them; a simple independent reference.

use std::f64::consts::PI;

use lanelet2_map::geometry::polyline::length_m;
use lanelet2_map::geometry::required_end::{first_aligned, required_end};
use lanelet2_map::geometry::{Point, wrapped};
use proptest::prelude::*;

const TOLERANCE_M: f64 = 1e-6;

fn points(coordinates: &[(f64, f64)]) -> Vec<Point> {
    coordinates.iter().map(|(x, y)| Point::new(*x, *y)).collect()
}

/// Quarter circle to the left, radius 10, from the origin along +x.
fn arc(step_deg: f64) -> Vec<Point> {
    let count = (90.0 / step_deg).round();
    (0..=90_u32)
        .map(f64::from)
        .take_while(|n| *n <= count)
        .map(|n| (n * step_deg).to_radians())
        .map(|a| Point::new(10.0 * a.sin(), 10.0 - 10.0 * a.cos()))
        .collect()
}

fn mirrored(line: &[Point]) -> Vec<Point> {
    line.iter().map(|point| Point::new(point.x_m, -point.y_m)).collect()
}

fn bent(heading_deg: f64) -> Vec<Point> {
    let heading = heading_deg.to_radians();
    points(&[(0.0, 0.0), (10.0, 0.0), (10.0 + 10.0 * heading.cos(), 10.0 * heading.sin())])
}

fn lanelet_497() -> Vec<Point> {
    points(&[(55.457, 94.080), (56.276, 90.845), (58.528, 88.386), (61.673, 87.292), (65.042, 87.183)])
}

fn lanelet_501() -> Vec<Point> {
    points(&[(51.509, 101.580), (54.375, 100.372), (55.472, 97.493)])
}

fn quarter_and_straight() -> Vec<Point> {
    let mut line = arc(15.0);
    line.extend(points(&[(10.0, 15.0), (10.0, 20.0)]));
    line
}

/// Id, line, threshold in degrees, expected point, its heading in degrees (NaN = not given).
type Case = (&'static str, Vec<Point>, f64, (f64, f64), f64);

fn cases() -> Vec<Case> {
    vec![
        ("Q1", arc(15.0), 15.0, (8.930_596, 5.500_206), 66.1235),
        ("Q2", arc(15.0), 30.0, (7.191_821, 3.051_625), 48.7556),
        ("Q3", arc(15.0), 5.0, (9.336_765, 6.417_793), 71.8766),
        ("Q4", mirrored(&arc(15.0)), 15.0, (8.930_596, -5.500_206), -66.1235),
        ("Q5", arc(30.0), 15.0, (7.902_942, 3.889_403), 54.6383),
        ("Q6", points(&[(0.0, 0.0), (10.0, 0.0), (20.0, 0.0)]), 15.0, (20.0, 0.0), 0.0),
        ("Q7", points(&[(0.0, 0.0), (12.5, 0.0)]), 15.0, (12.5, 0.0), 0.0),
        ("Q8", points(&[(0.0, 0.0), (10.05, 0.0)]), 15.0, (10.05, 0.0), 0.0),
        ("Q9", bent(10.0), 15.0, (19.848_078, 1.736_482), f64::NAN),
        ("Q10", bent(30.0), 15.0, (9.054_260, -0.202_500), 12.0856),
        (
            "Q11",
            points(&[(0.0, 0.0), (10.0, 0.0), (15.0, 3.0), (20.0, 6.0), (30.0, 6.0)]),
            15.0,
            (19.395_359, 5.793_263),
            17.3740,
        ),
        ("Q12", quarter_and_straight(), 15.0, (9.349_430, 6.406_686), 72.6456),
        ("Q13", lanelet_497(), 15.0, (59.759_391, 87.792_274), -17.1257),
        ("Q14", lanelet_501(), 15.0, (53.481_766, 100.928_537), -30.6208),
    ]
}

#[test]
fn the_listed_lines_have_the_listed_ends() {
    for (id, line, threshold, (x, y), heading_deg) in cases() {
        let end = required_end(&line, threshold).unwrap();
        let (dx, dy) = (end.position.x_m - x, end.position.y_m - y);
        assert!(dx.abs() < TOLERANCE_M && dy.abs() < TOLERANCE_M, "{id}: {end:?} is off by {dx}, {dy} m");
        if !heading_deg.is_nan() {
            assert!(
                (end.yaw_rad.to_degrees() - heading_deg).abs() < 6e-5,
                "{id}: {}",
                end.yaw_rad.to_degrees()
            );
        }
    }
}

#[test]
fn turning_a_line_turns_its_end_and_repeated_points_do_not_count() {
    for (id, line, threshold, ..) in cases() {
        let end = required_end(&line, threshold).unwrap();
        let turned: Vec<Point> = line.iter().map(|point| Point::new(-point.y_m, point.x_m)).collect();
        let expected = Point::new(-end.position.y_m, end.position.x_m);
        assert!(
            required_end(&turned, threshold).unwrap().position.distance_m(expected) < TOLERANCE_M,
            "{id}"
        );
        let doubled: Vec<Point> = line.iter().flat_map(|point| [*point, *point]).collect();
        assert_eq!(required_end(&doubled, threshold), Some(end), "{id}");
    }
}

#[test]
fn points_that_are_not_a_line_have_no_end() {
    for line in [&[][..], &[(1.0, 1.0)], &[(1.0, 1.0), (1.0, 1.0)], &[(0.0, 0.0), (f64::NAN, 1.0)]] {
        assert_eq!(required_end(&points(line), 15.0), None, "{line:?}");
        assert_eq!(first_aligned(&points(line), 15.0), None, "{line:?}");
    }
}

#[test]
fn tiny_lines_are_not_resampled() {
    let line = points(&[(0.0, 0.0), (1e-7, 0.0), (0.0, 3.0)]);
    let end = required_end(&line, 15.0).unwrap();
    assert_eq!((end.position, end.yaw_rad), (line[0], 0.0), "a piece too short to interpolate");
    let short = points(&[(0.0, 0.0), (0.05, 0.0)]);
    assert_eq!(required_end(&short, 15.0).unwrap().position, short[1], "one sample only");
}

#[test]
fn the_forward_rule_is_the_first_aligned_piece() {
    let line = points(&[(0.0, 0.0), (10.0, 0.0), (15.0, 3.0), (20.0, 6.0), (30.0, 6.0)]);
    assert_eq!(first_aligned(&line, 15.0).unwrap().position, line[0], "an S ends as it began");
    assert_eq!(first_aligned(&lanelet_497(), 15.0).unwrap().position, lanelet_497()[3]);
}

/// The cubic and the search written again, one sample at a time, as plainly as possible.
fn reference(line: &[Point], threshold_deg: f64) -> Point {
    let mut knots = vec![0.0];
    for pair in line.windows(2) {
        knots.push(knots.last().unwrap() + (pair[1].x_m - pair[0].x_m).hypot(pair[1].y_m - pair[0].y_m));
    }
    let total = *knots.last().unwrap();
    let mut at: Vec<f64> = (0..100_000).map(f64::from).take_while(|s| *s < total).collect();
    if total - at.last().unwrap() < 0.1 {
        at.pop();
    }
    at.push(total);
    let n = line.len() - 1; // pieces
    let sample = |s: f64, value: &dyn Fn(usize) -> f64| {
        let m = |i: usize| (value(i + 1) - value(i)) / (knots[i + 1] - knots[i]);
        let slope = |i: usize| {
            if i == 0 {
                m(0)
            } else if i == n {
                m(n - 1)
            } else if i == 1 || i == n - 1 {
                (m(i - 1) + m(i)) / 2.0
            } else {
                let (one, two) = ((m(i + 1) - m(i)).abs(), (m(i - 1) - m(i - 2)).abs());
                if one + two < 1e-5 {
                    (m(i - 1) + m(i)) / 2.0
                } else {
                    (one * m(i - 1) + two * m(i)) / (one + two)
                }
            }
        };
        let i = (0..n).rfind(|i| knots[*i] <= s).unwrap();
        let (h, t) = (knots[i + 1] - knots[i], s - knots[i]);
        // Hermite form instead of powers.
        let u = t / h;
        value(i) * (2.0 * u.powi(3) - 3.0 * u.powi(2) + 1.0)
            + value(i + 1) * (3.0 * u.powi(2) - 2.0 * u.powi(3))
            + h * slope(i) * (u.powi(3) - 2.0 * u.powi(2) + u)
            + h * slope(i + 1) * (u.powi(3) - u.powi(2))
    };
    let samples: Vec<Point> =
        at.iter().map(|s| Point::new(sample(*s, &|i| line[i].x_m), sample(*s, &|i| line[i].y_m))).collect();
    let last = samples.len() - 1;
    let heading = |i: usize| {
        let i = i.min(last - 1);
        (samples[i + 1].y_m - samples[i].y_m).atan2(samples[i + 1].x_m - samples[i].x_m)
    };
    let found =
        (0..=last).rev().find(|i| wrapped(heading(*i) - heading(last)).abs() >= threshold_deg * PI / 180.0);
    samples[found.unwrap_or(last)]
}

#[test]
fn the_reference_agrees_on_the_listed_lines() {
    for (id, line, threshold, (x, y), ..) in cases() {
        assert!(reference(&line, threshold).distance_m(Point::new(x, y)) < TOLERANCE_M * 1.5, "{id}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_line_ends_as_by_the_reference(
        steps in proptest::collection::vec((0.5..8.0_f64, -40.0..40.0_f64), 1..12),
        threshold in 1.0..90.0_f64,
    ) {
        let mut line = vec![Point::new(3.0, -7.0)];
        let mut heading = 0.3_f64;
        for (step, turn) in steps {
            heading += turn.to_radians();
            let last = *line.last().unwrap();
            line.push(Point::new(last.x_m + step * heading.cos(), last.y_m + step * heading.sin()));
        }
        prop_assume!(length_m(&line) > 1.5);
        let end = required_end(&line, threshold).unwrap();
        let expected = reference(&line, threshold);
        // A heading exactly at the threshold may fall on either side by rounding; that is a sample's step.
        prop_assert!(end.position.distance_m(expected) < TOLERANCE_M, "{end:?} {expected:?}");
    }

    #[test]
    fn any_points_at_all_give_a_finite_end_or_none(
        line in proptest::collection::vec((any::<f64>(), any::<f64>()), 0..6),
        threshold in any::<f64>(),
    ) {
        let line = points(&line);
        if let Some(end) = required_end(&line, threshold) {
            prop_assert!(line.iter().all(|point| point.is_finite()));
            prop_assert!(length_m(&line) >= 1e-5 || line.contains(&end.position));
        }
    }
}
