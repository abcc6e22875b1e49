//! A path for measuring: the soft nearest point, and signed distances from the vehicle
//! (docs/spec/turn-signal-decider.md, "Nearest point" and "Distance along the path").

use std::f64::consts::FRAC_PI_2;

use thiserror::Error;

use super::polyline::{arc_lengths_m, projection_m};
use super::{Point, Pose, wrapped};

/// Limits of distance and heading within which the nearest point is preferred.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestLimits {
    /// Maximum preferred distance, metres.
    pub distance_m: f64,
    /// Maximum preferred difference of heading, radians.
    pub yaw_rad: f64,
}

/// Distance equivalent to a heading difference of one radian, metres.
const METRES_PER_RADIAN: f64 = 3.0;

/// A path is smoothed and sampled every few metres, so its arc lengths differ slightly from the lanelets',
/// metres.
pub const SPAN_TOLERANCE_M: f64 = 3.0;

/// A path of at least two different points, all finite, without consecutive duplicates.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    poses: Vec<Pose>,
    arcs_m: Vec<f64>,
}

/// A reason why points do not form a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[allow(missing_docs)] // the texts say it
pub enum PathError {
    #[error("the path has fewer than two different points")]
    TooShort,
    /// The point with this index, from 0, is not a finite pose.
    #[error("point {0} of the path is not a finite pose")]
    NotFinite(usize),
}

impl Path {
    /// Creates the path through `poses`; of consecutive duplicates the first is kept.
    pub fn new(poses: impl IntoIterator<Item = Pose>) -> Result<Self, PathError> {
        let mut kept: Vec<Pose> = Vec::new();
        for (index, pose) in poses.into_iter().enumerate() {
            if !pose.is_finite() {
                return Err(PathError::NotFinite(index));
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

    /// Returns the points of the path, at least two.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Returns the length in metres.
    pub fn length_m(&self) -> f64 {
        self.arcs_m.last().copied().unwrap_or_default()
    }

    /// Returns the index of the soft nearest point: near and aligned if possible, otherwise near, otherwise
    /// aligned, otherwise just the nearest. If the path comes by twice, only the first visit counts.
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

    /// Returns the piece adjacent to the path's point `nearest` on which `query` lies.
    fn segment_at(&self, nearest: usize, query: Pose) -> usize {
        match nearest {
            0 => 0,
            index if index + 1 >= self.poses.len() => self.poses.len().saturating_sub(2),
            index if self.offset_m(index, query.position) <= 0.0 => index - 1,
            index => index,
        }
    }

    /// Returns the position of `query` along the path, metres from the first point, measured on its piece;
    /// may lie beyond both ends.
    pub fn station_m(&self, query: Pose, limits: NearestLimits) -> f64 {
        self.station_at(self.nearest_index(query, limits), query)
    }

    fn station_at(&self, nearest: usize, query: Pose) -> f64 {
        let segment = self.segment_at(nearest, query);
        self.arc_m(segment) + self.offset_m(segment, query.position)
    }

    /// Like [`Self::station_m`], but on the nearest piece whatever its heading.
    pub fn plain_station_m(&self, query: Point) -> f64 {
        let unlimited = NearestLimits { distance_m: f64::INFINITY, yaw_rad: f64::INFINITY };
        self.station_m(Pose { position: query, yaw_rad: 0.0 }, unlimited)
    }

    /// Like [`Self::station_m`], but using [`nearest_visit`].
    pub fn station_of_visit_m(&self, query: Pose, limits: NearestLimits) -> f64 {
        self.station_at(nearest_visit(&self.poses, query, limits, None), query)
    }

    /// Returns the arc length of a point in metres; an index beyond the path means the last point.
    pub fn arc_m(&self, index: usize) -> f64 {
        self.arcs_m.get(index).copied().unwrap_or_else(|| self.length_m())
    }

    /// Returns the signed projection on a piece, which may lie beyond its ends.
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
        // `min_by` returns the first of equal elements.
        run.min_by(|(_, one), (_, other)| squared(one).total_cmp(&squared(other))).map(|(index, _)| index)
    }
}

/// Returns the index of the line's point that is near to a pose and has a similar heading, as in
/// [`Path::nearest_index`]. If the line comes by twice, it chooses the visit at the height of the pose, if
/// any; then the visit with the lowest `rank`; otherwise the nearest and best aligned visit. A point with the
/// opposite heading, as when a line returns in the neighbouring lane, is the last choice. Returns 0 without
/// points.
pub fn nearest_visit(
    poses: &[Pose],
    query: Pose,
    limits: NearestLimits,
    rank: Option<&dyn Fn(usize) -> f64>,
) -> usize {
    let far_m = |pose: &Pose| pose.position.distance_m(query.position);
    let turned_rad = |pose: &Pose| wrapped(pose.yaw_rad - query.yaw_rad).abs();
    let near = |pose: &Pose| far_m(pose) <= limits.distance_m;
    let aligned = |pose: &Pose| turned_rad(pose) <= limits.yaw_rad;
    let passes: [&dyn Fn(&Pose) -> bool; 5] = [
        &|pose| near(pose) && aligned(pose),
        &|pose| near(pose) && turned_rad(pose) <= FRAC_PI_2,
        &aligned,
        &near,
        &|_: &Pose| true,
    ];
    let of_visit = |(index, pose): (usize, &Pose)| {
        let cost =
            rank.map_or_else(|| far_m(pose) + METRES_PER_RADIAN * turned_rad(pose), |rank| rank(index));
        (!pose.position.is_level_with(query.position), cost, index)
    };
    let best = |qualifies: &dyn Fn(&Pose) -> bool| {
        visits(poses, query, qualifies)
            .into_iter()
            .map(of_visit)
            .min_by(|one, other| one.0.cmp(&other.0).then(one.1.total_cmp(&other.1)))
    };
    passes.into_iter().find_map(best).map_or(0, |(_, _, index)| index)
}

/// Returns the nearest point of each contiguous run of qualifying points.
fn visits<'a>(poses: &'a [Pose], query: Pose, qualifies: &dyn Fn(&Pose) -> bool) -> Vec<(usize, &'a Pose)> {
    let mut visits = Vec::new();
    let mut visit: Option<(f64, (usize, &Pose))> = None;
    for (index, pose) in poses.iter().enumerate() {
        if !qualifies(pose) {
            visits.extend(visit.take().map(|(_, nearest)| nearest));
            continue;
        }
        let squared = pose.position.squared_distance(query.position);
        if visit.is_none_or(|(least, _)| squared < least) {
            visit = Some((squared, (index, pose)));
        }
    }
    visits.extend(visit.map(|(_, nearest)| nearest));
    visits
}

/// Measures distances along a path, from the vehicle.
#[derive(Debug, Clone, Copy)]
pub struct PathFrame<'a> {
    path: &'a Path,
    ego: Pose,
    ego_station_m: f64,
    front_m: f64,
    limits: NearestLimits,
    looks_at_every_visit: bool,
}

impl<'a> PathFrame<'a> {
    /// Creates the frame for a vehicle at `ego` (its rear axle), whose front is `front_m` ahead of that.
    /// `limits` are used to find both the vehicle and the measured poses.
    pub fn new(path: &'a Path, ego: Pose, front_m: f64, limits: NearestLimits) -> Self {
        let ego_station_m = path.station_m(ego, limits);
        Self { path, ego, ego_station_m, front_m, limits, looks_at_every_visit: false }
    }

    /// Like [`Self::new`], for a vehicle that is known to be near the arc length `near_arc_m`. If the path
    /// comes by twice, also on top of itself, height and heading decide which visit counts.
    pub fn of_every_visit(
        path: &'a Path,
        (ego, near_arc_m): (Pose, f64),
        front_m: f64,
        limits: NearestLimits,
    ) -> Self {
        let from_m = |index| (path.arc_m(index) - near_arc_m).abs();
        let nearest = nearest_visit(&path.poses, ego, limits, Some(&from_m));
        let ego_station_m = path.station_at(nearest, ego);
        Self { path, ego, ego_station_m, front_m, limits, looks_at_every_visit: true }
    }

    /// Returns whether it was created by [`Self::of_every_visit`].
    pub fn looks_at_every_visit(&self) -> bool {
        self.looks_at_every_visit
    }

    /// Returns the vehicle's rear axle.
    pub fn ego(&self) -> Pose {
        self.ego
    }

    /// Returns the signed distance from the rear axle to `pose` along the path, metres. If the path comes by
    /// twice, as once around a ring, the visit nearest to the vehicle counts.
    pub fn from_base_m(&self, pose: Pose) -> f64 {
        let station_m = if self.looks_at_every_visit {
            let from_ego_m = |index| (self.path.arc_m(index) - self.ego_station_m).abs();
            let nearest = nearest_visit(&self.path.poses, pose, self.limits, Some(&from_ego_m));
            self.path.station_at(nearest, pose)
        } else {
            self.path.station_m(pose, self.limits)
        };
        station_m - self.ego_station_m
    }

    /// Like [`Self::from_base_m`], for a pose that lies between two arc lengths of the path, metres, to
    /// within [`SPAN_TOLERANCE_M`]. Other pieces of the path near the pose are ignored.
    pub fn from_base_within_m(&self, pose: Pose, [from_m, to_m]: [f64; 2]) -> f64 {
        let beyond_m = |index: usize| {
            let arc_m = self.path.arc_m(index);
            (from_m - arc_m).max(arc_m - to_m).max(0.0)
        };
        // The distance beyond the stretch is added to the cost, since a stretch can end on top of the path
        // leading into it.
        let cost_m = |(index, at): &(usize, &Pose)| at.position.distance_m(pose.position) + beyond_m(*index);
        let within = self.path.poses.iter().enumerate();
        let within = within.filter(|(index, _)| beyond_m(*index) <= SPAN_TOLERANCE_M);
        // `min_by` returns the first of equal elements.
        let nearest =
            within.min_by(|one, other| cost_m(one).total_cmp(&cost_m(other))).map(|(index, _)| index);
        match nearest {
            Some(nearest) => self.path.station_at(nearest, pose) - self.ego_station_m,
            None => self.from_base_m(pose),
        }
    }

    /// Returns the distance from the rear axle to the front, metres.
    pub fn front_m(&self) -> f64 {
        self.front_m
    }

    /// Returns the signed distance from the front to `pose` along the path, metres.
    pub fn from_front_m(&self, pose: Pose) -> f64 {
        self.from_base_m(pose) - self.front_m
    }
}
