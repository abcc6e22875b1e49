//! I1 to I7: turns at intersections, improved and as upstream.

use std::time::Duration;

use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet, TurnDirection};
use turn_signal::compat::DeciderCompat::{self, Improved, Upstream};
use turn_signal::distance_path::DistancePath;
use turn_signal::intersection::turns;
use turn_signal::light_command::TurnCommand;

use super::drive::{Drive, straight_lane, turn};
use super::line::{at, blinking, line, samples};

fn with_left_turn(compat: DeciderCompat) -> Drive {
    let mut drive = Drive::new(compat);
    drive.observed.turns = vec![turn(5, TurnDirection::Left, 100.0, 116.0, 111.0)];
    drive
}

fn none(_: f64) -> Vec<turn_signal::manoeuvre::Manoeuvre> {
    Vec::new()
}

/// A path through these lanelets, each of which may lie anywhere on it.
fn through(lanes: &[LaneId]) -> DistancePath {
    let spans_m = lanes.iter().map(|_| [-1_000.0, 1_000.0]).collect();
    DistancePath { path: line(-60, 300), lanes: lanes.to_vec(), spans_m, ego_m: 60.0 }
}

#[test]
fn i1_one_left_lanelet() {
    for compat in [Upstream, Improved] {
        let mut drive = with_left_turn(compat);
        let signals = drive.through(samples(0.0, 116.0, 1.0), 10.0, none);
        assert_eq!(blinking(signals), "LEFT 37 to 116", "I1 {compat:?}");
        let last = drive.step(116.0, 10.0, &[]);
        assert_eq!(drive.announced_m(&last, 116.0), Some(37.0), "the memory");
        let passed = drive.step(117.0, 10.0, &[]);
        assert_eq!(drive.announced_m(&passed, 117.0), None, "passed");
        let after = drive.through(samples(117.0, 140.0, 1.0), 10.0, none);
        assert_eq!(blinking(after), "");
    }
}

#[test]
fn i2_slowing_down_drops_the_signal_upstream_and_not_by_default() {
    use TurnCommand::{Disable, Left};
    let (mut upstream, mut improved) = (with_left_turn(Upstream), with_left_turn(Improved));
    for (x, speed, upstream_turn, improved_turn) in [
        (36.0, 10.0, Disable, Disable),
        (37.0, 10.0, Left, Left),
        (40.0, 10.0, Left, Left),
        (45.0, 5.0, Disable, Left),
        (50.0, 1.0, Disable, Left),
        (60.0, 0.5, Disable, Left),
        (65.0, 0.5, Left, Left),
        (116.0, 3.0, Left, Left),
        (116.1, 3.0, Disable, Disable),
    ] {
        for (drive, expected) in [(&mut upstream, upstream_turn), (&mut improved, improved_turn)] {
            drive.wait(Duration::from_secs(2));
            let compat = drive.settings.compat;
            let decision = drive.step(x, speed, &[]);
            assert_eq!(decision.turn, expected, "I2 {compat:?} at {x}, {speed} m/s");
            let memory = drive.announced_m(&decision, x);
            assert_eq!(memory, Some(37.0).filter(|_| expected == Left), "{compat:?} at {x}");
        }
    }
}

#[test]
fn a_long_stop_out_of_range_ends_the_announcement_until_the_turn_is_in_range_again() {
    let mut drive = with_left_turn(Improved);
    assert_eq!(drive.step(37.0, 10.0, &[]).turn, TurnCommand::Left);
    for second in 0..=40 {
        drive.wait(Duration::from_secs(1));
        let turn = drive.step(50.0, 0.0, &[]).turn;
        let expected = if second <= 20 { TurnCommand::Left } else { TurnCommand::Disable };
        assert_eq!(turn, expected, "after {second} s");
    }
    drive.wait(Duration::from_secs(1));
    let again = drive.step(50.0, 8.0, &[]);
    assert_eq!(
        (again.turn, drive.announced_m(&again, 50.0)),
        (TurnCommand::Left, Some(50.0)),
        "in range again"
    );
}

#[test]
fn i3_a_distance_of_its_own() {
    for compat in [Upstream, Improved] {
        let mut drive = with_left_turn(compat);
        drive.observed.turns[0].search_distance_m = Some(10.0);
        let signals = drive.through(samples(0.0, 130.0, 0.5), 10.0, none);
        assert_eq!(blinking(signals), "LEFT 86.5 to 116", "I3 {compat:?}");
        let mut drive = with_left_turn(compat);
        drive.observed.turns[0].search_distance_m = Some(0.0);
        let signals = drive.through(samples(0.0, 130.0, 0.5), 10.0, none);
        assert_eq!(blinking(signals), "LEFT 96.5 to 116", "distance 0 {compat:?}");
    }
}

#[test]
fn i4_right_then_left() {
    let two = |compat| {
        let mut drive = Drive::new(compat);
        drive.observed.turns = vec![
            turn(501, TurnDirection::Right, 39.399, 45.590, 41.399),
            turn(497, TurnDirection::Left, 49.003, 62.376, 57.003),
        ];
        drive.through((-100..=700).map(|tenth| f64::from(tenth) / 10.0), 3.0, none)
    };
    assert_eq!(blinking(two(Upstream)), "RIGHT -3.3 to 41.3, LEFT 41.4 to 62.3", "I4");
    // By default half a second passes in between: the first sample after 1.5 m at 3 m/s.
    assert_eq!(blinking(two(Improved)), "RIGHT -3.3 to 41.3, LEFT 43 to 62.3", "I4 by default");
}

#[test]
fn i5_split_turns_are_two_upstream_and_one_by_default() {
    let lanes = || {
        let lane = |id, from, to, followers| Lanelet {
            turn_direction: TurnDirection::Left,
            followers,
            ..straight_lane(id, from, to)
        };
        let before = Lanelet { followers: vec![2], ..straight_lane(1, -60.0, 100.0) };
        LaneNetwork::new([before, lane(2, 100.0, 108.0, vec![3]), lane(3, 108.0, 116.0, vec![])], Vec::new())
    };
    let mut drive = Drive::on(lanes(), &[1, 2, 3], Upstream);
    let got = turns(&drive.context(at(0.0), 10.0), &through(&[1, 2, 3]), TurnCommand::NoCommand);
    assert_eq!(got.iter().map(|turn| turn.id).collect::<Vec<_>>(), [2, 3]);
    drive.observed.turns = vec![
        turn(2, TurnDirection::Left, 100.0, 108.0, 105.0),
        turn(3, TurnDirection::Left, 108.0, 116.0, 114.0),
    ];
    let signals = drive.through(samples(0.0, 105.0, 1.0), 10.0, none);
    assert_eq!(blinking(signals), "LEFT 37 to 105", "I5");
    for (x, start_m, turn_m) in [(105.0, 37.0, 100.0), (106.0, 45.0, 108.0)] {
        let decision = drive.step(x, 10.0, &[]);
        assert_eq!(drive.announced_m(&decision, x), Some(start_m));
        assert_eq!(decision.intersection.unwrap().pose, at(turn_m));
    }
    assert_eq!(blinking(drive.through(samples(106.0, 130.0, 1.0), 10.0, none)), "LEFT 106 to 116");

    let mut drive = Drive::on(lanes(), &[1, 2, 3], Improved);
    let got = turns(&drive.context(at(0.0), 10.0), &through(&[1, 2, 3]), TurnCommand::NoCommand);
    let [joined] = got.as_slice() else { panic!("not joined: {got:?}") };
    assert_eq!((joined.id, joined.front, joined.back), (2, at(100.0), at(116.0)));
    drive.observed.turns = got;
    let signals = drive.through(samples(0.0, 130.0, 1.0), 10.0, none);
    assert_eq!(blinking(signals), "LEFT 37 to 116", "I5 by default");
}

#[test]
fn turns_to_different_sides_or_apart_are_not_joined() {
    let lane = |id, from, to, turn_direction, followers| Lanelet {
        turn_direction,
        followers,
        ..straight_lane(id, from, to)
    };
    use TurnDirection::{Left, None, Right};
    for (what, middle, count) in [
        ("other side", lane(3, 110.0, 120.0, Right, vec![4]), 3),
        ("plain between", lane(3, 110.0, 120.0, None, vec![4]), 2),
        ("no follower", lane(3, 110.0, 120.0, Left, vec![]), 2),
        ("three in a row", lane(3, 110.0, 120.0, Left, vec![4]), 1),
    ] {
        let road = LaneNetwork::new(
            [lane(2, 100.0, 110.0, Left, vec![3]), middle, lane(4, 120.0, 130.0, Left, vec![])],
            Vec::new(),
        );
        let drive = Drive::on(road, &[2, 3, 4], Improved);
        let got = turns(&drive.context(at(90.0), 10.0), &through(&[2, 3, 4]), TurnCommand::NoCommand);
        assert_eq!(got.len(), count, "{what}");
    }
}

#[test]
fn i6_the_stop_rule_queues_plain_lanelets() {
    let road = || {
        let plain = Lanelet { followers: vec![2], ..straight_lane(1, -60.0, 100.0) };
        let left = Lanelet { turn_direction: TurnDirection::Left, ..straight_lane(2, 100.0, 116.0) };
        LaneNetwork::new([plain, left], Vec::new())
    };
    let ids = |compat, x: f64, speed, manoeuvre| {
        let drive = Drive::on(road(), &[1, 2], compat);
        turns(&drive.context(at(x), speed), &through(&[1, 2]), manoeuvre)
            .iter()
            .map(|turn| turn.id)
            .collect::<Vec<_>>()
    };
    use TurnCommand::{Left, NoCommand, Right};
    for (what, got, expected) in [
        ("8 m left", ids(Upstream, 92.0, 0.0, Left), vec![1, 2]),
        ("12 m left", ids(Upstream, 88.0, 0.0, Left), vec![2]),
        ("rolling", ids(Upstream, 92.0, 0.1, Left), vec![2]),
        ("nothing signalled", ids(Upstream, 92.0, 0.0, NoCommand), vec![2]),
        ("other side", ids(Upstream, 92.0, 0.0, Right), vec![2]),
        ("by default", ids(Improved, 92.0, 0.0, Left), vec![2]),
    ] {
        assert_eq!(got, expected, "{what}");
    }
}

#[test]
fn i7_the_start_lies_at_the_rear_axle() {
    let mut drive = with_left_turn(Upstream);
    let decision = drive.step(37.0, 10.0, &[]);
    let ahead = decision.intersection.unwrap();
    assert!(!ahead.active && (ahead.distance_m - 59.21).abs() < 1e-9, "{ahead:?}");
    let inside = drive.step(97.0, 10.0, &[]).intersection.unwrap();
    assert!(inside.active);
}

#[test]
fn by_default_a_lanelet_that_leaves_the_path_is_forgotten() {
    for (compat, start_m) in [(Upstream, 40.0), (Improved, 42.0)] {
        let mut drive = with_left_turn(compat);
        drive.step(40.0, 10.0, &[]);
        let turns = std::mem::take(&mut drive.observed.turns);
        drive.step(41.0, 10.0, &[]);
        drive.observed.turns = turns;
        let back = drive.step(42.0, 10.0, &[]);
        assert_eq!(drive.announced_m(&back, 42.0), Some(start_m), "W8 {compat:?}");
    }
}
