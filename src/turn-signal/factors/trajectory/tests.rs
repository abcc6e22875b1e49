//! Tests of manoeuvres from a trajectory, driven on a straight road with two lanes.

use super::super::tests::lane;
use super::*;
use crate::manoeuvre::ManoeuvreKind;
use crate::parameters::DeciderParameters;
use crate::route::{Route, Segment};
use gateway_base::time::MonoTime;

/// Returns lanelets 1 and 2 one after the other along y = 0, with 11 and 12 to their left, each 3.5 m wide.
fn road() -> LaneNetwork {
    let lanes = [
        lane(1, 0.0, 100.0, 0.0, &[2]),
        lane(2, 100.0, 300.0, 0.0, &[]),
        lane(11, 0.0, 100.0, 3.5, &[12]),
        lane(12, 100.0, 300.0, 3.5, &[]),
    ];
    LaneNetwork::new(lanes, Vec::new())
}

/// Returns an offset that changes smoothly between two positions.
fn smooth(x_m: f64, (from_m, to_m): (f64, f64), (before_m, after_m): (f64, f64)) -> f64 {
    let share = ((x_m - from_m) / (to_m - from_m)).clamp(0.0, 1.0);
    before_m + (after_m - before_m) * (3.0 - 2.0 * share) * share * share
}

/// Returns the kinds of manoeuvres detected along a drive from `from_m` to `to_m`, with their first and last
/// positions in whole metres. The trajectory reaches 80 m ahead, and the vehicle stands at both ends.
fn seen(offset_m: impl Fn(f64) -> f64, (from_m, to_m): (i32, i32)) -> Vec<(ManoeuvreKind, i32, i32)> {
    let (road, parameters) = (road(), DeciderParameters::DEPLOYED);
    let segment = |preferred, beside| Segment { preferred, lanes: vec![preferred, beside] };
    let route = Route::new(1, Pose::default(), vec![segment(1, 11), segment(2, 12)]).unwrap();
    let at = |x_m: i32| {
        let x_m = f64::from(x_m);
        Pose::new(x_m, offset_m(x_m), (offset_m(x_m + 0.5) - offset_m(x_m - 0.5)).atan())
    };
    let speed_mps = |x_m: i32| if x_m == from_m || x_m == to_m { 0.0 } else { 8.0 };
    let mut driven = DrivenPath::default();
    let mut seen: Vec<(ManoeuvreKind, i32, i32)> = Vec::new();
    for x_m in from_m..to_m {
        let odometry = Odometry { pose: at(x_m), speed_mps: speed_mps(x_m) };
        driven.update(odometry);
        let context = FactorContext {
            road: &road,
            route: &route,
            parameters: &parameters,
            looks_at_height: true,
            odometry,
            path: None,
            modified_goal: None,
            operation_mode: None,
        };
        let points = (x_m..=to_m.min(x_m + 80))
            .map(|x_m| TrajectoryPoint { pose: at(x_m), speed_mps: speed_mps(x_m) });
        let trajectory = Timed { at: MonoTime::ZERO, value: points.collect() };
        for made in trajectory_manoeuvres(&context, &driven, &trajectory) {
            let kind = made.value.kind();
            match seen.iter_mut().rfind(|(known, _, last)| *known == kind && *last == x_m - 1) {
                Some((.., last)) => *last = x_m,
                None => seen.push((kind, x_m, x_m)),
            }
        }
    }
    seen
}

#[test]
fn the_middle_of_a_lane_is_no_manoeuvre() {
    assert_eq!(seen(|_| 0.0, (0, 290)), []);
    assert_eq!(seen(|x_m| 0.1 * (x_m / 7.0).sin(), (0, 290)), [], "nor is swaying about it");
    assert_eq!(seen(|_| 0.4, (0, 290)), [], "nor driving beside it");
}

#[test]
fn a_lane_change_is_one_from_the_horizon_to_its_end() {
    let [(kind, first, last)] = seen(|x_m| smooth(x_m, (120.0, 170.0), (0.0, 3.5)), (0, 290))[..] else {
        panic!()
    };
    assert_eq!(kind, ManoeuvreKind::LaneChange);
    assert!((50..80).contains(&first) && (160..=170).contains(&last), "{first} {last}");
}

#[test]
fn two_lane_changes_are_told_apart() {
    let there_and_back =
        |x_m| smooth(x_m, (60.0, 110.0), (0.0, 3.5)) - smooth(x_m, (210.0, 260.0), (0.0, 3.5));
    let seen = seen(there_and_back, (0, 290));
    assert!(seen.iter().all(|(kind, ..)| *kind == ManoeuvreKind::LaneChange), "{seen:?}");
    let lasts: Vec<i32> = seen.iter().map(|(.., last)| *last).collect();
    assert!(
        (100..112).contains(&lasts[0]) && (250..=260).contains(&lasts[1]) && lasts.len() == 2,
        "{seen:?}"
    );
}

#[test]
fn an_avoidance_comes_back_into_its_lane() {
    for most_m in [1.2, 2.4, -1.2] {
        let around =
            |x_m| smooth(x_m, (60.0, 80.0), (0.0, most_m)) - smooth(x_m, (100.0, 120.0), (0.0, most_m));
        let seen = seen(around, (0, 290));
        // Beyond the horizon the path may not return.
        let avoidances: Vec<_> = seen.iter().filter(|(kind, ..)| *kind == ManoeuvreKind::Avoidance).collect();
        let [(_, first, last)] = avoidances[..] else { panic!("{seen:?}") };
        assert!(*first <= 40 && (112..=120).contains(last), "{most_m} {seen:?}");
        assert!(seen.iter().all(|(_, _, last)| *last <= 120), "{most_m} {seen:?}");
    }
}

#[test]
fn a_pull_out_starts_and_a_pull_over_ends_in_a_stand_off_the_middle() {
    let both = |x_m| smooth(x_m, (20.0, 45.0), (-2.2, 0.0)) + smooth(x_m, (220.0, 250.0), (0.0, -2.2));
    let seen = seen(both, (20, 250));
    let kinds: Vec<ManoeuvreKind> = seen.iter().map(|(kind, ..)| *kind).collect();
    assert_eq!(kinds, [ManoeuvreKind::PullOut, ManoeuvreKind::PullOver], "{seen:?}");
    let ((_, first, last), (_, over_first, over_last)) = (seen[0], seen[1]);
    assert!(first == 20 && (36..=45).contains(&last), "{seen:?}");
    assert!((170..200).contains(&over_first) && over_last >= 245, "{seen:?}");
}

#[test]
fn a_driven_path_ends_at_a_jump_and_when_the_vehicle_backs_up() {
    let mut driven = DrivenPath::default();
    let mut lengths = Vec::new();
    for (x_m, speed_mps) in
        [(0.0, 1.0), (0.9, 1.0), (1.1, 1.0), (f64::NAN, 1.0), (9.0, 1.0), (10.0, 1.0), (9.0, -1.0)]
    {
        driven.update(Odometry { pose: Pose::new(x_m, 0.0, 0.0), speed_mps });
        lengths.push(driven.points.len());
    }
    assert_eq!(lengths, [1, 1, 2, 2, 1, 2, 1]);
    for x_m in 0..2_000 {
        driven.update(Odometry { pose: Pose::new(f64::from(x_m), 0.0, 0.0), speed_mps: 1.0 });
    }
    assert_eq!(driven.points.len(), MAX_DRIVEN);
}
