//! Pulling out from the roadside (docs/spec/turn-signal-decider.md, "Pull-out").

use super::memory::ManoeuvreMemory;
use super::outcome::SignalReason;
use crate::chain::ManoeuvreRecords;
use crate::decision_context::DecisionContext;
use crate::section::Section;
use crate::shift::{Shift, ShiftKind, ShiftLine, ShiftVerdict, ShiftedPath};
use crate::subject::ManoeuvreKind;
use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::LaneId;

/// A pull-out, as the start planner plans it.
#[derive(Debug, Clone, PartialEq)]
pub struct PullOut {
    /// Its path; `None` if empty.
    pub path: Option<ShiftedPath>,
    /// Pose at which it starts.
    pub start: Pose,
    /// Pose at which it ends.
    pub end: Pose,
    /// Offset of the vehicle from the centerline, metres.
    pub current_shift_m: f64,
    /// It drives forwards; otherwise it backs up first.
    pub forward: bool,
    /// It has not departed, or its path is geometric and the vehicle is within 1.0 m of the end of the first
    /// part: it is also signalled while standing.
    pub standing_counts: bool,
    /// Not yet engaged forward, or within the time to blink before moving.
    pub before_start: bool,
    /// The current lanelets, extended.
    pub lanes: Vec<LaneId>,
}

impl ManoeuvreMemory {
    pub(super) fn pull_out(
        &mut self,
        context: &DecisionContext<'_>,
        pull_out: &PullOut,
        records: &mut ManoeuvreRecords,
    ) -> SignalReason {
        let Some(path) = &pull_out.path else { return SignalReason::Idle };
        let closest = context.road.closest(pull_out.lanes.iter().copied(), context.ego());
        let Some(lane) = closest.map(|lane| lane.id) else { return SignalReason::Idle };
        if self.pull_out_ignored == Some(lane) {
            return SignalReason::Ignored;
        }
        if self.pull_out_has_ended {
            return SignalReason::Shift(ShiftVerdict::NearBound);
        }
        let line = path.line(context, pull_out.start, pull_out.end);
        if starts_on_centerline(context, pull_out, path, &line) {
            return centerline_start(context, pull_out, path, records);
        }
        let shift = Shift {
            path,
            line,
            lanes: &pull_out.lanes,
            current_shift_m: pull_out.current_shift_m,
            kind: ShiftKind::PullOut,
            forward: pull_out.forward,
            stop_override: pull_out.standing_counts,
            nears_junction: false,
            is_announced: false,
        };
        let shift = Shift { nears_junction: nears_junction(context, &shift), ..shift };
        let kind = ManoeuvreKind::PullOut;
        let outcome =
            self.judged_in_lane(context, &shift, (kind, lane), |memory| &mut memory.pull_out_ignored);
        self.pull_out_has_ended = shift.nears_junction && outcome.verdict == ShiftVerdict::NearBound;
        records.add_by_rule(context, outcome.section);
        SignalReason::Shift(outcome.verdict)
    }
}

/// Returns whether the second half of the pull-out leads to a junction that offers its side and is not taken:
/// there its signal would be mistaken for a turn. In the first half the vehicle may be near the bound of a
/// narrow lane, and needs its signal.
fn nears_junction(context: &DecisionContext<'_>, shift: &Shift<'_>) -> bool {
    let ShiftLine { start_index, end_index, .. } = shift.line;
    let whole_m = shift.path.offset_between_m(start_index, end_index);
    let rest_m = shift.path.offset_at_m(end_index) - shift.current_shift_m;
    let nears = || {
        let search_m = context.parameters.intersection_search_m(context.speed_mps);
        let until_m = context.way?.ego_m + context.path_frame.front_m() + search_m;
        context.offered_before(shift.side(), until_m)
    };
    rest_m.abs() <= whole_m.abs() / 2.0 && nears().is_some()
}

/// Returns whether the vehicle starts from the middle of a lane, with a negligible shift.
fn starts_on_centerline(
    context: &DecisionContext<'_>,
    pull_out: &PullOut,
    path: &ShiftedPath,
    line: &ShiftLine,
) -> bool {
    let parameters = context.parameters;
    let shift_m = path.offset_between_m(line.start_index, line.end_index);
    shift_m.abs() < parameters.pull_out_minimum_shift_m
        && !parameters.pull_out_enable_back
        && parameters.pull_out_middle_distance_m < parameters.pull_out_minimum_shift_m
        && pull_out.before_start
}

/// Upstream only changes the command of the previous record, whose points are usually at the origin of the
/// map, so that nothing is signalled. In improved mode, the record lies at the start.
fn centerline_start(
    context: &DecisionContext<'_>,
    pull_out: &PullOut,
    path: &ShiftedPath,
    records: &mut ManoeuvreRecords,
) -> SignalReason {
    let side = context.parameters.centerline_start_side;
    if context.quirks.centerline_start_has_no_points {
        records.change_command(side.into());
    } else {
        let end = path.poses().get(path.index_of(context, pull_out.end)).copied().unwrap_or_default();
        let start = context.ego();
        records.add(context, Section::blinking(side, start..end, start..end));
    }
    SignalReason::OwnRule
}
