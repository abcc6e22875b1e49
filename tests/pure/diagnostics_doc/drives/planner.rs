//! A decider with and without its inputs.

use std::sync::Arc;

use lanelet2_map::geometry::Pose;
use signal_gateway::config::drive;
use signal_gateway::config::files::Disk;
use signal_gateway::desk::drive::simulation::DriveSimulation;
use turn_signal::light_command::{EnumOrUnknown, HazardCommand, TurnCommand};
use turn_signal::planner_input::{FactorTopic, Odometry, PlannerInput, PlannerRoute, PlanningFactor};
use turn_signal::route::Segment;

use super::{Desk, Reported};
use crate::pure::diagnostics_doc::project;
use crate::pure::turn_signal_cases::bench::{self, decider, path, route};
use crate::pure::turn_signal_cases::vehicle;
use crate::support::files::MemoryFiles;

const LANE_CHANGE: FactorTopic = FactorTopic::LaneChangeLeft;

pub(super) fn drive(reported: &mut Reported) {
    starts(reported);
    wins(reported);
    inputs(reported);
    roundabout(reported);
    routes(reported);
    shadow(reported);
    vehicle_signals(reported);
    routed("enabled = true\ncompat = \"path_generator\"", reported);
}

fn factor(from_m: f64, to_m: f64, shift_m: f64, is_driving_forward: bool) -> PlanningFactor {
    bench::factor(5, is_driving_forward, &[(from_m, 0.0), (to_m, shift_m)])
}

fn factors(topic: FactorTopic, factor: PlanningFactor) -> PlannerInput {
    PlannerInput::Factors { topic, factors: Arc::new([factor]) }
}

/// So long at one position, 20 m before the turn or elsewhere.
fn stay(desk: &mut Desk<'_>, x_m: f64, ms: u64) {
    desk.each_50_ms(ms, |desk, _| {
        let odometry = Odometry { pose: Pose::new(x_m, 0.0, 0.0), speed_mps: 5.0 };
        desk.input(PlannerInput::Odometry { odometry, stamp: desk.gateway.now.wall });
    });
}

fn routed<'a>(keys: &str, reported: &'a mut Reported) -> Desk<'a> {
    let mut desk = Desk::on(decider(keys), reported);
    desk.input(route(1, &[1, 2, 3]));
    stay(&mut desk, 36.0, 2_000);
    desk
}

/// Nothing known, then one input after the other.
fn starts(reported: &mut Reported) {
    let mut desk = Desk::on(decider("enabled = true"), reported);
    desk.pass(200);
    stay(&mut desk, 0.0, 200);
    desk.input(PlannerInput::LaneDriving(false));
    desk.input(route(1, &[1, 2, 3]));
    stay(&mut desk, 0.0, 200);
    desk.pass(2_000);
}

/// The candidates that can win, and the holds.
fn wins(reported: &mut Reported) {
    let mut desk = routed("enabled = true", reported);
    stay(&mut desk, 100.0, 100);
    stay(&mut desk, 150.0, 3_000);
    desk.input(PlannerInput::PlannedPath(path(140.0, 50).into()));
    desk.input(factors(LANE_CHANGE, factor(155.0, 175.0, 0.0, true)));
    stay(&mut desk, 150.0, 500);
    desk.input(factors(LANE_CHANGE, factor(155.0, f64::NAN, 0.0, true)));
    stay(&mut desk, 150.0, 200);
    desk.input(PlannerInput::Factors { topic: LANE_CHANGE, factors: Arc::new([]) });
    desk.input(PlannerInput::PlannedPath(path(140.0, 50).into()));
    desk.input(factors(FactorTopic::StartPlanner, factor(150.0, 160.0, 0.0, false)));
    stay(&mut desk, 150.0, 500);
    routed("enabled = true\ncompat = \"path_generator\"", desk.reported);
}

fn inputs(reported: &mut Reported) {
    let mut desk = routed("enabled = true", reported);
    desk.input(factors(FactorTopic::StaticObstacleAvoidance, factor(40.0, 50.0, -1.5, true)));
    stay(&mut desk, 36.0, 200);
    desk.input(PlannerInput::Factors { topic: FactorTopic::StaticObstacleAvoidance, factors: Arc::new([]) });
    desk.input(factors(LANE_CHANGE, factor(40.0, 60.0, 0.0, true)));
    stay(&mut desk, 36.0, 1_500);
    desk.input(PlannerInput::Factors { topic: LANE_CHANGE, factors: Arc::new([]) });
    let mut spoilt = path(30.0, 50);
    spoilt[20].pose.position.y_m = f64::NAN;
    for points in [Vec::new(), spoilt, path(30.0, 50)] {
        desk.input(PlannerInput::PlannedPath(points.into()));
        stay(&mut desk, 36.0, 200);
    }
    stay(&mut desk, 36.0, 1_500);
    desk.input(PlannerInput::PlannedPath(path(30.0, 50).into()));
    stay(&mut desk, f64::NAN, 200);
    stay(&mut desk, 36.0, 200);
    desk.pass(700);
    desk.input(PlannerInput::LaneDriving(true));
    stay(&mut desk, 36.0, 1_500);
    let mut desk = routed("enabled = true", desk.reported);
    desk.input(PlannerInput::HazardRequest(HazardCommand::Disable));
    stay(&mut desk, 36.0, 1_500);
}

/// Signals of the vehicle that are not received.
fn vehicle_signals(reported: &mut Reported) {
    for key in ["speed = \"vehicle\"", "hazard_in_reverse = true"] {
        stay(&mut Desk::on(vehicle::decider(key), reported), 36.0, 500);
    }
}

/// A drive through a roundabout.
fn roundabout(reported: &mut Reported) {
    let file = drive::read(&Disk, &project().join("config/drives/roundabout_first_exit.toml")).unwrap();
    let simulation = DriveSimulation::new(file).unwrap();
    let map = project().join("config/maps/roundabout/lanelet2_map.osm");
    let gateway = format!("[turn_signal]\nenabled = true\nmap = \"{}\"\n", map.display());
    let mut desk = Desk::of(&MemoryFiles::new([("gateway.toml", gateway)]).or_disk(), reported);
    let mut is_routed = false;
    for cycle in simulation.cycles() {
        if !std::mem::replace(&mut is_routed, true) {
            let (id, start, segments) =
                (cycle.route.id(), cycle.route.start(), cycle.route.segments().to_vec());
            let route = PlannerRoute { id, start, goal: cycle.goal, segments };
            desk.input(PlannerInput::Route(Arc::new(route)));
        }
        if let Some(odometry) = cycle.odometry {
            desk.input(PlannerInput::Odometry { odometry, stamp: desk.gateway.now.wall });
        }
        desk.pass(100);
    }
}

fn routes(reported: &mut Reported) {
    let mut desk = routed("enabled = true", reported);
    let segments = vec![Segment { preferred: 1, lanes: vec![1] }];
    let start = Pose::new(f64::NAN, 0.0, 0.0);
    let from_nowhere = PlannerRoute { id: 2, start, goal: Pose::default(), segments };
    for wrong in
        [route(2, &[]), route(2, &[1, 2, 1]), route(2, &[1, 99]), PlannerInput::Route(Arc::new(from_nowhere))]
    {
        desk.input(wrong);
        stay(&mut desk, 36.0, 200);
    }
}

fn shadow(reported: &mut Reported) {
    let mut desk = routed("shadow = true\nshadow_tolerance_ms = 300", reported);
    for _ in 0..20 {
        desk.input(PlannerInput::OwnTurnCommand(EnumOrUnknown::Known(TurnCommand::Disable)));
        stay(&mut desk, 36.0, 50);
    }
}
