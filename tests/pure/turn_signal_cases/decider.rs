//! The decider on a map, from inputs to command and reasons: the distance path; old, missing and bad inputs.

use std::time::Duration;

use gateway_base::time::MonoTime;
use lanelet2_map::geometry::path::PathError;
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::{LaneNetwork, Lanelet};
use proptest::prelude::*;
use signal_gateway::report::decision::reasons;
use turn_signal::compat::DeciderCompat::{self, Improved, Upstream};
use turn_signal::compat::DeciderQuirks;
use turn_signal::decider::{Decider, DeciderSettings};
use turn_signal::decision::{Basis, Decision};
use turn_signal::distance_path::DistancePath;
use turn_signal::inputs::{InputFinding, Inputs, Timed};
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::manoeuvre::{Manoeuvre, ManoeuvreKind};
use turn_signal::parameters::DeciderParameters;
use turn_signal::planner_input::Odometry;
use turn_signal::resolve::CandidateSource;
use turn_signal::route::Route;
use turn_signal::side::Side;

use super::drive::{inputs, lane_change, route_from, straight_lane};
use super::line::at;
use super::path_generator::{ROUTE, consecutive_turn};

const START: MonoTime = MonoTime::from_millis(50_000);

fn odometry(x_m: f64, y_m: f64, yaw_rad: f64, speed_mps: f64, at: MonoTime) -> Timed<Odometry> {
    Timed { at, value: Odometry { pose: Pose::new(x_m, y_m, yaw_rad), speed_mps } }
}

fn route_of(id: u128, lanes: &[i64]) -> Route {
    route_from(id, Pose::default(), lanes)
}

fn decider(compat: DeciderCompat) -> Decider {
    Decider::new(DeciderSettings::deployed(compat))
}

/// Right, then left, measured on the map: the required end of 501 lies 2 m into it, that of 497 8 m.
#[test]
fn two_turns_of_a_map() {
    let (road, route) = (consecutive_turn(), route_of(1, &ROUTE));
    for compat in [Upstream, Improved] {
        let mut decider = decider(compat);
        let mut now = START;
        let mut turn_at = |x, y, yaw, speed| {
            now = now.after(Duration::from_secs(2));
            decider.decide(&inputs(odometry(x, y, yaw, speed, now), &road, &route), now).turn
        };
        let turns = [
            // 500: 34 m from its end, then 33 m: 30 m and the front.
            turn_at(17.4, 101.41, 0.005, 0.0),
            turn_at(18.5, 101.415, 0.005, 0.0),
            turn_at(51.0, 101.577, 0.005, 3.0),
            // 501: 1 m and 5 m into it.
            turn_at(52.4, 101.3, -0.4, 3.0),
            turn_at(55.1, 98.4, -1.2, 3.0),
        ];
        use TurnCommand::{Disable, Left, Right};
        assert_eq!(&turns[..4], [Disable, Right, Right, Right], "{compat:?}");
        let changed = [turns[4], turn_at(55.46, 95.0, -1.57, 3.0)];
        let expected = if compat == Upstream { [Left, Left] } else { [Disable, Left] };
        assert_eq!(changed, expected, "{compat:?}: by default a gap lies between");
        assert_eq!(turn_at(65.0, 87.18, 0.0, 3.0), Left, "{compat:?}");
        assert_eq!(turn_at(66.0, 87.18, 0.0, 3.0), Disable, "{compat:?}");
    }
}

#[test]
fn the_distance_path_follows_the_route() {
    let (road, route) = (consecutive_turn(), route_of(1, &ROUTE));
    let ego = Pose::new(40.0, 101.5, 0.0);
    let (parameters, quirks) = (DeciderParameters::DEPLOYED, DeciderQuirks::of(Improved));
    let whole = DistancePath::new((&road, &route, quirks), &parameters, ego, 500, 100.0).unwrap();
    assert_eq!(whole.lanes, ROUTE);
    let own = whole.spans_m[ROUTE.iter().position(|id| *id == 500).unwrap()];
    assert!(
        (own[0]..=own[1]).contains(&whole.ego_m)
            && whole.spans_m.windows(2).all(|pair| pair[0][1] == pair[1][0])
    );
    let lengths: f64 = ROUTE.iter().map(|id| road.lane(*id).unwrap().length_m()).sum();
    // Smoothed corners are a little longer or shorter than sharp ones.
    assert!((whole.path.length_m() - lengths).abs() < 0.5, "{} {lengths}", whole.path.length_m());
    let spacing = whole.path.poses().windows(2).map(|pair| pair[0].position.distance_m(pair[1].position));
    assert!(spacing.take(10).all(|gap| (gap - 2.0).abs() < 1e-6), "a point every 2 m");

    let near = DeciderParameters { path_forward_length_m: 15.0, ..parameters };
    let short = DistancePath::new((&road, &route, quirks), &near, ego, 500, 20.0).unwrap();
    assert_eq!(short.lanes, [500, 501]);
    assert!((short.path.length_m() - 35.0).abs() < 0.1);
    assert!((short.path.poses()[0].position.x_m - 20.0).abs() < 0.1);

    let empty = LaneNetwork::new([Lanelet { id: 1, ..Lanelet::default() }], Vec::new());
    let pointless = DistancePath::new((&empty, &route_of(1, &[1]), quirks), &parameters, ego, 1, 100.0);
    assert_eq!(pointless, Err(PathError::TooShort));
}

fn assert_no_inputs(decision: &Decision, finding: InputFinding) {
    assert_eq!(
        (decision.turn, decision.hazard),
        (TurnCommand::NoCommand, HazardCommand::NoCommand),
        "{decision:?}"
    );
    assert_eq!((&decision.basis, &decision.findings[..]), (&Basis::NoInputs, &[finding][..]));
}

#[test]
fn without_what_is_indispensable_there_is_no_command() {
    let (road, route) = (consecutive_turn(), route_of(1, &ROUTE));
    let now = START;
    let fresh = odometry(45.0, 101.5, 0.0, 3.0, now);
    let whole = inputs(fresh, &road, &route);
    let old = Duration::from_millis(501);
    let ago = MonoTime::from_millis(49_499);
    let ahead = now.after(old);
    for compat in [Upstream, Improved] {
        let decide = |inputs: &Inputs<'_>| decider(compat).decide(inputs, now);
        assert_eq!(decide(&whole).turn, TurnCommand::Right);
        assert_no_inputs(&decide(&Inputs { odometry: None, ..whole }), InputFinding::NoOdometry);
        assert_no_inputs(&decide(&Inputs { road: None, ..whole }), InputFinding::NoRoad);
        assert_no_inputs(&decide(&Inputs { route: None, ..whole }), InputFinding::NoRoute);
        assert_no_inputs(&decide(&Inputs { lane_driving: false, ..whole }), InputFinding::NotLaneDriving);
        let with = |odometry| decide(&Inputs { odometry: Some(odometry), ..whole });
        assert_no_inputs(&with(Timed { at: ago, ..fresh }), InputFinding::OldOdometry(old));
        assert_no_inputs(&with(Timed { at: ahead, ..fresh }), InputFinding::FutureOdometry(old));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for spoiled in [
                odometry(bad, 0.0, 0.0, 3.0, now),
                odometry(0.0, bad, 0.0, 3.0, now),
                odometry(0.0, 0.0, bad, 3.0, now),
                odometry(0.0, 0.0, 0.0, bad, now),
            ] {
                assert_no_inputs(&with(spoiled), InputFinding::OdometryNotFinite);
            }
        }
        let limit = MonoTime::from_millis(49_500);
        assert_eq!(with(Timed { at: limit, ..fresh }).turn, TurnCommand::Right, "as old as the limit");
    }
}

#[test]
fn the_next_deadline_is_when_an_input_turns_old() {
    let (road, route) = (consecutive_turn(), route_of(1, &ROUTE));
    let fresh = odometry(45.0, 101.5, 0.0, 3.0, START);
    let mut decider = decider(Improved);
    let due = decider.decide(&inputs(fresh, &road, &route), START).next_deadline.unwrap();
    assert_eq!(due, START.after(Duration::from_nanos(500_000_001)));
    let just_before = START.after(Duration::from_millis(500));
    assert_eq!(decider.decide(&inputs(fresh, &road, &route), just_before).turn, TurnCommand::Right);
    assert_eq!(decider.decide(&inputs(fresh, &road, &route), due).turn, TurnCommand::NoCommand);
}

/// The minimum gap would follow on an end: off, though the turn goes on.
#[test]
fn a_gap_of_the_odometry_does_not_end_a_signal() {
    let (road, route) = (consecutive_turn(), route_of(1, &ROUTE));
    let mut decider = decider(Improved);
    let mut decide = |measured_ms, ms| {
        let after = |ms| START.after(Duration::from_millis(ms));
        let odometry = odometry(45.0, 101.5, 0.0, 3.0, after(measured_ms));
        let decision = decider.decide(&inputs(odometry, &road, &route), after(ms));
        (decision.turn, decision.held)
    };
    assert_eq!(decide(0, 0), (TurnCommand::Right, None));
    assert_eq!(decide(0, 501), (TurnCommand::NoCommand, None));
    assert_eq!(decide(600, 600), (TurnCommand::Right, None));
}

fn change(end: Pose) -> Manoeuvre {
    Manoeuvre::LaneChange(lane_change(Side::Left, None, Some(end)))
}

#[test]
fn with_an_empty_path_or_a_map_without_lanes_the_manoeuvres_decide_alone() {
    let (road, route) = (consecutive_turn(), route_of(1, &ROUTE));
    let fresh = odometry(45.0, 101.5, 0.0, 3.0, START);
    let manoeuvres = [Timed { at: START, value: change(Pose::new(50.0, 101.5, 0.0)) }];
    let empty = LaneNetwork::default();
    for compat in [Upstream, Improved] {
        let whole =
            Inputs { planned_path: Some(Timed { at: START, value: 0 }), ..inputs(fresh, &road, &route) };
        let got = decider(compat).decide(&whole, START);
        assert_eq!((got.turn, got.hazard), (TurnCommand::NoCommand, HazardCommand::Disable), "{compat:?}");
        assert_eq!(got.findings, [InputFinding::EmptyPlannedPath]);
        let got = decider(compat).decide(&Inputs { manoeuvres: &manoeuvres, ..whole }, START);
        assert_eq!((got.turn, got.basis), (TurnCommand::Left, Basis::ManoeuvreAlone(TurnCommand::Left)));
        let got = decider(compat).decide(&inputs(fresh, &empty, &route), START);
        assert_eq!(got.turn, TurnCommand::NoCommand);
        assert_eq!(got.findings, [InputFinding::NoLaneAround]);
        let pointless = LaneNetwork::new([Lanelet { id: 500, ..Lanelet::default() }], Vec::new());
        let got = decider(compat).decide(&inputs(fresh, &pointless, &route), START);
        assert_eq!(got.findings, [InputFinding::NoDistancePath(PathError::TooShort)]);
        assert_eq!(got.turn, TurnCommand::NoCommand);
        let crooked =
            Lanelet { id: 500, centerline: vec![Point::new(f64::NAN, 0.0); 3], ..Lanelet::default() };
        let got =
            decider(compat).decide(&inputs(fresh, &LaneNetwork::new([crooked], Vec::new()), &route), START);
        assert_eq!(got.turn.side(), None, "{got:?}");
        assert!(!got.findings.is_empty(), "{got:?}");
    }
}

#[test]
fn old_manoeuvres_are_left_out_and_bad_ones_not_signalled() {
    let road = LaneNetwork::new([straight_lane(1, -60.0, 300.0)], Vec::new());
    let route = route_of(1, &[1]);
    let decide = |compat, at_ms, end| {
        let manoeuvres = [Timed { at: MonoTime::from_millis(at_ms), value: change(end) }];
        let fresh = odometry(0.0, 0.0, 0.0, 3.0, START);
        decider(compat).decide(&Inputs { manoeuvres: &manoeuvres, ..inputs(fresh, &road, &route) }, START)
    };
    for compat in [Upstream, Improved] {
        assert_eq!(decide(compat, 49_000, at(60.0)).turn, TurnCommand::Left);
        let old = decide(compat, 48_999, at(60.0));
        let age = Duration::from_millis(1001);
        assert_eq!(old.turn, TurnCommand::Disable);
        assert_eq!(old.findings, [InputFinding::OldManoeuvre { kind: ManoeuvreKind::LaneChange, age }]);
        let bad = decide(compat, 50_000, Pose::new(f64::NAN, 0.0, 0.0));
        assert_eq!(bad.turn, TurnCommand::Disable);
        let is_reason = |reason: String| reason.starts_with("manoeuvre: a point of it is not a number");
        assert!(reasons(&bad).any(is_reason), "{bad:?}");
    }
}

#[test]
fn a_new_route_clears_what_was_remembered_by_default() {
    let (road, one, other) = (consecutive_turn(), route_of(1, &ROUTE), route_of(2, &ROUTE));
    for compat in [Upstream, Improved] {
        let mut decider = decider(compat);
        decider.decide(&inputs(odometry(45.0, 101.5, 0.0, 3.0, START), &road, &one), START);
        let later = START.after(Duration::from_millis(100));
        let got = decider.decide(&inputs(odometry(46.0, 101.5, 0.0, 3.0, later), &road, &other), later);
        assert_eq!((got.turn, &got.findings[..]), (TurnCommand::Right, &[InputFinding::NewRoute][..]));
        let Basis::Candidates(resolution) = got.basis else { panic!("W8 {compat:?}") };
        // Begun a metre ago, or here: the front is 3.79 m ahead.
        let start_m = resolution.winner.unwrap().distances.desired_start_m;
        assert_eq!(start_m < -4.5, compat == Upstream, "W8 {compat:?}: {start_m}");
    }
}

#[test]
fn a_clock_that_goes_back_is_a_finding_and_restarts_durations() {
    let (road, route) = (consecutive_turn(), route_of(1, &ROUTE));
    let mut decider = decider(Improved);
    let mut at = |millis, x| {
        let now = MonoTime::from_millis(millis);
        decider.decide(&inputs(odometry(x, 101.5, 0.0, 3.0, now), &road, &route), now)
    };
    assert_eq!(at(50_000, 45.0).turn, TurnCommand::Right);
    let back = at(10_000, 45.1);
    assert_eq!(back.findings, [InputFinding::TimeWentBack(Duration::from_secs(40))]);
    assert_eq!(back.turn, TurnCommand::Right);
    assert!(at(10_100, 45.2).findings.is_empty());
    assert_eq!(at(90_000_000, 45.3).turn, TurnCommand::Right, "a jump ahead with a fresh pose is harmless");
}

#[test]
fn a_decision_has_its_reasons() {
    let (road, route) = (consecutive_turn(), route_of(1, &ROUTE));
    let manoeuvres = [Timed { at: START, value: change(Pose::new(58.0, 100.0, 0.0)) }];
    let whole = inputs(odometry(45.0, 101.55, 0.0, 3.0, START), &road, &route);
    let got = decider(Upstream).decide(&Inputs { manoeuvres: &manoeuvres, ..whole }, START);
    assert_eq!((got.turn, got.winner()), (TurnCommand::Right, Some(CandidateSource::Intersection)));
    assert!(got.case().is_some());
    let reasons: Vec<_> = reasons(&got).collect();
    let expected = [
        "intersection: won (RIGHT, ds -3.79 de ",
        "roundabout: no record",
        "manoeuvre: lost to intersection by ",
        "lane change: signalled",
    ];
    assert_eq!(reasons.len(), expected.len(), "{reasons:?}");
    for (reason, start) in reasons.iter().zip(expected) {
        assert!(reason.starts_with(start), "{reason}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any inputs at any time: no panic, and a side only with reasons.
    #[test]
    fn nothing_makes_it_panic_or_invent(
        steps in proptest::collection::vec(
            (any::<u32>(), any::<u32>(), any::<f64>(), any::<f64>(), any::<f64>(), -5.0..30.0_f64, any::<bool>()), 1..12,
        ),
        upstream in any::<bool>(),
    ) {
        let (road, route) = (consecutive_turn(), route_of(1, &ROUTE));
        let mut decider = decider(if upstream { Upstream } else { Improved });
        for (now, at, x, y, yaw, speed, wild) in steps {
            let now = MonoTime::from_millis(u64::from(now));
            let at = MonoTime::from_millis(u64::from(at));
            let (x, y, at) = if wild { (x, y, at) } else { (40.0 + speed, 101.5, now) };
            let got = decider.decide(&inputs(odometry(x, y, yaw, speed, at), &road, &route), now);
            if let Basis::Candidates(resolution) = &got.basis {
                prop_assert!(got.turn.side().is_none() || got.held.is_some() || resolution.winner.is_some());
            } else {
                prop_assert_eq!(got.turn, TurnCommand::NoCommand);
            }
        }
    }
}
