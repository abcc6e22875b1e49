//! The inputs of a decision, and findings about them
//! (docs/spec/turn-signal-decider.md, "Inputs and outputs").

use std::time::Duration;

use derive_more::Display;

use super::manoeuvre::{Manoeuvre, ManoeuvreKind};
use super::planner_input::{FactorTopic, Odometry};
use super::route::{Route, RouteError};
use super::vehicle_state::VehicleHazard;
use crate::core::map::geometry::path::PathError;
use crate::core::map::lane_network::LaneNetwork;
use crate::core::time::MonoTime;

/// A value with its time of reception.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timed<T> {
    /// The time of reception.
    pub at: MonoTime,
    /// The value that was received.
    pub value: T,
}

/// All inputs of one decision.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// The last odometry; `None` before the first.
    pub odometry: Option<Timed<Odometry>>,
    /// The lanelets of the map.
    pub road: Option<&'a LaneNetwork>,
    /// The route that is driven.
    pub route: Option<&'a Route>,
    /// The number of points of the planned path; `None` = none was received.
    pub planned_path: Option<Timed<usize>>,
    /// The manoeuvres of the planner, in the order of the chain.
    pub manoeuvres: &'a [Timed<Manoeuvre>],
    /// The scenario is lane driving, or not known.
    pub lane_driving: bool,
}

/// Age limits of inputs. As old as the limit is not too old. Route and operation mode hold until the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AgeLimits {
    /// Age of the odometry.
    pub odometry: Duration,
    /// Age of the planned path.
    pub planned_path: Duration,
    /// Age of a manoeuvre.
    pub manoeuvre: Duration,
    /// Age of the scenario.
    pub scenario: Duration,
    /// Age of the system's request for hazard lights.
    pub hazard_request: Duration,
    /// Age of Autoware's own commands.
    pub own_command: Duration,
}

/// Something wrong with the inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub enum InputFinding {
    /// Without odometry: no command.
    #[display("no odometry")]
    NoOdometry,
    /// The odometry of this age is too old: no command.
    #[display("odometry is {} ms old", _0.as_millis())]
    OldOdometry(Duration),
    /// The odometry lies this far in the future: no command.
    #[display("odometry is {} ms in the future", _0.as_millis())]
    FutureOdometry(Duration),
    /// The odometry is not a number: no command.
    #[display("odometry is not a number")]
    OdometryNotFinite,
    /// Without a map: no command.
    #[display("no map")]
    NoRoad,
    /// Without a route: no command.
    #[display("no route")]
    NoRoute,
    /// The planner is not driving lanes: no command.
    #[display("the scenario is not lane driving")]
    NotLaneDriving,
    /// The planned path has no points: only the command of the manoeuvres.
    #[display("the planned path is empty")]
    EmptyPlannedPath,
    /// The planned path of this age is too old; the signal does not depend on it.
    #[display("the planned path is {} ms old", _0.as_millis())]
    OldPlannedPath(Duration),
    /// No lanelet of the route is on the map: only the command of the manoeuvres.
    #[display("no lanelet of the route is on the map")]
    NoLaneAround,
    /// The middle of the lanelets is not a path: only the command of the manoeuvres.
    #[display("no path to measure on: {_0}")]
    NoDistancePath(PathError),
    /// A manoeuvre is too old and left out.
    #[display("{kind} is {} ms old", age.as_millis())]
    OldManoeuvre {
        /// Kind of the manoeuvre.
        kind: ManoeuvreKind,
        /// Age of the manoeuvre.
        age: Duration,
    },
    /// The clock went backwards by this time; minimum durations start again.
    #[display("the clock went back by {} ms", _0.as_millis())]
    TimeWentBack(Duration),
    /// The route is another one; what was remembered of the old one is forgotten.
    #[display("new route")]
    NewRoute,
    /// The last route cannot be used, and the one before it holds no longer: no command.
    RouteRefused(RouteError),
    /// Points of the planned path are not numbers; it is not used.
    #[display("a point of the planned path is not a number")]
    PlannedPathNotFinite,
    /// A planning factor cannot be used and is left out.
    #[display("planning factor of {}: {flaw}", topic.name())]
    BadFactor {
        /// Topic of the factor.
        topic: FactorTopic,
        /// Reason for which it is left out.
        flaw: FactorFlaw,
    },
    /// A manoeuvre of this kind is left out: it needs a planned path, and there is none to use.
    #[display("{_0} without a planned path")]
    NoPathFor(ManoeuvreKind),
    /// The scenario of this age, lane driving or not, is too old: no command.
    #[display("the scenario is {} ms old", _0.as_millis())]
    OldScenario(Duration),
    /// The system's request of this age for hazard lights, or for none, is too old: neither is commanded for it.
    #[display("the hazard request is {} ms old", _0.as_millis())]
    OldHazardRequest(Duration),
    /// The state of the vehicle asks for hazard lights.
    #[display("hazard lights: {_0}")]
    VehicleHazard(VehicleHazard),
    /// The signals of the vehicle do not tell whether this is so: the hazard lights are not commanded for it, nor switched off.
    #[display("unknown whether {_0}")]
    UnknownVehicleHazard(VehicleHazard),
    /// The signals of the vehicle give no speed: the odometry's counts.
    #[display("the vehicle's signals give no speed")]
    NoVehicleSpeed,
}

/// A reason for which a planning factor cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub enum FactorFlaw {
    /// A position or an offset is not a number.
    #[display("a position or an offset is not a number")]
    NotFinite,
    /// It lacks a start or an end.
    #[display("no start and end")]
    NoStretch,
    /// It does not name a side.
    #[display("no side")]
    NoSide,
}

/// The weight of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Impact {
    /// Part of every drive.
    Normal,
    /// The decision may lack something.
    Degraded,
    /// A decision is missing that should be there.
    Failure,
}

impl AgeLimits {
    /// Several cycles of sources that send ten times a second or more.
    pub const DEFAULT: Self = Self {
        odometry: Duration::from_millis(500),
        planned_path: Duration::from_secs(1),
        manoeuvre: Duration::from_secs(1),
        scenario: Duration::from_secs(1),
        hazard_request: Duration::from_secs(1),
        own_command: Duration::from_secs(1),
    };
}

impl InputFinding {
    /// Returns the weight of the finding.
    pub const fn impact(&self) -> Impact {
        match self {
            Self::NoRoute | Self::NotLaneDriving | Self::NewRoute | Self::VehicleHazard(_) => Impact::Normal,
            Self::NoOdometry
            | Self::EmptyPlannedPath
            | Self::OldPlannedPath(_)
            | Self::NoLaneAround
            | Self::NoDistancePath(_)
            | Self::OldManoeuvre { .. }
            | Self::TimeWentBack(_)
            | Self::PlannedPathNotFinite
            | Self::BadFactor { .. }
            | Self::NoPathFor(_)
            | Self::OldHazardRequest(_)
            | Self::UnknownVehicleHazard(_)
            | Self::NoVehicleSpeed => Impact::Degraded,
            Self::OldOdometry(_)
            | Self::FutureOdometry(_)
            | Self::OdometryNotFinite
            | Self::NoRoad
            | Self::RouteRefused(_)
            | Self::OldScenario(_) => Impact::Failure,
        }
    }

    /// Returns the finding as text, without numbers that change from cycle to cycle.
    pub fn situation(&self) -> String {
        match self {
            Self::OldOdometry(_) => "odometry is too old".to_owned(),
            Self::FutureOdometry(_) => "odometry is in the future".to_owned(),
            Self::OldPlannedPath(_) => "the planned path is too old".to_owned(),
            Self::OldManoeuvre { kind, .. } => format!("{kind} is too old"),
            Self::TimeWentBack(_) => "the clock went back".to_owned(),
            Self::OldScenario(_) => "the scenario is too old".to_owned(),
            Self::OldHazardRequest(_) => "the hazard request is too old".to_owned(),
            Self::NoOdometry
            | Self::OdometryNotFinite
            | Self::NoRoad
            | Self::NoRoute
            | Self::NotLaneDriving
            | Self::EmptyPlannedPath
            | Self::NoLaneAround
            | Self::NoDistancePath(_)
            | Self::NewRoute
            | Self::RouteRefused(_)
            | Self::PlannedPathNotFinite
            | Self::BadFactor { .. }
            | Self::NoPathFor(_)
            | Self::VehicleHazard(_)
            | Self::UnknownVehicleHazard(_)
            | Self::NoVehicleSpeed => self.to_string(),
        }
    }
}

impl Inputs<'_> {
    /// Returns the odometry, if it can be used.
    pub(super) fn usable_odometry(&self, limits: AgeLimits, now: MonoTime) -> Result<Odometry, InputFinding> {
        let Timed { at, value } = self.odometry.ok_or(InputFinding::NoOdometry)?;
        let (age, ahead) = (now.since(at), at.since(now));
        if !(value.pose.is_finite() && value.speed_mps.is_finite()) {
            Err(InputFinding::OdometryNotFinite)
        } else if ahead > limits.odometry {
            Err(InputFinding::FutureOdometry(ahead))
        } else if age > limits.odometry {
            Err(InputFinding::OldOdometry(age))
        } else {
            Ok(value)
        }
    }

    /// Returns the manoeuvres that are new enough; a finding is noted for each other one.
    pub(super) fn usable_manoeuvres(
        &self,
        limits: AgeLimits,
        now: MonoTime,
        findings: &mut Vec<InputFinding>,
    ) -> Vec<&Manoeuvre> {
        let mut usable = Vec::new();
        for Timed { at, value } in self.manoeuvres {
            let age = now.since(*at);
            if age > limits.manoeuvre {
                findings.push(InputFinding::OldManoeuvre { kind: value.kind(), age });
            } else {
                usable.push(value);
            }
        }
        usable
    }
}
