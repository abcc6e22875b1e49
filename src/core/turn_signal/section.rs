//! A section record: what one manoeuvre wants to signal, and where
//! (docs/spec/turn-signal-decider.md, "Conventions").

use super::signal::{Hazard, Side, Signal};
use crate::core::map::geometry::Pose;
use crate::core::map::geometry::path::PathFrame;

/// What one manoeuvre wants. The default is upstream's empty record: no command, all points at the
/// origin of the map.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Section {
    /// Turn command.
    pub turn: Signal,
    /// Hazard command.
    pub hazard: Hazard,
    /// From here it may be signalled.
    pub desired_start: Pose,
    /// Up to here it may be signalled.
    pub desired_end: Pose,
    /// From here it must be signalled.
    pub required_start: Pose,
    /// Up to here it must be signalled.
    pub required_end: Pose,
}

/// The four distances of a record, metres along the path: starts from the front, ends from the rear
/// axle; negative = behind.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Distances {
    /// Front to the desired start (`ds`).
    pub desired_start_m: f64,
    /// Rear axle to the desired end (`de`).
    pub desired_end_m: f64,
    /// Front to the required start (`rs`).
    pub required_start_m: f64,
    /// Rear axle to the required end (`re`).
    pub required_end_m: f64,
}

impl Section {
    /// A record that blinks on one side.
    pub fn blinking(side: Side, desired: (Pose, Pose), required: (Pose, Pose)) -> Self {
        Self {
            turn: side.into(),
            hazard: Hazard::NoCommand,
            desired_start: desired.0,
            desired_end: desired.1,
            required_start: required.0,
            required_end: required.1,
        }
    }

    /// All four places are numbers.
    pub fn is_finite(&self) -> bool {
        [self.desired_start, self.desired_end, self.required_start, self.required_end]
            .iter()
            .all(|pose| pose.is_finite())
    }

    /// Its distances from the vehicle.
    pub fn distances(&self, path_frame: &PathFrame<'_>) -> Distances {
        Distances {
            desired_start_m: path_frame.from_front_m(self.desired_start),
            desired_end_m: path_frame.from_base_m(self.desired_end),
            required_start_m: path_frame.from_front_m(self.required_start),
            required_end_m: path_frame.from_base_m(self.required_end),
        }
    }
}
