//! State of manoeuvres that is kept from one cycle to the next.

use std::collections::BTreeSet;

use super::announced::{AnnouncedManoeuvres, ManoeuvreIdentity};
use crate::decision_context::DecisionContext;
use crate::shift::{Shift, ShiftOutcome, ShiftVerdict, judge};
use crate::subject::ManoeuvreKind;
use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::LaneId;

/// State of manoeuvres that is kept from one cycle to the next.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ManoeuvreMemory {
    /// Upstream: shift lines that are not judged again while avoiding.
    pub(super) avoidance_ignored: BTreeSet<u128>,
    /// Upstream: the lanelet in which pulling out is not judged again.
    pub(super) pull_out_ignored: Option<LaneId>,
    /// Improved: the signal of the pull-out has ended before a junction.
    pub(super) pull_out_has_ended: bool,
    /// Upstream: the lanelet in which pulling over is not judged again.
    pub(super) pull_over_ignored: Option<LaneId>,
    /// First deceleration pose of a pull-over, and the stop pose if it was known at the time.
    pub(super) pre_signal: Option<(Pose, Option<Pose>)>,
    /// Improved: the announced manoeuvres.
    pub(super) announced: AnnouncedManoeuvres,
}

impl ManoeuvreMemory {
    /// Judges a shift, which stays signalled until it is complete (W18).
    pub(super) fn judged(
        &mut self,
        context: &DecisionContext<'_>,
        shift: &Shift<'_>,
        kind: ManoeuvreKind,
    ) -> ShiftOutcome {
        let identity = ManoeuvreIdentity::new(&context.path_frame, kind, shift.side(), shift.line.end);
        let is_announced = self.announced.from(identity).is_some();
        let outcome = judge(context, &Shift { is_announced, ..*shift });
        if outcome.verdict == ShiftVerdict::Signalled && !is_announced {
            self.announced.announce(identity, context.ego());
        }
        outcome
    }

    /// Judges a shift in a lanelet; upstream remembers in `ignored` the lanelet in which it does not judge
    /// the shift again.
    pub(super) fn judged_in_lane(
        &mut self,
        context: &DecisionContext<'_>,
        shift: &Shift<'_>,
        (kind, lane): (ManoeuvreKind, LaneId),
        ignored: fn(&mut Self) -> &mut Option<LaneId>,
    ) -> ShiftOutcome {
        if !context.quirks.ends_shifts_early {
            return self.judged(context, shift, kind);
        }
        let outcome = judge(context, shift);
        *ignored(self) = outcome.ignore().then_some(lane);
        outcome
    }

    /// Clears the state of modules without a manoeuvre in this cycle.
    pub(super) fn forget_absent(&mut self, present: &BTreeSet<ManoeuvreKind>) {
        if !present.contains(&ManoeuvreKind::Avoidance) {
            self.avoidance_ignored.clear();
        }
        if !present.contains(&ManoeuvreKind::PullOut) {
            self.pull_out_ignored = None;
            self.pull_out_has_ended = false;
        }
        if !present.contains(&ManoeuvreKind::PullOver) {
            self.pull_over_ignored = None;
            self.pre_signal = None;
        }
        self.announced.end_cycle();
    }
}
