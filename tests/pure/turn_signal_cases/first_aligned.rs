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

use crate::pure::drive_scenarios::random_drives::drives::aligned::by_the_rule;
use crate::support::prerequisite::{public_maps, require};

const TOLERANCE_M: f64 = 1e-6;
/// As the path generator is deployed.
const THRESHOLD_DEG: f64 = 15.0;
/// A heading so near to the threshold may fall on either side by rounding, degrees.
const ROUNDING_DEG: f64 = 1e-6;

/// How far the two are apart, metres, infinitely if one is missing; `None` where rounding decides.
fn difference_m(line: &[Point], threshold_deg: f64) -> Option<f64> {
    let (expected, margin_deg) = by_the_rule(line, threshold_deg);
    let found = first_aligned(line, threshold_deg).map(|found| found.position);
    let difference_m = match (found, expected) {
        (Some(found), Some(expected)) => found.distance_m(expected),
        (None, None) => 0.0,
        (Some(_), None) | (None, Some(_)) => f64::INFINITY,
    };
    (margin_deg > ROUNDING_DEG).then_some(difference_m)
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
