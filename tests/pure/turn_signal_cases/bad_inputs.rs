//! Bad inputs of any kind: a clear finding, no panic, no invented signal, and the next good inputs count
//! again.

use std::sync::Arc;

use gateway_base::diagnostics::Level;
use gateway_base::time::WallStamp;
use lanelet2_map::geometry::Pose;
use proptest::prelude::*;
use turn_signal::light_command::{EnumOrUnknown, TurnCommand};
use turn_signal::planner_input::{
    ControlPoint, FactorTopic, Odometry, OperationMode, PlannedPathPoint, PlannerInput, PlannerRoute,
    PlanningFactor,
};

use super::bench::{announcing, decider, factor, path, route};
use super::drive::segments;

const NAN: f64 = f64::NAN;

/// The fault that occurs while the vehicle stands before its turn.
enum Bad {
    /// This input comes once, between good ones.
    PlannerInput(PlannerInput),
    /// The odometry is this one.
    Odometry(Odometry),
    /// No odometry is received for this time, ms.
    Silence(u64),
    /// The same measurement is received repeatedly for this time, ms.
    Frozen(u64),
    /// The clock jumps ahead by this time, ms.
    Jump(u64),
    /// The stamps of the odometry go back.
    StampsBack,
}

fn at(x: f64, y: f64, yaw: f64, speed_mps: f64) -> Bad {
    Bad::Odometry(Odometry { pose: Pose::new(x, y, yaw), speed_mps })
}

fn input(input: PlannerInput) -> Bad {
    Bad::PlannerInput(input)
}

fn factors(topic: FactorTopic, behavior: u16, points: &[(f64, f64)]) -> Bad {
    input(PlannerInput::Factors { topic, factors: Arc::new([factor(behavior, true, points)]) })
}

fn planned(points: Vec<PlannedPathPoint>) -> Bad {
    input(PlannerInput::PlannedPath(points.into()))
}

fn route_from(start: Pose) -> Bad {
    let route = PlannerRoute { id: 2, start, goal: Pose::default(), segments: segments(&[1]) };
    input(PlannerInput::Route(Arc::new(route)))
}

fn spoilt_path() -> Vec<PlannedPathPoint> {
    let mut points = path(30.0, 50);
    points[20].pose.position.y_m = NAN;
    points
}

#[test]
fn every_bad_input_has_a_finding_and_invents_no_signal() {
    use FactorTopic::{LaneChangeLeft, StaticObstacleAvoidance};
    use Level::{Error, Ok, Warn};
    use TurnCommand::{Disable, Left, NoCommand};
    let mode = OperationMode { mode: 77, is_autoware_control_enabled: false, is_in_transition: true };
    #[rustfmt::skip]
    let cases = [
        ("empty route", input(route(2, &[])), NoCommand, Error, "the route has no lanelet"),
        ("lanelet twice", input(route(2, &[1, 2, 1])), NoCommand, Error, "lists lanelet 1 twice"),
        ("unknown lanelet", input(route(2, &[1, 2, 99])), NoCommand, Error, "lanelet 99 of the route is not"),
        ("same id, unknown lanelet", input(route(1, &[1, 98])), NoCommand, Error, "lanelet 98 of the route"),
        ("route from nowhere", route_from(Pose::new(NAN, 0.0, 0.0)), NoCommand, Error,
            "the start of the route is not a number"),
        ("x is not a number", at(NAN, 0.0, 0.0, 5.0), NoCommand, Error, "odometry is not a number"),
        ("yaw is not a number", at(36.0, 0.0, NAN, 5.0), NoCommand, Error, "odometry is not a number"),
        ("speed is not a number", at(36.0, 0.0, 0.0, f64::INFINITY), NoCommand, Error,
            "odometry is not a number"),
        ("beyond the world", at(1e300, -1e300, 0.0, 5.0), Disable, Ok, "none"),
        ("silent odometry", Bad::Silence(700), NoCommand, Error, "odometry is 700 ms old"),
        ("frozen odometry", Bad::Frozen(700), NoCommand, Error, "odometry is 6"),
        ("an hour is gone", Bad::Jump(3_600_000), NoCommand, Error, "odometry is 36"),
        ("stamps go back", Bad::StampsBack, Left, Ok, "none"),
        ("no lanes driven", input(PlannerInput::LaneDriving(false)), NoCommand, Ok, "not lane driving"),
        ("empty path", planned(Vec::new()), NoCommand, Warn, "the planned path is empty"),
        ("path of one point", planned(vec![path(30.0, 1)[0].clone(); 9]), Left, Ok, "none"),
        ("path with a hole", planned(spoilt_path()), Left, Warn, "point of the planned path is not a number"),
        ("factor at no pose", factors(LaneChangeLeft, 5, &[(NAN, 0.0), (99.0, 0.0)]), Left, Warn,
            "lane_change_left"),
        ("factor without end", factors(LaneChangeLeft, 5, &[(40.0, 0.0)]), Left, Warn, "no start and end"),
        ("avoidance without path", factors(StaticObstacleAvoidance, 5, &[(40.0, 0.0), (50.0, -1.5)]), Left,
            Warn, "avoidance without a planned path"),
        ("unknown mode", input(PlannerInput::OperationMode(mode)), Left, Ok, "none"),
        ("own command", input(PlannerInput::OwnTurnCommand(EnumOrUnknown::Unknown(200))), Left, Ok, "none"),
    ];
    for (name, bad, turn, level, finding) in cases {
        let mut bench = announcing();
        let before = bench.now.wall;
        match bad {
            Bad::PlannerInput(input) => {
                bench.handle(input);
                bench.stay(36.0, 5.0, 200);
            }
            Bad::Odometry(odometry) => {
                // A stamp of its own for every measurement.
                for _ in 0..3 {
                    bench.handle(PlannerInput::Odometry { odometry, stamp: bench.now.wall });
                    bench.pass_without_end(100);
                }
            }
            Bad::Silence(ms) => bench.pass_without_end(ms),
            Bad::Frozen(ms) => {
                let odometry = Odometry { pose: Pose::new(36.0, 0.0, 0.0), speed_mps: 5.0 };
                for _ in 0..ms / 50 {
                    bench.handle(PlannerInput::Odometry { odometry, stamp: before });
                    bench.pass_without_end(50);
                }
            }
            Bad::Jump(ms) => bench.jump(ms),
            Bad::StampsBack => {
                let odometry = Odometry { pose: Pose::new(36.0, 0.0, 0.0), speed_mps: 5.0 };
                for step in 0..10_i64 {
                    let stamp = WallStamp::from_nanos(before.as_nanos() - step * 1_000_000);
                    bench.handle(PlannerInput::Odometry { odometry, stamp });
                    bench.pass_without_end(100);
                }
            }
        }
        let status = bench.status("turn_signal_decider");
        assert_eq!((bench.turn(), status.level), (Some(turn), level), "{name}: {status:?}");
        assert!(bench.decider_value("findings").contains(finding), "{name}: {status:?}");
        // All inputs are good again.
        bench.handle(route(3, &[1, 2, 3]));
        bench.handle(PlannerInput::LaneDriving(true));
        bench.handle(PlannerInput::PlannedPath(path(30.0, 100).into()));
        for topic in FactorTopic::ALL {
            bench.handle(PlannerInput::Factors { topic, factors: Arc::new([]) });
        }
        bench.stay(36.0, 5.0, 900);
        let status = bench.status("turn_signal_decider");
        assert_eq!((bench.turn(), status.level), (Some(Left), Ok), "{name}: {status:?}");
    }
}

#[test]
fn a_scenario_no_longer_received_ends_the_signal() {
    let mut bench = announcing();
    bench.handle(PlannerInput::LaneDriving(true));
    bench.stay(36.0, 5.0, 1_000);
    assert_eq!(bench.turn(), Some(TurnCommand::Left));
    bench.stay(36.0, 5.0, 300);
    let status = bench.status("turn_signal_decider");
    assert_eq!((bench.turn(), status.level), (Some(TurnCommand::NoCommand), Level::Error));
    assert_eq!(status.message, "NO_COMMAND: the scenario is too old");
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![8 => -20.0..250.0, 1 => any::<f64>(), 1 => Just(NAN), 1 => Just(f64::INFINITY), 1 => Just(0.0)]
}

fn any_pose() -> impl Strategy<Value = Pose> {
    let yaw = prop_oneof![4 => Just(0.0), 1 => any_number()];
    let y = prop_oneof![4 => -6.0..6.0, 1 => any_number()];
    (any_number(), y, yaw).prop_map(|(x, y, yaw)| Pose::new(x, y, yaw))
}

fn any_input() -> impl Strategy<Value = PlannerInput> {
    let lane = prop_oneof![9 => prop::sample::select(vec![1_i64, 2, 3, 11, 12, 13]), 1 => any::<i64>()];
    let lanes = prop::collection::vec(lane, 0..4);
    let odometry = (any_pose(), any_number(), any::<i64>()).prop_map(|(pose, speed_mps, stamp)| {
        PlannerInput::Odometry { odometry: Odometry { pose, speed_mps }, stamp: WallStamp::from_nanos(stamp) }
    });
    let routes = prop_oneof![
        3 => any::<u128>().prop_map(|id| route(id, &[1, 2, 3])),
        1 => (any::<u128>(), lanes.clone()).prop_map(|(id, lanes)| route(id, &lanes)),
    ];
    let point = (any_pose(), any_number(), lanes).prop_map(|(pose, speed_mps, lanes)| PlannedPathPoint {
        pose,
        speed_mps,
        lanes,
    });
    let paths = prop_oneof![
        prop::collection::vec(point, 0..8).prop_map(|points| PlannerInput::PlannedPath(points.into())),
        (0.0..50.0, 0..120_u32).prop_map(|(x, points)| PlannerInput::PlannedPath(path(x, points).into())),
    ];
    let control = (any_pose(), any_number()).prop_map(|(pose, shift_length_m)| ControlPoint {
        pose,
        distance_m: 0.0,
        speed_mps: 0.0,
        shift_length_m,
    });
    let factor = (0..9_u16, any::<bool>(), prop::collection::vec(control, 0..4)).prop_map(
        |(behavior, is_driving_forward, control_points)| PlanningFactor {
            behavior,
            is_driving_forward,
            detail: "".into(),
            control_points,
        },
    );
    let factors = (prop::sample::select(FactorTopic::ALL.to_vec()), prop::collection::vec(factor, 0..3))
        .prop_map(|(topic, factors)| PlannerInput::Factors { topic, factors: factors.into() });
    prop_oneof![
        4 => odometry,
        2 => routes,
        2 => paths,
        3 => factors,
        1 => any::<bool>().prop_map(PlannerInput::LaneDriving),
        1 => any::<u8>().prop_map(|number| PlannerInput::OwnTurnCommand(number.into())),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// A side is only ever commanded with an odometry of numbers and a route of this map.
    #[test]
    fn no_input_makes_a_side_without_odometry_and_route(
        steps in prop::collection::vec((any_input(), 0..300_u64), 1..40),
        upstream in any::<bool>(),
    ) {
        let compat = if upstream { "compat = \"upstream\"" } else { "" };
        let mut bench = decider(&format!("enabled = true\n{compat}"));
        let (mut has_odometry, mut has_route) = (false, false);
        for (input, ms) in steps {
            if let PlannerInput::Odometry { odometry, .. } = &input {
                has_odometry = odometry.pose.is_finite() && odometry.speed_mps.is_finite();
            }
            if let PlannerInput::Route(route) = &input {
                let lanes: Vec<i64> = route.segments.iter().map(|segment| segment.preferred).collect();
                let mut once = lanes.clone();
                once.sort_unstable();
                once.dedup();
                let known = lanes.iter().all(|lane| [1, 2, 3, 11, 12, 13].contains(lane));
                has_route = !lanes.is_empty() && once.len() == lanes.len() && known;
            }
            bench.handle(input);
            let before = bench.turn_commands().len();
            bench.pass_without_end(ms);
            let sides = bench.turn_commands()[before..].iter().any(|(_, turn)| turn.side().is_some());
            prop_assert!(!sides || has_odometry && has_route, "{:?}", bench.status("turn_signal_decider"));
        }
    }
}
