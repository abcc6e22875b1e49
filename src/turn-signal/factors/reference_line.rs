//! A line from which offsets are measured: the middle of consecutive lanelets, or a path.

use lanelet2_map::geometry::path::NearestLimits;
use lanelet2_map::geometry::{Point, Pose, wrapped};

/// A line of points, with its pieces measured once for many offsets.
#[derive(Debug, Clone)]
pub(super) struct ReferenceLine {
    first: Option<Point>,
    pieces: Vec<Piece>,
}

/// The straight piece between two points of a line.
#[derive(Debug, Clone, Copy)]
struct Piece {
    from: Point,
    yaw_rad: f64,
    /// Sine of the piece's direction.
    sin: f64,
    cos: f64,
    length_m: f64,
    /// Arc length from the first point of the line to the end of the piece, metres.
    end_m: f64,
}

impl ReferenceLine {
    /// Measures the line through `points`.
    pub(super) fn new(points: impl IntoIterator<Item = Point>) -> Self {
        let mut points = points.into_iter();
        let first = points.next();
        let (mut before, mut end_m, mut pieces) = (first, 0.0, Vec::new());
        for to in points {
            let Some(from) = before.replace(to) else { continue };
            let length_m = from.distance_m(to);
            if length_m > 0.0 {
                end_m += length_m;
                let yaw_rad = from.heading_to_rad(to);
                let (sin, cos) = yaw_rad.sin_cos();
                pieces.push(Piece { from, yaw_rad, sin, cos, length_m, end_m });
            }
        }
        Self { first, pieces }
    }

    /// Returns the offset of a pose to the left of the nearest piece, metres; 0 for an empty line. With
    /// `limits`, prefers pieces with a similar heading, since a line may return in the neighbouring lane.
    pub(super) fn offset_m(&self, pose: Pose, limits: Option<NearestLimits>) -> f64 {
        self.offset_near_m(pose, limits, &mut 0)
    }

    /// Returns the offsets of consecutive poses, as [`Self::offset_m`] computes them.
    pub(super) fn offsets_m(&self, poses: &[Pose], limits: Option<NearestLimits>) -> Vec<f64> {
        let mut near = 0;
        poses.iter().map(|pose| self.offset_near_m(*pose, limits, &mut near)).collect()
    }

    /// Like [`Self::offset_m`], starting the search at the piece `near`, which becomes the index of the
    /// nearest piece.
    fn offset_near_m(&self, pose: Pose, limits: Option<NearestLimits>, near: &mut usize) -> f64 {
        let point = pose.position;
        let faces_alike = |piece: &Piece| {
            limits.is_none_or(|limits| wrapped(piece.yaw_rad - pose.yaw_rad).abs() <= limits.yaw_rad)
        };
        let nearest =
            self.nearest(point, *near, faces_alike).or_else(|| self.nearest(point, *near, |_| true));
        let Some((index, piece)) = nearest else {
            return self.first.map_or(0.0, |first| point.y_m - first.y_m);
        };
        *near = index;
        piece.left_m(point, piece.along_m(point))
    }

    /// Returns the nearest qualifying piece and its index; of equally near pieces, the first. Checks
    /// `probable` first.
    fn nearest(
        &self,
        point: Point,
        probable: usize,
        qualifies: impl Fn(&Piece) -> bool,
    ) -> Option<(usize, &Piece)> {
        let mut best: Option<(f64, usize)> = None;
        let mut look = |index: usize| {
            let piece = self.pieces.get(index)?;
            let distance_m = piece.distance_m(point);
            let is_nearer =
                |(least_m, of): (f64, usize)| distance_m < least_m || distance_m <= least_m && index < of;
            if best.is_none_or(is_nearer) && qualifies(piece) {
                best = Some((distance_m, index));
            }
            // Along the line the distance changes by no more than the arc length does.
            let spare_m = best.map_or(0.0, |(least_m, _)| distance_m - least_m);
            Some(piece.end_m + spare_m.max(0.0))
        };
        look(probable);
        let mut index = 0;
        while let Some(until_m) = look(index) {
            index += 1;
            if self.pieces.get(index).is_some_and(|piece| piece.end_m < until_m) {
                index = self.pieces.partition_point(|piece| piece.end_m < until_m);
            }
        }
        best.and_then(|(_, index)| Some((index, self.pieces.get(index)?)))
    }
}

impl Piece {
    /// Returns the arc length from the start of the piece to its nearest place to a point, metres.
    fn along_m(&self, point: Point) -> f64 {
        let along_m = (point.x_m - self.from.x_m) * self.cos + (point.y_m - self.from.y_m) * self.sin;
        along_m.clamp(0.0, self.length_m)
    }

    /// Returns the lateral distance of a point to the left of the place at an arc length, metres.
    fn left_m(&self, point: Point, along_m: f64) -> f64 {
        let (x_m, y_m) = (self.from.x_m + along_m * self.cos, self.from.y_m + along_m * self.sin);
        (point.y_m - y_m) * self.cos - (point.x_m - x_m) * self.sin
    }

    fn distance_m(&self, point: Point) -> f64 {
        let along_m = self.along_m(point);
        let here = Point::new(self.from.x_m + along_m * self.cos, self.from.y_m + along_m * self.sin);
        here.distance_m(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn offsets_are_to_the_left_of_the_nearest_piece_that_faces_alike() {
        let line = |points: &[(f64, f64)]| {
            ReferenceLine::new(points.iter().map(|(x_m, y_m)| Point::new(*x_m, *y_m)))
        };
        let limits = Some(NearestLimits { distance_m: 3.0, yaw_rad: 1.0 });
        // Out and back in the neighbouring lane, with a repeated point.
        let there_and_back = line(&[(0.0, 0.0), (10.0, 0.0), (10.0, 0.0), (10.0, 4.0), (0.0, 4.0)]);
        let pose = Pose::new(5.0, 3.0, 0.0);
        let before = Pose::new(-7.0, 1.5, 0.0);
        for (line, pose, limits, expected_m) in [
            (&there_and_back, pose, None, 1.0),
            (&there_and_back, pose, limits, 3.0),
            (&there_and_back, before, limits, 1.5),
            (&line(&[(1.0, 2.0)]), pose, limits, 1.0),
            (&line(&[]), pose, limits, 0.0),
        ] {
            let measured_m = line.offset_m(pose, limits);
            assert!((measured_m - expected_m).abs() < 1e-9, "{measured_m}, expected {expected_m}");
        }
    }

    proptest! {
        #[test]
        fn pieces_that_are_left_out_are_no_nearer(
            line in prop::collection::vec((-90.0..90.0, -90.0..90.0), 0..30),
            (x_m, y_m) in (-99.0..99.0, -99.0..99.0),
            probable in 0..30_usize,
            yaw_rad in -1.0..3.0_f64,
        ) {
            let line = ReferenceLine::new(line.into_iter().map(|(x_m, y_m)| Point::new(x_m, y_m)));
            let point = Point::new(x_m, y_m);
            let qualifies = |piece: &Piece| piece.yaw_rad <= yaw_rad;
            let found = line.nearest(point, probable, qualifies);
            let distances = line.pieces.iter().filter(|piece| qualifies(piece)).map(|piece| piece.distance_m(point));
            let least_m = distances.min_by(f64::total_cmp);
            prop_assert_eq!(found.map(|(_, piece)| piece.distance_m(point)), least_m);
        }
    }
}
