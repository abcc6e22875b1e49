//! The inputs of a decision, and findings about them
//! (docs/spec/turn-signal-decider.md, "Inputs and outputs").

use std::time::Duration;

use derive_more::Display;

use super::catalogue;
use super::manoeuvre::{Manoeuvre, ManoeuvreKind};
use super::planner_input::{FactorTopic, Odometry};
use super::route::{Route, RouteError};
use super::vehicle_state::VehicleHazard;
use gateway_base::diagnostics::MessagePart;
use gateway_base::time::{MonoTime, deadline_after};
use lanelet2_map::geometry::path::PathError;
use lanelet2_map::lane_network::LaneNetwork;

/// A value with its time of reception.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // their names say it
pub struct Timed<T> {
    pub at: MonoTime,
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
    /// The number of points of the planned path; `None` if none was received.
    pub planned_path: Option<Timed<usize>>,
    /// The manoeuvres of the planner, in the order of the chain.
    pub manoeuvres: &'a [Timed<Manoeuvre>],
    /// The scenario is lane driving, or unknown.
    pub lane_driving: bool,
}

/// Age limits of inputs. An input exactly as old as its limit is still accepted. Route and operation mode are
/// valid until the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub struct AgeLimits {
    pub odometry: Duration,
    pub planned_path: Duration,
    pub manoeuvre: Duration,
    pub scenario: Duration,
    /// Of the system's request.
    pub hazard_request: Duration,
    /// Of the commands of Autoware's own decider, not of this one's.
    pub own_command: Duration,
}

/// Something wrong with the inputs. Written with its numbers, e.g. `odometry is 700 ms old`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
#[display("{}", self.message())]
#[allow(missing_docs)] // their names say it
pub enum InputFinding {
    /// Without odometry: no command.
    NoOdometry,
    /// The odometry of this age is too old: no command.
    #[display("odometry is {} ms old", _0.as_millis())]
    OldOdometry(Duration),
    /// The odometry lies this far in the future: no command.
    #[display("odometry is {} ms in the future", _0.as_millis())]
    FutureOdometry(Duration),
    /// The odometry is not a number: no command.
    OdometryNotFinite,
    /// Without a map: no command.
    NoRoad,
    /// Without a route: no command.
    NoRoute,
    /// The planner is not driving lanes: no command.
    NotLaneDriving,
    /// The planned path has no points: only the command of the manoeuvres.
    EmptyPlannedPath,
    /// The planned path of this age is too old; the signal does not depend on it.
    #[display("the planned path is {} ms old", _0.as_millis())]
    OldPlannedPath(Duration),
    /// No lanelet of the route is on the map: only the command of the manoeuvres.
    NoLaneAround,
    /// The middle of the lanelets is not a path: only the command of the manoeuvres.
    NoDistancePath(PathError),
    /// A manoeuvre is too old and left out.
    #[display("{kind} is {} ms old", age.as_millis())]
    OldManoeuvre { kind: ManoeuvreKind, age: Duration },
    /// The clock went backwards by this time; minimum durations start again.
    #[display("the clock went back by {} ms", _0.as_millis())]
    TimeWentBack(Duration),
    /// The route is another one; what was remembered of the old one is forgotten.
    NewRoute,
    /// The last route is unusable, and the previous one is no longer valid: no command.
    RouteRefused(RouteError),
    /// Points of the planned path are not finite; the path is ignored.
    PlannedPathNotFinite,
    /// A planning factor cannot be used and is left out.
    BadFactor {
        topic: FactorTopic,
        /// Reason why it is left out.
        flaw: FactorFlaw,
    },
    /// A manoeuvre of this kind is left out: it needs a usable planned path.
    NoPathFor(ManoeuvreKind),
    /// The scenario of this age, lane driving or not, is too old: no command.
    #[display("the scenario is {} ms old", _0.as_millis())]
    OldScenario(Duration),
    /// The system's hazard request of this age is too old: hazard lights are neither commanded on nor off for
    /// it.
    #[display("the hazard request is {} ms old", _0.as_millis())]
    OldHazardRequest(Duration),
    /// The state of the vehicle requests hazard lights.
    VehicleHazard(VehicleHazard),
    /// The signals of the vehicle do not show whether this is so: the hazard lights are neither commanded for
    /// it nor switched off.
    UnknownVehicleHazard(VehicleHazard),
    /// The signals of the vehicle give no speed: the odometry's speed is used.
    NoVehicleSpeed,
}

/// A reason why a planning factor cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
#[allow(missing_docs)] // the texts say it
pub enum FactorFlaw {
    #[display("a position or an offset is not a number")]
    NotFinite,
    #[display("no start and end")]
    NoStretch,
    #[display("no side")]
    NoSide,
}

impl AgeLimits {
    /// Several cycles of sources with a rate of at least 10 Hz.
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
    /// Returns the message of the finding, without numbers that change from cycle to cycle. With a finding of
    /// level ERROR, a decision is missing; after a WARN, the decision may be incomplete.
    pub fn message(&self) -> MessagePart {
        match self {
            Self::NoOdometry => catalogue::no_odometry(),
            Self::OldOdometry(_) => catalogue::old_odometry(),
            Self::FutureOdometry(_) => catalogue::odometry_in_future(),
            Self::OdometryNotFinite => catalogue::odometry_not_finite(),
            Self::NoRoad => catalogue::no_map(),
            Self::NoRoute => catalogue::no_route(),
            Self::NotLaneDriving => catalogue::not_lane_driving(),
            Self::EmptyPlannedPath => catalogue::empty_path(),
            Self::OldPlannedPath(_) => catalogue::old_path(),
            Self::NoLaneAround => catalogue::route_not_on_map(),
            Self::NoDistancePath(error) => catalogue::no_distance_path(error),
            Self::OldManoeuvre { kind, .. } => catalogue::old_manoeuvre(kind),
            Self::TimeWentBack(_) => catalogue::clock_went_back(),
            Self::NewRoute => catalogue::new_route(),
            Self::RouteRefused(error) => error.message(),
            Self::PlannedPathNotFinite => catalogue::path_not_finite(),
            Self::BadFactor { topic, flaw } => catalogue::bad_factor(topic.name(), flaw),
            Self::NoPathFor(kind) => catalogue::no_path_for(kind),
            Self::OldScenario(_) => catalogue::old_scenario(),
            Self::OldHazardRequest(_) => catalogue::old_hazard_request(),
            Self::VehicleHazard(state) => catalogue::vehicle_asks(state),
            Self::UnknownVehicleHazard(state) => catalogue::unknown_whether(state),
            Self::NoVehicleSpeed => catalogue::no_vehicle_speed(),
        }
    }
}

impl<'a> Inputs<'a> {
    /// Returns where the vehicle is, the map and the route, or the first reason why they cannot be used.
    pub(super) fn usable_surroundings(
        &self,
        limits: AgeLimits,
        now: MonoTime,
    ) -> Result<(Odometry, &'a LaneNetwork, &'a Route), InputFinding> {
        let odometry = self.usable_odometry(limits, now)?;
        let road = self.road.ok_or(InputFinding::NoRoad)?;
        let route = self.route.ok_or(InputFinding::NoRoute)?;
        Some((odometry, road, route)).filter(|_| self.lane_driving).ok_or(InputFinding::NotLaneDriving)
    }

    /// Returns the times from which inputs are too old, which happens without any event.
    pub(super) fn too_old_from(&self, limits: AgeLimits) -> impl Iterator<Item = MonoTime> {
        let odometry = self.odometry.map(|odometry| deadline_after(odometry.at, limits.odometry));
        let manoeuvres = self.manoeuvres.iter();
        let manoeuvres = manoeuvres.map(move |manoeuvre| deadline_after(manoeuvre.at, limits.manoeuvre));
        odometry.into_iter().chain(manoeuvres)
    }

    fn usable_odometry(&self, limits: AgeLimits, now: MonoTime) -> Result<Odometry, InputFinding> {
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

    /// Returns the manoeuvres that are new enough; adds a finding for each of the others.
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
