//! The decision at one cycle of a drive.

use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::LaneId;
use turn_signal::compat::DeciderCompat;
use turn_signal::decision::Decision;

/// The decision at one cycle of a drive.
#[derive(Debug, Clone, Copy)]
pub struct Snapshot<'a> {
    /// The `compat` of the decider.
    pub compat: DeciderCompat,
    /// Time since the start, seconds.
    pub at_s: f64,
    /// Position of the rear axle, metres along the route.
    pub at_m: f64,
    /// Pose of the rear axle on the map.
    pub pose: Pose,
    /// Speed, m/s; negative while backing up.
    pub speed_mps: f64,
    /// The lanelet of the rear axle.
    pub lane: Option<LaneId>,
    /// The decision with its reasons.
    pub decision: &'a Decision,
}
