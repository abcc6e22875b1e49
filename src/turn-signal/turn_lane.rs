//! A stretch of road with its own turn signal, reduced to the measured values.

use super::section::Section;
use super::subject::SignalSubject;
use crate::light_command::TurnCommand;
use lanelet2_map::geometry::path::PathFrame;
use lanelet2_map::geometry::polyline::{back_pose, front_pose, without_near_earlier};
use lanelet2_map::geometry::required_end::required_end;
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::{LaneId, Lanelet, TurnDirection};

/// Points nearer than this to an earlier one are dropped, metres.
const SAME_POINT_M: f64 = 0.01;

/// One lanelet, or several that form one turn.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnLane {
    /// Id of the first lanelet.
    pub id: LaneId,
    /// Direction of the turn.
    pub direction: TurnDirection,
    /// Its own search distance, metres.
    pub search_distance_m: Option<f64>,
    /// Pose at the start of the stretch.
    pub front: Pose,
    /// Pose at the end of the stretch.
    pub back: Pose,
    /// End of the required section.
    pub required_end: Pose,
    /// Centreline of all lanelets.
    pub centerline: Vec<Point>,
    /// Arc lengths of the lanelets on the distance path of this cycle, metres; `None` if its points must be
    /// searched for.
    pub span_m: Option<[f64; 2]>,
}

impl TurnLane {
    /// Creates the stretch of one lanelet. `None` without two different points.
    pub fn new(lane: &Lanelet, threshold_deg: f64) -> Option<Self> {
        let kept = without_near_earlier(&lane.centerline, SAME_POINT_M);
        Some(Self {
            id: lane.id,
            direction: lane.turn_direction,
            search_distance_m: lane.turn_signal_distance_m,
            front: front_pose(&kept)?,
            back: back_pose(&kept)?,
            required_end: required_end(&lane.centerline, threshold_deg)?,
            centerline: kept,
            span_m: None,
        })
    }

    /// Returns the signed distance from the rear axle to a point of the stretch, metres.
    pub fn from_base_m(&self, path_frame: &PathFrame<'_>, pose: Pose) -> f64 {
        match self.span_m {
            Some(span_m) => path_frame.from_base_within_m(pose, span_m),
            None => path_frame.from_base_m(pose),
        }
    }

    /// Returns this stretch joined with the next; id and search distance are taken from this one.
    pub fn joined(&self, next: &Self, threshold_deg: f64) -> Self {
        let all: Vec<Point> = self.centerline.iter().chain(&next.centerline).copied().collect();
        let centerline = without_near_earlier(&all, SAME_POINT_M);
        let required_end = required_end(&centerline, threshold_deg).unwrap_or(next.required_end);
        let span_m = self.span_m.zip(next.span_m).map(|([from_m, _], [_, to_m])| [from_m, to_m]);
        Self { back: next.back, required_end, centerline, span_m, ..self.clone() }
    }

    /// Returns the command of an intersection here: DISABLE where it does not turn.
    pub fn signal(&self) -> TurnCommand {
        match self.direction {
            TurnDirection::Left => TurnCommand::Left,
            TurnDirection::Right => TurnCommand::Right,
            TurnDirection::None | TurnDirection::Straight => TurnCommand::Disable,
        }
    }

    /// Returns the record, with the desired section up to the end of the stretch.
    pub fn section(&self, subject: SignalSubject, turn: TurnCommand, desired_start: Pose) -> Section {
        Section {
            turn,
            desired_start,
            desired_end: self.back,
            required_start: self.front,
            required_end: self.required_end,
            subject,
            ..Section::default()
        }
    }
}
