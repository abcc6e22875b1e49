//! The decider in one behaviour over a course.

use super::course::{Course, Cycle};
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::decider::{Decider, Settings};
use crate::core::turn_signal::decision::Decision;
use crate::core::turn_signal::inputs::{Inputs, Timed};
use crate::core::turn_signal::manoeuvre::Manoeuvre;
use crate::core::turn_signal::planner_input::Odometry;

/// A decider with the odometry it received last.
#[derive(Debug, Clone)]
pub struct Run<'a> {
    course: &'a Course,
    decider: Decider,
    odometry: Option<Timed<Odometry>>,
}

impl<'a> Run<'a> {
    /// A decider without any input yet.
    pub fn new(course: &'a Course, mode: DeciderCompat) -> Self {
        let file = course.file();
        let settings = Settings {
            parameters: file.parameters.clone(),
            vehicle: file.vehicle,
            ..Settings::deployed(mode)
        };
        Self { course, decider: Decider::new(settings), odometry: None }
    }

    /// The decision at the next cycle.
    pub fn step(&mut self, cycle: &Cycle) -> Decision {
        let now = cycle.now;
        if let Some(value) = cycle.odometry {
            self.odometry = Some(Timed { at: now, value });
        }
        let manoeuvres: Vec<Timed<Manoeuvre>> =
            cycle.manoeuvres.iter().cloned().map(|value| Timed { at: now, value }).collect();
        let inputs = Inputs {
            odometry: self.odometry,
            road: Some(self.course.road()),
            route: Some(&cycle.route),
            planned_path: Some(Timed { at: now, value: cycle.path.len() }),
            manoeuvres: &manoeuvres,
            lane_driving: cycle.lane_driving,
        };
        self.decider.decide(&inputs, now)
    }
}
