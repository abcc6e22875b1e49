//! A shift on the path that it is part of.

use crate::decision_context::DecisionContext;
use crate::section::Section;
use crate::side::Side;
use lanelet2_map::geometry::path::{NearestLimits, Path, PathError, nearest_visit};
use lanelet2_map::geometry::polyline::{arc_lengths_m, nearest_index};
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::LaneId;

/// A path with a lateral offset per point, metres, left positive.
#[derive(Debug, Clone, PartialEq)]
pub struct ShiftedPath {
    poses: Vec<Pose>,
    arcs_m: Vec<f64>,
    pub(super) shifts_m: Vec<f64>,
    path: Path,
}

/// The start and end of a shift.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // their names say it
pub struct ShiftLine {
    pub start_index: usize,
    pub end_index: usize,
    pub start: Pose,
    pub end: Pose,
}

/// The purpose of a shift, on which steps of the rule depend.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ShiftKind {
    /// Around an obstacle and back.
    Avoidance,
    /// From the roadside into the lane.
    PullOut,
    /// From the lane to the roadside.
    PullOver,
}

/// A shift to be judged.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::struct_excessive_bools)] // independent of each other
pub struct Shift<'a> {
    /// The path it is on.
    pub path: &'a ShiftedPath,
    /// Its start and end on the path.
    pub line: ShiftLine,
    /// Lanelets in which the vehicle is supposed to stay.
    pub lanes: &'a [LaneId],
    /// Present offset of the vehicle, metres.
    pub current_shift_m: f64,
    /// The manoeuvre of which it is part.
    pub kind: ShiftKind,
    /// The vehicle drives forwards.
    pub forward: bool,
    /// A return is signalled even at standstill.
    pub stop_override: bool,
    /// The vehicle approaches a junction at which its signal would be mistaken for a turn: the signal ends
    /// once the bound is near.
    pub nears_junction: bool,
    /// It was signalled before, and stays signalled until it is complete (W18).
    pub is_announced: bool,
}

impl ShiftedPath {
    /// Creates the path through `poses` with an offset for each.
    pub fn new(poses: Vec<Pose>, shifts_m: Vec<f64>) -> Result<Self, PathError> {
        let path = Path::new(poses.iter().copied())?;
        let points: Vec<Point> = poses.iter().map(|pose| pose.position).collect();
        Ok(Self { arcs_m: arc_lengths_m(&points), poses, shifts_m, path })
    }

    /// Returns the points of the path.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Returns the index of the point nearest to a position.
    pub fn nearest_index(&self, query: Point) -> usize {
        nearest_index(&self.poses, query)
    }

    /// Like [`Self::nearest_index`], but also considers heading and height.
    pub fn visit_index(&self, query: Pose, limits: NearestLimits) -> usize {
        nearest_visit(&self.poses, query, limits, None)
    }

    /// Returns the index of the point nearest to a pose; in improved mode also by heading and height.
    pub fn index_of(&self, context: &DecisionContext<'_>, pose: Pose) -> usize {
        if context.quirks.ignores_height_and_continuity {
            self.nearest_index(pose.position)
        } else {
            self.visit_index(pose, context.parameters.nearest)
        }
    }

    /// Returns the shift from the point nearest to `start` to the point nearest to `end`.
    pub fn line(&self, context: &DecisionContext<'_>, start: Pose, end: Pose) -> ShiftLine {
        let index = |pose| self.index_of(context, pose);
        ShiftLine { start_index: index(start), end_index: index(end), start, end }
    }

    /// Returns the change of the offset between two points, metres; 0 beyond the path.
    pub fn offset_between_m(&self, start_index: usize, end_index: usize) -> f64 {
        self.offset_at_m(end_index) - self.offset_at_m(start_index)
    }

    /// Returns the offset at a point, metres; 0 beyond the path.
    pub fn offset_at_m(&self, index: usize) -> f64 {
        self.shifts_m.get(index).copied().unwrap_or_default()
    }

    /// Returns the arc length from a position to a point, metres; `None` for an index beyond the path.
    pub fn distance_to_m(&self, from: Point, index: usize) -> Option<f64> {
        Some(self.arcs_m.get(index)? - self.path.plain_station_m(from))
    }

    /// Like [`Self::distance_to_m`], but also considers heading and height.
    pub(super) fn distance_of_visit_to_m(
        &self,
        from: Pose,
        index: usize,
        limits: NearestLimits,
    ) -> Option<f64> {
        Some(self.arcs_m.get(index)? - self.path.station_of_visit_m(from, limits))
    }

    /// Returns the record of a shift that is not signalled: the whole path, no command.
    pub(super) fn silent(&self) -> Section {
        let start = self.poses.first().copied().unwrap_or_default();
        let end = self.poses.last().copied().unwrap_or_default();
        Section {
            desired_start: start,
            required_start: start,
            desired_end: end,
            required_end: end,
            ..Section::default()
        }
    }
}

impl Shift<'_> {
    /// Returns the side to which the shift moves; right for no shift.
    pub fn side(&self) -> Side {
        let moves_left = self.path.offset_between_m(self.line.start_index, self.line.end_index) > 0.0;
        if moves_left { Side::Left } else { Side::Right }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Offsets {
    pub(super) before_m: f64,
    pub(super) after_m: f64,
}

impl Offsets {
    pub(super) fn relative_m(self) -> f64 {
        self.after_m - self.before_m
    }

    pub(super) fn side(self) -> Side {
        if self.relative_m() > 0.0 { Side::Left } else { Side::Right }
    }
}
