//! A path to measure on: the soft nearest point, and signed distances from the vehicle
//! (docs/spec/turn-signal-decider.md, "Nearest point" and "Distance along the path").

use thiserror::Error;

use super::polyline::{arc_lengths_m, projection_m};
use super::{Point, Pose, wrapped};

/// Limits of distance and heading within which the nearest point is preferred.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestLimits {
    /// Greatest distance that is preferred, metres.
    pub distance_m: f64,
    /// Greatest difference of heading that is preferred, radians.
    pub yaw_rad: f64,
}

/// A path of at least two different points, all finite, no two neighbours at one position.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    poses: Vec<Pose>,
    arcs_m: Vec<f64>,
}

/// A reason for which points do not make a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum PathError {
    /// Fewer than two different points.
    #[error("the path has fewer than two different points")]
    TooShort,
    /// A point that is not a finite pose.
    #[error("point {index} of the path is not a finite pose")]
    NotFinite {
        /// Index of the point, from 0.
        index: usize,
    },
}

impl Path {
    /// The path through `poses`; of neighbours at one position the first stays.
    pub fn new(poses: impl IntoIterator<Item = Pose>) -> Result<Self, PathError> {
        let mut kept: Vec<Pose> = Vec::new();
        for (index, pose) in poses.into_iter().enumerate() {
            if !pose.is_finite() {
                return Err(PathError::NotFinite { index });
            }
            if kept.last().is_none_or(|last| !last.position.coincides(pose.position)) {
                kept.push(pose);
            }
        }
        if kept.len() < 2 {
            return Err(PathError::TooShort);
        }
        let points: Vec<Point> = kept.iter().map(|pose| pose.position).collect();
        Ok(Self { arcs_m: arc_lengths_m(&points), poses: kept })
    }

    /// The points of the path, at least two.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Length, metres.
    pub fn length_m(&self) -> f64 {
        self.arcs_m.last().copied().unwrap_or_default()
    }

    /// The soft nearest point: near and aligned if there is one, else near, else aligned,
    /// else just the nearest. Of a path that comes by twice only the first visit counts.
    pub fn nearest_index(&self, query: Pose, limits: NearestLimits) -> usize {
        let squared = |pose: &Pose| pose.position.squared_distance(query.position);
        let near = |pose: &Pose| squared(pose) <= limits.distance_m * limits.distance_m;
        let aligned = |pose: &Pose| wrapped(pose.yaw_rad - query.yaw_rad).abs() <= limits.yaw_rad;
        self.nearest_of_first_run(query, |pose| near(pose) && aligned(pose))
            .or_else(|| self.nearest_of_first_run(query, near))
            .or_else(|| self.nearest_of_first_run(query, aligned))
            .or_else(|| self.nearest_of_first_run(query, |_| true))
            .unwrap_or_default()
    }

    /// The piece of the path `query` belongs to, by the index of its first point.
    pub fn segment_index(&self, query: Pose, limits: NearestLimits) -> usize {
        let nearest = self.nearest_index(query, limits);
        match nearest {
            0 => 0,
            index if index + 1 >= self.poses.len() => self.poses.len().saturating_sub(2),
            index if self.offset_m(index, query.position) <= 0.0 => index - 1,
            index => index,
        }
    }

    /// Position of `query` along the path, by its segment: metres from the first point, beyond both ends.
    pub fn station_m(&self, query: Pose, limits: NearestLimits) -> f64 {
        let segment = self.segment_index(query, limits);
        self.arc_m(segment) + self.offset_m(segment, query.position)
    }

    /// As [`Self::station_m`], by the plainly nearest piece.
    pub fn plain_station_m(&self, query: Point) -> f64 {
        let unlimited = NearestLimits { distance_m: f64::INFINITY, yaw_rad: f64::INFINITY };
        self.station_m(Pose { position: query, yaw_rad: 0.0 }, unlimited)
    }

    /// Arc length of a point, metres; that of the last one for an index beyond it.
    pub fn arc_m(&self, index: usize) -> f64 {
        self.arcs_m.get(index).copied().unwrap_or_else(|| self.length_m())
    }

    /// Signed projection on a piece, unbounded.
    fn offset_m(&self, segment: usize, query: Point) -> f64 {
        match self.poses.get(segment..segment + 2) {
            Some([from, to]) => projection_m(from.position, to.position, query),
            _ => 0.0,
        }
    }

    fn nearest_of_first_run(&self, query: Pose, qualifies: impl Fn(&Pose) -> bool) -> Option<usize> {
        let run = self
            .poses
            .iter()
            .enumerate()
            .skip_while(|(_, pose)| !qualifies(pose))
            .take_while(|(_, pose)| qualifies(pose));
        let squared = |pose: &Pose| pose.position.squared_distance(query.position);
        // `min_by` keeps the first of equals.
        run.min_by(|(_, one), (_, other)| squared(one).total_cmp(&squared(other))).map(|(index, _)| index)
    }
}

/// Distances along a path, from the vehicle.
#[derive(Debug, Clone, Copy)]
pub struct PathFrame<'a> {
    path: &'a Path,
    ego: Pose,
    ego_station_m: f64,
    front_m: f64,
    limits: NearestLimits,
}

impl<'a> PathFrame<'a> {
    /// A vehicle at `ego` (its rear axle), whose front is `front_m` before that. `limits` find both
    /// the vehicle and whatever is measured.
    pub fn new(path: &'a Path, ego: Pose, front_m: f64, limits: NearestLimits) -> Self {
        let ego_station_m = path.station_m(ego, limits);
        Self { path, ego, ego_station_m, front_m, limits }
    }

    /// The vehicle's rear axle.
    pub fn ego(&self) -> Pose {
        self.ego
    }

    /// Signed distance from the rear axle to `pose` along the path, metres.
    pub fn from_base_m(&self, pose: Pose) -> f64 {
        self.path.station_m(pose, self.limits) - self.ego_station_m
    }

    /// Signed distance from the front to `pose` along the path, metres.
    pub fn from_front_m(&self, pose: Pose) -> f64 {
        self.from_base_m(pose) - self.front_m
    }
}
