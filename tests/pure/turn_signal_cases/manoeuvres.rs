//! L1 to L3, P-2 to P-5 and combinations of manoeuvres with turns: whole drives with manoeuvres of the
//! planner.

use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::{LaneNetwork, TurnDirection};
use turn_signal::compat::DeciderCompat::{self, Improved, Upstream};
use turn_signal::decider::Observed;
use turn_signal::decision::Basis;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::manoeuvre::Manoeuvre;
use turn_signal::manoeuvre::avoidance::{Avoidance, AvoidanceLine};
use turn_signal::manoeuvre::lane_change::{LaneChange, LaneChangePhase};
use turn_signal::manoeuvre::pull_out::PullOut;
use turn_signal::manoeuvre::pull_over::{Decided, PullOver, Undecided};
use turn_signal::parameters::CandidatePolicy;
use turn_signal::resolve::{CandidateSource, Case};
use turn_signal::shift::ShiftedPath;
use turn_signal::side::Side;
use turn_signal::side::Side::{Left, Right};

use super::drive::{self, Drive, straight_lane, turn};
use super::line::{at, blinking, samples};
use super::shifts::{line_of, ramp};

fn lane_change(side: Side, start: Option<f64>, end: f64) -> Manoeuvre {
    Manoeuvre::LaneChange(drive::lane_change(side, start.map(at), Some(at(end))))
}

fn avoidance(side: Side, start: usize, end: usize, x: f64) -> Manoeuvre {
    Manoeuvre::Avoidance(avoiding(side, start, end, x))
}

fn avoiding(side: Side, start: usize, end: usize, x: f64) -> Avoidance {
    let after_m = if side == Left { 1.5 } else { -1.5 };
    let path = ramp(start, end, 0.0, after_m);
    let line = line_of(&path, start, end);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    Avoidance {
        lines: vec![AvoidanceLine { id: 7, line, start_shift_m: 0.0, end_shift_m: after_m }],
        path,
        ego_index: x.max(0.0) as usize,
        deviation_m: 0.0,
        current_shift_m: 0.0,
        lanes: vec![1],
        approved: true,
    }
}

fn with_right_turn(compat: DeciderCompat) -> Drive {
    let mut drive = Drive::new(compat).at_once();
    drive.observed.turns = vec![turn(5, TurnDirection::Right, 100.0, 116.0, 111.0)];
    drive
}

#[test]
fn l1_to_l3_upstream() {
    for (id, end, expected) in [
        ("L1", 60.0, "LEFT 0 to 60, RIGHT 61 to 116"),
        ("L2", 105.0, "LEFT 0 to 96, RIGHT 97 to 116"),
        ("L3", 120.0, "LEFT 0 to 36, RIGHT 37 to 111, LEFT 112 to 120"),
    ] {
        let mut drive = with_right_turn(Upstream);
        let signals = drive.through(samples(0.0, 140.0, 1.0), 10.0, |_| vec![lane_change(Left, None, end)]);
        assert_eq!(blinking(signals), expected, "{id}");
    }
    let mut drive = with_right_turn(Upstream);
    drive.step(96.0, 10.0, &[lane_change(Left, None, 105.0)]);
    let Basis::Candidates(resolution) = drive.step(97.0, 10.0, &[lane_change(Left, None, 105.0)]).basis
    else {
        panic!("no candidates")
    };
    assert_eq!(
        (resolution.case, resolution.winner.unwrap().source),
        (Some(Case::B2), CandidateSource::Intersection)
    );
}

#[test]
fn improved_a_lane_change_begins_where_the_steering_begins() {
    for (what, start, end, expected) in [
        // 30 m before steering, measured from the front, at the earliest.
        ("L1, steering at 40", 40.0, 60.0, "LEFT 7 to 60, RIGHT 61 to 116"),
        ("L1, far ahead", 80.0, 95.0, "RIGHT 37 to 46, LEFT 47 to 95, RIGHT 96 to 116"),
        // An ongoing lane change is not masked by a turn in range.
        ("L3, steering at 20", 20.0, 120.0, "LEFT 0 to 120"),
    ] {
        let mut drive = with_right_turn(Improved);
        let signals =
            drive.through(samples(0.0, 140.0, 1.0), 10.0, |_| vec![lane_change(Left, Some(start), end)]);
        assert_eq!(blinking(signals), expected, "{what}");
    }
    let mut drive = Drive::new(Improved).at_once();
    let change = [lane_change(Left, Some(60.0), 90.0)];
    let turns = [(20.0, 10.0), (30.0, 10.0), (40.0, 1.0), (50.0, 0.0)]
        .map(|(x, speed)| drive.step(x, speed, &change).turn);
    use TurnCommand::{Disable, Left as L};
    assert_eq!(turns, [Disable, L, L, L], "announced, it stays so while slowing down");
}

#[test]
fn a_lane_change_that_waits() {
    let waiting = |phase, end: Option<f64>| {
        Manoeuvre::LaneChange(LaneChange {
            phase,
            previous_path: (0..=150).map(|x| at(f64::from(x))).collect(),
            minimum_length_m: 30.0,
            ..drive::lane_change(Left, None, end.map(at))
        })
    };
    use LaneChangePhase::{Running, Unsignalled, Waiting};
    for (what, manoeuvres, blinks) in [
        ("with a path", vec![waiting(Waiting, Some(60.0))], "LEFT 0 to 60"),
        ("without one: up to the end of the path", vec![waiting(Waiting, None)], "LEFT 0 to 150"),
        ("running without one", vec![waiting(Running, None)], ""),
        ("of a special kind", vec![waiting(Unsignalled, Some(60.0))], ""),
        // 30 + 10 + 3.79 m before the end of the path, 3.79 m earlier for the front; later than the
        // other's end, so the other stays until it is gone.
        (
            "with another signal before",
            vec![lane_change(Right, None, 50.0), waiting(Waiting, Some(140.0))],
            "RIGHT 0 to 50",
        ),
        (
            "with another signal that lasts",
            vec![lane_change(Right, None, 110.0), waiting(Waiting, Some(140.0))],
            "LEFT 103 to 140",
        ),
    ] {
        let mut drive = Drive::new(Upstream);
        let signals = drive.through(samples(0.0, 160.0, 1.0), 10.0, |_| manoeuvres.clone());
        assert_eq!(blinking(signals), blinks, "{what}");
    }
}

#[test]
fn an_avoidance_before_and_behind_a_turn() {
    for compat in [Upstream, Improved] {
        let mut drive = Drive::new(compat).at_once();
        drive.observed.turns = vec![turn(5, TurnDirection::Left, 100.0, 116.0, 111.0)];
        let signals = drive.through(samples(0.0, 140.0, 1.0), 8.0, |x| vec![avoidance(Right, 50, 80, x)]);
        assert_eq!(blinking(signals), "RIGHT 23 to 80, LEFT 81 to 116", "before {compat:?}");

        let mut drive = Drive::new(compat).at_once();
        drive.observed.turns = vec![turn(5, TurnDirection::Left, 60.0, 76.0, 71.0)];
        let signals = drive.through(samples(0.0, 140.0, 1.0), 8.0, |x| vec![avoidance(Right, 90, 120, x)]);
        assert_eq!(blinking(signals), "LEFT 3 to 76, RIGHT 77 to 120", "behind {compat:?}");
    }
}

fn pull_out(forward: bool) -> Manoeuvre {
    let path = ramp(10, 40, 2.0, 0.0);
    Manoeuvre::PullOut(PullOut {
        start: path.poses()[10],
        end: path.poses()[40],
        path: Some(path),
        current_shift_m: 2.0,
        forward,
        standing_counts: false,
        before_start: false,
        lanes: vec![1],
    })
}

fn wide(compat: DeciderCompat) -> Drive {
    let mut lane = straight_lane(1, -60.0, 300.0);
    for point in &mut lane.right_bound {
        point.y_m = -5.0;
    }
    let mut drive = Drive::on(LaneNetwork::new([lane], Vec::new()), &[1], compat);
    drive.observed.turns = vec![turn(5, TurnDirection::Left, 60.0, 76.0, 71.0)];
    drive.at_once()
}

#[test]
fn p2_pulling_out_before_a_turn() {
    for compat in [Upstream, Improved] {
        let signals = wide(compat).through(samples(1.0, 90.0, 1.0), 4.0, |_| vec![pull_out(true)]);
        assert_eq!(blinking(signals), "RIGHT 1 to 40, LEFT 41 to 76", "P-2 {compat:?}");
    }
}

#[test]
fn p3_pulling_over_and_standing() {
    let pull_over = |current_shift_m: f64| {
        let path = ramp(60, 90, 0.0, 2.2);
        Manoeuvre::PullOver(PullOver::Decided(Decided {
            start: path.poses()[60],
            goal: path.poses()[90],
            path: Some(path),
            current_shift_m,
            near_first_end: false,
            lanes: vec![1],
        }))
    };
    for compat in [Upstream, Improved] {
        for (what, x, speed, lateral, on) in [
            ("too early", 41.1, 5.0, 0.0, false),
            ("in range", 41.3, 5.0, 0.0, true),
            ("front past the start", 56.3, 5.0, 0.0, true),
            ("nearly there", 88.0, 5.0, 2.09, true),
            ("there", 89.0, 5.0, 2.11, false),
            ("standing", 88.0, 0.0, 2.0, true),
        ] {
            let turn = Drive::new(compat).step(x, speed, &[pull_over(lateral)]).turn;
            assert_eq!(turn == TurnCommand::Left, on, "P-3 {what} {compat:?}: {turn}");
        }
        let mut drive = Drive::new(compat).at_once();
        assert_eq!(drive.step(88.0, 5.0, &[pull_over(2.2)]).turn, TurnCommand::Disable);
        let again = drive.step(88.0, 5.0, &[pull_over(0.0)]).turn;
        let expected = if compat == Upstream { TurnCommand::Disable } else { TurnCommand::Left };
        assert_eq!(again, expected, "upstream ignores it in this lanelet");
        let done = drive.step(89.0, 5.0, &[pull_over(2.2)]).turn;
        assert_eq!(done, expected, "W18: once signalled, until it is complete");
    }
}

#[test]
fn p4_backing_out_is_hazard_lights_on_any_map() {
    for compat in [Upstream, Improved] {
        let mut drive = wide(compat);
        let decision = drive.step(55.0, -1.0, &[pull_out(false)]);
        assert_eq!(
            (decision.turn, decision.hazard),
            (TurnCommand::Disable, HazardCommand::Enable),
            "P-4 {compat:?}"
        );
        let next = drive.step(56.0, 1.0, &[]);
        assert_eq!(drive.announced_m(&next, 56.0), Some(56.0), "memories stand still meanwhile");
    }
}

#[test]
fn p5_the_signal_before_a_pull_over_is_decided() {
    let undecided = || {
        Manoeuvre::PullOver(PullOver::Undecided(Undecided {
            stop_path: (0..=85).map(|x| at(f64::from(x))).collect(),
            deceleration: Some(at(40.0)),
            stop: Some(at(70.0)),
        }))
    };
    for (compat, parking, side) in [(Upstream, Left, Left), (Improved, Left, Left), (Upstream, Right, Right)]
    {
        let mut drive = Drive::new(compat).at_once();
        drive.parameters.parking_side = parking;
        let signals = drive.through(samples(0.0, 100.0, 1.0), 5.0, |_| vec![undecided()]);
        assert_eq!(blinking(signals), format!("{side} 40 to 85"), "P-5 {compat:?}");
    }
    let mut drive = Drive::new(Upstream);
    let decision = drive.step(50.0, 5.0, &[undecided()]);
    let Basis::Candidates(resolution) = decision.basis else { panic!("no candidates") };
    let distances = resolution.winner.unwrap().distances;
    // D[40,85] R[70,85]
    let expected = [40.0 - 53.79, 85.0 - 50.0, 70.0 - 53.79, 85.0 - 50.0];
    let got = [
        distances.desired_start_m,
        distances.desired_end_m,
        distances.required_start_m,
        distances.required_end_m,
    ];
    assert!(got.iter().zip(expected).all(|(got, expected)| (got - expected).abs() < 1e-9), "{got:?}");
}

#[test]
fn an_empty_record_erases_a_signal_upstream_and_not_by_default() {
    for (compat, late, side_shift, hazard) in [
        (Upstream, TurnCommand::Disable, TurnCommand::Disable, HazardCommand::Disable),
        (Improved, TurnCommand::Left, TurnCommand::Left, HazardCommand::Enable),
    ] {
        let change = || lane_change(Left, None, 120.0);
        let mut drive = Drive::new(compat).at_once();
        // The avoidance is 50 m ahead: its record has no command.
        let got = drive.step(10.0, 4.0, &[change(), avoidance(Right, 60, 90, 10.0)]);
        assert_eq!(got.turn, late, "W5 {compat:?}");
        let got = Drive::new(compat).at_once().step(10.0, 4.0, &[change(), Manoeuvre::SideShift]);
        assert_eq!(got.turn, side_shift, "W5, side shift {compat:?}");
        let got = Drive::new(compat).step(10.0, -1.0, &[pull_out(false), change()]);
        assert_eq!(got.hazard, hazard, "W5, hazard {compat:?}");
    }
}

#[test]
fn avoiding_out_and_back() {
    let both = |x: f64| {
        let offset = |x: f64| ((x - 50.0) / 20.0).clamp(0.0, 1.5) - ((x - 100.0) / 20.0).clamp(0.0, 1.5);
        let poses: Vec<Pose> = (0..=200).map(f64::from).map(|x| Pose::new(x, offset(x), 0.0)).collect();
        let offsets = poses.iter().map(|pose| pose.position.y_m).collect();
        let path = ShiftedPath::new(poses, offsets).unwrap();
        let line = |id, start, end, start_shift_m, end_shift_m| AvoidanceLine {
            id,
            line: line_of(&path, start, end),
            start_shift_m,
            end_shift_m,
        };
        let lines = vec![line(1, 50, 80, 0.0, 1.5), line(2, 100, 130, 1.5, 0.0)];
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        Avoidance {
            path,
            lines,
            ego_index: x as usize,
            deviation_m: 0.0,
            current_shift_m: offset(x),
            lanes: vec![1],
            approved: true,
        }
    };
    let turn_at = |x: f64, change: fn(&mut Avoidance)| {
        let mut avoidance = both(x);
        change(&mut avoidance);
        let ego = Pose::new(x, avoidance.current_shift_m, 0.0);
        let mut drive = Drive::new(Upstream);
        let context = drive.context(ego, 8.0);
        let mut decider = drive.decider.clone();
        let decision =
            decider.decide_on(&context, &[Manoeuvre::Avoidance(avoidance)], |_| Observed::default());
        drive.decider = decider;
        decision.turn
    };
    assert_eq!(turn_at(60.0, |_| {}), TurnCommand::Left, "out");
    assert_eq!(turn_at(75.0, |_| {}), TurnCommand::Left, "the shift back is 25 m off, more than 3 s");
    assert_eq!(turn_at(77.0, |_| {}), TurnCommand::Right, "it is 23 m off");
    assert_eq!(turn_at(120.0, |_| {}), TurnCommand::Right, "back");
    assert_eq!(turn_at(129.0, |_| {}), TurnCommand::Disable, "0.05 m are left of it");
    assert_eq!(turn_at(131.0, |_| {}), TurnCommand::Disable, "past both");
    assert_eq!(turn_at(60.0, |a| a.deviation_m = 1.01), TurnCommand::Disable, "beside its path");
    assert_eq!(turn_at(60.0, |a| a.deviation_m = -1.0), TurnCommand::Left);
    assert_eq!(turn_at(60.0, |a| a.approved = false), TurnCommand::Disable, "waiting for approval");
}

#[test]
fn candidates_are_signalled_by_policy() {
    let waiting = |x| Manoeuvre::Avoidance(Avoidance { approved: false, ..avoiding(Right, 50, 80, x) });
    use CandidatePolicy::{AllCandidate, None, StopOnApproval, StoppedCandidate};
    for (policy, speed, on) in [
        (None, 8.0, false),
        (StoppedCandidate, 8.0, false),
        (StoppedCandidate, 0.0, true),
        (AllCandidate, 8.0, true),
        (StopOnApproval, 0.0, false),
    ] {
        let mut drive = Drive::new(Upstream);
        drive.parameters.avoidance_candidate = policy;
        let got = drive.step(42.0, speed, &[waiting(42.0)]).turn;
        assert_eq!(got == TurnCommand::Right, on, "{policy:?} at {speed} m/s");
    }
}

#[test]
fn an_ignored_shift_stays_so_until_the_module_is_gone() {
    let mut drive = Drive::new(Upstream);
    let small = |x| {
        let done = Avoidance { current_shift_m: -1.45, ..avoiding(Right, 50, 80, x) };
        Manoeuvre::Avoidance(done)
    };
    let turns = [
        drive.step(48.0, 8.0, &[small(48.0)]).turn,
        drive.step(49.0, 8.0, &[avoidance(Right, 50, 80, 49.0)]).turn,
        drive.step(50.0, 8.0, &[]).turn,
        drive.step(51.0, 8.0, &[avoidance(Right, 50, 80, 51.0)]).turn,
    ];
    assert_eq!(turns, [TurnCommand::Disable, TurnCommand::Disable, TurnCommand::Disable, TurnCommand::Right]);
}
