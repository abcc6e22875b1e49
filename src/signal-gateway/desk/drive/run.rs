//! The decider with one `compat` over a simulation.

use super::simulation::{DriveCycle, DriveSimulation};
use turn_signal::compat::DeciderCompat;
use turn_signal::decider::{Decider, DeciderSettings};
use turn_signal::decision::Decision;
use turn_signal::inputs::{Inputs, Timed};
use turn_signal::manoeuvre::Manoeuvre;
use turn_signal::planner_input::Odometry;

/// A decider with the last odometry that it received.
#[derive(Debug, Clone)]
pub struct DriveRun<'a> {
    simulation: &'a DriveSimulation,
    decider: Decider,
    odometry: Option<Timed<Odometry>>,
}

impl<'a> DriveRun<'a> {
    /// Creates a decider without any input yet.
    pub fn new(simulation: &'a DriveSimulation, compat: DeciderCompat) -> Self {
        let settings = DeciderSettings { compat, ..simulation.file().decider.clone() };
        Self { simulation, decider: Decider::new(settings), odometry: None }
    }

    /// Returns the decision at the next cycle.
    pub fn step(&mut self, cycle: &DriveCycle) -> Decision {
        let now = cycle.now;
        if let Some(value) = cycle.odometry {
            self.odometry = Some(Timed { at: now, value });
        }
        let manoeuvres: Vec<Timed<Manoeuvre>> =
            cycle.manoeuvres.iter().cloned().map(|value| Timed { at: now, value }).collect();
        let inputs = Inputs {
            odometry: self.odometry,
            road: Some(self.simulation.road()),
            route: Some(&cycle.route),
            planned_path: Some(Timed { at: now, value: cycle.path.len() }),
            manoeuvres: &manoeuvres,
            lane_driving: cycle.lane_driving,
        };
        self.decider.decide(&inputs, now)
    }
}
