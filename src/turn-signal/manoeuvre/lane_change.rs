//! Lane changes (docs/spec/turn-signal-decider.md, "Lane change"). Upstream's lane change has no start: it
//! counts as begun from the first request (W9). In improved mode, it begins where the steering begins.

use super::announced::ManoeuvreIdentity;
use super::memory::ManoeuvreMemory;
use super::outcome::SignalReason;
use crate::chain::ManoeuvreRecords;
use crate::decision_context::DecisionContext;
use crate::section::Section;
use crate::side::Side;
use crate::subject::ManoeuvreKind;
use lanelet2_map::geometry::path::Path;
use lanelet2_map::geometry::polyline::{at_arc, headed};
use lanelet2_map::geometry::{Point, Pose};

/// A lane change, requested or running.
#[derive(Debug, Clone, PartialEq)]
pub struct LaneChange {
    /// The side to which it changes.
    pub side: Side,
    /// Its state in the planner.
    pub phase: LaneChangePhase,
    /// Pose at which steering begins, if known.
    pub start: Option<Pose>,
    /// Pose at which it crosses the bound of the lane, if known.
    pub crossing: Option<Pose>,
    /// Pose at which it ends; `None` without a valid path.
    pub end: Option<Pose>,
    /// Path of the previous module, for a waiting lane change.
    pub previous_path: Vec<Pose>,
    /// Length that the planner reserves for it before the lane ends, metres.
    pub minimum_length_m: f64,
}

/// The progress of a lane change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LaneChangePhase {
    /// Approved, driven, held or aborted.
    Running,
    /// Waiting for approval.
    Waiting,
    /// Waiting, and of a special kind (avoidance by lane change) or not on a lane: not signalled.
    Unsignalled,
}

impl ManoeuvreMemory {
    pub(super) fn lane_change(
        &mut self,
        context: &DecisionContext<'_>,
        change: &LaneChange,
        records: &mut ManoeuvreRecords,
    ) -> SignalReason {
        let last_of_path = change.previous_path.last().copied();
        let end = match change.phase {
            LaneChangePhase::Unsignalled => None,
            LaneChangePhase::Running => change.end,
            LaneChangePhase::Waiting if change.previous_path.is_empty() => None,
            LaneChangePhase::Waiting => change.end.or(last_of_path),
        };
        let Some(end) = end else { return SignalReason::Idle };
        let waits = change.phase == LaneChangePhase::Waiting;
        let (start, required_end) = match (context.quirks.lane_changes_have_begun, change.start) {
            (false, Some(start)) => {
                let kind = ManoeuvreKind::LaneChange;
                let identity = ManoeuvreIdentity::new(&context.path_frame, kind, change.side, end);
                let Some(from) = self.announced_from(context, identity, start) else {
                    return SignalReason::TooEarly;
                };
                let section =
                    Section::blinking(change.side, from..end, start..change.crossing.unwrap_or(end));
                records.add(context, section);
                return SignalReason::OwnRule;
            }
            _ if waits && records.request_side() => {
                let Some(start) = terminal_start(context, change) else { return SignalReason::Idle };
                (start, end)
            }
            _ => (context.ego(), end),
        };
        let section = Section::blinking(change.side, start..end, start..required_end);
        records.add(context, section);
        SignalReason::OwnRule
    }

    /// Returns the pose at which the announcement of a lane change began; `None` while it is too far ahead.
    /// Once announced it stays announced, however much the vehicle slows down.
    fn announced_from(
        &mut self,
        context: &DecisionContext<'_>,
        identity: ManoeuvreIdentity,
        start: Pose,
    ) -> Option<Pose> {
        let known = self.announced.from(identity);
        known.or_else(|| {
            let ahead_m = context.path_frame.from_front_m(start);
            // Already steering: the announcement begins at the start of the lane change.
            let from = if ahead_m > 0.0 { context.ego() } else { start };
            let is_near = ahead_m <= context.parameters.prepare_m(context.speed_mps);
            is_near.then(|| self.announced.announce(identity, from)).map(|()| from)
        })
    }
}

/// Returns the latest pose at which a waiting lane change must begin, on the path of the previous module.
fn terminal_start(context: &DecisionContext<'_>, change: &LaneChange) -> Option<Pose> {
    let path = Path::new(change.previous_path.iter().copied()).ok()?;
    let buffer_m = change.minimum_length_m
        + context.parameters.lane_change_activation_length_m
        + context.vehicle.front_m();
    let points: Vec<Point> = path.poses().iter().map(|pose| pose.position).collect();
    let position = at_arc(&points, (path.length_m() - buffer_m).max(0.0))?;
    let station_m = path.plain_station_m(position);
    let before = |(index, _): &(usize, Pose)| path.arc_m(*index) <= station_m;
    let piece = headed(&points).into_iter().enumerate().take_while(before).last();
    Some(Pose { position, yaw_rad: piece.map_or(0.0, |(_, pose)| pose.yaw_rad) })
}
