//! Routes that meet themselves: around a block, through a teardrop, back over a place that was passed; some
//! random ones. `cargo test --test random_drives -- --loops 10000` drives as many as wanted.

use lanelet2_map::lane_network::LaneId;
use lanelet2_map::lane_network::TurnDirection::{Left, None as Untagged, Right};
use turn_signal::light_command::TurnCommand;

use crate::pure::drive_scenarios::random_drives::drives::drawn_road::DrawnRoad;
use crate::pure::drive_scenarios::random_drives::drives::drawn_road::Piece::{Arc, Straight};
use crate::pure::drive_scenarios::random_drives::drives::drive_loop;

/// Ids in order, and those in which the last lanelet comes before the first, and backwards.
fn orders(count: usize) -> [Vec<LaneId>; 3] {
    let ids = |id: fn(i64, i64) -> i64| {
        let count = i64::try_from(count).unwrap();
        (0..count).map(|index| id(index, count)).collect()
    };
    [
        ids(|index, _| index + 1),
        ids(|index, count| (index + 1) % count + 1),
        ids(|index, count| count - index),
    ]
}

fn obeys(road: &DrawnRoad, speed_mps: f64, what: &str) {
    assert_eq!(road.broken(speed_mps), None, "{what}");
}

/// Once around a block that is joined from outside, straight on or after a turn to the other side; its goal
/// is before the joint.
fn around_blocks(perimeters_m: impl Iterator<Item = u32>, speeds_mps: &[f64]) {
    for perimeter_m in perimeters_m {
        let (corner, corner_m) = (Arc(6.0, 90.0, Left), 6.0 * std::f64::consts::FRAC_PI_2);
        let side_m = (f64::from(perimeter_m) - 4.0 * corner_m) / 4.0;
        let (before, side, after) =
            (Straight(side_m / 2.0 - 1.0), Straight(side_m), Straight(side_m / 2.0 + 1.0));
        let block = [after, corner, side, corner, side, corner, side, corner, before];
        let from_outside = [&[Straight(60.0)][..], &block].concat();
        let after_a_turn = [&[Straight(60.0), Arc(6.0, -90.0, Right), Straight(5.0)][..], &block].concat();
        for (pieces, joins) in [(from_outside, 1), (after_a_turn, 3)] {
            for ids in orders(pieces.len()) {
                for speed_mps in speeds_mps {
                    let what = format!("{perimeter_m} m at {speed_mps} m/s, {ids:?}");
                    let joint = [pieces.len() - 1, joins];
                    obeys(&DrawnRoad::new(&pieces, &ids, &[joint]), *speed_mps, &what);
                }
            }
        }
    }
}

/// The way comes back beside itself, nearly in parallel, and turns off to the right there.
fn through_teardrops(ways_in_m: &[f64], degrees: &[f64], speeds_mps: &[f64]) {
    for way_in_m in ways_in_m {
        for degrees in degrees {
            let pieces =
                [Straight(*way_in_m), Arc(15.0, *degrees, Untagged), Arc(8.0, -120.0, Right), Straight(40.0)];
            for ids in orders(pieces.len()) {
                for speed_mps in speeds_mps {
                    let what = format!("{way_in_m} m, {degrees}° at {speed_mps} m/s, {ids:?}");
                    obeys(&DrawnRoad::new(&pieces, &ids, &[]), *speed_mps, &what);
                }
            }
        }
    }
}

#[test]
fn random_roads_that_meet_themselves_keep_the_laws() {
    for number in 0..60 {
        drive_loop(1, number).unwrap_or_else(|broken| panic!("--seed 1 --only-loop {number}: {broken}"));
    }
}

#[test]
fn around_a_block_each_turn_is_signalled_in_its_place() {
    around_blocks([120, 250].into_iter(), &[10.0]);
}

#[test]
fn a_teardrop_is_not_mistaken_for_the_way_in_beside_it() {
    through_teardrops(&[60.0], &[330.0], &[6.0]);
}

mod slow {
    use super::*;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn around_blocks_of_all_sizes_each_turn_is_signalled_in_its_place() {
        around_blocks((110..=370).step_by(20), &[3.0, 10.0]);
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn no_teardrop_is_mistaken_for_the_way_in_beside_it() {
        through_teardrops(&[40.0, 60.0, 90.0], &[300.0, 315.0, 330.0], &[3.0, 6.0, 10.0]);
    }
}

/// The end of one lanelet lies on the way into it.
#[test]
fn a_turn_that_ends_on_its_own_way_in_is_not_over_before_it() {
    for (way_in_m, radius_m, degrees) in [(20.0, 8.18, 342.2), (20.0, 9.13, 344.4), (71.7, 8.0, 343.7)] {
        let pieces =
            [Straight(way_in_m), Arc(radius_m, degrees, Left), Arc(6.0, -50.0, Right), Straight(5.0)];
        for ids in orders(pieces.len()) {
            let what = format!("{way_in_m} m, {degrees}°, {ids:?}");
            obeys(&DrawnRoad::new(&pieces, &ids, &[]), 2.0, &what);
        }
    }
}

#[test]
fn a_turn_that_is_driven_again_is_signalled_again() {
    let pieces = [Straight(80.0), Arc(8.0, 90.0, Left), Straight(80.0)];
    let road = DrawnRoad::new(&pieces, &[1, 2, 3], &[]);
    // Past it, back by 60 m, and on; then set back to the start as a demonstration is.
    let shown = road.drive(5.0, &[[10.0, 110.0], [110.0, 50.0], [50.0, 150.0], [10.0, 150.0]]);
    let signalled = |way: usize| {
        let lengths = [200, 120, 200, 280];
        let before: usize = lengths[..way].iter().sum();
        let way = shown[before..before + lengths[way]].iter().filter(|(at_m, _)| *at_m > 52.0);
        way.filter(|(_, turn)| *turn == TurnCommand::Left).count()
    };
    let once = signalled(0);
    assert!(once > 50, "{once} cycles");
    assert_eq!((signalled(2), signalled(3)), (once, once));
    let [.., end_m] = road.turns[0].1;
    let late = shown.iter().find(|(at_m, turn)| *at_m > end_m + 9.0 && turn.side().is_some());
    assert_eq!(late, None);
}

#[test]
fn the_last_metres_of_a_turn_are_not_announced() {
    let pieces = [Straight(80.0), Arc(8.0, 90.0, Left), Straight(80.0)];
    let road = DrawnRoad::new(&pieces, &[1, 2, 3], &[]);
    let [.., end_m] = road.turns[0].1;
    let shown = road.drive(5.0, &[[end_m - 2.0, end_m + 60.0]]);
    assert!(shown.iter().all(|(_, turn)| turn.side().is_none()), "{shown:?}");
    let shown = road.drive(5.0, &[[end_m - 6.0, end_m + 60.0]]);
    assert_eq!(shown[0].1, TurnCommand::Left);
}
