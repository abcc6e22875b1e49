//! Forks: the point at which two ways with a common start diverge, and to which side.

use super::geometry::Point;
use super::geometry::polyline::{at_arc, is_on_left, nearest};
use super::lane_network::{Lanelet, TurnDirection};

/// Two ways have diverged where their middles are this far apart, metres: about the width of a lane.
const APART_M: f64 = 3.0;
/// Ways that have not diverged within this distance from their common start are lanes of one road, metres.
const FORK_M: f64 = 40.0;
const STEP_M: f64 = 2.0;

/// The point at which a way diverges from another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parting {
    /// Distance from their common start, metres.
    pub at_m: f64,
    /// The way lies to the left of the other at this point.
    pub is_left: bool,
}

/// Returns where `way` diverges from `other`, which begins at the same place; `None` if both are lanes of one
/// road, or too short to decide.
pub fn parting(way: &Lanelet, other: &Lanelet) -> Option<Parting> {
    let most_m = way.length_m().min(other.length_m()).min(FORK_M);
    let steps = std::iter::successors(Some(STEP_M), |at_m| Some(at_m + STEP_M));
    let places = steps.take_while(|at_m| *at_m < most_m).chain([most_m]);
    let point_apart = |at_m: f64| -> Option<Point> {
        let point = at_arc(&way.centerline, at_m)?;
        let is_apart = nearest(&other.centerline, point)?.distance_m >= APART_M;
        is_apart.then_some(point)
    };
    places.into_iter().find_map(|at_m| {
        let is_left = is_on_left(&other.centerline, point_apart(at_m)?);
        Some(Parting { at_m, is_left })
    })
}

/// Returns whether `way` leads off to the left, by its tag or else by its position next to `other`; `None` if
/// it leads to neither side.
pub fn leads_left(way: &Lanelet, other: &Lanelet) -> Option<bool> {
    match way.turn_direction {
        TurnDirection::Left => Some(true),
        TurnDirection::Right => Some(false),
        TurnDirection::Straight => None,
        TurnDirection::None => parting(way, other).map(|parting| parting.is_left),
    }
}
