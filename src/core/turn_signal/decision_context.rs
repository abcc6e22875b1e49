//! The moment a decision is made in: road, route, vehicle, parameters.

use super::compat::UpstreamQuirks;
use super::parameters::{Parameters, Vehicle};
use super::route::Route;
use crate::core::map::geometry::Pose;
use crate::core::map::geometry::path::PathFrame;
use crate::core::map::lane_network::LaneNetwork;
use crate::core::time::MonoTime;

/// Below this the vehicle stands, m/s.
pub const STOP_SPEED_MPS: f64 = 0.1;

/// Everything a manoeuvre is looked at with.
#[derive(Debug, Clone, Copy)]
pub struct DecisionContext<'a> {
    /// The lanelets.
    pub road: &'a LaneNetwork,
    /// The route.
    pub route: &'a Route,
    /// Distances along the distance path.
    pub path_frame: PathFrame<'a>,
    /// Speed of the odometry, m/s, negative backwards.
    pub speed_mps: f64,
    /// The parameters.
    pub parameters: &'a Parameters,
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// What is done as upstream does it.
    pub quirks: UpstreamQuirks,
    /// The time of the decision.
    pub now: MonoTime,
}

impl DecisionContext<'_> {
    /// The rear axle.
    pub fn ego(&self) -> Pose {
        self.path_frame.ego()
    }

    /// The vehicle does not move (forwards).
    pub fn stands(&self) -> bool {
        self.speed_mps < STOP_SPEED_MPS
    }
}
