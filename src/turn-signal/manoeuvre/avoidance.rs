//! Avoidance of static obstacles (docs/spec/turn-signal-decider.md, "Avoidance").

use super::memory::ManoeuvreMemory;
use super::outcome::SignalReason;
use crate::chain::ManoeuvreRecords;
use crate::decision_context::DecisionContext;
use crate::parameters::CandidatePolicy;
use crate::shift::{Shift, ShiftKind, ShiftLine, ShiftVerdict, ShiftedPath, judge};
use crate::subject::ManoeuvreKind;
use lanelet2_map::lane_network::LaneId;

/// Maximum distance from its path at which the vehicle is avoiding, metres.
const MAX_DEVIATION_M: f64 = 1.0;

/// An avoidance: shift lines out and back.
#[derive(Debug, Clone, PartialEq)]
pub struct Avoidance {
    /// The linearly shifted path.
    pub path: ShiftedPath,
    /// Its shift lines, in order.
    pub lines: Vec<AvoidanceLine>,
    /// Index of the path's point nearest to the vehicle.
    pub ego_index: usize,
    /// Offset of the vehicle from the path, metres.
    pub deviation_m: f64,
    /// Offset of the path at the vehicle, metres.
    pub current_shift_m: f64,
    /// The lanelets in which the vehicle should stay.
    pub lanes: Vec<LaneId>,
    /// It is being executed; otherwise it waits for approval.
    pub approved: bool,
}

/// One shift of an avoidance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AvoidanceLine {
    /// Id of the line (`uuid`).
    pub id: u128,
    /// Start and end of the line.
    pub line: ShiftLine,
    /// Offset before the line, metres to the left.
    pub start_shift_m: f64,
    /// Offset after the line, metres to the left.
    pub end_shift_m: f64,
}

impl AvoidanceLine {
    fn shifts_left(&self) -> bool {
        self.start_shift_m < self.end_shift_m
    }
}

impl Avoidance {
    /// Returns the lines whose end is not behind the vehicle, in order.
    fn lines_left(&self) -> impl Iterator<Item = &AvoidanceLine> {
        self.lines.iter().filter(|line| line.line.end_index >= self.ego_index)
    }

    fn shift(&self, line: &AvoidanceLine) -> Shift<'_> {
        Shift {
            path: &self.path,
            line: line.line,
            lanes: &self.lanes,
            current_shift_m: self.current_shift_m,
            kind: ShiftKind::Avoidance,
            forward: true,
            stop_override: false,
            nears_junction: false,
            is_announced: false,
        }
    }
}

impl ManoeuvreMemory {
    pub(super) fn avoidance(
        &mut self,
        context: &DecisionContext<'_>,
        avoidance: &Avoidance,
        records: &mut ManoeuvreRecords,
    ) -> SignalReason {
        if !avoidance.approved && !signalled_while_waiting(context)
            || avoidance.deviation_m.abs() > MAX_DEVIATION_M
        {
            return SignalReason::Idle;
        }
        if !context.quirks.ends_shifts_early {
            return self.each_line(context, avoidance, records);
        }
        let Some(line) = target_line(context, avoidance) else { return SignalReason::Idle };
        if self.avoidance_ignored.contains(&line.id) {
            return SignalReason::Ignored;
        }
        let outcome = judge(context, &avoidance.shift(&line));
        if outcome.ignore() {
            self.avoidance_ignored.insert(line.id);
        }
        records.add(context, outcome.section);
        SignalReason::Shift(outcome.verdict)
    }

    /// Judges each line by itself and adds a record for each; the pairwise rule decides between them (W18).
    fn each_line(
        &mut self,
        context: &DecisionContext<'_>,
        avoidance: &Avoidance,
        records: &mut ManoeuvreRecords,
    ) -> SignalReason {
        let mut verdicts = Vec::new();
        for line in avoidance.lines_left() {
            let outcome = self.judged(context, &avoidance.shift(line), ManoeuvreKind::Avoidance);
            records.add(context, outcome.section);
            verdicts.push(outcome.verdict);
        }
        let signalled = verdicts.iter().find(|verdict| **verdict == ShiftVerdict::Signalled);
        signalled.or(verdicts.first()).map_or(SignalReason::Idle, |verdict| SignalReason::Shift(*verdict))
    }
}

fn signalled_while_waiting(context: &DecisionContext<'_>) -> bool {
    match context.parameters.avoidance_candidate {
        CandidatePolicy::None | CandidatePolicy::StopOnApproval => false,
        CandidatePolicy::StoppedCandidate => context.stands(),
        CandidatePolicy::AllCandidate => true,
    }
}

/// Chooses the line as upstream does: the first remaining shift, or the first shift back if it is near.
fn target_line(context: &DecisionContext<'_>, avoidance: &Avoidance) -> Option<AvoidanceLine> {
    let mut left = avoidance.lines_left();
    let first = left.next()?;
    let Some(back) = left.find(|line| line.shifts_left() != first.shifts_left()) else { return Some(*first) };
    let ego = context.ego().position;
    let ahead_m = |line: &AvoidanceLine| {
        avoidance.path.distance_to_m(ego, line.line.start_index).unwrap_or(f64::INFINITY)
    };
    let near_m = context.speed_mps * context.parameters.avoidance_prepare_time_s;
    let turns_back = ahead_m(first) <= 0.0 && ahead_m(back) < near_m;
    Some(if turns_back { *back } else { *first })
}
