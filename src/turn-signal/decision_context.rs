//! The circumstances of a decision: road, route, vehicle, parameters.

use std::time::Duration;

use super::compat::DeciderQuirks;
use super::distance_path::DistancePath;
use super::junction::{JunctionRule, OfferedWay, last_offered};
use super::parameters::{DeciderParameters, VehicleInfo};
use super::route::Route;
use super::side::Side;
use gateway_base::time::MonoTime;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::path::PathFrame;
use lanelet2_map::lane_network::LaneNetwork;

/// Speed below which the vehicle stands, m/s.
pub const STOP_SPEED_MPS: f64 = 0.1;

/// Circumstances by which a manoeuvre is judged.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)] // their names say it
pub struct DecisionContext<'a> {
    pub road: &'a LaneNetwork,
    pub route: &'a Route,
    /// Distances along the distance path.
    pub path_frame: PathFrame<'a>,
    /// The distance path with its lanelets; `None` if there is no such path.
    pub way: Option<&'a DistancePath>,
    /// Speed from the odometry, m/s, negative backwards.
    pub speed_mps: f64,
    pub parameters: &'a DeciderParameters,
    pub vehicle: &'a VehicleInfo,
    /// The quirks of upstream in effect.
    pub quirks: DeciderQuirks,
    /// A vehicle that stands longer than this gives up a turn that is out of range.
    pub standing_limit: Duration,
    /// The conditions on which a turn's signal waits for a junction; `None` if it never waits.
    pub junction_rule: Option<JunctionRule>,
    pub now: MonoTime,
}

impl DecisionContext<'_> {
    /// Returns the pose of the rear axle.
    pub fn ego(&self) -> Pose {
        self.path_frame.ego()
    }

    /// Returns the last junction that offers `side` and is not taken, among the junctions that the front has
    /// not passed and that begin before `until_m`, metres on the distance path; `None` if signals do not wait
    /// for junctions.
    pub fn offered_before(&self, side: Side, until_m: f64) -> Option<OfferedWay> {
        let path = self.way.filter(|_| self.junction_rule.is_some())?;
        last_offered(self.road, path, side, [path.ego_m + self.path_frame.front_m(), until_m])
    }

    /// Returns whether the vehicle stands or drives backwards.
    pub fn stands(&self) -> bool {
        self.speed_mps < STOP_SPEED_MPS
    }
}
