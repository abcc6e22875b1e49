//! Tests of each manoeuvre built from its factors, on a straight road with two lanes.

#![allow(clippy::float_cmp)] // whole metres are exact
#![allow(clippy::items_after_statements)] // tables with their short names

use super::*;
use crate::manoeuvre::ManoeuvreKind;
use crate::manoeuvre::avoidance::Avoidance;
use crate::manoeuvre::lane_change::{LaneChange, LaneChangePhase};
use crate::manoeuvre::pull_over::PullOver;
use crate::parameters::DeciderParameters;
use crate::planner_input::{ControlPoint, Odometry, PlannedPathPoint};
use crate::route::Route;
use crate::route::Segment;
use crate::side::Side;
use gateway_base::time::MonoTime;
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::{LaneNetwork, Lanelet};

/// Returns a straight lanelet, 3.5 m wide.
pub(super) fn lane(id: i64, from_m: f64, to_m: f64, y_m: f64, followers: &[i64]) -> Lanelet {
    let line = |y_m: f64| vec![Point::new(from_m, y_m), Point::new(to_m, y_m)];
    Lanelet {
        id,
        centerline: line(y_m),
        left_bound: line(y_m + 1.75),
        right_bound: line(y_m - 1.75),
        followers: followers.to_vec(),
        ..Lanelet::default()
    }
}

/// Returns lanelets 1 and 2 one after the other, with 11 and 12 to their left.
fn road() -> LaneNetwork {
    let lanes = [
        lane(1, 0.0, 60.0, 0.0, &[2]),
        lane(2, 60.0, 200.0, 0.0, &[]),
        lane(11, 0.0, 60.0, 3.5, &[12]),
        lane(12, 60.0, 200.0, 3.5, &[]),
    ];
    LaneNetwork::new(lanes, Vec::new())
}

/// Returns a path along x with a point at each metre from 0 to 150, with these offsets and lanelets.
fn path(offset_m: impl Fn(f64) -> f64, lanes: impl Fn(f64) -> Vec<i64>) -> Vec<PlannedPathPoint> {
    let point = |x: i32| {
        let x = f64::from(x);
        PlannedPathPoint { pose: Pose::new(x, offset_m(x), 0.0), speed_mps: 5.0, lanes: lanes(x) }
    };
    (0..=150).map(point).collect()
}

fn own_lanes(x: f64) -> Vec<i64> {
    if x < 60.0 { vec![1] } else { vec![2] }
}

/// Returns a value that changes smoothly from `before` to `after` between two positions.
fn smooth(x: f64, from: f64, to: f64, before: f64, after: f64) -> f64 {
    let share = ((x - from) / (to - from)).clamp(0.0, 1.0);
    before + (after - before) * (3.0 - 2.0 * share) * share * share
}

fn factor(behavior: u16, points: &[(f64, f64)]) -> PlanningFactor {
    let control = |(x, shift_length_m): &(f64, f64)| ControlPoint {
        pose: Pose::new(*x, 0.0, 0.0),
        distance_m: 0.0,
        speed_mps: 0.0,
        shift_length_m: *shift_length_m,
    };
    let control_points = points.iter().map(control).collect();
    PlanningFactor { behavior, is_driving_forward: true, detail: "".into(), control_points }
}

/// Returns the manoeuvres and findings of these factors, with the vehicle at `x_m`.
fn made_of(
    x_m: f64,
    path: Option<&[PlannedPathPoint]>,
    factors: &[(FactorTopic, Vec<PlanningFactor>)],
) -> (Vec<Manoeuvre>, Vec<InputFinding>) {
    made_with(x_m, path, factors, None)
}

fn made_with(
    x_m: f64,
    path: Option<&[PlannedPathPoint]>,
    factors: &[(FactorTopic, Vec<PlanningFactor>)],
    modified_goal: Option<Pose>,
) -> (Vec<Manoeuvre>, Vec<InputFinding>) {
    let (road, parameters) = (road(), DeciderParameters::DEPLOYED);
    let segments = [1, 2].map(|lane| Segment { preferred: lane, lanes: vec![lane] });
    let route = Route::new(1, Pose::default(), segments.to_vec()).unwrap();
    let odometry = Odometry { pose: Pose::new(x_m, 0.0, 0.0), speed_mps: 5.0 };
    let context = FactorContext {
        road: &road,
        route: &route,
        parameters: &parameters,
        looks_at_height: true,
        odometry,
        path,
        modified_goal,
        operation_mode: None,
    };
    let timed = |factors: &Vec<PlanningFactor>| Timed { at: MonoTime::ZERO, value: factors.clone().into() };
    let factors = factors.iter().map(|(topic, factors)| (*topic, timed(factors))).collect();
    let (manoeuvres, findings) = manoeuvres(&context, &factors);
    (manoeuvres.into_iter().map(|timed| timed.value).collect(), findings)
}

fn only<T>(mut all: Vec<T>) -> T {
    assert_eq!(all.len(), 1);
    all.pop().unwrap()
}

/// Returns the only manoeuvre, and asserts that there is no finding.
fn manoeuvre((manoeuvres, findings): (Vec<Manoeuvre>, Vec<InputFinding>)) -> Manoeuvre {
    assert_eq!(findings, []);
    only(manoeuvres)
}

fn lane_change(made: (Vec<Manoeuvre>, Vec<InputFinding>)) -> LaneChange {
    let Manoeuvre::LaneChange(change) = manoeuvre(made) else { panic!("no lane change") };
    change
}

fn avoidance(made: (Vec<Manoeuvre>, Vec<InputFinding>)) -> Avoidance {
    let Manoeuvre::Avoidance(avoidance) = manoeuvre(made) else { panic!("no avoidance") };
    avoidance
}

#[test]
fn a_lane_change_has_side_start_end_and_where_its_path_crosses_the_bound() {
    let ids = |x: f64| if x < 60.0 { vec![1, 11] } else { vec![2, 12] };
    let changing = path(|x| smooth(x, 40.0, 100.0, 0.0, 3.5), ids);
    // The side of the factor takes precedence over the name of the module.
    for (topic, behavior, side) in [
        (FactorTopic::LaneChangeLeft, 4, Side::Left),
        (FactorTopic::LaneChangeLeft, 1, Side::Left),
        (FactorTopic::ExternalRequestLaneChangeRight, 1, Side::Right),
        (FactorTopic::LaneChangeLeft, 5, Side::Right),
        (FactorTopic::AvoidanceByLaneChange, 4, Side::Left),
    ] {
        let factors = [(topic, vec![factor(behavior, &[(40.0, 0.0), (100.0, 0.0)])])];
        let change = lane_change(made_of(10.0, Some(&changing), &factors));
        assert_eq!((change.side, change.phase), (side, LaneChangePhase::Running), "{topic:?}");
        assert_eq!(change.start.map(|pose| pose.position.x_m), Some(40.0));
        assert_eq!(change.end.map(|pose| pose.position.x_m), Some(100.0));
        // Half of the lane change, rounded to the next point.
        let crossing = change.crossing.unwrap().position;
        assert!((70.0..=71.0).contains(&crossing.x_m), "{crossing:?}");
        assert_eq!(change.minimum_length_m, 60.0);
    }
}

#[test]
fn a_lane_change_that_the_path_does_not_drive_waits() {
    let straight = path(|_| 0.0, own_lanes);
    for (topic, path, phase) in [
        (FactorTopic::LaneChangeLeft, Some(straight.as_slice()), LaneChangePhase::Waiting),
        (FactorTopic::LaneChangeLeft, None, LaneChangePhase::Waiting),
        (FactorTopic::AvoidanceByLaneChange, Some(straight.as_slice()), LaneChangePhase::Unsignalled),
    ] {
        let factors = [(topic, vec![factor(4, &[(40.0, 0.0), (100.0, 0.0)])])];
        let change = lane_change(made_of(10.0, path, &factors));
        assert_eq!((change.phase, change.crossing), (phase, None));
        assert_eq!(change.previous_path.len(), path.map_or(0, <[_]>::len));
    }
}

#[test]
fn a_batch_of_one_shift_line_is_that_line() {
    let out = path(|x| smooth(x, 50.0, 80.0, 0.0, 1.5), own_lanes);
    let factors = [(FactorTopic::StaticObstacleAvoidance, vec![factor(4, &[(50.0, 0.0), (80.0, 1.5)])])];
    let avoiding = avoidance(made_of(65.0, Some(&out), &factors));
    let line = only(avoiding.lines);
    assert_eq!((line.line.start_index, line.line.end_index), (50, 80));
    assert_eq!((line.start_shift_m, line.end_shift_m), (0.0, 1.5));
    assert!(avoiding.approved);
    assert_eq!((avoiding.ego_index, avoiding.lanes), (65, vec![1, 2]));
    assert!((avoiding.current_shift_m - 0.75).abs() < 1e-9 && (avoiding.deviation_m + 0.75).abs() < 0.02);
    assert_eq!(avoiding.path.offset_between_m(50, 65), 0.75, "linear in between");
    let next = avoidance(made_of(66.0, Some(&out), &factors));
    assert_eq!(only(next.lines).id, line.id, "the same line in the next cycle");
    // Long before it, another manoeuvre shifts the path.
    let pulling_out = path(|x| smooth(x, 5.0, 30.0, -2.0, 0.0) + smooth(x, 50.0, 80.0, 0.0, 1.5), own_lanes);
    assert_eq!(avoidance(made_of(10.0, Some(&pulling_out), &factors)).current_shift_m, 0.0);
    // Before it is approved, the path stays in the middle.
    let waiting = path(|_| 0.0, own_lanes);
    assert!(!avoidance(made_of(20.0, Some(&waiting), &factors)).approved);
}

#[test]
fn a_batch_that_comes_back_is_read_off_the_path() {
    let there_and_back =
        path(|x| smooth(x, 40.0, 60.0, 0.0, -1.5) + smooth(x, 80.0, 110.0, 0.0, 1.5), own_lanes);
    let factors = [(FactorTopic::StaticObstacleAvoidance, vec![factor(5, &[(40.0, 0.0), (110.0, 0.0)])])];
    let avoiding = avoidance(made_of(20.0, Some(&there_and_back), &factors));
    let lines: Vec<_> = avoiding
        .lines
        .iter()
        .map(|line| (line.line.start_index, line.line.end_index, line.end_shift_m < line.start_shift_m))
        .collect();
    let [(out_from, out_to, true), (back_from, back_to, false)] = lines.as_slice() else {
        panic!("{lines:?}")
    };
    assert_eq!((*out_from, *back_to), (40, 110), "as in the factor");
    for (found, planned) in [(out_to, 60), (back_from, 80)] {
        assert!(found.abs_diff(planned) <= 4, "{found} for {planned}");
    }
    assert!(avoiding.approved);
    // Within the first line, whose beginning is no longer on the path.
    let avoiding = avoidance(made_of(50.0, Some(&there_and_back[45..]), &factors));
    let first = avoiding.lines[0];
    assert_eq!((first.line.start.position.x_m, first.start_shift_m), (40.0, 0.0));
    assert_eq!(avoiding.lines[1].end_shift_m, 0.0);
    // After the first line, and before the path reaches the second: each is identified alone.
    let back = only(avoidance(made_of(85.0, Some(&there_and_back[75..]), &factors)).lines);
    assert!(back.start_shift_m < -1.4 && back.end_shift_m == 0.0, "{back:?}");
    let out = only(avoidance(made_of(30.0, Some(&there_and_back[..70]), &factors)).lines);
    assert!(out.start_shift_m == 0.0 && out.end_shift_m < -1.4, "{out:?}");
}

#[test]
fn pulling_out_shifts_by_its_offsets_and_backwards_requests_hazard_lights() {
    let out = path(|x| smooth(x, 5.0, 30.0, -2.0, 0.0), own_lanes);
    let mut pulling = factor(1, &[(5.0, -2.0), (30.0, 0.0)]);
    let at = |x_m: f64, factor: &PlanningFactor, path: Option<&[PlannedPathPoint]>| {
        let made = made_of(x_m, path, &[(FactorTopic::StartPlanner, vec![factor.clone()])]);
        let Manoeuvre::PullOut(out) = manoeuvre(made) else { panic!("no pull-out") };
        out
    };
    let begun = at(5.4, &pulling, Some(&out));
    assert!(begun.forward && begun.standing_counts);
    assert_eq!(begun.path.unwrap().offset_between_m(5, 30), 2.0);
    assert!(!at(7.0, &pulling, Some(&out)).standing_counts, "departed");
    assert!(at(5.4, &pulling, None).path.is_none(), "nothing to signal without a path");
    pulling.is_driving_forward = false;
    let backing = at(20.0, &pulling, None);
    assert!(!backing.forward && backing.path.is_some(), "needs none to request hazard lights");
}

#[test]
fn pulling_over_is_decided_by_a_shift_and_announced_by_braking() {
    let mut straight = path(|_| 0.0, own_lanes);
    for point in &mut straight {
        // Three seconds before the stop at 120 m, starting at 90 m.
        let left_m = 120.0 - point.pose.position.x_m;
        point.speed_mps = if left_m > 30.0 { 10.0 } else { (left_m / 3.0).max(0.0) };
    }
    let at = |factors: Vec<PlanningFactor>| {
        let made = made_of(60.0, Some(&straight), &[(FactorTopic::GoalPlanner, factors)]);
        let Manoeuvre::PullOver(over) = manoeuvre(made) else { panic!("no pull-over") };
        over
    };
    let PullOver::Decided(decided) =
        at(vec![factor(3, &[(120.0, 0.0)]), factor(4, &[(90.0, 0.0), (120.0, 2.2)])])
    else {
        panic!("decided")
    };
    assert_eq!((decided.start.position.x_m, decided.goal.position.x_m), (90.0, 120.0));
    assert_eq!(decided.path.unwrap().offset_between_m(90, 120), 2.2);
    let braking = |factors| match at(factors) {
        PullOver::Undecided(undecided) => {
            let x = |pose: Option<Pose>| pose.map(|pose| pose.position.x_m);
            (x(undecided.deceleration), x(undecided.stop))
        }
        other @ PullOver::Decided(_) => panic!("{other:?}"),
    };
    let (stop, slow_down) = (factor(3, &[(120.0, 0.0)]), factor(2, &[(70.0, 0.0)]));
    assert_eq!(braking(vec![stop.clone(), slow_down]), (Some(70.0), Some(120.0)), "as in the factor");
    let (begins, stops) = braking(vec![stop]);
    assert!((88.0..=90.0).contains(&begins.unwrap()), "{begins:?}: off the planned speed");
    assert_eq!(stops, Some(120.0));
}

#[test]
fn a_pull_over_ends_at_the_modified_goal_where_it_is_known() {
    let straight = path(|_| 0.0, own_lanes);
    let factors = [(FactorTopic::GoalPlanner, vec![factor(4, &[(90.0, 0.0), (120.0, 2.2)])])];
    for (modified_goal, expected_m) in [(None, 120.0), (Some(Pose::new(126.0, 2.2, 0.0)), 126.0)] {
        let made = made_with(60.0, Some(&straight), &factors, modified_goal);
        let Manoeuvre::PullOver(PullOver::Decided(decided)) = manoeuvre(made) else { panic!("decided") };
        assert_eq!(decided.goal.position.x_m, expected_m);
        let shift_m = decided.path.unwrap().offset_between_m(90, 120);
        let expected_shift_m = 2.2 * 30.0 / (expected_m - 90.0);
        assert!((shift_m - expected_shift_m).abs() < 1e-6, "{shift_m}: the ramp ends at the goal");
    }
}

#[test]
fn modules_come_in_the_order_of_the_planner_without_those_about_speed() {
    let straight = path(|_| 0.0, own_lanes);
    let change = vec![factor(4, &[(40.0, 0.0), (100.0, 0.0)])];
    let shift = vec![factor(4, &[(50.0, 0.0), (80.0, 1.5)]), factor(3, &[(60.0, 0.0)])];
    let factors = [
        (FactorTopic::GoalPlanner, vec![factor(4, &[(90.0, 0.0), (120.0, 2.2)])]),
        (FactorTopic::LaneChangeLeft, change.clone()),
        (FactorTopic::AvoidanceByLaneChange, change),
        (FactorTopic::StaticObstacleAvoidance, shift),
        (FactorTopic::StartPlanner, vec![factor(1, &[(5.0, -2.0), (30.0, 0.0)])]),
        (FactorTopic::LaneChangeRight, vec![factor(2, &[(50.0, 0.0)])]),
    ];
    let (manoeuvres, findings) = made_of(10.0, Some(&straight), &factors);
    use ManoeuvreKind::{Avoidance, LaneChange, PullOut, PullOver};
    let kinds: Vec<_> = manoeuvres.iter().map(Manoeuvre::kind).collect();
    assert_eq!(kinds, [PullOut, LaneChange, Avoidance, LaneChange, PullOver]);
    assert_eq!(findings, []);
}

#[test]
fn factors_that_cannot_be_used_are_left_out_with_a_finding() {
    use FactorFlaw::{NoSide, NoStretch, NotFinite};
    use FactorTopic::{
        AvoidanceByLaneChange, GoalPlanner, LaneChangeLeft, StartPlanner, StaticObstacleAvoidance,
    };
    let straight = path(|_| 0.0, own_lanes);
    let interval = [(40.0, 0.0), (100.0, 0.0)];
    let nowhere = [(f64::NAN, 0.0), (100.0, 0.0)];
    for (topic, bad, flaw) in [
        (LaneChangeLeft, factor(4, &nowhere), NotFinite),
        (StaticObstacleAvoidance, factor(4, &[(40.0, f64::INFINITY), (100.0, 0.0)]), NotFinite),
        (LaneChangeLeft, factor(4, &[(40.0, 0.0)]), NoStretch),
        (StaticObstacleAvoidance, factor(4, &[]), NoStretch),
        (StartPlanner, factor(1, &[(40.0, 0.0)]), NoStretch),
        (GoalPlanner, factor(4, &[(40.0, 0.0)]), NoStretch),
        (AvoidanceByLaneChange, factor(1, &interval), NoSide),
    ] {
        let made = made_of(10.0, Some(&straight), &[(topic, vec![bad])]);
        assert_eq!(made, (vec![], vec![InputFinding::BadFactor { topic, flaw }]), "{topic:?}");
    }
    let shift = vec![factor(4, &[(50.0, 0.0), (80.0, 1.5)])];
    let without_path = made_of(10.0, None, &[(StaticObstacleAvoidance, shift)]);
    assert_eq!(without_path, (vec![], vec![InputFinding::NoPathFor(ManoeuvreKind::Avoidance)]));
}
