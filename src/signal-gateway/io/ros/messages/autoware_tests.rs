//! Tests the bytes of messages from and to Autoware, the resulting inputs, and refused bytes.

use std::sync::Arc;

use proptest::prelude::*;

use super::ToRos as _;
use super::geometry::plane_pose;
use super::golden::{STAMP, Wire, cdr, with_stamp};
use crate::io::ros::reading;
use crate::io::ros::topics::SubscriptionKind as Kind;
use gateway_core::command::input::CommandInput;
use gateway_core::command::origin::{CommandOrigin, SampleId, WriterId};
use gateway_core::gateway::event::Input;
use lanelet2_map::geometry as plane;
use ros_messages::autoware_adapi_v1_msgs::OperationModeState;
use ros_messages::autoware_internal_planning_msgs::{
    ControlPoint, PathPointWithLaneId, PathWithLaneId, PlanningFactor, PlanningFactorArray, SafetyFactor,
    SafetyFactorArray, Scenario,
};
use ros_messages::autoware_perception_msgs::PredictedPath;
use ros_messages::autoware_planning_msgs::{
    LaneletPrimitive, LaneletRoute, LaneletSegment, PathPoint, PoseWithUuidStamped, Trajectory,
    TrajectoryPoint,
};
use ros_messages::autoware_vehicle_msgs::ControlModeReport;
use ros_messages::builtin_interfaces::Duration;
use ros_messages::cdr::{Endian, Unreadable};
use ros_messages::geometry_msgs::{
    Pose, PoseWithCovariance, Quaternion, Twist, TwistWithCovariance, Vector3,
};
use ros_messages::nav_msgs::Odometry;
use ros_messages::std_msgs::Header;
use ros_messages::unique_identifier_msgs::UUID;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::planner_input::{self, FactorTopic, OperationMode, PlannerInput, PlannerRoute};
use turn_signal::route::Segment;

const SAMPLE: SampleId = SampleId { writer: WriterId([7; 16]), sequence: 5 };

fn read(kind: Kind, bytes: &[u8], endian: Endian) -> Result<Input, Unreadable> {
    reading::read(kind, SAMPLE, bytes, endian)
}

fn header() -> Header {
    Header { stamp: STAMP.into(), frame_id: "map".to_owned() }
}

fn turned(z: f64, w: f64) -> Quaternion {
    Quaternion { x: 0.0, y: 0.0, z, w }
}

/// Pose at (1, 2, 3), turned by half a revolution.
fn pose() -> Pose {
    Pose { position: [1.0, 2.0, 3.0].into(), orientation: turned(1.0, 0.0) }
}

const POSE: [f64; 7] = [1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 0.0];
const PLANE_POSE: plane::Pose = plane::Pose::new(1.0, 2.0, std::f64::consts::PI);

fn input(kind: Kind, bytes: &[u8]) -> PlannerInput {
    match read(kind, bytes, Endian::Little) {
        Ok(Input::Planner(input)) => input,
        other => panic!("{kind:?}: {other:?}"),
    }
}

fn counting(to: u8) -> Vec<f64> {
    (0..to).map(f64::from).collect()
}

fn odometry() -> Vec<u8> {
    let pose = Wire::with_header().text("base_link").doubles(&POSE).doubles(&counting(36));
    pose.doubles(&[-4.5, 0.1, 0.2, 0.3, 0.4, 0.5]).doubles(&counting(36)).done()
}

fn route() -> Vec<u8> {
    let wire = Wire::with_header().doubles(&POSE).doubles(&[7.0, 8.0, 0.0, 0.0, 0.0, 0.0, 2.0]);
    let wire = wire.count(2).id(10).text("lane").count(2).id(10).text("lane").id(-11).text("area");
    let wire = wire.id(12).text("").count(0);
    wire.bytes(&[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]).bytes(&[1]).done()
}

fn path() -> Vec<u8> {
    let wire = Wire::with_header().count(2);
    let wire = wire.doubles(&POSE).singles(&[4.5, 0.25, -0.5]).bytes(&[1]).count(2).id(100).id(-7);
    let wire = wire.doubles(&[9.0; 7]).singles(&[0.0; 3]).bytes(&[0]).count(0);
    wire.count(1).doubles(&[1.0, 2.0, 3.0]).count(2).doubles(&counting(6)).done()
}

fn trajectory() -> Vec<u8> {
    let wire = Wire::with_header().count(2);
    let wire = wire.count(1).count(500).doubles(&POSE).singles(&[4.5, 0.25, 0.5, -0.5, 0.125, 0.0]);
    wire.count(2).count(0).doubles(&[9.0; 7]).singles(&[0.0; 6]).done()
}

fn safety(wire: Wire) -> Wire {
    let wire = wire.stamp().text("map").count(1);
    let wire = wire.short(2).bytes(&[9; 16]).count(1).doubles(&POSE).count(0).count(500_000_000);
    let wire = wire.singles(&[0.5, 1.5, 2.5]).count(1).doubles(&[4.0, 5.0, 6.0]).bytes(&[1]);
    wire.bytes(&[0]).text("near")
}

fn factors() -> Vec<u8> {
    let wire = Wire::with_header().count(1).text("avoidance").bytes(&[1]).count(2);
    let wire = wire.doubles(&POSE).singles(&[4.0, -0.5, 12.0]).doubles(&POSE).singles(&[3.0, 1.5, 40.0]);
    safety(wire.short(4).text("left shift")).done()
}

#[test]
fn odometry_has_its_bytes_and_becomes_pose_and_speed() {
    let rows =
        |row: u8| std::array::from_fn(|column| f64::from(row * 6) + [0.0, 1.0, 2.0, 3.0, 4.0, 5.0][column]);
    let covariance = [rows(0), rows(1), rows(2), rows(3), rows(4), rows(5)];
    let linear = Vector3 { x: -4.5, y: 0.1, z: 0.2 };
    let message = Odometry {
        header: header(),
        child_frame_id: "base_link".to_owned(),
        pose: PoseWithCovariance { pose: pose(), covariance },
        twist: TwistWithCovariance {
            twist: Twist { linear, angular: Vector3 { x: 0.3, y: 0.4, z: 0.5 } },
            covariance,
        },
    };
    assert_eq!(cdr(&message), odometry());
    let expected_odometry = planner_input::Odometry { pose: PLANE_POSE, speed_mps: -4.5 };
    assert_eq!(
        input(Kind::Odometry, &odometry()),
        PlannerInput::Odometry { odometry: expected_odometry, stamp: STAMP }
    );
}

#[test]
fn a_route_has_its_bytes_and_becomes_its_lanes() {
    let primitive = |id, kind: &str| LaneletPrimitive { id, primitive_type: kind.to_owned() };
    let message = LaneletRoute {
        header: header(),
        start_pose: pose(),
        goal_pose: Pose { position: [7.0, 8.0, 0.0].into(), orientation: turned(0.0, 2.0) },
        segments: vec![
            LaneletSegment {
                preferred_primitive: primitive(10, "lane"),
                primitives: vec![primitive(10, "lane"), primitive(-11, "area")],
            },
            LaneletSegment { preferred_primitive: primitive(12, ""), primitives: vec![] },
        ],
        uuid: UUID { uuid: [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16] },
        allow_modification: true,
    };
    assert_eq!(cdr(&message), route());
    let segment = |lane| Segment { preferred: lane, lanes: vec![lane] };
    let expected = PlannerRoute {
        id: 0x0102_0304_0506_0708_090A_0B0C_0D0E_0F10,
        start: PLANE_POSE,
        goal: plane::Pose::new(7.0, 8.0, 0.0),
        segments: vec![segment(10), segment(12)],
    };
    assert_eq!(input(Kind::Route, &route()), PlannerInput::Route(Arc::new(expected)));
    // Layout without uuids, from older releases.
    let old = &route()[..route().len() - 17];
    assert!(matches!(read(Kind::Route, old, Endian::Little), Err(Unreadable::Layout(_))));
}

#[test]
fn a_path_has_its_bytes_and_becomes_its_points() {
    let far = Pose { position: [9.0; 3].into(), orientation: Quaternion { x: 9.0, y: 9.0, z: 9.0, w: 9.0 } };
    let point = PathPoint {
        pose: pose(),
        longitudinal_velocity_mps: 4.5,
        lateral_velocity_mps: 0.25,
        heading_rate_rps: -0.5,
        is_final: true,
    };
    let message = PathWithLaneId {
        header: header(),
        points: vec![
            PathPointWithLaneId { point, lane_ids: vec![100, -7] },
            PathPointWithLaneId { point: PathPoint { pose: far, ..PathPoint::default() }, lane_ids: vec![] },
        ],
        left_bound: vec![[1.0, 2.0, 3.0].into()],
        right_bound: vec![[0.0, 1.0, 2.0].into(), [3.0, 4.0, 5.0].into()],
    };
    assert_eq!(cdr(&message), path());
    let expected = [
        planner_input::PlannedPathPoint { pose: PLANE_POSE, speed_mps: 4.5, lanes: vec![100, -7] },
        planner_input::PlannedPathPoint { pose: plane_pose(far), speed_mps: 0.0, lanes: vec![] },
    ];
    assert_eq!(input(Kind::PlannedPath, &path()), PlannerInput::PlannedPath(expected.into()));
}

#[test]
fn a_trajectory_has_its_bytes_and_becomes_poses_and_speeds() {
    let far = Pose { position: [9.0; 3].into(), orientation: Quaternion { x: 9.0, y: 9.0, z: 9.0, w: 9.0 } };
    let near = TrajectoryPoint {
        time_from_start: Duration { sec: 1, nanosec: 500 },
        pose: pose(),
        longitudinal_velocity_mps: 4.5,
        lateral_velocity_mps: 0.25,
        acceleration_mps2: 0.5,
        heading_rate_rps: -0.5,
        front_wheel_angle_rad: 0.125,
        rear_wheel_angle_rad: 0.0,
    };
    let time_from_start = Duration { sec: 2, nanosec: 0 };
    let last = TrajectoryPoint { time_from_start, pose: far, ..TrajectoryPoint::default() };
    assert_eq!(cdr(&Trajectory { header: header(), points: vec![near, last] }), trajectory());
    let expected = [
        planner_input::TrajectoryPoint { pose: PLANE_POSE, speed_mps: 4.5 },
        planner_input::TrajectoryPoint { pose: plane_pose(far), speed_mps: 0.0 },
    ];
    assert_eq!(input(Kind::Trajectory, &trajectory()), PlannerInput::Trajectory(expected.into()));
}

#[test]
fn a_modified_goal_is_read_with_and_without_its_flag() {
    let uuid = UUID { uuid: [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16] };
    let message = PoseWithUuidStamped { header: header(), pose: pose(), uuid };
    let wire = || Wire::with_header().doubles(&POSE).bytes(&uuid.uuid);
    assert_eq!(cdr(&message), wire().done());
    let route = 0x0102_0304_0506_0708_090A_0B0C_0D0E_0F10;
    let expected = PlannerInput::ModifiedGoal { route, goal: PLANE_POSE };
    assert_eq!(input(Kind::ModifiedGoal, &wire().done()), expected);
    assert_eq!(input(Kind::ModifiedGoal, &wire().bytes(&[1]).done()), expected);
    let longer = wire().bytes(&[1]).doubles(&[0.0]).done();
    assert!(read(Kind::ModifiedGoal, &longer, Endian::Little).is_err());
}

#[test]
fn planning_factors_have_their_bytes_and_become_an_input() {
    let control =
        |velocity, shift_length, distance| ControlPoint { pose: pose(), velocity, shift_length, distance };
    let safety_factor = SafetyFactor {
        r#type: 2,
        object_id: UUID { uuid: [9; 16] },
        predicted_path: PredictedPath {
            path: vec![pose()],
            time_step: Duration { sec: 0, nanosec: 500_000_000 },
            confidence: 0.5,
        },
        ttc_begin: 1.5,
        ttc_end: 2.5,
        points: vec![[4.0, 5.0, 6.0].into()],
        is_safe: true,
    };
    let message = PlanningFactorArray {
        header: header(),
        factors: vec![PlanningFactor {
            module: "avoidance".to_owned(),
            is_driving_forward: true,
            control_points: vec![control(4.0, -0.5, 12.0), control(3.0, 1.5, 40.0)],
            behavior: 4,
            detail: "left shift".to_owned(),
            safety_factors: SafetyFactorArray {
                header: header(),
                factors: vec![safety_factor],
                is_safe: false,
                detail: "near".to_owned(),
            },
        }],
    };
    assert_eq!(cdr(&message), factors());
    let control = |speed_mps, shift_length_m, distance_m| planner_input::ControlPoint {
        pose: PLANE_POSE,
        distance_m,
        speed_mps,
        shift_length_m,
    };
    let factor = planner_input::PlanningFactor {
        behavior: 4,
        is_driving_forward: true,
        detail: "left shift".into(),
        control_points: vec![control(4.0, -0.5, 12.0), control(3.0, 1.5, 40.0)],
    };
    for topic in FactorTopic::ALL {
        let expected = PlannerInput::Factors { topic, factors: [factor.clone()].into() };
        assert_eq!(input(Kind::Factors(topic), &factors()), expected);
    }
}

/// Layouts of other releases and forks are refused, not misinterpreted.
#[test]
fn planning_factors_of_other_layouts_are_refused() {
    let begin = || Wire::with_header().count(1);
    let points = |wire: Wire| wire.count(1).doubles(&POSE).singles(&[4.0, -0.5, 12.0]);
    let layouts = [
        ("with a version in front", {
            let wire = points(begin().text("0.1").text("avoidance").bytes(&[1]));
            safety(wire.short(4).text("left shift")).done()
        }),
        ("without safety factors", {
            points(begin().text("avoidance").bytes(&[1])).short(4).text("left shift").done()
        }),
        ("control points without the shift", {
            let wire = begin().text("avoidance").bytes(&[1]).count(1).doubles(&POSE).singles(&[4.0, 12.0]);
            safety(wire.short(4).text("left shift")).done()
        }),
        ("one field more", {
            let wire = points(begin().text("avoidance").bytes(&[1]));
            safety(wire.short(4).text("left shift")).doubles(&[1.0]).done()
        }),
    ];
    for (name, bytes) in layouts {
        let result = read(Kind::Factors(FactorTopic::GoalPlanner), &bytes, Endian::Little);
        assert!(result.is_err(), "{name}: {result:?}");
    }
}

#[test]
fn the_operation_mode_has_its_bytes() {
    let message = OperationModeState {
        stamp: STAMP.into(),
        mode: 2,
        is_autoware_control_enabled: true,
        is_in_transition: false,
        is_stop_mode_available: true,
        is_autonomous_mode_available: true,
        is_local_mode_available: false,
        is_remote_mode_available: false,
    };
    let bytes = with_stamp(&[2, 1, 0, 1, 1, 0, 0]);
    assert_eq!(cdr(&message), bytes);
    let mode = OperationMode { mode: 2, is_autoware_control_enabled: true, is_in_transition: false };
    assert_eq!(input(Kind::OperationMode, &bytes), PlannerInput::OperationMode(mode));
    let other_flag = with_stamp(&[2, 0, 1, 0, 0, 1, 1]);
    let mode = OperationMode { mode: 2, is_autoware_control_enabled: false, is_in_transition: true };
    assert_eq!(input(Kind::OperationMode, &other_flag), PlannerInput::OperationMode(mode));
}

#[test]
fn the_scenario_has_its_bytes_and_only_lane_driving_is_lane_driving() {
    for (name, drives_lanes) in [("LaneDriving", true), ("Parking", false), ("Empty", false), ("", false)] {
        let bytes = Wire::default().text(name).count(2).text("LaneDriving").text("Parking").done();
        let activating_scenarios = vec!["LaneDriving".to_owned(), "Parking".to_owned()];
        assert_eq!(cdr(&Scenario { current_scenario: name.to_owned(), activating_scenarios }), bytes);
        assert_eq!(input(Kind::Scenario, &bytes), PlannerInput::LaneDriving(drives_lanes), "{name}");
    }
}

#[test]
fn every_command_has_its_bytes() {
    let turns = [
        (TurnCommand::NoCommand, 0),
        (TurnCommand::Disable, 1),
        (TurnCommand::Left, 2),
        (TurnCommand::Right, 3),
    ];
    for (command, byte) in turns {
        assert_eq!(cdr(&command.to_ros(STAMP)), with_stamp(&[byte]));
    }
    for (command, byte) in
        [(HazardCommand::NoCommand, 0), (HazardCommand::Disable, 1), (HazardCommand::Enable, 2)]
    {
        assert_eq!(cdr(&command.to_ros(STAMP)), with_stamp(&[byte]));
        assert_eq!(input(Kind::HazardRequest, &with_stamp(&[byte])), PlannerInput::HazardRequest(command));
    }
    let unknown = read(Kind::HazardRequest, &with_stamp(&[3]), Endian::Little);
    assert_eq!(unknown, Err(Unreadable::Layout("3 is not a hazard command".to_owned())));
}

#[test]
fn commands_and_modes_are_handed_on_as_sent() {
    for raw in [0, 3, 7, 255] {
        let bytes = with_stamp(&[raw]);
        let decoded = |kind| read(kind, &bytes, Endian::Little);
        let (sample, origin, stamp) = (SAMPLE, CommandOrigin::Topic(SAMPLE), STAMP);
        let turn = CommandInput::Turn { origin, command: raw.into(), stamp };
        assert_eq!(decoded(Kind::TurnCommand), Ok(turn.into()));
        let hazard = CommandInput::Hazard { origin, command: raw.into(), stamp };
        assert_eq!(decoded(Kind::HazardCommand), Ok(hazard.into()));
        assert_eq!(cdr(&ControlModeReport { stamp: STAMP.into(), mode: raw }), bytes);
        let mode = CommandInput::ControlMode { sample, mode: raw.into(), stamp };
        assert_eq!(decoded(Kind::ControlMode), Ok(mode.into()));
        assert_eq!(
            decoded(Kind::OwnTurnCommand),
            Ok(Input::Planner(PlannerInput::OwnTurnCommand(raw.into())))
        );
        assert_eq!(
            decoded(Kind::OwnHazardCommand),
            Ok(Input::Planner(PlannerInput::OwnHazardCommand(raw.into())))
        );
    }
}

#[test]
fn sequences_have_a_greatest_length() {
    let path = |points, lanes| PathWithLaneId {
        points: vec![
            PathPointWithLaneId { lane_ids: vec![1; lanes], ..PathPointWithLaneId::default() };
            points
        ],
        ..PathWithLaneId::default()
    };
    let trajectory =
        |points| Trajectory { points: vec![TrajectoryPoint::default(); points], ..Trajectory::default() };
    let route = |segments| LaneletRoute {
        segments: vec![LaneletSegment::default(); segments],
        ..LaneletRoute::default()
    };
    let cases = [
        (
            Kind::PlannedPath,
            cdr(&path(PathWithLaneId::MAX_POINTS, 1)),
            cdr(&path(PathWithLaneId::MAX_POINTS + 1, 1)),
        ),
        (
            Kind::PlannedPath,
            cdr(&path(1, PathPointWithLaneId::MAX_LANE_IDS)),
            cdr(&path(1, PathPointWithLaneId::MAX_LANE_IDS + 1)),
        ),
        (
            Kind::Trajectory,
            cdr(&trajectory(Trajectory::MAX_POINTS)),
            cdr(&trajectory(Trajectory::MAX_POINTS + 1)),
        ),
        (Kind::Route, cdr(&route(LaneletRoute::MAX_SEGMENTS)), cdr(&route(LaneletRoute::MAX_SEGMENTS + 1))),
    ];
    for (kind, longest, too_long) in cases {
        input(kind, &longest);
        match read(kind, &too_long, Endian::Little) {
            Err(Unreadable::Layout(why)) => assert!(why.contains("a sequence of more than"), "{why}"),
            other => panic!("{kind:?}: {other:?}"),
        }
    }
    // The length is only announced, so it is refused at once, without allocation.
    for kind in [Kind::PlannedPath, Kind::Trajectory, Kind::Factors(FactorTopic::GoalPlanner)] {
        let bytes = Wire::with_header().count(u32::MAX).done();
        assert!(read(kind, &bytes, Endian::Little).is_err());
    }
}

fn samples() -> Vec<(Kind, Vec<u8>)> {
    let command = with_stamp(&[2]);
    vec![
        (Kind::Odometry, odometry()),
        (Kind::Route, route()),
        (Kind::PlannedPath, path()),
        (Kind::Trajectory, trajectory()),
        (Kind::Factors(FactorTopic::GoalPlanner), factors()),
        (Kind::OperationMode, with_stamp(&[2, 1, 0, 1, 1, 0, 0])),
        (Kind::Scenario, Wire::default().text("LaneDriving").count(1).text("Parking").done()),
        (Kind::HazardRequest, command.clone()),
        (Kind::OwnTurnCommand, command.clone()),
        (Kind::OwnHazardCommand, command.clone()),
        (Kind::TurnCommand, command.clone()),
        (Kind::HazardCommand, command.clone()),
        (Kind::ControlMode, command),
    ]
}

#[test]
fn whatever_is_cut_off_is_refused_wherever_it_is_cut() {
    for (kind, bytes) in samples() {
        for length in 0..bytes.len() {
            let result = read(kind, &bytes[..length], Endian::Little);
            assert!(result.is_err(), "{kind:?} cut to {length}: {result:?}");
        }
    }
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        for (kind, _) in samples() {
            let _ = read(kind, &bytes, Endian::Little);
            let _ = read(kind, &bytes, Endian::Big);
        }
    }

    #[test]
    fn changed_bytes_are_read_or_refused(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        for (kind, mut bytes) in samples() {
            for (at, byte) in &changes {
                *at.get_mut(&mut bytes) = *byte;
            }
            let _ = read(kind, &bytes, Endian::Little);
        }
    }
}
