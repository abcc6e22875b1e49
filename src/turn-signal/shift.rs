//! The rule for all lateral manoeuvres (docs/spec/turn-signal-decider.md, "Shift rule"): avoidance, pulling
//! out and over.

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::decision_context::DecisionContext;
use super::section::Section;
use super::side::Side;
use crate::light_command::{HazardCommand, TurnCommand};
use lanelet2_map::geometry::Pose;

mod shifted_path;
mod surroundings;

use shifted_path::Offsets;
pub use shifted_path::{Shift, ShiftKind, ShiftLine, ShiftedPath};

/// The start of a signalled shift counts as ahead until the front is past it by this much, metres: distances
/// along the shifted path and along the lanes differ, and the signal would drop out between the two.
const START_TOLERANCE_M: f64 = 2.0;

/// The step of the rule that decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema, Display)]
#[serde(rename_all = "snake_case")]
pub enum ShiftVerdict {
    /// 0: backwards; hazard lights.
    #[display("driving backwards")]
    Backwards,
    /// 1: the line is not on the path.
    #[display("the shift is not on its path")]
    OffPath,
    /// 3: less than a shift.
    #[display("shift too small")]
    TooSmall,
    /// 4: next to nothing remains.
    #[display("next to nothing of the shift remains")]
    NearlyDone,
    /// 5: too far away yet.
    #[display("shift too far ahead")]
    TooEarly,
    /// 6: swerving is not signalled.
    #[display("swerving is not signalled")]
    SwervingIsSilent,
    /// 7: no lanelet of the route.
    #[display("no lanelet of the route")]
    NoLane,
    /// 8: only a hatched marking on that side.
    #[display("only a hatched marking on that side")]
    HatchedSide,
    /// 9: the vehicle stays between the bounds.
    #[display("the vehicle stays in its lane")]
    StaysInLane,
    /// 10: standing before returning.
    #[display("standing in the lane before returning")]
    StandsBeforeReturn,
    /// 11: near the bound of the lane it joins.
    #[display("near the bound of the lane it joins")]
    NearBound,
    /// 12: the shift is signalled.
    #[display("signalled")]
    Signalled,
}

/// The result of the rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShiftOutcome {
    /// The record; without a command if not signalled.
    pub section: Section,
    /// The step that decided.
    pub verdict: ShiftVerdict,
}

impl ShiftOutcome {
    /// Returns whether upstream does not judge the shift again.
    pub const fn ignore(&self) -> bool {
        use ShiftVerdict::{Backwards, Signalled, SwervingIsSilent, TooEarly};
        !matches!(self.verdict, Backwards | TooEarly | SwervingIsSilent | Signalled)
    }
}

/// Judges a shift, step by step.
pub fn judge(context: &DecisionContext<'_>, shift: &Shift<'_>) -> ShiftOutcome {
    if !shift.forward {
        return ShiftOutcome { section: backwards(context), verdict: ShiftVerdict::Backwards };
    }
    let Some((offsets, start, end, ahead_m)) = located(context, shift) else {
        return ShiftOutcome { section: Section::default(), verdict: ShiftVerdict::OffPath };
    };
    if let Some(verdict) = objection(context, shift, offsets, ahead_m - context.vehicle.front_m()) {
        return ShiftOutcome { section: shift.path.silent(), verdict };
    }
    let tolerance_m = if shift.is_announced { START_TOLERANCE_M } else { 0.0 };
    let is_ahead = ahead_m - context.vehicle.front_m() + tolerance_m > 0.0;
    let desired_start = if is_ahead { context.ego() } else { start };
    let section = Section::blinking(offsets.side(), desired_start..end, start..end);
    ShiftOutcome { section, verdict: ShiftVerdict::Signalled }
}

/// Step 0: returns a record with hazard lights from the start of the route to here.
pub(super) fn backwards(context: &DecisionContext<'_>) -> Section {
    Section {
        turn: TurnCommand::NoCommand,
        hazard: HazardCommand::Enable,
        desired_start: context.route.start(),
        required_start: context.route.start(),
        desired_end: context.ego(),
        required_end: context.ego(),
        ..Section::default()
    }
}

/// Step 1: returns offsets, first and last pose, and arc length to the first; `None` when the line is not on
/// the path.
fn located(context: &DecisionContext<'_>, shift: &Shift<'_>) -> Option<(Offsets, Pose, Pose, f64)> {
    let ShiftLine { start_index, end_index, .. } = shift.line;
    let offset = |index: usize| shift.path.shifts_m.get(index).copied();
    let offsets = Offsets { before_m: offset(start_index)?, after_m: offset(end_index)? };
    let pose = |index: usize| shift.path.poses().get(index).copied();
    let ahead_m = if context.quirks.ignores_height_and_continuity {
        shift.path.distance_to_m(context.ego().position, start_index)?
    } else {
        shift.path.distance_of_visit_to_m(context.ego(), start_index, context.parameters.nearest)?
    };
    Some((offsets, pose(start_index)?, pose(end_index)?, ahead_m))
}

/// Steps 3 to 11: returns the first objection to a signal. `ahead_m` is the front's distance to the
/// start of the shift.
fn objection(
    context: &DecisionContext<'_>,
    shift: &Shift<'_>,
    offsets: Offsets,
    ahead_m: f64,
) -> Option<ShiftVerdict> {
    let parameters = context.parameters;
    // Written so that an offset that is not a number is an objection.
    let at_least = |value: f64, limit: f64| value.abs() >= limit;
    if !at_least(offsets.relative_m(), parameters.shift_length_threshold_m) {
        return Some(ShiftVerdict::TooSmall);
    }
    if shift.nears_junction && is_near_bound(context, offsets.side()) {
        return Some(ShiftVerdict::NearBound);
    }
    // Upstream judges again in every cycle what it already signals (W18).
    if shift.is_announced {
        return None;
    }
    let remaining_m = offsets.after_m - shift.current_shift_m;
    if !at_least(remaining_m, parameters.remaining_shift_length_threshold_m) {
        return Some(ShiftVerdict::NearlyDone);
    }
    if parameters.prepare_m(context.speed_mps) < ahead_m {
        return Some(ShiftVerdict::TooEarly);
    }
    if !parameters.on_swerving {
        return Some(ShiftVerdict::SwervingIsSilent);
    }
    let Some(lane) = context.road.closest(context.route.lanes(), shift.line.end) else {
        return Some(ShiftVerdict::NoLane);
    };
    let threshold_m = parameters.shift_length_threshold_m;
    if shift.kind == ShiftKind::Avoidance {
        if surroundings::hatched_forbids(lane, offsets, threshold_m) {
            return Some(ShiftVerdict::HatchedSide);
        }
        if !surroundings::crosses_bound(context, shift) {
            return Some(ShiftVerdict::StaysInLane);
        }
    }
    let is_return = offsets.before_m.abs() > threshold_m && offsets.after_m.abs() < threshold_m;
    if context.stands() && !shift.stop_override && is_return && surroundings::is_inside(context, shift.lanes)
    {
        return Some(ShiftVerdict::StandsBeforeReturn);
    }
    let near_bound = context.quirks.ends_shifts_early
        && shift.kind == ShiftKind::PullOut
        && is_near_bound(context, offsets.side());
    near_bound.then_some(ShiftVerdict::NearBound)
}

/// Step 11: returns whether the front corner on a side is near the bound there.
fn is_near_bound(context: &DecisionContext<'_>, side: Side) -> bool {
    let limit_m = context.parameters.remaining_distance_to_bound_threshold_m;
    surroundings::distance_to_bound_m(context, side).is_some_and(|distance_m| distance_m < limit_m)
}
