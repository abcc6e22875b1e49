//! The circumstances of a decision: road, route, vehicle, parameters.

use std::time::Duration;

use super::compat::UpstreamQuirks;
use super::parameters::{Parameters, Vehicle};
use super::route::Route;
use crate::core::map::geometry::Pose;
use crate::core::map::geometry::path::PathFrame;
use crate::core::map::lane_network::LaneNetwork;
use crate::core::time::MonoTime;

/// Speed below which the vehicle stands, m/s.
pub const STOP_SPEED_MPS: f64 = 0.1;

/// Everything by which a manoeuvre is judged.
#[derive(Debug, Clone, Copy)]
pub struct DecisionContext<'a> {
    /// The lanelets of the map.
    pub road: &'a LaneNetwork,
    /// The route that is driven.
    pub route: &'a Route,
    /// Distances along the distance path.
    pub path_frame: PathFrame<'a>,
    /// Speed of the odometry, m/s, negative backwards.
    pub speed_mps: f64,
    /// The parameters.
    pub parameters: &'a Parameters,
    /// Dimensions of the vehicle.
    pub vehicle: &'a Vehicle,
    /// The quirks of upstream that are kept.
    pub quirks: UpstreamQuirks,
    /// A vehicle that stands for longer gives up a turn that is out of range.
    pub standing_limit: Duration,
    /// The time of the decision.
    pub now: MonoTime,
}

impl DecisionContext<'_> {
    /// Pose of the rear axle.
    pub fn ego(&self) -> Pose {
        self.path_frame.ego()
    }

    /// The vehicle does not move (forwards).
    pub fn stands(&self) -> bool {
        self.speed_mps < STOP_SPEED_MPS
    }
}
