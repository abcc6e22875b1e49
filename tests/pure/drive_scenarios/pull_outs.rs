//! Pull-outs of the shipped drives as planning factors and a planned path, which is all that is published of
//! them: the decisions are those on the manoeuvre itself.

use std::path::Path;
use std::sync::Arc;

use signal_gateway::config::drive::read;
use signal_gateway::config::files::Disk;
use signal_gateway::desk::drive::run::DriveRun;
use signal_gateway::desk::drive::simulation::{DriveCycle, DriveSimulation};
use turn_signal::compat::DeciderCompat;
use turn_signal::decider::{Decider, DeciderSettings};
use turn_signal::factors::{FactorContext, Factors, manoeuvres};
use turn_signal::inputs::{Inputs, Timed};
use turn_signal::light_command::TurnCommand;
use turn_signal::manoeuvre::Manoeuvre;
use turn_signal::planner_input::{ControlPoint, FactorTopic, PlanningFactor};

/// Changes of the command lie this near to each other, metres.
const NEAR_M: f64 = 1.5;

const DRIVES: [(&str, f64); 4] = [
    ("pull_out_left", -2.2),
    ("pull_out_right", 2.2),
    ("pull_out_before_turn", 2.2),
    ("pull_out_beside_oncoming", -2.2),
];

fn factors(cycle: &DriveCycle, offset_m: f64) -> Factors {
    let point = |pose, shift_length_m| ControlPoint { pose, distance_m: 0.0, speed_mps: 0.0, shift_length_m };
    let of = |manoeuvre: &Manoeuvre| {
        let Manoeuvre::PullOut(pull_out) = manoeuvre else { panic!("{manoeuvre:?}") };
        let control_points = vec![point(pull_out.start, offset_m), point(pull_out.end, 0.0)];
        let factor =
            PlanningFactor { behavior: 0, is_driving_forward: true, detail: "".into(), control_points };
        (FactorTopic::StartPlanner, Timed { at: cycle.now, value: Arc::from(vec![factor]) })
    };
    cycle.manoeuvres.iter().map(of).collect()
}

fn note(changes: &mut Vec<(TurnCommand, f64)>, at_m: f64, turn: TurnCommand) {
    if changes.last().is_none_or(|(before, _)| *before != turn) {
        changes.push((turn, at_m));
    }
}

#[test]
fn a_pull_out_is_known_from_its_factor_and_the_path() {
    for (name, offset_m) in DRIVES {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/drives").join(format!("{name}.toml"));
        let simulation = DriveSimulation::new(read(&Disk, &file).unwrap()).unwrap();
        let settings =
            DeciderSettings { compat: DeciderCompat::Improved, ..simulation.file().decider.clone() };
        let mut changes = [Vec::new(), Vec::new()];
        let mut of_factors = Decider::new(settings.clone());
        let mut of_manoeuvres = DriveRun::new(&simulation, settings.compat);
        for cycle in simulation.cycles() {
            let odometry = cycle.odometry.unwrap();
            let context = FactorContext {
                road: simulation.road(),
                route: &cycle.route,
                parameters: &settings.parameters,
                looks_at_height: true,
                odometry,
                path: Some(&cycle.path),
                modified_goal: None,
                operation_mode: None,
            };
            let (manoeuvres, findings) = manoeuvres(&context, &factors(&cycle, offset_m));
            assert_eq!(findings, [], "{name} at {:.1} m", cycle.at_m);
            let inputs = Inputs {
                odometry: Some(Timed { at: cycle.now, value: odometry }),
                road: Some(simulation.road()),
                route: Some(&cycle.route),
                planned_path: Some(Timed { at: cycle.now, value: cycle.path.len() }),
                manoeuvres: &manoeuvres,
                lane_driving: cycle.lane_driving,
            };
            note(&mut changes[0], cycle.at_m, of_factors.decide(&inputs, cycle.now).turn);
            note(&mut changes[1], cycle.at_m, of_manoeuvres.step(&cycle).turn);
        }
        let [found, expected] = changes;
        let is_same = |((one, one_m), (other, other_m)): (&(TurnCommand, f64), &(TurnCommand, f64))| {
            one == other && (one_m - other_m).abs() < NEAR_M
        };
        let are_same = found.len() == expected.len() && found.iter().zip(&expected).all(is_same);
        assert!(are_same, "{name}: {found:?} instead of {expected:?}");
    }
}
