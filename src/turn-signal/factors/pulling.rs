//! Builds pull-outs and pull-overs from planning factors, which have start, end and offsets. The rest is
//! inferred: the vehicle has not departed while it is within a metre of the start, and the planner's path
//! counts as one piece. Before the path to the roadside is decided, the pose at which the vehicle begins to
//! slow down comes from a factor to stop or slow down; without such a factor, it is the first point whose
//! planned speed covers the remaining distance to the stop within the search time.

use super::factor::{Behavior, FactorContext, Made, Ramp};
use super::path_offsets::PathOffsets;
use crate::decision_context::STOP_SPEED_MPS;
use crate::inputs::FactorFlaw;
use crate::manoeuvre::pull_out::PullOut;
use crate::manoeuvre::pull_over::{Decided, PullOver, Undecided};
use crate::manoeuvre::{Manoeuvre, ManoeuvreKind};
use crate::planner_input::PlanningFactor;
use crate::shift::ShiftedPath;
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::LaneId;

/// Distance from the start within which the vehicle has not departed, metres.
const DEPARTED_M: f64 = 1.0;
/// A planned speed of at least this share of the limit counts as at the limit.
const AT_LIMIT: f64 = 0.95;

/// Returns the pull-out of a factor. Ignores its `behavior`, which comes from upstream's own signal.
pub(super) fn out(
    context: &FactorContext<'_>,
    path_offsets: Option<&PathOffsets>,
    factor: &PlanningFactor,
) -> Result<Option<Manoeuvre>, FactorFlaw> {
    let ego = context.odometry.pose;
    let lanes = path_offsets.map(|path_offsets| path_offsets.lanes.clone()).filter(|lanes| !lanes.is_empty());
    let lanes: Vec<LaneId> = lanes.unwrap_or_else(|| context.route.lanes().collect());
    if !factor.is_driving_forward {
        // Backing up needs neither path nor offsets: the hazard lights are used, wherever it leads.
        let ahead = Pose { position: ego.point_at(1.0, 0.0), yaw_rad: ego.yaw_rad };
        let path = ShiftedPath::new(vec![ego, ahead], vec![0.0, 0.0]).ok();
        let pull_out = PullOut {
            path,
            start: ego,
            end: ahead,
            current_shift_m: 0.0,
            forward: false,
            standing_counts: true,
            before_start: false,
            lanes,
        };
        return Ok(Some(Manoeuvre::PullOut(pull_out)));
    }
    if factor.is_about_speed() {
        return Ok(None);
    }
    let ramp = factor.interval()?.ramp();
    Ok(Some(Manoeuvre::PullOut(forwards(context, path_offsets, &ramp, lanes))))
}

/// Returns the pull-out that drives forwards along a ramp.
pub(super) fn forwards(
    context: &FactorContext<'_>,
    path_offsets: Option<&PathOffsets>,
    ramp: &Ramp,
    lanes: Vec<LaneId>,
) -> PullOut {
    let ego = context.odometry.pose;
    let near_start = ego.position.distance_m(ramp.start.position) <= DEPARTED_M;
    PullOut {
        path: path_offsets.and_then(|path_offsets| path_offsets.ramped(&[*ramp])),
        start: ramp.start,
        end: ramp.end,
        current_shift_m: path_offsets.map_or(0.0, |path_offsets| path_offsets.offset_m(ego)),
        forward: true,
        standing_counts: near_start,
        before_start: near_start && (!context.is_engaged() || context.odometry.speed_mps < STOP_SPEED_MPS),
        lanes,
    }
}

/// Returns the pull-over of the module's factors: decided if one of them shifts, otherwise announced by
/// factors to stop or slow down.
pub(super) fn over(
    context: &FactorContext<'_>,
    path_offsets: Option<&PathOffsets>,
    factors: &[&PlanningFactor],
    refuse: &mut impl FnMut(FactorFlaw),
) -> Made {
    let Some(first) = factors.first() else { return Ok(Vec::new()) };
    let Some(path_offsets) = path_offsets else { return Err(ManoeuvreKind::PullOver) };
    let pull_over = match factors.iter().find(|factor| !factor.is_about_speed()) {
        Some(shifting) => shifting
            .interval()
            .ok()
            .map(|interval| PullOver::Decided(decided(context, path_offsets, &interval.ramp()))),
        None => undecided(context, path_offsets, factors).map(PullOver::Undecided),
    };
    if pull_over.is_none() && !(first.control_points.len() == 1 && first.is_about_speed()) {
        refuse(FactorFlaw::NoStretch);
    }
    Ok(pull_over.into_iter().map(Manoeuvre::PullOver).collect())
}

/// Returns the pull-over along a ramp.
pub(super) fn decided(context: &FactorContext<'_>, path_offsets: &PathOffsets, ramp: &Ramp) -> Decided {
    let goal = context.modified_goal.unwrap_or(ramp.end);
    Decided {
        path: path_offsets.ramped(&[Ramp { end: goal, ..*ramp }]),
        start: ramp.start,
        goal,
        current_shift_m: path_offsets.offset_m(context.odometry.pose),
        near_first_end: false,
        lanes: path_offsets.lanes.clone(),
    }
}

fn undecided(
    context: &FactorContext<'_>,
    path_offsets: &PathOffsets,
    factors: &[&PlanningFactor],
) -> Option<Undecided> {
    let pose_of = |behavior: Behavior| {
        let factor = factors.iter().find(|factor| factor.known_behavior() == behavior)?;
        factor.control_points.first().map(|point| point.pose)
    };
    let (slow_down, stop) = (pose_of(Behavior::SlowDown), pose_of(Behavior::Stop));
    let deceleration = slow_down.or_else(|| begins_to_brake(context, stop?.position));
    deceleration.map(|deceleration| Undecided {
        stop_path: path_offsets.poses.clone(),
        deceleration: Some(deceleration),
        stop,
    })
}

/// Returns the first point whose planned speed covers the remaining distance to the stop within the search
/// time.
fn begins_to_brake(context: &FactorContext<'_>, stop: Point) -> Option<Pose> {
    let at_limit = |speed_mps: f64, left_m: f64| {
        let limit_mps = left_m / context.parameters.search_time_s;
        left_m > 0.0 && speed_mps >= limit_mps * AT_LIMIT
    };
    let braking =
        context.path?.iter().find(|point| at_limit(point.speed_mps, point.pose.position.distance_m(stop)));
    braking.map(|point| point.pose)
}
