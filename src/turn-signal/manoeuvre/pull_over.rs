//! Pulling over to the roadside (docs/spec/turn-signal-decider.md, "Pull-over"), with the signal given before
//! the path is decided.

use super::announced::ManoeuvreIdentity;
use super::memory::ManoeuvreMemory;
use super::outcome::SignalReason;
use crate::chain::ManoeuvreRecords;
use crate::decision_context::DecisionContext;
use crate::section::Section;
use crate::shift::{Shift, ShiftKind, ShiftedPath};
use crate::subject::ManoeuvreKind;
use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::LaneId;

/// A pull-over, as the goal planner plans it.
#[derive(Debug, Clone, PartialEq)]
pub enum PullOver {
    /// A pull-over with its path to the roadside.
    Decided(Decided),
    /// A pull-over whose path is not decided yet.
    Undecided(Undecided),
}

/// A pull-over whose path is decided.
#[derive(Debug, Clone, PartialEq)]
pub struct Decided {
    /// Its path; `None` if empty.
    pub path: Option<ShiftedPath>,
    /// Pose at which it begins.
    pub start: Pose,
    /// The goal, as modified.
    pub goal: Pose,
    /// Offset of the vehicle from the centerline, metres.
    pub current_shift_m: f64,
    /// Its path is not a shift path, and the vehicle is within 1.0 m of the end of the first part.
    pub near_first_end: bool,
    /// The current lanelets, with the lengths of the goal search.
    pub lanes: Vec<LaneId>,
}

/// A pull-over whose path is not decided yet: the vehicle slows down in its lane.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Undecided {
    /// The path to the pose at which it would stop.
    pub stop_path: Vec<Pose>,
    /// Pose at which it begins to slow down with the blinker on; `None` until known.
    pub deceleration: Option<Pose>,
    /// Pose at which it would stop; `None` until known.
    pub stop: Option<Pose>,
}

impl ManoeuvreMemory {
    pub(super) fn pull_over(
        &mut self,
        context: &DecisionContext<'_>,
        pull_over: &PullOver,
        records: &mut ManoeuvreRecords,
    ) -> SignalReason {
        match pull_over {
            PullOver::Decided(decided) => self.decided(context, decided, records),
            PullOver::Undecided(undecided) => self.undecided(context, undecided, records),
        }
    }

    fn decided(
        &mut self,
        context: &DecisionContext<'_>,
        decided: &Decided,
        records: &mut ManoeuvreRecords,
    ) -> SignalReason {
        let Some(path) = &decided.path else {
            records.lose(context);
            return SignalReason::Idle;
        };
        let closest = context.road.closest(decided.lanes.iter().copied(), context.ego());
        let Some(lane) = closest.map(|lane| lane.id) else { return SignalReason::Idle };
        if self.pull_over_ignored == Some(lane) {
            return SignalReason::Ignored;
        }
        let shift = Shift {
            path,
            line: path.line(context, decided.start, decided.goal),
            lanes: &decided.lanes,
            current_shift_m: decided.current_shift_m,
            kind: ShiftKind::PullOver,
            forward: true,
            stop_override: decided.near_first_end,
            nears_junction: false,
            is_announced: false,
        };
        let kind = ManoeuvreKind::PullOver;
        let outcome =
            self.judged_in_lane(context, &shift, (kind, lane), |memory| &mut memory.pull_over_ignored);
        records.add(context, outcome.section);
        SignalReason::Shift(outcome.verdict)
    }

    fn undecided(
        &mut self,
        context: &DecisionContext<'_>,
        undecided: &Undecided,
        records: &mut ManoeuvreRecords,
    ) -> SignalReason {
        if self.pre_signal.is_none() {
            self.pre_signal = undecided.deceleration.map(|pose| (pose, undecided.stop));
        }
        let Some((deceleration, stop)) = self.pre_signal else { return SignalReason::Idle };
        let shifts_m = Vec::new();
        let Ok(path) = ShiftedPath::new(undecided.stop_path.clone(), shifts_m) else {
            return SignalReason::Idle;
        };
        let index = |pose: Pose| path.index_of(context, pose);
        let Some(end) = path.poses().last().copied() else { return SignalReason::Idle };
        let side = context.parameters.parking_side;
        let identity = ManoeuvreIdentity::new(&context.path_frame, ManoeuvreKind::PullOver, side, end);
        let is_announced = self.announced.from(identity).is_some();
        let is_before = index(context.ego()) < index(deceleration);
        if is_before && (context.quirks.ends_shifts_early || !is_announced) {
            return SignalReason::TooEarly;
        }
        if !is_announced {
            // Once its path is decided, the pull-over stays announced.
            self.announced.announce(identity, context.ego());
        }
        let section = Section::blinking(side, deceleration..end, stop.unwrap_or(deceleration)..end);
        records.add(context, section);
        SignalReason::OwnRule
    }
}
