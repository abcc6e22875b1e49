//! The manoeuvres that the planner of a drive publishes at a cycle.

use std::iter::successors;

use super::route_path::{RoutePath, smooth};
use crate::config::drive::{DriveFile, DriveMoment, ManoeuvrePlan, PlanKind, PlannedShift};
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::path::PathError;
use lanelet2_map::lane_network::LaneId;
use turn_signal::manoeuvre::Manoeuvre;
use turn_signal::manoeuvre::avoidance::{Avoidance, AvoidanceLine};
use turn_signal::manoeuvre::lane_change::{LaneChange, LaneChangePhase};
use turn_signal::manoeuvre::pull_out::PullOut;
use turn_signal::manoeuvre::pull_over::{Decided, PullOver, Undecided};
use turn_signal::parameters::DeciderParameters;
use turn_signal::shift::{ShiftLine, ShiftedPath};

/// Reach of manoeuvre paths behind and ahead of the vehicle, metres.
const BEHIND_M: f64 = 100.0;
const AHEAD_M: f64 = 300.0;
const SPACING_M: f64 = 0.5;
/// Points closer together than this count as one, metres.
const SAME_M: f64 = 1e-6;
/// A manoeuvre is over when its end is this far behind, metres.
const OVER_M: f64 = 1.0;
/// Distance from the end of the first part of a path within which the end counts as reached, metres.
const NEAR_PART_END_M: f64 = 1.0;

#[derive(Debug, Clone, Copy)]
pub(super) struct DrivePosition<'a> {
    pub(super) file: &'a DriveFile,
    pub(super) route_path: &'a RoutePath,
    /// Offset from a position of the drive to the position on the route path, metres.
    pub(super) moved_m: f64,
    pub(super) at_m: f64,
    pub(super) at_s: f64,
    pub(super) departed: bool,
}

/// Returns the offset of the vehicle from the route path at a position, metres.
pub(super) fn offset_m(file: &DriveFile, at_m: f64) -> f64 {
    file.manoeuvres.iter().map(|plan| own_offset_m(&plan.kind, at_m, smooth)).sum()
}

impl DrivePosition<'_> {
    /// Returns the manoeuvres of the planner in the order of its chain: start, approved, waiting, goal.
    pub(super) fn manoeuvres(&self) -> Vec<Manoeuvre> {
        let mut known: Vec<&ManoeuvrePlan> =
            self.file.manoeuvres.iter().filter(|plan| self.knows(plan)).collect();
        known.sort_by_key(|plan| match plan.kind {
            PlanKind::PullOut { .. } => 0,
            PlanKind::PullOver { .. } => 3,
            PlanKind::Avoidance(_) | PlanKind::LaneChange { .. } | PlanKind::SideShift(_) => {
                if self.is_approved(plan) { 1 } else { 2 }
            }
        });
        known.into_iter().filter_map(|plan| self.manoeuvre(plan)).collect()
    }

    /// Returns true if a position or a time has been reached.
    pub(super) fn has_come(&self, moment: DriveMoment) -> bool {
        match moment {
            DriveMoment::AtM(at_m) => self.at_m >= at_m - 1e-9,
            DriveMoment::AtS(at_s) => self.at_s >= at_s - 1e-9,
        }
    }

    fn knows(&self, plan: &ManoeuvrePlan) -> bool {
        let is_over = match plan.known_to {
            Some(moment) => self.has_come(moment),
            None => self.at_m > plan.kind.end_m() + OVER_M,
        };
        !is_over && plan.known_from.is_none_or(|moment| self.has_come(moment))
    }

    fn is_approved(&self, plan: &ManoeuvrePlan) -> bool {
        plan.approved_from.is_none_or(|moment| self.has_come(moment))
    }

    fn pose(&self, at_m: f64, offset_m: impl Fn(f64) -> f64) -> Pose {
        self.route_path.pose(at_m + self.moved_m, |path_m| offset_m(path_m - self.moved_m))
    }

    fn lanes(&self, plan: &ManoeuvrePlan) -> Vec<LaneId> {
        let here_m = self.at_m + self.moved_m;
        plan.lanes.clone().unwrap_or_else(|| self.route_path.lanes_between(here_m - 10.0, here_m + AHEAD_M))
    }

    fn manoeuvre(&self, plan: &ManoeuvrePlan) -> Option<Manoeuvre> {
        let current_shift_m = own_offset_m(&plan.kind, self.at_m, smooth);
        let linear = |at_m: f64| linear_offset_m(&plan.kind, at_m);
        Some(match &plan.kind {
            PlanKind::Avoidance(lines) => self.avoidance(plan, lines, current_shift_m)?,
            PlanKind::LaneChange {
                side,
                from_m,
                to_m,
                crossing_m,
                valid_path,
                special,
                minimum_length_m,
            } => {
                let phase = match (self.is_approved(plan), special) {
                    (true, _) => LaneChangePhase::Running,
                    (false, true) => LaneChangePhase::Unsignalled,
                    (false, false) => LaneChangePhase::Waiting,
                };
                let pose = |at_m: &f64| valid_path.then(|| self.pose(*at_m, |_| 0.0));
                Manoeuvre::LaneChange(LaneChange {
                    side: *side,
                    phase,
                    start: pose(from_m),
                    crossing: pose(crossing_m),
                    end: pose(to_m),
                    previous_path: self.line(self.at_m, self.at_m + AHEAD_M, |_| 0.0),
                    minimum_length_m: *minimum_length_m,
                })
            }
            PlanKind::PullOut { shift, backwards_until_s, first_part_end_m } => Manoeuvre::PullOut(PullOut {
                path: self.shifted(&plan.kind).ok(),
                start: self.pose(shift.from_m, linear),
                end: self.pose(shift.to_m, linear),
                current_shift_m,
                forward: backwards_until_s.is_none_or(|until_s| self.at_s >= until_s),
                standing_counts: !self.departed || self.is_near(*first_part_end_m),
                before_start: !self.departed,
                lanes: self.lanes(plan),
            }),
            PlanKind::PullOver {
                shift,
                decided_from,
                deceleration_m,
                stop_m,
                stop_path_end_m,
                first_part_end_m,
            } => {
                let pose = |at_m: Option<f64>| at_m.map(|at_m| self.pose(at_m, |_| 0.0));
                if decided_from.is_some_and(|moment| !self.has_come(moment)) {
                    return Some(Manoeuvre::PullOver(PullOver::Undecided(Undecided {
                        stop_path: self.line(self.at_m - BEHIND_M, *stop_path_end_m, |_| 0.0),
                        deceleration: pose(*deceleration_m),
                        stop: pose(*stop_m),
                    })));
                }
                Manoeuvre::PullOver(PullOver::Decided(Decided {
                    path: self.shifted(&plan.kind).ok(),
                    start: self.pose(shift.from_m, linear),
                    goal: self.pose(shift.to_m, linear),
                    current_shift_m,
                    near_first_end: self.is_near(*first_part_end_m),
                    lanes: self.lanes(plan),
                }))
            }
            PlanKind::SideShift(_) => Manoeuvre::SideShift,
        })
    }

    fn avoidance(
        &self,
        plan: &ManoeuvrePlan,
        lines: &[PlannedShift],
        current_shift_m: f64,
    ) -> Option<Manoeuvre> {
        let linear = |at_m: f64| linear_offset_m(&plan.kind, at_m);
        let path = self.shifted(&plan.kind).ok()?;
        let limits = DeciderParameters::DEPLOYED.nearest;
        let index = |at_m: f64| path.visit_index(self.pose(at_m, linear), limits);
        let mut before_m = 0.0;
        let lines = lines.iter().enumerate().map(|(number, line)| {
            let start_shift_m = std::mem::replace(&mut before_m, line.offset_m);
            AvoidanceLine {
                id: u128::try_from(number).unwrap_or_default() + 1,
                line: ShiftLine {
                    start_index: index(line.from_m),
                    end_index: index(line.to_m),
                    start: self.pose(line.from_m, linear),
                    end: self.pose(line.to_m, linear),
                },
                start_shift_m,
                end_shift_m: line.offset_m,
            }
        });
        // A line that ends at the vehicle's point is not over.
        let ahead = |line: &AvoidanceLine| line.line.end_index >= index(self.at_m);
        Some(Manoeuvre::Avoidance(Avoidance {
            lines: lines.filter(ahead).collect(),
            ego_index: index(self.at_m),
            deviation_m: 0.0,
            current_shift_m,
            lanes: self.lanes(plan),
            approved: self.is_approved(plan),
            path,
        }))
    }

    fn is_near(&self, part_end_m: Option<f64>) -> bool {
        part_end_m.is_some_and(|end_m| (self.at_m - end_m).abs() < NEAR_PART_END_M)
    }

    /// Returns the path around the vehicle with linearly changing offsets.
    fn shifted(&self, kind: &PlanKind) -> Result<ShiftedPath, PathError> {
        let mut positions = self.positions(self.at_m - BEHIND_M, self.at_m + AHEAD_M);
        // The ends of shifts are points of the path.
        for end_m in ends_m(kind) {
            let index = positions.partition_point(|at_m| *at_m < end_m);
            let is_within = index > 0 && index < positions.len();
            if is_within && positions.get(index).is_some_and(|at_m| at_m - end_m > SAME_M) {
                positions.insert(index, end_m);
            }
        }
        let offset_m = |at_m: f64| linear_offset_m(kind, at_m);
        let shifts_m = positions.iter().map(|at_m| offset_m(*at_m)).collect();
        ShiftedPath::new(positions.iter().map(|at_m| self.pose(*at_m, offset_m)).collect(), shifts_m)
    }

    fn line(&self, from_m: f64, to_m: f64, offset_m: impl Fn(f64) -> f64) -> Vec<Pose> {
        self.positions(from_m, to_m).iter().map(|at_m| self.pose(*at_m, &offset_m)).collect()
    }

    /// Returns positions of the drive on a fixed grid, which does not move with the vehicle.
    fn positions(&self, from_m: f64, to_m: f64) -> Vec<f64> {
        let from_m = from_m.max(-self.moved_m).max(self.at_m - BEHIND_M);
        let to_m = to_m.min(self.route_path.length_m() - self.moved_m).min(self.at_m + AHEAD_M);
        let first_m = (from_m / SPACING_M).ceil() * SPACING_M;
        successors(Some(first_m), |at_m| Some(at_m + SPACING_M)).take_while(|at_m| *at_m <= to_m).collect()
    }
}

/// Returns the offset on the planner's paths, with linear ramps, metres.
fn linear_offset_m(kind: &PlanKind, at_m: f64) -> f64 {
    own_offset_m(kind, at_m, |share| share.clamp(0.0, 1.0))
}

fn ends_m(kind: &PlanKind) -> Vec<f64> {
    match kind {
        PlanKind::Avoidance(lines) => lines.iter().flat_map(|line| [line.from_m, line.to_m]).collect(),
        PlanKind::LaneChange { from_m, to_m, .. } => vec![*from_m, *to_m],
        PlanKind::PullOut { shift, .. } | PlanKind::PullOver { shift, .. } | PlanKind::SideShift(shift) => {
            vec![shift.from_m, shift.to_m]
        }
    }
}

/// Returns one manoeuvre's contribution to the offset at a position, metres; `ramp` maps 0 to 1 onto 0 to 1.
fn own_offset_m(kind: &PlanKind, at_m: f64, ramp: impl Fn(f64) -> f64) -> f64 {
    let part = |shift: &PlannedShift| ramp((at_m - shift.from_m) / (shift.to_m - shift.from_m));
    match kind {
        PlanKind::Avoidance(lines) => {
            let mut offset_m = 0.0;
            for line in lines {
                offset_m += (line.offset_m - offset_m) * part(line);
            }
            offset_m
        }
        PlanKind::LaneChange { .. } => 0.0,
        PlanKind::PullOut { shift, .. } => shift.offset_m * (1.0 - part(shift)),
        PlanKind::PullOver { shift, .. } | PlanKind::SideShift(shift) => shift.offset_m * part(shift),
    }
}
