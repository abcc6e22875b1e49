//! Objections from the road to signalling a shift: hatched sides, bounds not crossed, bounds near
//! (docs/spec/turn-signal-decider.md, "Shift rule", steps 8 to 11).

use super::shifted_path::{Offsets, Shift};
use crate::decision_context::DecisionContext;
use crate::parameters::VehicleInfo;
use crate::side::Side;
use lanelet2_map::geometry::shape::{sideways_distance_m, touches};
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::{LaneId, Lanelet};

/// Returns whether the shift leads over, or back from, a side with only a hatched marking.
pub(super) fn hatched_forbids(lane: &Lanelet, offsets: Offsets, threshold_m: f64) -> bool {
    let Offsets { before_m, after_m } = offsets;
    let (left_only, right_only) = (lane.left.is_hatched_only(), lane.right.is_hatched_only());
    let (near, far) = (|shift: f64| shift.abs() < threshold_m, |shift: f64| shift.abs() > threshold_m);
    let (toward, from) = offsets.side().choose((left_only, right_only), (right_only, left_only));
    near(before_m) && far(after_m) && toward
        || far(before_m) && near(after_m) && from
        || before_m > threshold_m && after_m > threshold_m && left_only
        // Upstream compares with the positive threshold here.
        || before_m < threshold_m && after_m < threshold_m && right_only
}

/// Returns whether the vehicle touches a bound of a current lanelet while driving along the shift.
pub(super) fn crosses_bound(context: &DecisionContext<'_>, shift: &Shift<'_>) -> bool {
    let bounds: Vec<&[Point]> = shift
        .lanes
        .iter()
        .filter_map(|id| context.road.lane(*id))
        .flat_map(|lane| [lane.left_bound.as_slice(), lane.right_bound.as_slice()])
        .collect();
    let (start, end) = (shift.line.start_index, shift.line.end_index);
    let driven = shift.path.poses().get(start..end.max(start)).unwrap_or_default();
    driven.iter().any(|pose| {
        let ring = footprint(context.vehicle, *pose);
        bounds.iter().any(|bound| touches(&ring, bound))
    })
}

/// Returns whether the vehicle is in one of `lanes`.
pub(super) fn is_inside(context: &DecisionContext<'_>, lanes: &[LaneId]) -> bool {
    lanes.iter().filter_map(|id| context.road.lane(*id)).any(|lane| lane.contains(context.ego().position))
}

/// Returns the lateral distance from the front corner on `side` to the bound on that side of the lanelet
/// below it, metres.
pub(super) fn distance_to_bound_m(context: &DecisionContext<'_>, side: Side) -> Option<f64> {
    let (vehicle, ego) = (context.vehicle, context.ego());
    let corner = ego.point_at(vehicle.front_m(), side.choose(vehicle.left_m, -vehicle.right_m));
    let lane =
        context.road.closest(context.route.lanes(), Pose { position: corner, yaw_rad: ego.yaw_rad })?;
    sideways_distance_m(ego, corner, side.choose(&lane.left_bound, &lane.right_bound))
}

/// Returns the outline of the vehicle at a pose of its rear axle.
fn footprint(vehicle: &VehicleInfo, pose: Pose) -> [Point; 6] {
    let (front, middle, rear) = (vehicle.front_m(), vehicle.wheel_base_m / 2.0, -vehicle.rear_overhang_m);
    let (left, right) = (vehicle.left_m, -vehicle.right_m);
    [(front, left), (front, right), (middle, right), (rear, right), (rear, left), (middle, left)]
        .map(|(forward_m, left_m)| pose.point_at(forward_m, left_m))
}
