//! Routes that meet themselves: around a block, through a teardrop, back over a place that was passed. A road is drawn piece by
//! piece, and the vehicle drives along its middle.

use std::time::Duration;

use signal_gateway::core::light_command::TurnCommand;
use signal_gateway::core::map::geometry::Pose;
use signal_gateway::core::map::geometry::polyline::{headed, length_m, without_repeats};
use signal_gateway::core::map::geometry::required_end::required_end;
use signal_gateway::core::map::lane_network::{Lane, LaneId, LaneNetwork, TurnDirection};
use signal_gateway::core::time::MonoTime;
use signal_gateway::core::turn_signal::compat::DeciderCompat::Improved;
use signal_gateway::core::turn_signal::decider::{Decider, Settings};
use signal_gateway::core::turn_signal::inputs::Timed;
use signal_gateway::core::turn_signal::planner_input::Odometry;
use signal_gateway::core::turn_signal::route::Route;
use signal_gateway::core::turn_signal::side::Side;

use super::drive::{HALF_WIDTH_M, inputs, route_from};

/// The front of the sample vehicle before its rear axle, metres.
const FRONT_M: f64 = 3.79;
/// Nothing is announced farther ahead than 30 m and 3 s.
const CONSTANT_M: f64 = 30.0;
const SEARCH_S: f64 = 3.0;
/// What the middle of the lanes and the smoothed path differ by, metres.
const MARGIN_M: f64 = 1.5;
const CYCLE: Duration = Duration::from_millis(100);
/// A signal may last so long to be seen, s.
const MINIMUM_S: f64 = 1.6;

/// A piece of road: a lanelet.
#[derive(Debug, Clone, Copy)]
enum Piece {
    Straight(f64),
    /// Radius, metres; degrees, positive to the left; what it is tagged.
    Arc(f64, f64, TurnDirection),
}
use Piece::{Arc, Straight};
use TurnDirection::{Left, None as Untagged, Right};

/// A road that is driven from its first lanelet to its last.
struct Loop {
    road: LaneNetwork,
    route: Route,
    poses: Vec<Pose>,
    /// Its turns: side, start, end of the required section, end, metres.
    turns: Vec<(Side, [f64; 3])>,
}

impl Loop {
    /// These pieces, whose lanelets have these ids; the last one leads to the start of the one at `joins`.
    fn new(pieces: &[Piece], ids: &[LaneId], joins: Option<usize>) -> Self {
        let mut here = Pose::default();
        let (mut lanes, mut middle, mut turns, mut start_m) = (Vec::new(), Vec::new(), Vec::new(), 0.0);
        for (index, piece) in pieces.iter().enumerate() {
            let poses = drawn(here, *piece);
            let side = |by_m: f64| poses.iter().map(|pose| pose.point_at(0.0, by_m)).collect::<Vec<_>>();
            let centerline = side(0.0);
            let direction = if let Arc(.., direction) = piece { *direction } else { Untagged };
            let end_m = start_m + length_m(&centerline);
            if let Some(turned) =
                [(Left, Side::Left), (Right, Side::Right)].iter().find(|(tag, _)| *tag == direction)
            {
                let required = required_end(&centerline, 15.0).unwrap();
                let nearest = centerline.iter().position(|point| point.distance_m(required.position) < 0.6);
                let required_m = start_m + length_m(&centerline[..=nearest.unwrap()]);
                turns.push((turned.1, [start_m, required_m, end_m]));
            }
            start_m = end_m;
            let next = if index + 1 < pieces.len() { Some(index + 1) } else { joins };
            lanes.push(Lane {
                id: ids[index],
                left_bound: side(HALF_WIDTH_M),
                right_bound: side(-HALF_WIDTH_M),
                followers: next.map(|next| ids[next]).into_iter().collect(),
                turn_direction: direction,
                centerline: centerline.clone(),
                ..Lane::default()
            });
            here = *poses.last().unwrap();
            middle.extend(centerline);
        }
        let poses = headed(&without_repeats(&middle));
        let route = route_from(1, poses[0], ids);
        Self { road: LaneNetwork::new(lanes, Vec::new()), route, poses, turns }
    }

    /// The pose on the middle of the road, metres from its start.
    fn at(&self, at_m: f64) -> Pose {
        let mut rest_m = at_m;
        for pair in self.poses.windows(2) {
            let piece_m = pair[0].position.distance_m(pair[1].position);
            if rest_m <= piece_m {
                return Pose {
                    position: pair[0].position.toward(pair[1].position, rest_m / piece_m),
                    ..pair[0]
                };
            }
            rest_m -= piece_m;
        }
        *self.poses.last().unwrap()
    }

    fn length_m(&self) -> f64 {
        length_m(&self.poses.iter().map(|pose| pose.position).collect::<Vec<_>>())
    }

    /// What is shown along `ways`: each from one position to another, at this speed.
    fn drive(&self, speed_mps: f64, ways: &[[f64; 2]]) -> Vec<(f64, TurnCommand)> {
        let mut decider = Decider::new(Settings::deployed(Improved));
        let mut now = MonoTime::from_millis(50_000);
        let mut shown = Vec::new();
        for [from_m, to_m] in ways {
            let step_m = speed_mps * CYCLE.as_secs_f64() * (to_m - from_m).signum();
            let mut at_m = *from_m;
            while (to_m - at_m) * step_m.signum() > 0.0 {
                now = now.after(CYCLE);
                let value = Odometry { pose: self.at(at_m), speed_mps: speed_mps.copysign(step_m) };
                let decision =
                    decider.decide(&inputs(Timed { at: now, value }, &self.road, &self.route), now);
                shown.push((at_m, decision.turn));
                at_m += step_m;
            }
        }
        shown
    }

    /// Every turn is signalled while it is required, and no side long before or after a turn to it.
    fn obeys(&self, speed_mps: f64, what: &str) {
        let shown = self.drive(speed_mps, &[[1.0, self.length_m() - 1.0]]);
        self.judge(&shown, speed_mps, what);
    }

    fn judge(&self, shown: &[(f64, TurnCommand)], speed_mps: f64, what: &str) {
        for (at_m, turn) in shown {
            for (side, [start_m, required_m, _]) in &self.turns {
                let is_required = (start_m - FRONT_M + MARGIN_M..=required_m - MARGIN_M).contains(at_m);
                assert!(
                    !is_required || turn.side() == Some(*side),
                    "{what}: {turn:?} at {at_m:.1} m, in a turn {side:?}"
                );
            }
            let Some(side) = turn.side() else { continue };
            let announced_m = FRONT_M + CONSTANT_M + SEARCH_S * speed_mps + MARGIN_M;
            let is_wanted = |(of, [start_m, _, end_m]): &(Side, [f64; 3])| {
                *of == side
                    && (start_m - announced_m..=end_m + MARGIN_M + MINIMUM_S * speed_mps).contains(at_m)
            };
            assert!(
                self.turns.iter().any(is_wanted),
                "{what}: {turn:?} at {at_m:.1} m, turns {:?}",
                self.turns
            );
        }
    }
}

/// A pose every half metre, or every three degrees.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // some hundred steps
fn drawn(from: Pose, piece: Piece) -> Vec<Pose> {
    match piece {
        Straight(piece_m) => {
            let steps = (piece_m * 2.0).ceil();
            (0..=steps as u32)
                .map(|step| Pose { position: from.point_at(piece_m * f64::from(step) / steps, 0.0), ..from })
                .collect()
        }
        Arc(radius_m, degrees, _) => {
            let steps = (degrees.abs() / 3.0).ceil();
            let side = degrees.signum();
            let pose = |step: u32| {
                let turned = (degrees * f64::from(step) / steps).to_radians();
                let (ahead_m, left_m) =
                    (radius_m * turned.abs().sin(), side * radius_m * (1.0 - turned.cos()));
                Pose { position: from.point_at(ahead_m, left_m), yaw_rad: from.yaw_rad + turned }
            };
            (0..=steps as u32).map(pose).collect()
        }
    }
}

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

/// Once around a block that is joined from outside, straight on or after a turn to the other side; its goal is before the joint.
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
                    Loop::new(&pieces, &ids, Some(joins)).obeys(*speed_mps, &what);
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
                    Loop::new(&pieces, &ids, None).obeys(*speed_mps, &what);
                }
            }
        }
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
    fn around_blocks_of_all_sizes_each_turn_is_signalled_in_its_place() {
        around_blocks((110..=370).step_by(20), &[3.0, 10.0]);
    }

    #[test]
    fn no_teardrop_is_mistaken_for_the_way_in_beside_it() {
        through_teardrops(&[40.0, 60.0, 90.0], &[300.0, 315.0, 330.0], &[3.0, 6.0, 10.0]);
    }
}

#[test]
fn a_turn_that_is_driven_again_is_signalled_again() {
    let pieces = [Straight(80.0), Arc(8.0, 90.0, Left), Straight(80.0)];
    let road = Loop::new(&pieces, &[1, 2, 3], None);
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
    let road = Loop::new(&pieces, &[1, 2, 3], None);
    let [.., end_m] = road.turns[0].1;
    let shown = road.drive(5.0, &[[end_m - 2.0, end_m + 60.0]]);
    assert!(shown.iter().all(|(_, turn)| turn.side().is_none()), "{shown:?}");
    let shown = road.drive(5.0, &[[end_m - 6.0, end_m + 60.0]]);
    assert_eq!(shown[0].1, TurnCommand::Left);
}
