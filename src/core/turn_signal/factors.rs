//! Planning factors and the planned path as manoeuvres
//! (docs/spec/turn-signal-decider.md, "Manoeuvres from planning factors").
//!
//! Upstream's modules know more than they publish. The rest is taken from the planned path and the road, and the
//! documentation of each builder names what of it is approximate.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::inputs::{FactorFlaw, InputFinding, Timed};
use super::manoeuvre::{Manoeuvre, ManoeuvreKind};
use super::parameters::DeciderParameters;
use super::planner_input::{
    ControlPoint, FactorTopic, Odometry, OperationMode, PlannedPathPoint, PlanningFactor,
};
use super::route::Route;
use crate::core::map::geometry::Pose;
use crate::core::map::lane_network::LaneNetwork;
use path_offsets::{PathOffsets, Ramp};

mod avoidance;
mod lane_change;
mod path_offsets;
mod pulling;

#[cfg(test)]
mod tests;

/// `STOP` of the operation mode.
const MODE_STOP: u8 = 1;

/// The latest factors of each module, in the order in which the planner runs them.
pub type Factors = BTreeMap<FactorTopic, Timed<Arc<[PlanningFactor]>>>;

/// Everything by which factors are judged.
#[derive(Debug, Clone, Copy)]
pub struct FactorContext<'a> {
    /// The lanelets of the map.
    pub road: &'a LaneNetwork,
    /// The route that is driven.
    pub route: &'a Route,
    /// The parameters.
    pub parameters: &'a DeciderParameters,
    /// Points of the planned path are found by heading and height as well, not by position alone (W20).
    pub looks_at_height: bool,
    /// Pose and speed of the vehicle.
    pub odometry: Odometry,
    /// The planned path, if there is one to use.
    pub path: Option<&'a [PlannedPathPoint]>,
    /// The goal of a pull-over, if it is published.
    pub modified_goal: Option<Pose>,
    /// The operation mode, if known.
    pub operation_mode: Option<OperationMode>,
}

/// The values of `PlanningFactor.behavior` that matter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Behavior {
    SlowDown,
    Stop,
    ShiftLeft,
    ShiftRight,
    Other,
}

/// The stretch of a factor.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FactorInterval {
    start: ControlPoint,
    end: ControlPoint,
}

/// The manoeuvres in the order of the chain, and what could not be made into one. A manoeuvre is as old
/// as the factors it is made of.
pub fn manoeuvres(
    context: &FactorContext<'_>,
    factors: &Factors,
) -> (Vec<Timed<Manoeuvre>>, Vec<InputFinding>) {
    let mut findings = Vec::new();
    let mut manoeuvres = Vec::new();
    let anything = factors.values().any(|latest| !latest.value.is_empty());
    let path_offsets = if anything { PathOffsets::new(context) } else { None };
    for (topic, latest) in factors {
        let made = made(context, path_offsets.as_ref(), *topic, &latest.value, &mut findings);
        manoeuvres.extend(made.into_iter().map(|value| Timed { at: latest.at, value }));
    }
    (manoeuvres, findings)
}

fn made(
    context: &FactorContext<'_>,
    path_offsets: Option<&PathOffsets>,
    topic: FactorTopic,
    factors: &[PlanningFactor],
    findings: &mut Vec<InputFinding>,
) -> Vec<Manoeuvre> {
    let mut usable = Vec::new();
    for factor in factors {
        if factor.is_finite() {
            usable.push(factor);
        } else {
            findings.push(InputFinding::BadFactor { topic, flaw: FactorFlaw::NotFinite });
        }
    }
    let mut refuse = |flaw| findings.push(InputFinding::BadFactor { topic, flaw });
    let made = match topic {
        FactorTopic::StartPlanner => usable
            .iter()
            .filter_map(|factor| pulling::out(context, path_offsets, factor, &mut refuse))
            .collect(),
        FactorTopic::StaticObstacleAvoidance => {
            avoidance::around(context, path_offsets, &usable, &mut refuse)
        }
        FactorTopic::GoalPlanner => pulling::over(context, path_offsets, &usable, &mut refuse),
        FactorTopic::AvoidanceByLaneChange
        | FactorTopic::LaneChangeLeft
        | FactorTopic::LaneChangeRight
        | FactorTopic::ExternalLaneChangeLeft
        | FactorTopic::ExternalLaneChangeRight => {
            let change = |factor: &&PlanningFactor| {
                lane_change::sideways(context, path_offsets, topic, factor, &mut refuse)
                    .map(Manoeuvre::LaneChange)
            };
            usable.iter().filter_map(change).collect()
        }
    };
    match made {
        Made::All(made) => made,
        Made::NeedsPath(kind) => {
            findings.push(InputFinding::NoPathFor { kind });
            Vec::new()
        }
    }
}

/// The manoeuvres made of the factors of a module.
enum Made {
    All(Vec<Manoeuvre>),
    NeedsPath(ManoeuvreKind),
}

impl FromIterator<Manoeuvre> for Made {
    fn from_iter<I: IntoIterator<Item = Manoeuvre>>(manoeuvres: I) -> Self {
        Self::All(manoeuvres.into_iter().collect())
    }
}

impl FactorContext<'_> {
    /// Autoware drives, as far as is known.
    fn is_engaged(&self) -> bool {
        self.operation_mode.is_none_or(|mode| mode.mode != MODE_STOP && mode.is_autoware_control_enabled)
    }
}

impl PlanningFactor {
    fn known_behavior(&self) -> Behavior {
        match self.behavior {
            2 => Behavior::SlowDown,
            3 => Behavior::Stop,
            4 => Behavior::ShiftLeft,
            5 => Behavior::ShiftRight,
            _ => Behavior::Other,
        }
    }

    /// All that is used of it are numbers. Distance and speed are not used.
    fn is_finite(&self) -> bool {
        self.control_points.iter().all(|point| point.pose.is_finite() && point.shift_length_m.is_finite())
    }

    /// It is only about stopping or slowing down.
    fn is_about_speed(&self) -> bool {
        matches!(self.known_behavior(), Behavior::SlowDown | Behavior::Stop)
    }

    /// The stretch from its first control point to its last.
    fn interval(&self) -> Option<FactorInterval> {
        match self.control_points.as_slice() {
            [start, .., end] => Some(FactorInterval { start: *start, end: *end }),
            _ => None,
        }
    }
}

impl FactorInterval {
    fn start(&self) -> Pose {
        self.start.pose
    }

    fn end(&self) -> Pose {
        self.end.pose
    }

    /// The change of offset over the stretch.
    fn ramp(&self) -> Ramp {
        Ramp {
            start: self.start(),
            end: self.end(),
            before_m: self.start.shift_length_m,
            after_m: self.end.shift_length_m,
        }
    }

    /// Change of the offset to the left, metres.
    fn shift_m(&self) -> f64 {
        self.end.shift_length_m - self.start.shift_length_m
    }
}
