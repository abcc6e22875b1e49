//! The middle of a lane as poses along it, and lines beside it.

/// x to the east, y to the north, metres.
pub(crate) type Point = [f64; 2];

/// A point on a lane, and the direction of the lane there.
#[derive(Clone, Copy)]
pub(crate) struct Pose {
    pub(crate) at: Point,
    pub(crate) yaw_deg: f64,
}

/// The middle of a lane.
#[derive(Clone)]
pub(crate) struct Curve(pub(crate) Vec<Pose>);

/// An arc has a point at least this often, degrees.
const ARC_STEP_DEG: f64 = 10.0;
/// Pieces of a bend.
const BEND_STEPS: u32 = 12;

pub(crate) const fn pose(x: f64, y: f64, yaw_deg: f64) -> Pose {
    Pose { at: [x, y], yaw_deg }
}

impl Pose {
    fn unit(self) -> Point {
        let (sin, cos) = self.yaw_deg.to_radians().sin_cos();
        [cos, sin]
    }

    /// `ahead_m` further on and `left_m` to the left.
    pub(crate) fn moved(self, ahead_m: f64, left_m: f64) -> Self {
        let [cos, sin] = self.unit();
        let [x, y] = self.at;
        let at = [x + ahead_m * cos - left_m * sin, y + ahead_m * sin + left_m * cos];
        Self { at, ..self }
    }

    /// Turned about the origin by quarters, counterclockwise.
    pub(crate) fn quarters(self, count: u32) -> Self {
        (0..count).fold(self, |Self { at: [x, y], yaw_deg }, _| pose(-y, x, yaw_deg + 90.0))
    }
}

/// Straight on from a pose.
pub(crate) fn straight(from: Pose, length_m: f64) -> Curve {
    Curve(vec![from, from.moved(length_m, 0.0)])
}

/// Part of a circle from a pose, `turn_deg` to the left (right if negative).
pub(crate) fn arc(from: Pose, radius_m: f64, turn_deg: f64) -> Curve {
    let left_m = radius_m.copysign(turn_deg);
    let middle = from.moved(0.0, left_m);
    let steps = (turn_deg.abs() / ARC_STEP_DEG).ceil();
    let at = |step: f64| {
        let yaw_deg = from.yaw_deg + turn_deg * step / steps;
        Pose { yaw_deg, ..middle }.moved(0.0, -left_m)
    };
    let on_the_way = (1..).map(f64::from).take_while(|step| *step <= steps).map(at);
    Curve(std::iter::once(from).chain(on_the_way).collect())
}

/// A soft bend from one pose to another (a cubic with handles along both).
pub(crate) fn bend(from: Pose, to: Pose) -> Curve {
    let [dx, dy] = [to.at[0] - from.at[0], to.at[1] - from.at[1]];
    let handle_m = 0.4 * dx.hypot(dy);
    let handles = [from.at, from.moved(handle_m, 0.0).at, to.moved(-handle_m, 0.0).at, to.at];
    let at = |share: f64| {
        let rest = 1.0 - share;
        let mixed = |weights: [f64; 4], axis: usize| {
            handles.iter().zip(weights).map(|(handle, weight)| handle[axis] * weight).sum::<f64>()
        };
        let weights = [rest.powi(3), 3.0 * rest * rest * share, 3.0 * rest * share * share, share.powi(3)];
        let slopes = [-rest * rest, rest * (rest - 2.0 * share), share * (2.0 * rest - share), share * share];
        let yaw_deg = mixed(slopes, 1).atan2(mixed(slopes, 0)).to_degrees();
        Pose { at: [0, 1].map(|axis| mixed(weights, axis)), yaw_deg }
    };
    let inner = (1..BEND_STEPS).map(|step| at(f64::from(step) / f64::from(BEND_STEPS)));
    Curve(std::iter::once(from).chain(inner).chain([to]).collect())
}

impl Curve {
    /// This one and another that begins where it ends.
    pub(crate) fn then(mut self, next: impl FnOnce(Pose) -> Self) -> Self {
        self.0.extend(next(self.end()).0.into_iter().skip(1));
        self
    }

    /// Its last pose; a curve has one.
    pub(crate) fn end(&self) -> Pose {
        self.0.last().copied().unwrap_or(pose(0.0, 0.0, 0.0))
    }

    /// The line `left_m` to the left of it.
    pub(crate) fn beside(&self, left_m: f64) -> Vec<Point> {
        self.0.iter().map(|pose| pose.moved(0.0, left_m).at).collect()
    }

    /// Turned about the origin by quarters, counterclockwise.
    pub(crate) fn quarters(&self, count: u32) -> Self {
        Self(self.0.iter().map(|pose| pose.quarters(count)).collect())
    }
}
