//! The aligned start of upstream's path generator, held against the rule written a second time: on random
//! centrelines, and on the turns of public maps, where a folder of these is named.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use lanelet2_map::geometry::Point;
use lanelet2_map::geometry::required_end::first_aligned;
use lanelet2_map::lane_network::TurnDirection;
use proptest::prelude::*;
use signal_gateway::config::files::Disk;
use signal_gateway::config::map::read_lane_network;

use crate::support::prerequisite::{public_maps, require};

const TOLERANCE_M: f64 = 0.05;
/// As the path generator is deployed.
const THRESHOLD_DEG: f64 = 15.0;
/// A heading so near to the threshold may fall on either side by rounding, degrees.
const ROUNDING_DEG: f64 = 1e-6;

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

/// The five points that divide a line into quarters.
fn quarters(line: &[Point]) -> Vec<Point> {
    let arcs_m = chords_m(line);
    let at = |at_m: f64| {
        let piece = (1..line.len() - 1).take_while(|index| arcs_m[*index] < at_m).count();
        let share = (at_m - arcs_m[piece]) / (arcs_m[piece + 1] - arcs_m[piece]);
        let between = |from: f64, to: f64| from + share * (to - from);
        let (from, to) = (line[piece], line[piece + 1]);
        Point::new(between(from.x_m, to.x_m), between(from.y_m, to.y_m))
    };
    [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| at(share * arcs_m[line.len() - 1])).to_vec()
}

/// The aligned start by the rule, and how far the headings of its points are from the threshold at least,
/// degrees.
fn by_the_rule(line: &[Point], threshold_deg: f64) -> (Point, f64) {
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
    let found = (0..=last).find(|index| turned_deg(*index) < threshold_deg).unwrap();
    let margins = (0..=found).map(|index| (turned_deg(index) - threshold_deg).abs());
    (line[found], margins.fold(f64::INFINITY, f64::min))
}

/// How far the two are apart, metres; `None` where rounding decides.
fn difference_m(line: &[Point], threshold_deg: f64) -> Option<f64> {
    let (expected, margin_deg) = by_the_rule(line, threshold_deg);
    let found = first_aligned(line, threshold_deg).unwrap().position;
    (margin_deg > ROUNDING_DEG).then(|| found.distance_m(expected))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_centreline_is_aligned_where_the_rule_says(
        steps in proptest::collection::vec((0.3..12.0_f64, -50.0..50.0_f64), 1..20),
        threshold_deg in prop_oneof![Just(THRESHOLD_DEG), 2.0..60.0_f64],
    ) {
        let mut line = vec![Point::new(3.0, -7.0)];
        let mut heading_deg = 20.0_f64;
        for (step_m, turn_deg) in steps {
            heading_deg += turn_deg;
            let (last, heading) = (line[line.len() - 1], heading_deg.to_radians());
            line.push(Point::new(last.x_m + step_m * heading.cos(), last.y_m + step_m * heading.sin()));
        }
        let difference_m = difference_m(&line, threshold_deg);
        prop_assume!(difference_m.is_some());
        prop_assert!(difference_m.unwrap() < TOLERANCE_M, "{difference_m:?} m: {line:?}");
    }
}

#[test]
fn turns_of_public_maps_are_aligned_where_the_rule_says() {
    let folder = require!(public_maps());
    let (mut maps, mut turns, mut undecided, mut wrong) = (0, 0, 0, Vec::new());
    for map in maps_in(&folder) {
        let Ok(road) = read_lane_network(&Disk, &map) else { continue };
        maps += 1;
        let turns_off = |direction| matches!(direction, TurnDirection::Left | TurnDirection::Right);
        for lane in road.lanes().filter(|lane| turns_off(lane.turn_direction)) {
            let mut line = lane.centerline.clone();
            line.dedup_by(|next, before| next.distance_m(*before) < 1e-8);
            turns += 1;
            match difference_m(&line, THRESHOLD_DEG) {
                None => undecided += 1,
                Some(difference_m) if difference_m < TOLERANCE_M => {}
                Some(difference_m) => wrong.push((map.clone(), lane.id, difference_m)),
            }
        }
    }
    println!("{turns} turns of {maps} maps, {undecided} of them decided by rounding");
    assert!(wrong.is_empty(), "{} of {turns} turns differ: {wrong:?}", wrong.len());
    assert!(turns > 0, "no turn on any map in {}", folder.display());
}

fn maps_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut maps: Vec<PathBuf> = entries
        .flat_map(|path| if path.is_dir() { maps_in(&path) } else { vec![path] })
        .filter(|path| path.extension() == Some(OsStr::new("osm")))
        .collect();
    maps.sort();
    maps
}
