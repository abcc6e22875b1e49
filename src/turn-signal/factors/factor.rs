//! A planning factor and the context in which it is judged.

use crate::inputs::FactorFlaw;
use crate::manoeuvre::{Manoeuvre, ManoeuvreKind};
use crate::parameters::DeciderParameters;
use crate::planner_input::{ControlPoint, Odometry, OperationMode, PlannedPathPoint, PlanningFactor};
use crate::route::Route;
use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::LaneNetwork;

const MODE_STOP: u8 = 1;

/// Context in which factors are judged.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)] // their names say it
pub struct FactorContext<'a> {
    pub road: &'a LaneNetwork,
    pub route: &'a Route,
    pub parameters: &'a DeciderParameters,
    /// Points of the planned path are also found by heading and height, not by position alone (W20).
    pub looks_at_height: bool,
    /// Pose and speed of the vehicle.
    pub odometry: Odometry,
    /// The planned path, if it is usable.
    pub path: Option<&'a [PlannedPathPoint]>,
    /// The goal of a pull-over, if it is published.
    pub modified_goal: Option<Pose>,
    /// The operation mode, if known.
    pub operation_mode: Option<OperationMode>,
}

/// The values of `PlanningFactor.behavior` in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Behavior {
    SlowDown,
    Stop,
    ShiftLeft,
    ShiftRight,
    Other,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FactorInterval {
    pub(super) start: ControlPoint,
    pub(super) end: ControlPoint,
}

/// Manoeuvres made from the factors of a module, or the kind of manoeuvre that needs a missing planned path.
pub(super) type Made = Result<Vec<Manoeuvre>, ManoeuvreKind>;

/// A change of offset along the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ramp {
    pub(super) start: Pose,
    pub(super) end: Pose,
    pub(super) before_m: f64,
    pub(super) after_m: f64,
}

impl FactorContext<'_> {
    /// Returns whether Autoware drives, as far as is known.
    pub(super) fn is_engaged(&self) -> bool {
        self.operation_mode.is_none_or(|mode| mode.mode != MODE_STOP && mode.is_autoware_control_enabled)
    }
}

impl PlanningFactor {
    pub(super) fn known_behavior(&self) -> Behavior {
        match self.behavior {
            2 => Behavior::SlowDown,
            3 => Behavior::Stop,
            4 => Behavior::ShiftLeft,
            5 => Behavior::ShiftRight,
            _ => Behavior::Other,
        }
    }

    /// Returns whether all values in use are finite. Distance and speed are not used.
    pub(super) fn is_finite(&self) -> bool {
        self.control_points.iter().all(|point| point.pose.is_finite() && point.shift_length_m.is_finite())
    }

    /// Returns whether the factor only concerns stopping or slowing down.
    pub(super) fn is_about_speed(&self) -> bool {
        matches!(self.known_behavior(), Behavior::SlowDown | Behavior::Stop)
    }

    /// Returns the stretch from its first control point to its last.
    pub(super) fn interval(&self) -> Result<FactorInterval, FactorFlaw> {
        match self.control_points.as_slice() {
            [start, .., end] => Ok(FactorInterval { start: *start, end: *end }),
            _ => Err(FactorFlaw::NoStretch),
        }
    }
}

impl FactorInterval {
    pub(super) fn ramp(&self) -> Ramp {
        Ramp {
            start: self.start.pose,
            end: self.end.pose,
            before_m: self.start.shift_length_m,
            after_m: self.end.shift_length_m,
        }
    }

    /// Returns the change of the offset to the left, metres.
    pub(super) fn shift_m(&self) -> f64 {
        self.end.shift_length_m - self.start.shift_length_m
    }
}
