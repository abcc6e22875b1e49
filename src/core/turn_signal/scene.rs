//! The moment a decision is made in: road, route, vehicle, parameters.

use super::geometry::Pose;
use super::geometry::path::Ruler;
use super::parameters::{Parameters, Vehicle};
use super::road::Road;
use super::route::Route;
use crate::core::time::MonoTime;

/// Which behaviour is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Mode {
    /// Without the weaknesses of upstream (section 8.3).
    #[default]
    Improved,
    /// As upstream executes it, discrepancies included (sections 3 to 5).
    Compat,
}

/// Below this the vehicle stands, m/s.
pub const STOP_SPEED_MPS: f64 = 0.1;

/// Everything a manoeuvre is looked at with.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The lanelets.
    pub road: &'a Road,
    /// The route.
    pub route: &'a Route,
    /// Distances along the distance path.
    pub ruler: Ruler<'a>,
    /// Speed of the odometry, m/s, negative backwards.
    pub speed_mps: f64,
    /// The parameters.
    pub parameters: &'a Parameters,
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// Which behaviour.
    pub mode: Mode,
    /// When.
    pub now: MonoTime,
}

impl Scene<'_> {
    /// The rear axle.
    pub fn ego(&self) -> Pose {
        self.ruler.ego()
    }

    /// As upstream.
    pub fn is_compat(&self) -> bool {
        self.mode == Mode::Compat
    }

    /// The vehicle does not move (forwards).
    pub fn stands(&self) -> bool {
        self.speed_mps < STOP_SPEED_MPS
    }
}
