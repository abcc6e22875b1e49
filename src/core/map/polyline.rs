//! A line of points and places along it.

/// At least two points. Arc lengths are measured in x and y, from the first point.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    points: Vec<[f64; 3]>,
    arcs_m: Vec<f64>,
}

/// The point of a line nearest to some place, in x and y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// The segment it is on, from 0.
    pub segment: usize,
    /// Arc length to it, metres.
    pub arc_m: f64,
    /// How far away it is, metres.
    pub distance_m: f64,
    /// Whether the place is on the left of the line.
    pub is_left: bool,
}

impl Polyline {
    /// A line through these points; none with fewer than two.
    pub fn new(points: Vec<[f64; 3]>) -> Option<Self> {
        if points.len() < 2 {
            return None;
        }
        let arcs_m = arcs_m(&points);
        Some(Self { points, arcs_m })
    }

    /// The same line the other way round.
    pub(super) fn reversed(self) -> Self {
        let mut points = self.points;
        points.reverse();
        Self { arcs_m: arcs_m(&points), points }
    }

    /// x and y of the point in the middle of the list, or half-way between two.
    pub(super) fn middle(&self) -> [f64; 2] {
        match self.points.as_slice() {
            [one, two] => [f64::midpoint(one[0], two[0]), f64::midpoint(one[1], two[1])],
            many => many.get(many.len() / 2).map_or([0.0; 2], |point| [point[0], point[1]]),
        }
    }

    /// x, y, z in the map frame, metres.
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// Arc length to each point, metres.
    pub fn arcs_m(&self) -> &[f64] {
        &self.arcs_m
    }

    /// Length in x and y, metres.
    pub fn length_m(&self) -> f64 {
        self.arcs_m.last().copied().unwrap_or_default()
    }

    /// Length with heights, metres.
    pub fn length_3d_m(&self) -> f64 {
        segments(&self.points).map(|(from, to)| length_3d(minus(*to, *from))).sum()
    }

    /// The point at an arc length, which is held between the ends.
    pub fn point_at(&self, arc_m: f64) -> [f64; 3] {
        interpolate(&self.points, &self.arcs_m, arc_m)
    }

    /// Points at the fractions 0/parts, 1/parts, … 1 of the length with heights.
    fn divided(&self, parts: u32) -> impl Iterator<Item = [f64; 3]> {
        let mut arcs_m = vec![0.0];
        let mut length_m = 0.0;
        for (from, to) in segments(&self.points) {
            length_m += length_3d(minus(*to, *from));
            arcs_m.push(length_m);
        }
        let at = move |part| length_m * f64::from(part) / f64::from(parts);
        (0..=parts).map(move |part| interpolate(&self.points, &arcs_m, at(part)))
    }

    /// The nearest point in x and y; the first of several.
    pub fn nearest(&self, place: [f64; 2]) -> Projection {
        let mut best = Projection { segment: 0, arc_m: 0.0, distance_m: f64::INFINITY, is_left: false };
        for (segment, ((from, to), arc_m)) in segments(&self.points).zip(&self.arcs_m).enumerate() {
            let (share, distance_m) = project_onto(*from, *to, place);
            if distance_m < best.distance_m {
                let arc_m = arc_m + share * length_2d(minus(*to, *from));
                best =
                    Projection { segment, arc_m, distance_m, is_left: self.is_left(segment, share, place) };
            }
        }
        best
    }

    /// Side of a place whose nearest point is on a segment. At a corner both of its segments count: the
    /// inside of the bend is what both have on that side.
    fn is_left(&self, segment: usize, share: f64, place: [f64; 2]) -> bool {
        let corner = if share >= 1.0 { segment + 1 } else { segment };
        let left_of = |at: usize| {
            let [from, to] = [self.points.get(at)?, self.points.get(at + 1)?];
            Some(cross(minus(*to, *from), [place[0] - from[0], place[1] - from[1], 0.0]) > 0.0)
        };
        let own = left_of(segment).unwrap_or_default();
        let neighbour = if share >= 1.0 {
            left_of(corner)
        } else if share <= 0.0 {
            corner.checked_sub(1).and_then(left_of)
        } else {
            None
        };
        match (neighbour, self.bends_left(corner)) {
            (None, _) => own,
            (Some(other), true) => own && other,
            (Some(other), false) => own || other,
        }
    }

    fn bends_left(&self, corner: usize) -> bool {
        let before = corner.checked_sub(1).and_then(|at| self.points.get(at));
        match (before, self.points.get(corner), self.points.get(corner + 1)) {
            (Some(a), Some(b), Some(c)) => cross(minus(*b, *a), minus(*c, *b)) > 0.0,
            _ => false,
        }
    }
}

/// The line in the middle of two bounds: as many parts as the longer bound has pieces of five metres,
/// each point half-way between the bounds at that fraction of their lengths.
/// docs/spec/turn-signal-decider.md, "Lanelet centreline".
pub fn centerline(left: &Polyline, right: &Polyline) -> Option<Polyline> {
    let middle =
        |(left, right): ([f64; 3], [f64; 3])| [0, 1, 2].map(|axis| f64::midpoint(left[axis], right[axis]));
    let parts = centerline_parts(left, right);
    Polyline::new(left.divided(parts).zip(right.divided(parts)).map(middle).collect())
}

/// How many parts the centerline of these bounds has.
pub(super) fn centerline_parts(left: &Polyline, right: &Polyline) -> u32 {
    let length_m = left.length_3d_m().max(right.length_3d_m());
    let parts = (length_m / CENTERLINE_RESOLUTION_M).ceil().clamp(1.0, f64::from(u32::MAX));
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // between 1 and u32::MAX
    let parts = parts as u32;
    parts
}

/// Spacing of generated centerlines in Autoware's map loader.
const CENTERLINE_RESOLUTION_M: f64 = 5.0;

fn segments(points: &[[f64; 3]]) -> impl Iterator<Item = (&[f64; 3], &[f64; 3])> {
    points.iter().zip(points.iter().skip(1))
}

fn arcs_m(points: &[[f64; 3]]) -> Vec<f64> {
    let mut arcs_m = vec![0.0];
    let mut arc_m = 0.0;
    for (from, to) in segments(points) {
        arc_m += length_2d(minus(*to, *from));
        arcs_m.push(arc_m);
    }
    arcs_m
}

fn interpolate(points: &[[f64; 3]], arcs_m: &[f64], arc_m: f64) -> [f64; 3] {
    let after = arcs_m.partition_point(|&arc| arc <= arc_m).clamp(1, points.len().max(2) - 1);
    let around = (points.get(after - 1), points.get(after), arcs_m.get(after - 1), arcs_m.get(after));
    let (Some(from), Some(to), Some(begin), Some(end)) = around else { return [0.0; 3] };
    let share = if end > begin { ((arc_m - begin) / (end - begin)).clamp(0.0, 1.0) } else { 0.0 };
    [0, 1, 2].map(|axis| from[axis] + share * (to[axis] - from[axis]))
}

/// Share of the segment before the point nearest to a place, and its distance.
pub(super) fn project_onto(from: [f64; 3], to: [f64; 3], place: [f64; 2]) -> (f64, f64) {
    let along = minus(to, from);
    let square = along[0] * along[0] + along[1] * along[1];
    let scalar = (place[0] - from[0]) * along[0] + (place[1] - from[1]) * along[1];
    let share = if square > 0.0 { (scalar / square).clamp(0.0, 1.0) } else { 0.0 };
    let foot = [from[0] + share * along[0], from[1] + share * along[1]];
    (share, (place[0] - foot[0]).hypot(place[1] - foot[1]))
}

fn minus(to: [f64; 3], from: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| to[axis] - from[axis])
}

fn length_2d(along: [f64; 3]) -> f64 {
    along[0].hypot(along[1])
}

fn length_3d(along: [f64; 3]) -> f64 {
    length_2d(along).hypot(along[2])
}

fn cross(one: [f64; 3], two: [f64; 3]) -> f64 {
    one[0] * two[1] - one[1] * two[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[[f64; 3]]) -> Polyline {
        Polyline::new(points.to_vec()).unwrap()
    }

    #[test]
    fn lengths_and_places_are_measured_from_above() {
        let line = line(&[[0.0, 0.0, 0.0], [3.0, 0.0, 4.0], [3.0, 0.0, 4.0], [3.0, 7.0, 4.0]]);
        assert_eq!(
            (line.length_m(), line.length_3d_m(), line.arcs_m()),
            (10.0, 12.0, [0.0, 3.0, 3.0, 10.0].as_slice())
        );
        let cases = [
            (-1.0, [0.0, 0.0, 0.0]),
            (1.5, [1.5, 0.0, 2.0]),
            (3.0, [3.0, 0.0, 4.0]),
            (5.0, [3.0, 2.0, 4.0]),
            (11.0, [3.0, 7.0, 4.0]),
        ];
        for (arc_m, point) in cases {
            assert_eq!(Some(line.point_at(arc_m)), Some(point), "{arc_m}");
        }
        assert_eq!(Polyline::new(vec![[0.0; 3]]), None);
    }

    #[test]
    fn sides_are_told_at_corners_too() {
        // To the east, then to the north: a bend to the left.
        let bend = line(&[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0]]);
        let cases = [
            ([5.0, 1.0], 0, 5.0, 1.0, true),
            ([5.0, -1.0], 0, 5.0, 1.0, false),
            ([13.0, -4.0], 0, 10.0, 5.0, false), // outside of the corner
            ([11.0, -1e-3], 0, 10.0, 1.0, false),
            ([9.0, 2.0], 1, 12.0, 1.0, true),
            ([12.0, 3.0], 1, 13.0, 2.0, false),
            ([-3.0, 4.0], 0, 0.0, 5.0, true),
        ];
        for (place, segment, arc_m, distance_m, is_left) in cases {
            let foot = bend.nearest(place);
            assert_eq!((foot.segment, foot.arc_m, foot.is_left), (segment, arc_m, is_left), "{place:?}");
            assert!((foot.distance_m - distance_m).abs() < 1e-5, "{place:?}: {foot:?}");
        }
        let mirrored = line(&[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, -10.0, 0.0]]);
        assert!(mirrored.nearest([13.0, 4.0]).is_left);
    }

    #[test]
    fn a_centerline_takes_equal_shares_of_both_bounds() {
        // 12 m on the left and 6 m on the right: three parts.
        let left = line(&[[0.0, 2.0, 0.0], [9.0, 2.0, 0.0], [12.0, 2.0, 0.0]]);
        let right = line(&[[0.0, 0.0, 0.0], [6.0, 0.0, 3.0]]);
        let middle = centerline(&left, &right).unwrap();
        let expected = [[0.0, 1.0, 0.0], [3.0, 1.0, 0.5], [6.0, 1.0, 1.0], [9.0, 1.0, 1.5]];
        let near = |one: &[f64; 3], two: &[f64; 3]| (0..3).all(|axis| (one[axis] - two[axis]).abs() < 1e-9);
        assert!(middle.points().iter().zip(&expected).all(|(one, two)| near(one, two)), "{middle:?}");
        let count = |length_m: f64| {
            let bound = line(&[[0.0; 3], [length_m, 0.0, 0.0]]);
            centerline(&bound, &bound).unwrap().points().len()
        };
        assert_eq!(
            [middle.points().len(), count(0.0), count(5.0), count(5.01), count(25.0)],
            [4, 2, 2, 3, 6]
        );
    }
}
