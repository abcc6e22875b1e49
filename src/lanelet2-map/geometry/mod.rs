//! Plane geometry: poses, distances along a path, where a turn ends
//! (docs/spec/turn-signal-decider.md, "Geometry"). Height counts in the lengths of bounds, and distinguishes
//! stacked roads.

pub mod centerline;
pub mod path;
pub mod polyline;
pub mod required_end;
pub mod sampling;
pub mod shape;
pub mod spline;

use std::f64::consts::{PI, TAU};

/// A position in the map frame, metres. Distances, headings and equality are computed in the plane.
#[derive(Debug, Clone, Copy, Default)]
pub struct Point {
    /// East in most maps, metres.
    pub x_m: f64,
    /// North in most maps, metres.
    pub y_m: f64,
    /// Height, metres; NaN if unknown.
    pub z_m: f64,
}

/// A position with a heading.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// Position in the map frame.
    pub position: Point,
    /// Heading in the map frame, radians, counter-clockwise from +x.
    pub yaw_rad: f64,
}

impl Point {
    /// Creates the point (`x_m`, `y_m`) at an unknown height.
    pub const fn new(x_m: f64, y_m: f64) -> Self {
        Self { x_m, y_m, z_m: f64::NAN }
    }

    /// Returns the same point at a height, metres.
    #[must_use]
    pub const fn at_height(self, z_m: f64) -> Self {
        Self { z_m, ..self }
    }

    /// Returns whether both heights are known and can belong to one road, rather than to stacked roads.
    pub fn is_level_with(self, other: Self) -> bool {
        (self.z_m - other.z_m).abs() <= SAME_LEVEL_M
    }

    /// Returns the straight distance in the plane, in metres.
    pub fn distance_m(self, other: Self) -> f64 {
        self.squared_distance(other).sqrt()
    }

    /// Returns the straight distance in metres, with the difference of height if it is known.
    pub fn spatial_distance_m(self, other: Self) -> f64 {
        let rise_m = other.z_m - self.z_m;
        self.distance_m(other).hypot(if rise_m.is_finite() { rise_m } else { 0.0 })
    }

    /// Returns the direction towards `other`, radians in (-π, π]; zero if they coincide.
    pub fn heading_to_rad(self, other: Self) -> f64 {
        (other.y_m - self.y_m).atan2(other.x_m - self.x_m)
    }

    /// Returns the point on the line to `other` at `fraction` of its length; 0 is this point, 1 is `other`.
    pub fn toward(self, other: Self, fraction: f64) -> Self {
        let along = |from: f64, to: f64| from + (to - from) * fraction;
        Self::new(along(self.x_m, other.x_m), along(self.y_m, other.y_m))
            .at_height(along(self.z_m, other.z_m))
    }

    /// Returns whether both coordinates in the plane are finite.
    pub const fn is_finite(self) -> bool {
        self.x_m.is_finite() && self.y_m.is_finite()
    }

    /// Returns the square of the distance in the plane, m².
    pub fn squared_distance(self, other: Self) -> f64 {
        let (dx, dy) = (self.x_m - other.x_m, self.y_m - other.y_m);
        dx * dx + dy * dy
    }

    /// Returns whether both points count as one: they differ by less than 10 nm in x and in y.
    pub fn coincides(self, other: Self) -> bool {
        (self.x_m - other.x_m).abs() < SAME_POINT_M && (self.y_m - other.y_m).abs() < SAME_POINT_M
    }
}

impl PartialEq for Point {
    fn eq(&self, other: &Self) -> bool {
        (self.x_m, self.y_m) == (other.x_m, other.y_m)
    }
}

/// Points nearer than this in x and y are one point, metres.
const SAME_POINT_M: f64 = 1e-8;
/// Heights that differ by more than this belong to different roads, metres: half of the clearance between
/// stacked roads, and more than the error between localisation and map.
const SAME_LEVEL_M: f64 = 2.5;

impl Pose {
    /// Creates the pose at (`x_m`, `y_m`), facing `yaw_rad`.
    pub const fn new(x_m: f64, y_m: f64, yaw_rad: f64) -> Self {
        Self { position: Point::new(x_m, y_m), yaw_rad }
    }

    /// Returns whether position and heading are finite.
    pub const fn is_finite(self) -> bool {
        self.position.is_finite() && self.yaw_rad.is_finite()
    }

    /// Returns the point `forward_m` ahead and `left_m` to the left, in the map frame, at the same height.
    pub fn point_at(self, forward_m: f64, left_m: f64) -> Point {
        let (sin, cos) = self.yaw_rad.sin_cos();
        Point::new(
            self.position.x_m + cos * forward_m - sin * left_m,
            self.position.y_m + sin * forward_m + cos * left_m,
        )
        .at_height(self.position.z_m)
    }
}

/// Returns the cross product of `a - origin` and `b - origin`: positive when `b` lies to the left of the
/// direction to `a`.
pub fn cross(origin: Point, a: Point, b: Point) -> f64 {
    (a.x_m - origin.x_m) * (b.y_m - origin.y_m) - (a.y_m - origin.y_m) * (b.x_m - origin.x_m)
}

/// Returns the angle normalised to (-π, π].
pub fn wrapped(angle_rad: f64) -> f64 {
    let rest = angle_rad.rem_euclid(TAU);
    if rest > PI { rest - TAU } else { rest }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_wrap_to_the_half_open_circle() {
        for (angle, expected) in
            [(0.0, 0.0), (PI, PI), (-PI, PI), (3.0 * PI, PI), (-0.5, -0.5), (6.0, 6.0 - TAU)]
        {
            assert!((wrapped(angle) - expected).abs() < 1e-12, "{angle}");
        }
    }
}
