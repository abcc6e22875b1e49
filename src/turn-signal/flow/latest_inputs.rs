//! The latest message of each kind from Autoware, with its time of reception.

use std::sync::Arc;
use std::time::Duration;

use crate::factors::{DrivenPath, Factors};
use crate::inputs::{InputFinding, Timed};
use crate::light_command::{EnumOrUnknown, HazardCommand, TurnCommand};
use crate::planner_input::{Odometry, OperationMode, PlannedPathPoint, PlannerInput, TrajectoryPoint};
use gateway_base::time::{MonoTime, WallStamp};
use lanelet2_map::geometry::Pose;

#[derive(Debug, Clone, Default)]
pub(super) struct LatestInputs {
    pub(super) odometry: Option<Timed<Odometry>>,
    odometry_stamp: Option<WallStamp>,
    path: Option<Timed<Arc<[PlannedPathPoint]>>>,
    trajectory: Option<Timed<Arc<[TrajectoryPoint]>>>,
    pub(super) driven: DrivenPath,
    pub(super) factors: Factors,
    modified_goal: Option<(u128, Pose)>,
    pub(super) operation_mode: Option<OperationMode>,
    lane_driving: Option<Timed<bool>>,
    pub(super) hazard_request: Option<Timed<HazardCommand>>,
    pub(super) own_turn: Option<Timed<EnumOrUnknown<TurnCommand>>>,
    pub(super) own_hazard: Option<Timed<EnumOrUnknown<HazardCommand>>>,
}

impl LatestInputs {
    /// Stores a message received at `at`, except a route.
    pub(super) fn update(&mut self, input: PlannerInput, at: MonoTime) {
        match input {
            PlannerInput::Odometry { odometry, stamp } => {
                // A repeated measurement does not renew its age. A message without a stamp is always
                // accepted.
                let is_repeated = self.odometry_stamp == Some(stamp) && stamp != WallStamp::default();
                if !is_repeated {
                    self.odometry = Some(Timed { at, value: odometry });
                    self.driven.update(odometry);
                }
                self.odometry_stamp = Some(stamp);
            }
            PlannerInput::PlannedPath(value) => self.path = Some(Timed { at, value }),
            PlannerInput::Trajectory(value) => self.trajectory = Some(Timed { at, value }),
            PlannerInput::Factors { topic, factors } => {
                self.factors.insert(topic, Timed { at, value: factors });
            }
            PlannerInput::ModifiedGoal { route, goal } => self.modified_goal = Some((route, goal)),
            PlannerInput::OperationMode(mode) => self.operation_mode = Some(mode),
            PlannerInput::LaneDriving(value) => self.lane_driving = Some(Timed { at, value }),
            PlannerInput::HazardRequest(value) => self.hazard_request = Some(Timed { at, value }),
            PlannerInput::OwnTurnCommand(value) => self.own_turn = Some(Timed { at, value }),
            PlannerInput::OwnHazardCommand(value) => self.own_hazard = Some(Timed { at, value }),
            PlannerInput::Route(_) => {}
        }
    }

    /// Returns the goal of the pull-over on a route; `None` when the last goal belongs to another route or is
    /// not finite.
    pub(super) fn modified_goal(&self, route: u128) -> Option<Pose> {
        self.modified_goal.filter(|(of, goal)| *of == route && goal.is_finite()).map(|(_, goal)| goal)
    }

    pub(super) fn planned_path_length(&self) -> Option<Timed<usize>> {
        self.path.as_ref().map(|path| Timed { at: path.at, value: path.value.len() })
    }

    /// Returns the planned path, if it is usable; the decider reports its age.
    pub(super) fn planned_path(
        &self,
        limit: Duration,
        now: MonoTime,
        findings: &mut Vec<InputFinding>,
    ) -> Option<&[PlannedPathPoint]> {
        let path = self.path.as_ref().filter(|path| now.since(path.at) <= limit)?;
        if path.value.iter().all(|point| point.pose.is_finite()) {
            return Some(&path.value);
        }
        findings.push(InputFinding::PlannedPathNotFinite);
        None
    }

    /// Returns the trajectory of a planner without planning factors, if it is usable.
    pub(super) fn trajectory(
        &self,
        limit: Duration,
        now: MonoTime,
        findings: &mut Vec<InputFinding>,
    ) -> Option<&Timed<Arc<[TrajectoryPoint]>>> {
        let trajectory = self.trajectory.as_ref().filter(|_| self.factors.is_empty())?;
        let age = now.since(trajectory.at);
        if age > limit {
            findings.push(InputFinding::OldPlannedPath(age));
            return None;
        }
        if trajectory.value.iter().all(|point| point.pose.is_finite() && point.speed_mps.is_finite()) {
            return Some(trajectory);
        }
        findings.push(InputFinding::PlannedPathNotFinite);
        None
    }

    /// Returns whether the planner drives lanes: true before any scenario was received, false once the last
    /// scenario is too old.
    pub(super) fn lane_driving(
        &self,
        limit: Duration,
        now: MonoTime,
        findings: &mut Vec<InputFinding>,
    ) -> bool {
        let Some(scenario) = self.lane_driving else { return true };
        let age = now.since(scenario.at);
        if age > limit {
            findings.push(InputFinding::OldScenario(age));
        }
        scenario.value && age <= limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_modified_goal_counts_on_its_route_only() {
        let mut latest = LatestInputs::default();
        assert_eq!(latest.modified_goal(7), None);
        let goal = Pose::new(1.0, 2.0, 3.0);
        latest.update(PlannerInput::ModifiedGoal { route: 7, goal }, MonoTime::ZERO);
        assert_eq!([7, 8].map(|route| latest.modified_goal(route)), [Some(goal), None]);
        let goal = Pose::new(f64::NAN, 2.0, 3.0);
        latest.update(PlannerInput::ModifiedGoal { route: 7, goal }, MonoTime::ZERO);
        assert_eq!(latest.modified_goal(7), None);
    }
}
